import assert from "node:assert/strict";
import { test } from "node:test";
import { Outbox } from "./outbox.ts";
import type { FromWorker, Receipt, ShownFrame, TimedFrame } from "./worker_messages.ts";

const timed = (kind: ShownFrame["kind"]): TimedFrame => ({ frame: { kind } as ShownFrame, receivedMs: 0 });
const receipt = (sequence: number): Receipt => ({ connection: 1, sequence });

/** An outbox, and of each message that it posted the kinds of frames and the sequence. */
function watched(): { outbox: Outbox; posted: [string, number][] } {
  const posted: [string, number][] = [];
  const outbox = new Outbox((message: FromWorker) => {
    if (message.type === "frames") posted.push([message.frames.map(({ frame }) => frame.kind).join(), message.receipt.sequence]);
  });
  return { outbox, posted };
}

test("pages wait for each other, what else comes goes at once and behind them", () => {
  const { outbox, posted } = watched();
  outbox.add(timed("meshPage"), receipt(2));
  outbox.add(timed("meshPage"), receipt(3));
  assert.deepEqual(posted, []);
  outbox.add(timed("pose"), receipt(4));
  outbox.flush();
  assert.deepEqual(posted, [["meshPage,meshPage,pose", 4]]);
});

test("pages go after a moment, or when there are many", async () => {
  const { outbox, posted } = watched();
  for (let i = 0; i < 60; ++i) outbox.add(timed("meshPage"), receipt(2 + i));
  assert.deepEqual(posted.map(([, sequence]) => sequence), [51]);
  await new Promise(done => setTimeout(done, 50));
  assert.deepEqual(posted.map(([, sequence]) => sequence), [51, 61]);
});
