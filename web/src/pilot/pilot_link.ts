import type { Vec3 } from "../protocol/frames.ts";

export type Holder = "you" | "other" | "none";
/** Kinds of commands on `/pilot` (docs/file_formats.md). */
export type CommandKind = "toggle_engage" | "take_off" | "land" | "hold" | "e_stop" | "reset" | "return" | "velocity" | "go_to" | "preview";
export interface CommandValues { velocity_m_s?: Vec3; yaw_rad_s?: number; position_m?: Vec3; yaw_rad?: number }
/** What the person steers: velocity in the vehicle's level frame, and when the input was read (ms). */
export interface Input { velocity: Vec3; yawRate: number; atMs: number }
export interface Answer { sequence: number; kind: CommandKind; accepted: boolean; reason: string; roundTripMs: number }
export type PilotNews = { type: "lease"; holder: Holder } | ({ type: "answer" } & Answer) | null;

export const COMMAND_EXPIRES_MS = 1000, VELOCITY_EXPIRES_MS = 300;
const STOP_AGAIN_MS = 100, MOST_STOPS = 10;

/**
 * The pilot's side of `/pilot` without a socket: sequence, age, expiry; velocity only while inputs are fresh; the emergency
 * stop again and again until it is answered. Clocks are in milliseconds.
 */
export class PilotLink {
  holder: Holder = "none";
  private sequence = 0;
  private readonly waiting = new Map<number, { kind: CommandKind; sentMs: number }>();
  private input: Input | null = null;
  private steering = false;  // a velocity other than zero was the last one sent
  private stop: { sentMs: number; count: number } | null = null;

  constructor(private readonly send: (text: string) => void, private readonly nowMs: () => number) {}

  /** A new connection: the server counts anew, and nobody holds the lease by it. */
  opened(): void {
    this.sequence = 0;
    this.waiting.clear();
    this.holder = "none";
    this.input = null;
    this.steering = false;
  }

  take(force: boolean): void { this.send(JSON.stringify({ type: "take", force })); }
  release(): void { this.send(JSON.stringify({ type: "release" })); }

  /** `atMs`: when the person asked for it. */
  command(kind: CommandKind, atMs: number, values: CommandValues = {}): void {
    if (kind === "e_stop") this.stop = { sentMs: this.nowMs(), count: 1 };
    if (kind === "e_stop" || kind === "hold" || kind === "land") this.input = null;
    this.write(kind, atMs, values, COMMAND_EXPIRES_MS);
  }

  steer(input: Input): void { this.input = input; }

  /** To be called every 50 ms. */
  tick(): void {
    const now = this.nowMs();
    if (this.stop && now - this.stop.sentMs >= STOP_AGAIN_MS) this.stopAgain(now);
    if (!this.input || this.holder !== "you") return;
    const { velocity, yawRate, atMs } = this.input, moving = yawRate !== 0 || velocity.some(value => value !== 0);
    if (now - atMs > VELOCITY_EXPIRES_MS) this.input = null;  // the page is frozen: nothing is sent, the vehicle holds
    else if (moving || this.steering) this.write("velocity", atMs, { velocity_m_s: velocity, yaw_rad_s: yawRate }, VELOCITY_EXPIRES_MS);
    this.steering = moving && this.input !== null;
  }

  /** Reads a message of the server; null: nothing to show. Throws where it is no JSON object. */
  receive(text: string): PilotNews {
    const message = JSON.parse(text) as { type?: string; holder?: Holder; sequence?: number; accepted?: boolean; reason?: string };
    if (message.type === "ping") this.send(JSON.stringify({ type: "pong", sequence: message.sequence }));
    if (message.type === "lease" && message.holder) {
      this.holder = message.holder;
      return { type: "lease", holder: message.holder };
    }
    if (message.type !== "answer" || message.sequence === undefined) return null;
    const asked = this.waiting.get(message.sequence);
    if (!asked) return null;
    this.waiting.delete(message.sequence);
    if (asked.kind === "e_stop" && message.accepted) this.stop = null;
    return {
      type: "answer", sequence: message.sequence, kind: asked.kind, accepted: message.accepted === true, reason: message.reason ?? "",
      roundTripMs: this.nowMs() - asked.sentMs,
    };
  }

  private stopAgain(now: number): void {
    const count = this.stop!.count + 1;
    this.stop = count > MOST_STOPS ? null : { sentMs: now, count };
    if (this.stop) this.write("e_stop", now, {}, COMMAND_EXPIRES_MS);
  }

  private write(kind: CommandKind, atMs: number, values: CommandValues, expiresMs: number): void {
    const now = this.nowMs(), sequence = ++this.sequence;
    for (const [old, { sentMs }] of this.waiting) if (now - sentMs > 5000) this.waiting.delete(old);
    this.waiting.set(sequence, { kind, sentMs: now });
    this.send(JSON.stringify({ type: "command", sequence, kind, age_ms: Math.max(0, Math.round(now - atMs)), expires_ms: expiresMs, ...values }));
  }
}
