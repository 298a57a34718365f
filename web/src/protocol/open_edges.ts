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

/** Pages around one, corners included: meshes that were cut by triangles meet across corners. */
const NEIGHBOURS: PageKey[] = Array.from({ length: 27 }, (_, i): PageKey => [i % 3 - 1, Math.floor(i / 3) % 3 - 1, Math.floor(i / 9) - 1]).filter(offset => offset.some(v => v !== 0));
const CELL_TOLERANCES = 4;

/** Open edges of one page, found again by the middle of an edge: numbers of cells, sorted, and whose they are. */
class EdgeIndex {
  /** Three numbers an edge. */
  readonly middles: Float32Array;
  private readonly codes: Int32Array;
  private readonly order: Uint32Array;
  private readonly low = [Infinity, Infinity, Infinity];
  private readonly high = [-Infinity, -Infinity, -Infinity];
  private readonly cellM: number;

  constructor(readonly ends: Float32Array, private readonly toleranceM: number) {
    this.cellM = CELL_TOLERANCES * toleranceM;
    const count = ends.length / 6, codes = new Int32Array(count), middles = new Float32Array(3 * count);
    for (let edge = 0; edge < count; ++edge) {
      for (let k = 0; k < 3; ++k) {
        const middle = Math.fround((ends[6 * edge + k] + ends[6 * edge + 3 + k]) / 2);
        middles[3 * edge + k] = middle;
        this.low[k] = Math.min(this.low[k], middle - toleranceM);
        this.high[k] = Math.max(this.high[k], middle + toleranceM);
      }
      codes[edge] = this.code(middles[3 * edge], middles[3 * edge + 1], middles[3 * edge + 2]);
    }
    this.middles = middles;
    this.order = Uint32Array.from(codes.keys()).sort((a, b) => codes[a] - codes[b]);
    this.codes = Int32Array.from(this.order, edge => codes[edge]);
  }

  /** May edges of another page be the same as some of this one? */
  meets({ low, high }: EdgeIndex): boolean {
    return [0, 1, 2].every(k => low[k] <= this.high[k] && high[k] >= this.low[k]);
  }

  /** Is there an edge whose middle is within the tolerance? */
  has(x: number, y: number, z: number): boolean {
    const { low, high, toleranceM } = this;
    if (x < low[0] || x > high[0] || y < low[1] || y > high[1] || z < low[2] || z > high[2]) return false;
    for (let corner = 0; corner < 8; ++corner) {  // the cube of the tolerance around the middle touches up to two cells an axis
      const dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
      if ((dx && !this.isParted(x)) || (dy && !this.isParted(y)) || (dz && !this.isParted(z))) continue;
      if (this.isInCell(this.code(x + (2 * dx - 1) * toleranceM, y + (2 * dy - 1) * toleranceM, z + (2 * dz - 1) * toleranceM), x, y, z)) return true;
    }
    return false;
  }

  /** Does a border of cells part the tolerance below a coordinate from that above it? */
  private isParted(value: number): boolean {
    return Math.floor((value - this.toleranceM) / this.cellM) !== Math.floor((value + this.toleranceM) / this.cellM);
  }

  private isInCell(code: number, x: number, y: number, z: number): boolean {
    const { middles, order, toleranceM } = this;
    for (let at = this.firstOf(code); this.codes[at] === code; ++at) {
      const i = 3 * order[at];
      if (Math.abs(middles[i] - x) < toleranceM && Math.abs(middles[i + 1] - y) < toleranceM && Math.abs(middles[i + 2] - z) < toleranceM) return true;
    }
    return false;
  }

  private code(x: number, y: number, z: number): number {
    return Math.imul(Math.floor(x / this.cellM), 73856093) ^ Math.imul(Math.floor(y / this.cellM), 19349663) ^ Math.imul(Math.floor(z / this.cellM), 83492791);
  }

  private firstOf(code: number): number {
    let low = 0, high = this.codes.length;
    while (low < high) {
      const middle = low + high >> 1;
      if (this.codes[middle] < code) low = middle + 1;
      else high = middle;
    }
    return low;
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
    if (ends) this.pages.set(key.join(), new EdgeIndex(ends, this.toleranceM));
    else this.pages.delete(key.join());
    const around = this.neighboursOf(key).filter(other => this.pages.has(other.join()));
    return [key, ...around];
  }

  /** The edges of the page that are open in the model, as findOpenEdges. */
  of(key: PageKey): Float32Array {
    const own = this.pages.get(key.join());
    if (!own) return new Float32Array(0);
    const others: EdgeIndex[] = [];
    for (const name of this.neighboursOf(key)) {
      const other = this.pages.get(name.join());
      if (other?.meets(own)) others.push(other);
    }
    const { middles } = own, open: number[] = [];
    for (let edge = 0; edge < own.ends.length / 6; ++edge)
      if (!others.some(other => other.has(middles[3 * edge], middles[3 * edge + 1], middles[3 * edge + 2])))
        for (let k = 0; k < 6; ++k) open.push(own.ends[6 * edge + k]);
    return Float32Array.from(open);
  }

  private neighboursOf(key: PageKey): PageKey[] {
    return NEIGHBOURS.map(offset => key.map((value, k) => value + offset[k]) as PageKey);
  }
}
