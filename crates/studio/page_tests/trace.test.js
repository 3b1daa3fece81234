// What the trace adds up of its lines.

import assert from "node:assert/strict";
import { test } from "node:test";

import { ORDERS, addIdentifiers, cycleOf, frameOf, lineAt, periodOf, timeOf } from "../page/trace_sum.js";

const line = (at_s, id) => ({ at_s, id });
const lines = [line(1, "080"), line(1.25, "184"), line(1.5, "080"), line(1.5, "584"), line(2.25, "184")];

test("a line's time is that of the bus, or since another line", () => {
  const times = (delta, chosen_s = null) => lines.map((_, at) => timeOf(lines, at, delta, chosen_s));
  assert.deepEqual(times("none"), [1, 1.25, 1.5, 1.5, 2.25]);
  assert.deepEqual(times("before"), [null, 0.25, 0.25, 0, 0.75]);
  assert.deepEqual(times("same"), [null, null, 0.5, null, 1]);
  assert.deepEqual(times("chosen", 1.5), [-0.5, -0.25, 0, 0, 0.75]);
  assert.deepEqual(times("chosen"), [null, null, null, null, null]);
});

test("the line of a time is the last one that is not later", () => {
  assert.deepEqual([0.9, 1, 1.3, 1.5, 9].map((at_s) => lineAt(lines, at_s)), [-1, 0, 1, 3, 4]);
  assert.equal(lineAt([], 1), -1);
});

test("parts add up to the count, the period and the range of the whole", () => {
  // SYNC at 0, 10, 24, 34, 44 ms, in two parts: 44 ms in four intervals.
  const part = (times, least_ms, most_ms) => ({ identifiers: [{ id: "080", count: times.length, first_s: times[0] / 1e3, least_ms, most_ms, last: { at_s: times.at(-1) / 1e3 } }] });
  const known = addIdentifiers(new Map(), part([0, 10], 10, 10));
  assert.ok(Math.abs(periodOf(known.get("080")) - 10) < 1e-9);
  addIdentifiers(known, part([24, 34, 44], 10, 10));
  const one = known.get("080");
  assert.equal(one.count, 5);
  assert.ok(Math.abs(periodOf(one) - 11) < 1e-9);
  assert.ok(Math.abs(one.least_ms - 10) < 1e-9 && Math.abs(one.most_ms - 14) < 1e-9, "the gap between the parts counts");
  // A single frame has no period, and no range before the second one.
  addIdentifiers(known, { identifiers: [{ id: "701", count: 1, first_s: 3, least_ms: null, most_ms: null, last: { at_s: 3 } }] });
  assert.deepEqual([periodOf(known.get("701")), known.get("701").least_ms], [null, null]);
  addIdentifiers(known, { identifiers: [{ id: "701", count: 1, first_s: 4, least_ms: null, most_ms: null, last: { at_s: 4 } }] });
  assert.deepEqual([periodOf(known.get("701")), known.get("701").least_ms, known.get("701").most_ms], [1000, 1000, 1000]);
  const extended = { ...one, id: "00000001", count: 9 };
  assert.deepEqual([extended, known.get("701"), one].sort(ORDERS.id).map(({ id }) => id), ["080", "701", "00000001"]);
  assert.deepEqual([one, extended].sort(ORDERS.count).map(({ count }) => count), [9, 5]);
});

test("two fields are a frame, or what is wrong with them is said", () => {
  for (const [id, data, text] of [
    ["604", "40 41 60 00 00 00 00 00", "604#4041600000000000"],
    ["0x80", "", "080#"],
    ["701h", "r", "701#R"],
    ["18ff0001", "01.02", "18FF0001#0102"],
  ]) {
    assert.equal(frameOf(id, data), text);
  }
  for (const [id, data, why] of [
    ["800", "", /'800' is not a COB-ID: expected 0 to 7FF/],
    ["20000000", "", /not a COB-ID/],
    ["1234", "", /not a COB-ID/],
    ["", "", /not a COB-ID/],
    ["604", "4", /not the data of a frame/],
    ["604", "00 11 22 33 44 55 66 77 88", /up to eight bytes/],
    ["604", "xx", /not the data/],
  ]) {
    assert.throws(() => frameOf(id, data), why);
  }
  assert.deepEqual([cycleOf(""), cycleOf("20"), cycleOf("1e3")], [null, 20, 1000]);
  for (const text of ["19", "-5", "fast", "NaN", "1e9"]) assert.throws(() => cycleOf(text), /is not a period: expected 20 to 3600000 ms/);
});
