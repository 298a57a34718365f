/** Values of one plot over time: a column of times, a column for each name; the oldest go. */
export class TimeSeries {
  private readonly times: number[] = [];
  private readonly columns = new Map<string, (number | null)[]>();

  /** `leastStepS`: of values that follow faster the newest is kept; `most`: rows. */
  constructor(private readonly leastStepS = 0.2, private readonly most = 1500) {}

  get names(): string[] { return [...this.columns.keys()]; }
  get length(): number { return this.times.length; }

  add(timeS: number, values: Record<string, number | null | undefined>): void {
    const last = this.times.length - 1;
    if (last >= 0 && timeS < this.times[last]) this.clear();  // the clock went back: a replay was wound back
    if (this.times.length > 1 && timeS - this.times[this.times.length - 2] < this.leastStepS) this.drop(this.times.length - 1);
    this.times.push(timeS);
    for (const name of Object.keys(values))
      if (!this.columns.has(name)) this.columns.set(name, Array<number | null>(this.times.length - 1).fill(null));
    for (const [name, column] of this.columns) {
      const value = values[name];
      column.push(value !== undefined && value !== null && Number.isFinite(value) ? value : null);
    }
    if (this.times.length > this.most) this.drop(0, this.times.length - this.most);
  }

  /** Times, then each column, as uPlot wants them. */
  table(): [number[], ...(number | null)[][]] { return [this.times, ...this.columns.values()]; }

  clear(): void {
    this.times.length = 0;
    this.columns.clear();
  }

  private drop(at: number, count = 1): void {
    this.times.splice(at, count);
    for (const column of this.columns.values()) column.splice(at, count);
  }
}
