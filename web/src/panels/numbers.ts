/** A number as a person reads it: three figures, or "-" where it is not known. */
export function figure(value: number | null | undefined, unit = ""): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "-";
  const size = Math.abs(value), digits = size >= 100 ? 0 : size >= 10 ? 1 : 2;
  return `${value.toFixed(digits)}${unit && "\u202f" + unit}`;
}

/** Metres, or centimetres below one metre. */
export function length(metres: number): string {
  return Math.abs(metres) < 1 ? `${(100 * metres).toFixed(1)}\u202fcm` : `${metres.toFixed(3)}\u202fm`;
}

/** "12.3 M", "4.5 k". */
export function count(value: number): string {
  if (value >= 1e6) return `${(value / 1e6).toFixed(2)}\u202fM`;
  return value >= 1e4 ? `${(value / 1e3).toFixed(1)}\u202fk` : String(value);
}

export function bytes(value: number): string {
  const units = ["B", "kB", "MB", "GB"];
  let at = 0;
  while (value >= 1000 && at < 3) [value, at] = [value / 1000, at + 1];
  return `${value.toFixed(at && value < 100 ? 1 : 0)}\u202f${units[at]}`;
}

/** "1:05" */
export function clock(seconds: number): string {
  const whole = Math.max(Math.floor(seconds), 0);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}
