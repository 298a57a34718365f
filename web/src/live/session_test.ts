import assert from "node:assert/strict";
import { test } from "node:test";
import { MeshoptEncoder } from "meshoptimizer";
import * as encode from "../../testing/encode.ts";
import type { PageKey } from "../protocol/frames.ts";
import { FrameError } from "../protocol/reader.ts";
import { LiveSession } from "./session.ts";

await MeshoptEncoder.ready;

const hello = (session: string): encode.Payload => encode.hello({
  protocol: 1, session, program: "p", source: { verb: "scan", name: "n" }, can: { pilot: false, replay: false, exports: [] }, limits: { in_bytes: 1, in_per_s: 1 } });
const page = (key: PageKey, version: number, level: number): encode.Payload =>
  encode.meshPage({ key, version, level, hasColors: true, origin: [0, 0, 0], quantum: 1, ageS: 0 }, { vertices: [], indices: [] });

function feed(session: LiveSession, ...payloads: encode.Payload[]) {
  session.opened();
  return payloads.map((payload, i) => session.receive(encode.frame(payload, i + 1)));
}

test("hello is answered with what is known: nothing at first, then every page", () => {
  const session = new LiveSession(), [first] = feed(session, hello("a"), page([1, 2, 3], 4, 0), page([-1, 0, 0], 2, 2));
  assert.deepEqual(first.send.map(text => JSON.parse(text)), [{ type: "hello", protocol: 1, session: "a", all_levels: true, pages: [], more: false }]);
  const [again] = feed(session, hello("a"));
  assert.equal(again.cleared, false);
  assert.deepEqual(JSON.parse(again.send[0]).pages, [1, 2, 3, 4, 0, -1, 0, 0, 2, 2]);
});

test("another session clears what was shown", () => {
  const session = new LiveSession();
  feed(session, hello("a"), page([1, 2, 3], 4, 0));
  const [other] = feed(session, hello("b"));
  assert.equal(other.cleared, true);
  assert.deepEqual(JSON.parse(other.send[0]).pages, []);
});

test("more than 1,000 levels of pages are named in several messages, each shorter than 64 kB", () => {
  const session = new LiveSession();
  feed(session, hello("a"), ...Array.from({ length: 2500 }, (_, i) => page([i, -i, 100 * i], 1e9 + i, 0)));
  const { send } = feed(session, hello("a"))[0];
  assert.deepEqual(send.map(text => JSON.parse(text).more), [true, true, false]);
  assert.ok(send.every(text => text.length < 64000));
});

test("order, hello first, versions: what breaks them is refused and counted", () => {
  const session = new LiveSession();
  assert.throws(() => feed(session, encode.telemetry({})), /hello/);
  session.opened();
  assert.throws(() => session.receive(encode.frame(hello("a"), 2)), /frame 2 came after frame 0/);
  assert.throws(() => feed(session, hello("a"), hello("a")), /hello/);
  session.receive(encode.frame(encode.telemetry({}), 2));
  assert.throws(() => session.receive(encode.frame(encode.telemetry({}), 2)), FrameError);
  assert.equal(session.refused, 4);
});

test("unknown kinds are skipped, older pages are not shown, both are counted", () => {
  const session = new LiveSession();
  const received = feed(session, hello("a"), { kind: 77, bytes: new Uint8Array(0) }, page([0, 0, 0], 2, 0), page([0, 0, 0], 1, 0), encode.pageGone([0, 0, 0], 1), encode.pageGone([0, 0, 0], 3));
  assert.deepEqual(received.map(({ frame }) => frame?.kind ?? null), ["hello", null, "meshPage", null, null, "pageGone"]);
  assert.deepEqual([session.skipped, session.outdated, session.pages.size], [1, 1, 0]);
});

test("attempts become rarer, up to 5 s, and frequent again once the server was there", () => {
  const session = new LiveSession();
  assert.deepEqual(Array.from({ length: 6 }, () => session.nextPauseS()), [0.5, 1, 2, 4, 5, 5]);
  feed(session, hello("a"));
  assert.equal(session.nextPauseS(), 0.5);
});
