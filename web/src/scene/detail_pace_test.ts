import assert from "node:assert/strict";
import { test } from "node:test";
import { DetailPace } from "./detail_pace.ts";

/** Draws changing pictures on a card that needs so long for triangles of the finest size; returns the last coarseness. */
function play(pace: DetailPace, finestMs: number, pictures: number, clock: { ms: number }): number {
  let coarseness = 1;
  for (let i = 0; i < pictures; ++i) {
    coarseness = pace.begin("moved", clock.ms) ?? assert.fail("a change is drawn");
    clock.ms += finestMs / coarseness ** 2;
    pace.finished(clock.ms);
  }
  return coarseness;
}

test("a fast card draws in every detail, once a change", () => {
  const pace = new DetailPace(), clock = { ms: 0 };
  assert.equal(play(pace, 16, 20, clock), 1);
  assert.equal(pace.begin("none", clock.ms + 1e4), null);
});

test("a slow card settles on pictures of a tenth of a second, and does not swing", () => {
  const pace = new DetailPace(), clock = { ms: 0 };
  const settled = play(pace, 1600, 6, clock);
  assert.ok(1600 / settled ** 2 <= 100 && settled <= 8, `${settled}`);
  for (let i = 0; i < 5; ++i) assert.equal(play(pace, 1600, 1, clock), settled);
  assert.equal(play(pace, 1e6, 30, clock), 8);
});

test("what rests becomes fine step by step, and a change begins coarse again", () => {
  const pace = new DetailPace(), clock = { ms: 0 };
  const settled = play(pace, 1600, 8, clock);
  assert.equal(pace.begin("none", clock.ms + 100), null);
  const seen: number[] = [];
  for (let i = 0; i < 8; ++i) {
    clock.ms += 300;
    const coarseness = pace.begin("none", clock.ms);
    if (coarseness === null) break;
    seen.push(coarseness);
    clock.ms += 1600 / coarseness ** 2;
    pace.finished(clock.ms);
  }
  assert.equal(seen.at(-1), 1);
  assert.ok(seen.every((value, i) => value < (seen[i - 1] ?? settled)));
  assert.equal(pace.begin("none", clock.ms + 1e4), null);
  assert.equal(pace.begin("moved", clock.ms), settled);
});

test("one long picture does not last", () => {
  const pace = new DetailPace(), clock = { ms: 0 };
  play(pace, 800, 1, clock);
  assert.equal(play(pace, 16, 8, clock), 1);
});

test("pictures of a model that grows take half of the time, others do not wait", () => {
  const pace = new DetailPace();
  assert.equal(pace.begin("grown", 1000), 1);
  pace.finished(1080);
  assert.equal(pace.begin("grown", 1150), null);
  assert.equal(pace.begin("grown", 1160), 1);
  pace.finished(1240);
  assert.equal(pace.begin("moved", 1240), 1);
  pace.finished(5240);
  assert.notEqual(pace.begin("grown", 5500), null);  // not longer than a quarter of a second
});
