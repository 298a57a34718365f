import assert from "node:assert/strict";
import { test } from "node:test";
import { PathStore } from "./path_store.ts";

const chunk = (first: number, total: number, ...points: number[]) => ({ which: 0, first, total, points: Float32Array.from(points) });

test("chunks are put in their places, in any order; what is missing is left out until it comes", () => {
  const paths = new PathStore();
  paths.set(chunk(2, 3, 7, 8, 9));
  assert.deepEqual([...paths.points(0)], [7, 8, 9]);
  paths.set(chunk(0, 3, 1, 2, 3, 4, 5, 6));
  assert.deepEqual([...paths.points(0)], [1, 2, 3, 4, 5, 6, 7, 8, 9]);
  assert.deepEqual(paths.box(), { low: [1, 2, 3], high: [7, 8, 9] });
});

test("a path that was corrected replaces points and becomes shorter", () => {
  const paths = new PathStore();
  paths.set(chunk(0, 3, 1, 1, 1, 2, 2, 2, 3, 3, 3));
  paths.set(chunk(1, 2, 5, 5, 5));
  assert.deepEqual([...paths.points(0)], [1, 1, 1, 5, 5, 5]);
  paths.set(chunk(0, 0));
  assert.deepEqual([...paths.points(0)], []);
  assert.equal(paths.box(), null);
});
