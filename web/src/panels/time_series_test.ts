import assert from "node:assert/strict";
import { test } from "node:test";
import { TimeSeries } from "./time_series.ts";
import { bytes, clock, count, figure, length } from "./numbers.ts";

test("columns that come later are empty before; what is not a number is a gap", () => {
  const series = new TimeSeries(0.2, 10);
  series.add(0, { a: 1 });
  series.add(1, { a: 2, b: 5 });
  series.add(2, { b: NaN });
  assert.deepEqual(series.table(), [[0, 1, 2], [1, 2, null], [null, 5, null]]);
  assert.deepEqual(series.names, ["a", "b"]);
});

test("values that follow too fast are thinned, and the newest is always there", () => {
  const series = new TimeSeries(0.2, 1000);
  for (let i = 0; i <= 100; ++i) series.add(i / 100, { a: i });
  const [times, values] = series.table();
  assert.ok(times.length <= 8, String(times.length));
  assert.equal(times.at(-1), 1);
  assert.equal(values.at(-1), 100);
});

test("the oldest go", () => {
  const series = new TimeSeries(0.1, 5);
  for (let i = 0; i < 9; ++i) series.add(i, { a: i });
  assert.deepEqual(series.table(), [[4, 5, 6, 7, 8], [4, 5, 6, 7, 8]]);
});

test("numbers as they are read", () => {
  assert.deepEqual([figure(null), figure(NaN, "m"), figure(2.34567, "m"), figure(31.4), figure(-314.2)], ["-", "-", "2.35\u202fm", "31.4", "-314"]);
  assert.deepEqual([length(0.1234), length(4)], ["12.3\u202fcm", "4.000\u202fm"]);
  assert.deepEqual([bytes(999), bytes(1.25e6), bytes(3e9)], ["999\u202fB", "1.3\u202fMB", "3.0\u202fGB"]);
  assert.deepEqual([clock(65.9), clock(-1), count(3440000), count(1296)], ["1:05", "0:00", "3.44\u202fM", "1296"]);
});
