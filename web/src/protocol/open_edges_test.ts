import assert from "node:assert/strict";
import { test } from "node:test";
import type { PageKey, Vec3 } from "./frames.ts";
import type { MeshPage } from "./mesh_page.ts";
import { findOpenEdges, OpenBorders } from "./open_edges.ts";
import { makeRandom } from "../../testing/random.ts";

/** A level sheet of squares of 0.1 m from (x, 0) to (x + 1, 1), without those whose number is in `holes`. */
function sheet(x: number, holes: number[] = []): MeshPage {
  const positions: number[] = [], indices: number[] = [];
  for (let j = 0; j <= 10; ++j) for (let i = 0; i <= 10; ++i) positions.push(1000 * i, 1000 * j, 0, 0);
  for (let j = 0; j < 10; ++j)
    for (let i = 0; i < 10; ++i) {
      const a = 11 * j + i;
      if (!holes.includes(10 * j + i)) indices.push(a, a + 1, a + 12, a, a + 12, a + 11);
    }
  return {
    key: [0, 0, 0], version: 1, level: 0, hasColors: true, origin: [x, 0, 0], quantum: 1e-4, ageS: 0, positions: Int16Array.from(positions),
    tints: new Uint8Array(positions.length), indices: Uint16Array.from(indices), low: [x, 0, 0] as Vec3, high: [x + 1, 1, 0] as Vec3,
  };
}

const lengthOf = (ends: Float32Array): number => {
  let sum = 0;
  for (let i = 0; i < ends.length; i += 6) sum += Math.hypot(ends[i + 3] - ends[i], ends[i + 4] - ends[i + 1], ends[i + 5] - ends[i + 2]);
  return sum;
};

test("the border of a sheet is open, and that of a hole in it", () => {
  assert.ok(Math.abs(lengthOf(findOpenEdges(sheet(0))) - 4) < 1e-5);
  assert.ok(Math.abs(lengthOf(findOpenEdges(sheet(0, [44, 45]))) - 4.6) < 1e-5);
  assert.equal(findOpenEdges({ ...sheet(0), indices: new Uint16Array(0) }).length, 0);
});

test("a border that two pages share is closed, until one of them goes", () => {
  const borders = new OpenBorders(0.0025), left: PageKey = [0, 0, 0], right: PageKey = [1, 0, 0];
  assert.deepEqual(borders.set(left, findOpenEdges(sheet(0))), [left]);
  assert.ok(Math.abs(lengthOf(borders.of(left)) - 4) < 1e-5);
  // The copies of the shared border differ by the rounding of each page.
  const shifted = findOpenEdges(sheet(1)).map((value, i) => i % 3 < 2 ? value + 4e-5 : value);
  assert.deepEqual(borders.set(right, shifted), [right, left]);
  assert.ok(Math.abs(lengthOf(borders.of(left)) - 3) < 1e-5);
  assert.ok(Math.abs(lengthOf(borders.of(right)) - 3) < 1e-5);
  assert.deepEqual(borders.set(right, null), [right, left]);
  assert.equal(borders.of(right).length, 0);  // what is gone is told as well: its edges are not drawn any more
  assert.ok(Math.abs(lengthOf(borders.of(left)) - 4) < 1e-5);
});

test("matches are those of a search over all edges, whatever the tolerance's cells", () => {
  const random = makeRandom(3);
  const edges = (count: number): Float32Array => Float32Array.from({ length: 6 * count }, () => 0.2 * random() - 0.1);
  const left = edges(400), right = edges(400), tolerance = 0.004, borders = new OpenBorders(tolerance);
  borders.set([0, 0, 0], left);
  borders.set([1, -1, 1], right);
  const middle = (ends: Float32Array, i: number): number[] => [0, 1, 2].map(k => (ends[6 * i + k] + ends[6 * i + 3 + k]) / 2);
  let open = 0;
  for (let i = 0; i < 400; ++i) {
    const own = middle(left, i), met = Array.from({ length: 400 }, (_, j) => middle(right, j)).some(other => other.every((v, k) => Math.abs(v - own[k]) < tolerance));
    if (!met) ++open;
  }
  assert.equal(borders.of([0, 0, 0]).length / 6, open);
  assert.ok(open > 100 && open < 390, String(open));
});

test("where the page behind the border has a hole the border stays open", () => {
  const borders = new OpenBorders(0.0025), left: PageKey = [0, 0, 0];
  borders.set(left, findOpenEdges(sheet(0)));
  borders.set([1, 0, 0], findOpenEdges(sheet(1, [30, 40])));
  assert.ok(Math.abs(lengthOf(borders.of(left)) - 3.2) < 1e-5);
});
