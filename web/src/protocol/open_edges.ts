import type { PageKey } from "./frames.ts";
import type { MeshPage } from "./mesh_page.ts";

/** Edges that belong to one triangle of the page: six numbers each (both ends, m, in `map`). */
export function findOpenEdges(page: MeshPage): Float32Array {
  const { indices, positions, origin, quantum } = page;
  let capacity = 16;
  while (capacity < 3 * indices.length) capacity *= 2;
  const low = new Int32Array(capacity).fill(-1), high = new Int32Array(capacity), uses = new Uint8Array(capacity);
  for (let i = 0; i < indices.length; ++i) {
    const a = indices[i], b = indices[i % 3 === 2 ? i - 2 : i + 1], least = Math.min(a, b), most = Math.max(a, b);
    let slot = (Math.imul(least, 0x9e3779b1) ^ Math.imul(most, 0x85ebca6b)) >>> 0 & capacity - 1;
    while (low[slot] !== -1 && (low[slot] !== least || high[slot] !== most)) slot = slot + 1 & capacity - 1;
    low[slot] = least;
    high[slot] = most;
    uses[slot] = Math.min(uses[slot] + 1, 2);
  }
  const ends: number[] = [];
  for (let slot = 0; slot < capacity; ++slot)
    if (uses[slot] === 1)
      for (const vertex of [low[slot], high[slot]])
        for (let k = 0; k < 3; ++k) ends.push(origin[k] + quantum * positions[4 * vertex + k]);
  return Float32Array.from(ends);
}

const NEIGHBOURS: PageKey[] = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];

/** Open edges of one page, found again by the middle of an edge. */
class EdgeIndex {
  private readonly cells = new Map<string, number[]>();

  constructor(readonly ends: Float32Array, private readonly cellM: number) {
    for (let i = 0; i < ends.length; i += 6) {
      const name = this.cellOf(this.middle(i), [0, 0, 0]), list = this.cells.get(name);
      if (list) list.push(i);
      else this.cells.set(name, [i]);
    }
  }

  /** Is there an edge whose middle is within half a cell? */
  has(middle: number[]): boolean {
    for (let corner = 0; corner < 8; ++corner) {
      const offset = [0, 1, 2].map(k => (corner >> k & 1 ? 0.5 : -0.5) * this.cellM);
      const list = this.cells.get(this.cellOf(middle, offset)) ?? [];
      if (list.some(i => this.middle(i).every((value, k) => Math.abs(value - middle[k]) < this.cellM / 2))) return true;
    }
    return false;
  }

  middle(i: number): number[] { return [0, 1, 2].map(k => (this.ends[i + k] + this.ends[i + 3 + k]) / 2); }

  private cellOf(point: number[], offset: number[]): string {
    return point.map((value, k) => Math.floor((value + offset[k]) / this.cellM)).join();
  }
}

/**
 * Open edges of the whole model: those of a page that no neighbouring page has too (vertices on a shared border are in
 * both). They bound holes and what has not been seen.
 */
export class OpenBorders {
  private readonly pages = new Map<string, EdgeIndex>();

  /** `toleranceM`: how far the copies of an edge in two pages may be apart. */
  constructor(private readonly toleranceM: number) {}

  /** Sets the open edges of a page (null: it is gone); returns the keys of pages whose borders may have changed. */
  set(key: PageKey, ends: Float32Array | null): PageKey[] {
    if (ends) this.pages.set(key.join(), new EdgeIndex(ends, 2 * this.toleranceM));
    else this.pages.delete(key.join());
    const around = this.neighboursOf(key).filter(other => this.pages.has(other.join()));
    return ends ? [key, ...around] : around;
  }

  clear(): void { this.pages.clear(); }

  /** The edges of the page that are open in the model, as findOpenEdges. */
  of(key: PageKey): Float32Array {
    const own = this.pages.get(key.join());
    if (!own) return new Float32Array(0);
    const others = this.neighboursOf(key).flatMap(other => this.pages.get(other.join()) ?? []);
    const open: number[] = [];
    for (let i = 0; i < own.ends.length; i += 6) {
      const middle = own.middle(i);
      if (!others.some(other => other.has(middle))) open.push(...own.ends.subarray(i, i + 6));
    }
    return Float32Array.from(open);
  }

  private neighboursOf(key: PageKey): PageKey[] {
    return NEIGHBOURS.map(offset => key.map((value, k) => value + offset[k]) as PageKey);
  }
}
