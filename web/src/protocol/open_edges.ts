import type { PageKey } from "./frames.ts";
import type { MeshPage } from "./mesh_page.ts";

/** Edges of a page's triangles and how many triangles each has; its memory serves one page after the other. */
class EdgeTable {
  count = 0;
  low = new Uint32Array(0);  // the vertices of each edge
  high = new Uint32Array(0);
  uses = new Uint8Array(0);  // 2: two or more
  private next = new Int32Array(0);   // edge with the same low vertex, or -1
  private first = new Int32Array(0);  // of each vertex

  clear(vertices: number, mostEdges: number): void {
    if (this.low.length < mostEdges) {
      this.low = new Uint32Array(mostEdges);
      this.high = new Uint32Array(mostEdges);
      this.uses = new Uint8Array(mostEdges);
      this.next = new Int32Array(mostEdges);
    }
    if (this.first.length < vertices) this.first = new Int32Array(vertices);
    this.first.fill(-1, 0, vertices);
    this.count = 0;
  }

  add(a: number, b: number): void {
    const low = a < b ? a : b, high = a < b ? b : a;
    let edge = this.first[low];
    while (edge !== -1 && this.high[edge] !== high) edge = this.next[edge];
    if (edge !== -1) {
      this.uses[edge] = 2;
      return;
    }
    edge = this.count++;
    this.low[edge] = low;
    this.high[edge] = high;
    this.uses[edge] = 1;
    this.next[edge] = this.first[low];
    this.first[low] = edge;
  }
}
const table = new EdgeTable();

/** Edges that belong to one triangle of the page: six numbers each (both ends, m, in `map`). */
export function findOpenEdges({ indices, positions, origin, quantum }: MeshPage): Float32Array {
  table.clear(positions.length / 4, indices.length);
  for (let i = 0; i < indices.length; i += 3) {
    const a = indices[i], b = indices[i + 1], c = indices[i + 2];
    table.add(a, b);
    table.add(b, c);
    table.add(c, a);
  }
  const { count, uses, low, high } = table, ends: number[] = [];
  for (let edge = 0; edge < count; ++edge)
    if (uses[edge] === 1)
      for (const vertex of [low[edge], high[edge]])
        for (let k = 0; k < 3; ++k) ends.push(origin[k] + quantum * positions[4 * vertex + k]);
  return Float32Array.from(ends);
}

/** Pages around one, corners included: meshes that were cut by triangles meet across corners. */
const NEIGHBOURS: PageKey[] = Array.from({ length: 27 }, (_, i): PageKey => [i % 3 - 1, Math.floor(i / 3) % 3 - 1, Math.floor(i / 9) - 1]).filter(offset => offset.some(v => v !== 0));
const CELL_TOLERANCES = 4;

/** Open edges of one page, found again by the middle of an edge: in lists, by the number of its cell. */
class EdgeIndex {
  /** Three numbers an edge. */
  readonly middles: Float32Array;
  private readonly first: Int32Array;  // edge of each list, or -1; as many as a power of two
  private readonly next: Int32Array;   // edge of the same list, or -1
  private readonly low = [Infinity, Infinity, Infinity];
  private readonly high = [-Infinity, -Infinity, -Infinity];
  private readonly cellM: number;

  constructor(readonly ends: Float32Array, private readonly toleranceM: number) {
    this.cellM = CELL_TOLERANCES * toleranceM;
    const count = ends.length / 6, middles = new Float32Array(3 * count);
    this.first = new Int32Array(2 ** Math.ceil(Math.log2(count + 1))).fill(-1);
    this.next = new Int32Array(count);
    for (let edge = 0; edge < count; ++edge) {
      for (let k = 0; k < 3; ++k) {
        const middle = Math.fround((ends[6 * edge + k] + ends[6 * edge + 3 + k]) / 2);
        middles[3 * edge + k] = middle;
        if (middle - toleranceM < this.low[k]) this.low[k] = middle - toleranceM;
        if (middle + toleranceM > this.high[k]) this.high[k] = middle + toleranceM;
      }
      const list = this.listOf(middles[3 * edge], middles[3 * edge + 1], middles[3 * edge + 2]);
      this.next[edge] = this.first[list];
      this.first[list] = edge;
    }
    this.middles = middles;
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
      if (this.isInList(this.listOf(x + (2 * dx - 1) * toleranceM, y + (2 * dy - 1) * toleranceM, z + (2 * dz - 1) * toleranceM), x, y, z)) return true;
    }
    return false;
  }

  /** Does a border of cells part the tolerance below a coordinate from that above it? */
  private isParted(value: number): boolean {
    return Math.floor((value - this.toleranceM) / this.cellM) !== Math.floor((value + this.toleranceM) / this.cellM);
  }

  private isInList(list: number, x: number, y: number, z: number): boolean {
    const { middles, next, toleranceM } = this;
    for (let edge = this.first[list]; edge !== -1; edge = next[edge]) {
      const i = 3 * edge;
      if (Math.abs(middles[i] - x) < toleranceM && Math.abs(middles[i + 1] - y) < toleranceM && Math.abs(middles[i + 2] - z) < toleranceM) return true;
    }
    return false;
  }

  /** The list of the cell of a point; several cells may share one. */
  private listOf(x: number, y: number, z: number): number {
    const { cellM } = this, code = Math.imul(Math.floor(x / cellM), 73856093) ^ Math.imul(Math.floor(y / cellM), 19349663) ^ Math.imul(Math.floor(z / cellM), 83492791);
    return (code ^ code >>> 15) & this.first.length - 1;
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
