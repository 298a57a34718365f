import assert from "node:assert/strict";
import { test } from "node:test";
import type { MeshPage } from "../protocol/mesh_page.ts";
import { chooseLevel, triangleSide } from "./level_choice.ts";

const SIDES = [0.02, 0.04, 0.08];

test("the further a page is, the coarser is what is drawn of it", () => {
  assert.deepEqual([0.001, 0.019, 0.021, 0.039, 0.041, 1].map(pixelM => chooseLevel(SIDES, pixelM, 0)), [0, 0, 1, 1, 2, 2]);
});

test("near a limit the level that is drawn stays", () => {
  const there = [0.0199, 0.0201, 0.0199, 0.0165], drawn: number[] = [];
  for (const pixelM of there) drawn.push(chooseLevel(SIDES, pixelM, drawn.at(-1) ?? 0));
  assert.deepEqual(drawn, [0, 1, 1, 1]);
  assert.equal(chooseLevel(SIDES, 0.0159, 1), 0);
  assert.equal(chooseLevel(SIDES, 0.033, 2), 2);
  assert.equal(chooseLevel(SIDES, 0.018, 2), 1);  // from 2 over 1: kept at 1 by its own limit
});

test("of levels that have not come the next finer one is drawn, or what there is", () => {
  assert.equal(chooseLevel([0.02, undefined, 0.08], 0.02, 0), 0);
  assert.equal(chooseLevel([0.02, 0.04, undefined], 1, 0), 1);
  assert.equal(chooseLevel([undefined, undefined, 0.08], 0.001, 2), 2);
  assert.equal(chooseLevel([undefined, 0.04, 0.08], 0.001, 2), 1);
});

test("a level wall of 32 x 32 squares has triangles of about a square's side, with a quarter of them twice that", () => {
  const wall = (indices: number): MeshPage => ({
    key: [0, 0, 0], version: 1, level: 0, hasColors: false, origin: [0, 0, 0], quantum: 1, ageS: 0, positions: new Int16Array(0), tints: new Uint8Array(0),
    indices: new Uint16Array(indices), low: [0, 0, 0], high: [0.64, 0.64, 0],
  });
  assert.ok(Math.abs(triangleSide(wall(6 * 32 * 32)) - 0.02 * Math.SQRT2) < 1e-9);
  assert.ok(Math.abs(triangleSide(wall(6 * 16 * 16)) - 0.04 * Math.SQRT2) < 1e-9);
  assert.equal(triangleSide({ ...wall(0), high: [0, 0, 0] }), 0);
});
