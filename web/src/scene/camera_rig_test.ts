import assert from "node:assert/strict";
import { test } from "node:test";
import { CameraRig, VIEW_SLOPE } from "./camera_rig.ts";
import type { Box, Vec3 } from "../protocol/frames.ts";

const near = (a: readonly number[], b: readonly number[], limit = 1e-9): boolean => a.every((value, k) => Math.abs(value - b[k]) < limit);
const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

test("right, up and ahead are a right-handed frame in every mode", () => {
  for (const mode of ["orbit", "walk", "plan"] as const) {
    const rig = new CameraRig();
    rig.mode = mode;
    rig.turn(77, 33);
    const { right, up, ahead } = rig.basis();
    assert.ok(near([dot(right, right), dot(up, up), dot(right, up), dot(right, ahead), dot(up, ahead)], [1, 1, 0, 0, 0]));
    assert.ok(near([right[1] * up[2] - right[2] * up[1], right[2] * up[0] - right[0] * up[2], right[0] * up[1] - right[1] * up[0]], ahead.map(v => -v)));
  }
});

test("orbiting keeps the target, walking keeps the eye", () => {
  const rig = new CameraRig(), target = [...rig.target];
  rig.turn(50, -20);
  assert.ok(near(rig.target, target));
  rig.setMode("walk");
  const eye = rig.eye();
  rig.turn(120, 40);
  assert.ok(near(rig.eye(), eye));
  rig.walk(0, 1, 0);
  const { ahead } = rig.basis(), size = Math.hypot(ahead[0], ahead[1]);
  assert.ok(near(rig.eye(), [eye[0] + ahead[0] / size, eye[1] + ahead[1] / size, eye[2]]));
});

test("zooming towards a point leaves it where it is in the view", () => {
  const rig = new CameraRig(), point: Vec3 = [2, 1, 0.5];
  const place = (): number[] => {
    const { right, up, ahead } = rig.basis(), eye = rig.eye(), offset = point.map((v, k) => v - eye[k]) as Vec3;
    return [dot(offset, right) / dot(offset, ahead), dot(offset, up) / dot(offset, ahead)];
  };
  const before = place();
  rig.zoom(0.5, point);
  assert.ok(near(place(), before));
  assert.equal(rig.distance, 6);
});

test("a model that is fitted lies within the view, and fills most of it", () => {
  const box: Box = { low: [-3, 2, 0], high: [9, 8, 2.6] };
  for (const aspect of [0.5, 1.6]) {
    const rig = new CameraRig();
    rig.fit(box, aspect);
    const { right, up, ahead } = rig.basis(), eye = rig.eye();
    let widest = 0;
    for (let corner = 0; corner < 8; ++corner) {
      const offset = [0, 1, 2].map(k => (corner >> k & 1 ? box.high[k] : box.low[k]) - eye[k]) as Vec3, depth = dot(offset, ahead) * VIEW_SLOPE;
      widest = Math.max(widest, Math.abs(dot(offset, right)) / depth / aspect, Math.abs(dot(offset, up)) / depth);
    }
    assert.ok(widest < 1 && widest > 0.9, String(widest));
  }
});

test("a plan that is fitted fills the view, seen without perspective", () => {
  const rig = new CameraRig();
  rig.setMode("plan");
  rig.fit({ low: [-3, 2, 0], high: [9, 8, 2.6] }, 1.6);
  const half = VIEW_SLOPE * rig.distance;
  assert.ok(near(rig.target.slice(0, 2), [3, 5]));
  assert.ok(Math.abs(Math.max(6 / (half * 1.6), 3 / half) - 0.94) < 1e-6);
});

test("a drag pans by what lies under the pointer, and the plan looks straight down", () => {
  const rig = new CameraRig();
  rig.setMode("plan");
  const { ahead } = rig.basis(), target = [...rig.target];
  assert.ok(near(ahead, [0, 0, -1]));
  rig.pan(100, 0, 500);
  assert.ok(near(rig.target, [target[0] - 100 * 2 * rig.distance * VIEW_SLOPE / 500, target[1], target[2]]));
});

test("distances stay between 0.1 m and 2 km", () => {
  const rig = new CameraRig();
  for (let i = 0; i < 100; ++i) rig.zoom(0.5);
  assert.equal(rig.distance, 0.1);
  for (let i = 0; i < 100; ++i) rig.zoom(2);
  assert.equal(rig.distance, 2000);
});
