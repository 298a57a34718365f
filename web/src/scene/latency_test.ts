import assert from "node:assert/strict";
import { test } from "node:test";
import { sharedClockMs, type ShownFrame } from "../live/worker_messages.ts";
import { Latency } from "./latency.ts";

const nothing = { has: () => false }, everything = { has: () => true };
const page = (ageS: number): ShownFrame => ({ kind: "meshPage", page: { ageS } }) as ShownFrame;
const pose = { kind: "pose" } as ShownFrame;

test("a change counts from the map to the finished picture", () => {
  const latency = new Latency(), now = sharedClockMs();
  latency.note(page(0.3), now - 20, nothing);
  latency.note(page(0.3), now - 20, everything);  // another level of what is there
  latency.note(pose, now - 20, nothing);
  latency.finished();
  assert.deepEqual([latency.pages, latency.poses], [[], []]);
  latency.drawn();
  latency.note(pose, now, nothing);  // not in that picture
  latency.finished();
  assert.equal(latency.pages.length, 1);
  assert.equal(latency.poses.length, 1);
  assert.ok(latency.pages[0] >= 320 && latency.pages[0] < 2320);
  assert.ok(latency.poses[0] >= 20 && latency.poses[0] < 2020);
});
