import assert from "node:assert/strict";
import { test } from "node:test";
import { PilotLink } from "./pilot_link.ts";

interface Sent { type: string; sequence: number; kind: string; age_ms: number; expires_ms: number; velocity_m_s?: number[]; force?: boolean }

function start(holder = "you") {
  const sent: Sent[] = [], clock = { ms: 1000 };
  const link = new PilotLink(text => sent.push(JSON.parse(text)), () => clock.ms);
  link.opened();
  link.receive(JSON.stringify({ type: "lease", holder }));
  const tick = (times: number, everyMs: number): void => {
    for (let i = 0; i < times; ++i) {
      clock.ms += everyMs;
      link.tick();
    }
  };
  return { link, sent, clock, tick };
}

test("commands have rising sequences, their age and an expiry; a new connection counts anew", () => {
  const { link, sent, clock } = start();
  link.command("take_off", clock.ms - 40);
  clock.ms += 5;
  link.command("go_to", clock.ms, { position_m: [1, 2, 3], yaw_rad: 0.5 });
  assert.deepEqual(sent, [
    { type: "command", sequence: 1, kind: "take_off", age_ms: 40, expires_ms: 1000 },
    { type: "command", sequence: 2, kind: "go_to", age_ms: 0, expires_ms: 1000, position_m: [1, 2, 3], yaw_rad: 0.5 },
  ]);
  link.opened();
  link.command("hold", clock.ms);
  assert.equal(sent[2].sequence, 1);
});

test("velocity is sent while the page reads inputs, with their age; a frozen page sends nothing after 0.3 s", () => {
  const { link, sent, clock } = start();
  link.steer({ velocity: [0.5, 0, 0], yawRate: 0, atMs: clock.ms });
  for (let i = 0; i < 10; ++i) {
    link.tick();
    clock.ms += 50;
  }
  assert.deepEqual(sent.map(({ kind, age_ms, expires_ms }) => [kind, age_ms, expires_ms]), [0, 50, 100, 150, 200, 250, 300].map(age => ["velocity", age, 300]));
});

test("letting go sends zero once, then nothing", () => {
  const { link, sent, clock } = start();
  link.steer({ velocity: [0.5, 0, 0], yawRate: 0, atMs: clock.ms });
  link.tick();
  link.steer({ velocity: [0, 0, 0], yawRate: 0, atMs: clock.ms });
  for (let i = 0; i < 5; ++i) link.tick();
  assert.deepEqual(sent.map(({ velocity_m_s }) => velocity_m_s), [[0.5, 0, 0], [0, 0, 0]]);
});

test("without the lease nothing steers; hold and stop end steering at once", () => {
  const other = start("other");
  other.link.steer({ velocity: [1, 0, 0], yawRate: 0, atMs: other.clock.ms });
  other.link.tick();
  assert.deepEqual(other.sent, []);
  const { link, sent, clock } = start();
  link.steer({ velocity: [1, 0, 0], yawRate: 0, atMs: clock.ms });
  link.command("hold", clock.ms);
  link.tick();
  assert.deepEqual(sent.map(({ kind }) => kind), ["hold"]);
});

test("the emergency stop is sent again every 0.1 s until it is answered, without a lease", () => {
  const { link, sent, clock, tick } = start("none");
  link.command("e_stop", clock.ms);
  tick(5, 50);
  assert.deepEqual(sent.map(({ kind, sequence }) => [kind, sequence]), [["e_stop", 1], ["e_stop", 2], ["e_stop", 3]]);
  const answer = link.receive(JSON.stringify({ type: "answer", sequence: 3, accepted: true, reason: "" }));
  assert.deepEqual(answer, { type: "answer", sequence: 3, kind: "e_stop", accepted: true, reason: "", roundTripMs: 50 });
  tick(5, 100);
  assert.equal(sent.length, 3);
});

test("an emergency stop that nobody answers is given up after a second", () => {
  const { link, sent, clock, tick } = start("none");
  link.command("e_stop", clock.ms);
  tick(100, 50);
  assert.equal(sent.length, 10);
});

test("pings are answered; answers that nobody waits for, and unknown messages, are nothing", () => {
  const { link, sent } = start();
  assert.equal(link.receive(JSON.stringify({ type: "ping", sequence: 12 })), null);
  assert.deepEqual(sent, [{ type: "pong", sequence: 12 }]);
  assert.equal(link.receive(JSON.stringify({ type: "answer", sequence: 99, accepted: true })), null);
  assert.equal(link.receive(JSON.stringify({ type: "news" })), null);
  assert.throws(() => link.receive("{"));
});
