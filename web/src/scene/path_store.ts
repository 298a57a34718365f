import type { Box, Path, Vec3 } from "../protocol/frames.ts";

/** Points of the paths, put together from chunks. */
export class PathStore {
  private readonly paths = new Map<number, number[]>();

  /** Puts a chunk in its place; what lies beyond the new total is dropped, what has not come yet is left out when read. */
  set({ which, first, total, points }: Path): void {
    const all = this.paths.get(which) ?? [];
    while (all.length < 3 * first) all.push(NaN);
    for (let i = 0; i < points.length; ++i) all[3 * first + i] = points[i];
    all.length = Math.min(all.length, 3 * total);
    this.paths.set(which, all);
  }

  clear(): void { this.paths.clear(); }

  /** Three numbers a point. */
  points(which: number): Float32Array {
    const all = this.paths.get(which) ?? [];
    return Float32Array.from(all.some(Number.isNaN) ? all.filter(value => !Number.isNaN(value)) : all);
  }

  box(): Box | null {
    const low: Vec3 = [Infinity, Infinity, Infinity], high: Vec3 = [-Infinity, -Infinity, -Infinity];
    for (const which of this.paths.keys())
      this.points(which).forEach((value, i) => {
        low[i % 3] = Math.min(low[i % 3], value);
        high[i % 3] = Math.max(high[i % 3], value);
      });
    return low[0] <= high[0] ? { low, high } : null;
  }
}
