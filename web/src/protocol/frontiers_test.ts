import assert from "node:assert/strict";
import { test } from "node:test";
import type { GridTile } from "./frames.ts";
import { Frontiers } from "./frontiers.ts";

const SIDE = 8, CELL_M = 0.5;
const VALUES: Record<string, number> = { " ": 0, ".": 1, "o": 127, "x": 128, "#": 255 };

/** A tile as drawn, the highest row first. */
function tile(key: [number, number], version: number, rows: string[]): GridTile {
  const cells = Uint8Array.from(rows.reverse().flatMap(row => [...row].map(cell => VALUES[cell])));
  return { key, version, cellM: CELL_M, heightM: 1.5, side: SIDE, cells };
}
const filled = (row: string): string[] => Array.from({ length: SIDE }, () => row);

/** The sides as text, "x y - x y" in cells, in order. */
function sides(ends: Float32Array): string[] {
  const all: string[] = [];
  for (let i = 0; i < ends.length; i += 6) {
    assert.equal(ends[i + 2], 1.5);
    assert.equal(ends[i + 5], 1.5);
    all.push(`${ends[i] / CELL_M} ${ends[i + 1] / CELL_M} - ${ends[i + 3] / CELL_M} ${ends[i + 4] / CELL_M}`);
  }
  return all.sort();
}

test("what is free ends at a frontier where it is unknown, not at walls", () => {
  const frontiers = new Frontiers();
  assert.deepEqual(frontiers.set(tile([0, 0], 1, filled("#..o    "))), [[0, 0]]);
  // The rows above and below the tile are unknown, too.
  assert.deepEqual(sides(frontiers.of([0, 0])), ["1 0 - 4 0", "1 8 - 4 8", "4 0 - 4 8"]);
  frontiers.set(tile([0, 0], 2, filled("#..x    ")));
  assert.deepEqual(sides(frontiers.of([0, 0])), ["1 0 - 3 0", "1 8 - 3 8"]);
  assert.deepEqual(sides(frontiers.of([5, 5])), []);
});

test("a closed room has none, but behind its door", () => {
  const room = ["        ", "######  ", "#....#  ", "#....#  ", "#....#  ", "#....#  ", "######  ", "        "];
  const frontiers = new Frontiers();
  frontiers.set(tile([0, 0], 1, [...room]));
  assert.deepEqual(sides(frontiers.of([0, 0])), []);
  frontiers.set(tile([0, 0], 2, room.map((row, i) => i === 3 || i === 4 ? "#.....  " : row)));
  assert.deepEqual(sides(frontiers.of([0, 0])), ["6 3 - 6 5"]);
});

test("single cells that no beam has met, or only one, are no frontier", () => {
  const frontiers = new Frontiers();
  for (let y = -1; y <= 1; ++y) for (let x = -1; x <= 1; ++x) frontiers.set(tile([x, y], 1, filled("........")));
  frontiers.set(tile([0, 0], 2, ["........", "... ....", "........", ".....  .", "........", "........", "........", "........"]));
  assert.deepEqual(sides(frontiers.of([0, 0])), []);
  frontiers.set(tile([0, 0], 3, ["        ", " .      ", "        ", "  .     ", "   .    ", "    .   ", "        ", "        "]));
  assert.deepEqual(sides(frontiers.of([0, 0])), []);
  frontiers.set(tile([0, 0], 4, ["........", "........", "........", ".....  .", ".....  .", "........", "........", "........"]));
  assert.deepEqual(sides(frontiers.of([0, 0])), ["5 3 - 5 5", "5 3 - 7 3", "5 5 - 7 5", "7 3 - 7 5"]);
});

test("a neighbour that comes later closes the frontier between them; an older version changes nothing", () => {
  const frontiers = new Frontiers();
  for (const y of [-1, 0, 1]) frontiers.set(tile([-1, y], 1, filled("........")));
  assert.ok(sides(frontiers.of([-1, 0])).includes("0 0 - 0 8"));
  assert.deepEqual(new Set(frontiers.set(tile([0, 0], 3, filled("....#   "))).map(key => key.join())), new Set(["-1,-1", "-1,0", "-1,1", "0,0"]));
  assert.ok(!sides(frontiers.of([-1, 0])).includes("0 0 - 0 8"));
  assert.deepEqual(frontiers.set(tile([0, 0], 2, filled("        "))), []);
  assert.ok(!sides(frontiers.of([-1, 0])).includes("0 0 - 0 8"));
});
