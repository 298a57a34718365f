import assert from "node:assert/strict";
import { test } from "node:test";
import { BlockList, type Run } from "./block_list.ts";

test("blocks are taken from the lowest on, in as few runs as they lie in", () => {
  const list = new BlockList(10);
  assert.deepEqual(list.take(3), [{ first: 0, count: 3 }]);
  const second = list.take(2)!;
  assert.deepEqual(list.take(4), [{ first: 5, count: 4 }]);
  list.give(second);
  assert.deepEqual(list.take(3), [{ first: 3, count: 2 }, { first: 9, count: 1 }]);
  assert.equal(list.take(1), null);
});

test("where too few are free nothing is taken", () => {
  const list = new BlockList(4);
  list.take(2);
  assert.equal(list.take(3), null);
  assert.deepEqual(list.take(2), [{ first: 2, count: 2 }]);
});

test("no block is taken twice, whatever comes and goes", () => {
  const list = new BlockList(64), held: Run[][] = [], owner = new Map<number, number>();
  let state = 1;
  const below = (limit: number): number => {
    state = (state * 48271) % 2147483647;
    return state % limit;
  };
  const blocks = (runs: Run[]): number[] => runs.flatMap(({ first, count }) => Array.from({ length: count }, (_, i) => first + i));
  for (let step = 0; step < 2000; ++step) {
    if (held.length && below(2)) {
      const runs = held.splice(below(held.length), 1)[0];
      for (const block of blocks(runs)) owner.delete(block);
      list.give(runs);
      continue;
    }
    const wanted = 1 + below(9), runs = list.take(wanted);
    assert.equal(runs === null, owner.size + wanted > 64);
    if (!runs) continue;
    assert.equal(blocks(runs).length, wanted);
    for (const block of blocks(runs)) {
      assert.ok(block < 64 && !owner.has(block));
      owner.set(block, step);
    }
    held.push(runs);
  }
  held.forEach(runs => list.give(runs));
  assert.ok(list.isEmpty);
});
