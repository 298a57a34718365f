import assert from "node:assert/strict";
import { test } from "node:test";
import { GridLayer } from "./grid_layer.ts";

const tile = (x: number, y: number, version: number, cells: number[]) => ({ key: [x, y] as [number, number], version, cellM: 0.5, heightM: 1, side: 2, cells: Uint8Array.from(cells) });

test("the box is that of known cells, also left of zero", () => {
  const grid = new GridLayer();
  assert.equal(grid.box(), null);
  grid.set(tile(-1, 0, 1, [0, 1, 0, 0]));
  grid.set(tile(0, 1, 1, [0, 0, 255, 0]));
  assert.deepEqual(grid.box(), { low: [-0.5, 0, 1], high: [0.5, 2, 1] });
});

test("a ray meets known cells of the slice only, ahead of it only", () => {
  const grid = new GridLayer();
  grid.set(tile(-1, 0, 1, [0, 1, 0, 0]));
  assert.deepEqual(grid.meet({ origin: [-0.25, 0.25, 3], direction: [0, 0, -1] }), [-0.25, 0.25, 1]);
  assert.equal(grid.meet({ origin: [-0.75, 0.25, 3], direction: [0, 0, -1] }), null);
  assert.equal(grid.meet({ origin: [-0.25, 0.25, 3], direction: [0, 0, 1] }), null);
  assert.equal(grid.meet({ origin: [-0.25, 0.25, 3], direction: [1, 0, 0] }), null);
});

test("an older version of a tile does not replace a newer one", () => {
  const grid = new GridLayer();
  grid.set(tile(0, 0, 2, [1, 0, 0, 0]));
  grid.set(tile(0, 0, 1, [1, 1, 1, 1]));
  assert.deepEqual(grid.box(), { low: [0, 0, 1], high: [0.5, 0.5, 1] });
});
