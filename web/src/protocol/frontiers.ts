import type { GridTile } from "./frames.ts";

type TileKey = GridTile["key"];

/** Cells as the frontiers know them. */
const UNKNOWN = 0, FREE = 1, OCCUPIED = 2;
/** Values below it are more free than occupied. */
const OCCUPIED_FROM = 128;
/** A cell counts with so many of its kind around it: single cells that no beam has met, or only one, are no frontier. At the corner of an area three cells are of its kind. */
const LEAST_ALIKE = 3;
const HALO = 2;  // cells around a tile that decide about its own
const SIDES: TileKey[] = [[1, 0], [-1, 0], [0, 1], [0, -1]];

/** Frontiers of an occupancy slice: the sides between free cells and unknown ones, where nobody has looked yet. */
export class Frontiers {
  private readonly tiles = new Map<string, GridTile>();
  private cells = new Uint8Array(0);  // of a tile and what lies around it; its memory serves one tile after the other
  private width = 0;

  /** Takes a tile; gives those whose frontiers it may have changed. */
  set(tile: GridTile): TileKey[] {
    const name = tile.key.join(), old = this.tiles.get(name);
    if (old && old.version > tile.version) return [];
    this.tiles.set(name, tile);
    return around(tile.key).filter(key => this.tiles.has(key.join()));
  }

  /** The frontiers of a tile's free cells: six numbers each (both ends, m, in `map`); sides in a row are one. */
  of(key: TileKey): Float32Array {
    const tile = this.tiles.get(key.join()), ends: number[] = [];
    if (!tile) return new Float32Array(0);
    this.gather(tile);
    const { side, cellM, heightM } = tile, at = (value: number, k: number): number => (key[k] * side + value) * cellM;
    for (const [dx, dy] of SIDES) {
      const across = dx !== 0 ? 0 : 1;  // the axis that the sides face
      for (let line = 0; line < side; ++line)
        for (let along = 0, begin = -1; along <= side; ++along) {
          const isOne = along < side && (across === 0 ? this.isFrontier(line, along, dx, dy) : this.isFrontier(along, line, dx, dy));
          if (isOne && begin < 0) begin = along;
          if (isOne || begin < 0) continue;
          const place = at(line + (dx + dy > 0 ? 1 : 0), across);
          if (across === 0) ends.push(place, at(begin, 1), heightM, place, at(along, 1), heightM);
          else ends.push(at(begin, 0), place, heightM, at(along, 0), place, heightM);
          begin = -1;
        }
    }
    return Float32Array.from(ends);
  }

  /** The states of a tile's cells and of HALO cells around it. */
  private gather({ key, side }: GridTile): void {
    this.width = side + 2 * HALO;
    if (this.cells.length !== this.width ** 2) this.cells = new Uint8Array(this.width ** 2);
    this.cells.fill(UNKNOWN);
    for (const near of around(key)) {
      const tile = this.tiles.get(near.join());
      if (!tile || tile.side !== side) continue;
      const left = (near[0] - key[0]) * side + HALO, bottom = (near[1] - key[1]) * side + HALO;
      for (let y = Math.max(0, -bottom); y < Math.min(side, this.width - bottom); ++y)
        for (let x = Math.max(0, -left); x < Math.min(side, this.width - left); ++x) {
          const value = tile.cells[y * side + x];
          this.cells[(bottom + y) * this.width + left + x] = value === 0 ? UNKNOWN : value < OCCUPIED_FROM ? FREE : OCCUPIED;
        }
    }
  }

  private isFrontier(x: number, y: number, dx: number, dy: number): boolean {
    return this.isOf(FREE, x, y) && this.isOf(UNKNOWN, x + dx, y + dy) && this.isArea(FREE, x, y) && this.isArea(UNKNOWN, x + dx, y + dy);
  }

  private isOf(state: number, x: number, y: number): boolean { return this.cells[(y + HALO) * this.width + x + HALO] === state; }

  private isArea(state: number, x: number, y: number): boolean {
    let alike = -1;  // without itself
    for (let dy = -1; dy <= 1; ++dy) for (let dx = -1; dx <= 1; ++dx) if (this.isOf(state, x + dx, y + dy)) ++alike;
    return alike >= LEAST_ALIKE;
  }
}

/** A tile and the eight around it. */
function around([x, y]: TileKey): TileKey[] {
  return Array.from({ length: 9 }, (_, i): TileKey => [x + i % 3 - 1, y + Math.floor(i / 3) - 1]);
}
