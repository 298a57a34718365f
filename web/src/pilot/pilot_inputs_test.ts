import assert from "node:assert/strict";
import { test } from "node:test";
import { add, atRest, fromGamepad, fromKeys, fromSticks, REST, velocityOf, withDeadBand } from "./pilot_inputs.ts";

test("keys: opposite ones cancel, others add", () => {
  assert.deepEqual(fromKeys(["KeyW", "ArrowLeft"]), { ahead: 1, left: 0, up: 0, turn: 1 });
  assert.ok(atRest(fromKeys(["KeyW", "KeyS"])));
  assert.ok(atRest(fromKeys(["KeyX"])));
  assert.deepEqual(add(fromKeys(["KeyA"]), { ...REST, left: 0.8 }).left, 1);
});

test("sticks: the left one climbs and turns, the right one goes; a gamepad's y grows downwards", () => {
  assert.deepEqual(fromSticks(1, 1, 0, 0), { turn: -1, up: 1, left: -0, ahead: 0 });
  assert.deepEqual(fromSticks(0, 0, -1, 1), { turn: -0, up: 0, left: 1, ahead: 1 });
  assert.deepEqual(fromGamepad([0, -1, 0, -1]), { turn: -0, up: 1, left: -0, ahead: 1 });
  assert.ok(atRest(fromGamepad([])));
  assert.ok(atRest(fromGamepad([0.1, -0.1, 0.05, 0.11])));
});

test("the dead band has no step at its edge", () => {
  assert.equal(withDeadBand(0.12), 0);
  assert.ok(withDeadBand(0.13) < 0.02);
  assert.equal(withDeadBand(-1), -1);
});

test("no direction is faster than full speed", () => {
  const [x, y] = velocityOf({ ahead: 1, left: 1, up: 0, turn: 0 }, 0.5);
  assert.ok(Math.abs(Math.hypot(x, y) - 0.5) < 1e-12);
  assert.deepEqual(velocityOf({ ahead: 0.5, left: 0, up: -1, turn: 0 }, 1), [0.5, 0, -0.6]);
});
