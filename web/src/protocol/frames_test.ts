import assert from "node:assert/strict";
import { test } from "node:test";
import * as encode from "../../testing/encode.ts";
import { readFrame, readHeader, type Frame } from "./frames.ts";
import { FrameError } from "./reader.ts";
import { makeRandom } from "../../testing/random.ts";

const read = (payload: encode.Payload): Frame => readFrame(encode.frame(payload, 1, 5_000_000_000n));
const HELLO = { protocol: 1, session: "s", program: "p", source: { verb: "scan", name: "n" }, can: { pilot: false, replay: false, exports: [] }, limits: { in_bytes: 1, in_per_s: 1 } };

/** One frame of each kind, as small as it goes. */
const SAMPLES: Record<string, encode.Payload> = {
  hello: encode.hello(HELLO), pageGone: encode.pageGone([-1, 2, 3], 9), pose: encode.pose(1, 2, 0.25, [1, -2, 3], [0, 0, 0, 1], [0.5, 0.25]),
  path: encode.path(2, 1, 4, [1, 2, 3, 4, 5, 6]), scan: encode.scan(1, [1, 2, 3]), plan: encode.plan(2, "wall, 2 m", [0, 0, 1]),
  gridTile: encode.gridTile([-2, 5], 3, 0.5, 1.5, 2, Uint8Array.of(0, 1, 128, 255)), telemetry: encode.telemetry({ state: "running" }),
  event: encode.event({ id: 4, time_s: 1, level: "error", text: "t" }), picture: encode.picture(1, 0, 4, 3, Uint8Array.of(1, 2, 3)), statistics: encode.statistics({ time_s: 2 }),
};

test("the header holds kind, sequence and stamp", () => {
  assert.deepEqual(readHeader(encode.frame(SAMPLES.scan, 77, -3n)), { kind: 6, sequence: 77, stampNs: -3n });
});

test("every kind is read as it was written", () => {
  assert.deepEqual(read(SAMPLES.hello), { kind: "hello", hello: HELLO });
  assert.deepEqual(read(SAMPLES.pageGone), { kind: "pageGone", gone: { key: [-1, 2, 3], version: 9 } });
  assert.deepEqual(read(SAMPLES.pose), { kind: "pose", stampNs: 5_000_000_000n, pose: {
    which: "vehicle", state: "estimated", deviationM: 0.25, position: [1, -2, 3], quaternion: [0, 0, 0, 1], halfFieldRad: [0.5, 0.25] } });
  assert.deepEqual(read(SAMPLES.path), { kind: "path", path: { which: 2, first: 1, total: 4, points: Float32Array.of(1, 2, 3, 4, 5, 6) } });
  assert.deepEqual(read(SAMPLES.scan), { kind: "scan", scan: { which: "obstacles", points: Float32Array.of(1, 2, 3) } });
  assert.deepEqual(read(SAMPLES.plan), { kind: "plan", plan: { state: "refused", reason: "wall, 2 m", points: Float32Array.of(0, 0, 1) } });
  assert.deepEqual(read(SAMPLES.gridTile), { kind: "gridTile", tile: { key: [-2, 5], version: 3, cellM: 0.5, heightM: 1.5, side: 2, cells: Uint8Array.of(0, 1, 128, 255) } });
  assert.deepEqual(read(SAMPLES.telemetry), { kind: "telemetry", telemetry: { state: "running" } });
  assert.deepEqual(read(SAMPLES.event), { kind: "event", event: { id: 4, time_s: 1, level: "error", text: "t" } });
  assert.deepEqual(read(SAMPLES.picture), { kind: "picture", picture: { which: "depth", type: "image/jpeg", width: 4, height: 3, file: Uint8Array.of(1, 2, 3) } });
  assert.deepEqual(read(SAMPLES.statistics), { kind: "statistics", statistics: { time_s: 2 } });
});

test("an unknown kind is no error, another version is one that names both", () => {
  assert.deepEqual(read({ kind: 99, bytes: Uint8Array.of(1) }), { kind: "unknown", number: 99 });
  const other = encode.frame(SAMPLES.scan, 1);
  other[0] = 2;
  assert.throws(() => readFrame(other), /version 2 of the protocol, this page 1/);
});

test("every prefix of every frame is refused", () => {
  for (const [name, payload] of Object.entries(SAMPLES)) {
    // A picture's file ends with the frame: its length is not known otherwise.
    const whole = encode.frame(payload, 1), least = name === "picture" ? whole.length - 3 : whole.length;
    for (let size = 0; size < least; ++size) assert.throws(() => readFrame(whole.subarray(0, size)), FrameError, `${name}, ${size} bytes`);
  }
});

test("bytes after the end are refused", () => {
  for (const name of ["pageGone", "pose", "path", "scan", "plan"])
    assert.throws(() => readFrame(encode.pack(encode.frame(SAMPLES[name], 1), Uint8Array.of(0))), /1 bytes more/, name);
});

test("random damage is read or refused, never another error", () => {
  const uniform = makeRandom(1), random = (below: number): number => Math.floor(below * uniform());
  let refused = 0;
  for (let round = 0; round < 4000; ++round) {
    const payloads = Object.values(SAMPLES), bytes = encode.frame(payloads[random(payloads.length)], 1);
    for (let i = 0; i <= random(4); ++i) bytes[random(bytes.length)] = random(256);
    try {
      readFrame(bytes);
    } catch (error) {
      assert.ok(error instanceof FrameError, String(error));
      ++refused;
    }
  }
  assert.ok(refused > 500, `${refused} of 4000`);
});
