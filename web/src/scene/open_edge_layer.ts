import type { PageKey } from "../protocol/frames.ts";
import { Lines } from "./lines.ts";

/** Open borders of the model: where it has holes, and where nobody has looked yet. */
export class OpenEdgeLayer {
  readonly lines = new Lines({ color: "#ff4fd8", widthPx: 2 });
  private readonly byPage = new Map<string, { ends: Float32Array; lengthM: number }>();
  private stale = false;

  set(key: PageKey, ends: Float32Array): void {
    if (ends.length) this.byPage.set(key.join(), { ends, lengthM: lengthOf(ends) });
    else this.byPage.delete(key.join());
    this.stale = true;
  }

  clear(): void {
    this.byPage.clear();
    this.stale = true;
  }

  /** Metres of open borders. */
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

function lengthOf(ends: Float32Array): number {
  let sum = 0;
  for (let i = 0; i < ends.length; i += 6) sum += Math.sqrt((ends[i + 3] - ends[i]) ** 2 + (ends[i + 4] - ends[i + 1]) ** 2 + (ends[i + 5] - ends[i + 2]) ** 2);
  return sum;
}
