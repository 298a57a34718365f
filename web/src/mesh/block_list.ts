/** Blocks that follow each other: the first and how many. */
export interface Run { first: number; count: number }

/** Blocks of equal size in a buffer, each taken or free. */
export class BlockList {
  private readonly taken: Uint8Array;
  private free: number;
  private lowest = 0;  // no block before this one is free

  constructor(readonly size: number) {
    this.taken = new Uint8Array(size);
    this.free = size;
  }

  get isEmpty(): boolean { return this.free === this.size; }

  /** The lowest free blocks, so many in all, as runs; null, and nothing is taken, where so many are not free. */
  take(count: number): Run[] | null {
    if (count > this.free) return null;
    const runs: Run[] = [];
    this.free -= count;
    for (; count > 0; ++this.lowest) {
      if (this.taken[this.lowest]) continue;
      this.taken[this.lowest] = 1;
      --count;
      const last = runs[runs.length - 1];
      if (last && last.first + last.count === this.lowest) ++last.count;
      else runs.push({ first: this.lowest, count: 1 });
    }
    return runs;
  }

  give(runs: readonly Run[]): void {
    for (const { first, count } of runs) {
      this.taken.fill(0, first, first + count);
      this.free += count;
      this.lowest = Math.min(this.lowest, first);
    }
  }
}
