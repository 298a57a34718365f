import assert from "node:assert/strict";
import { test } from "node:test";
import { PageSet } from "./page_set.ts";

test("the newest version and of it every level is kept, in whatever order they come", () => {
  const pages = new PageSet();
  assert.ok(pages.accept([0, 0, 0], 3, 2));
  assert.ok(pages.accept([0, 0, 0], 3, 0));
  assert.ok(pages.accept([0, 0, 0], 3, 1));
  assert.deepEqual(pages.describe(2), [[0, 0, 0, 3, 2, 0, 0, 0, 3, 0], [0, 0, 0, 3, 1]]);
  assert.ok(!pages.accept([0, 0, 0], 3, 0));
  assert.ok(!pages.accept([0, 0, 0], 2, 0));
  assert.ok(pages.accept([0, 0, 0], 4, 2));
  assert.ok(!pages.accept([0, 0, 0], 3, 1));
  assert.deepEqual(pages.describe(10), [[0, 0, 0, 4, 2]]);
});

test("what is gone stays gone until a newer version comes", () => {
  const pages = new PageSet();
  pages.accept([1, 2, 3], 5, 0);
  assert.ok(!pages.remove([1, 2, 3], 4));
  assert.ok(pages.remove([1, 2, 3], 6));
  assert.ok(!pages.remove([1, 2, 3], 6));
  assert.ok(!pages.accept([1, 2, 3], 5, 0));
  assert.ok(pages.accept([1, 2, 3], 7, 1));
  assert.equal(pages.size, 1);
});

test("keys that are negative, and many pages, are described in parts", () => {
  const pages = new PageSet();
  for (let i = 0; i < 5; ++i) pages.accept([-i, i, -7], i, 1);
  assert.deepEqual(pages.describe(2).map(part => part.length), [10, 10, 5]);
  assert.deepEqual(pages.describe(2)[1].slice(0, 5), [-2, 2, -7, 2, 1]);
  assert.deepEqual(new PageSet().describe(2), [[]]);
});
