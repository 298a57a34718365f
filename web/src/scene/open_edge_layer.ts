import { Lines } from "./lines.ts";

/** What ends where nobody has looked yet, wherever it is drawn. */
export const UNSEEN_COLOR = "#ff4fd8";

/** Where the model has holes, and where nobody has looked yet: open borders of the mesh, by its pages, or frontiers of the occupancy, by its tiles. */
export class OpenEdgeLayer {
  readonly lines: Lines;
  private readonly byPage = new Map<string, { ends: Float32Array; lengthM: number }>();
  private stale = false;

  constructor(widthPx = 2) { this.lines = new Lines({ color: UNSEEN_COLOR, widthPx }); }

  set(key: readonly number[], ends: Float32Array): void {
    if (ends.length) this.byPage.set(key.join(), { ends, lengthM: lengthOf(ends) });
    else this.byPage.delete(key.join());
    this.stale = true;
  }

  clear(): void {
    this.byPage.clear();
    this.stale = true;
  }

  /** Metres of all of them. */
  lengthM(): number {
    let sum = 0;
    for (const { lengthM } of this.byPage.values()) sum += lengthM;
    return sum;
  }

  /** Before drawing. */
  update(): void {
    if (!this.stale || !this.lines.visible) return;
    this.stale = false;
    const all = new Float32Array([...this.byPage.values()].reduce((sum, { ends }) => sum + ends.length, 0));
    let at = 0;
    for (const { ends } of this.byPage.values()) {
      all.set(ends, at);
      at += ends.length;
    }
    this.lines.setSegments(all);
  }
}

/** Of segments of six numbers each, m. */
export function lengthOf(ends: Float32Array): number {
  let sum = 0;
  for (let i = 0; i < ends.length; i += 6) sum += Math.sqrt((ends[i + 3] - ends[i]) ** 2 + (ends[i + 4] - ends[i + 1]) ** 2 + (ends[i + 5] - ends[i + 2]) ** 2);
  return sum;
}
