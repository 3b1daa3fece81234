// Units that are chosen for a value: by closed forms, and by what a turn moves.

import assert from "node:assert/strict";
import { test } from "node:test";

import { seriesOf } from "../page/capture.js";
import { perSecond, inOther } from "../page/unit_field.js";
import { conversion, unitsOf } from "../page/unit_table.js";
import { inUnit } from "../page/units.js";

const line = (node, values, more = {}) => ({ node, name: `node ${node}`, isCapture: false, series: seriesOf({ times: Float64Array.from(values, (_, at) => at), values: Float64Array.from(values) }), ...more });
const pane = (unit, lines, more = {}) => ({ key: "x", field: "x", unit, decimals: 1, lines, ...more });
const shown = (of) => of.lines.map(({ series }) => [...series.values].map((value) => Math.round(value * 1e6) / 1e6));
const feeds = (node) => ({ 4: 0.5, 5: 0.01 })[node] ?? null;

test("units along a way are offered where a node has one", () => {
  assert.deepEqual(unitsOf("r/min"), ["r/min", "rad/s", "°/s", "turns/s"]);
  assert.deepEqual(unitsOf("°", [null, 0.5]), ["°", "rad", "turns", "mm", "m"]);
  assert.deepEqual(unitsOf("V", [0.5]), ["V"]);
});

test("a turn in a minute is 6 degrees in a second, 2 pi / 60 rad/s, and the feed of each node", () => {
  const speeds = pane("r/min", [line(4, [60, -30])]);
  assert.deepEqual(shown(inUnit(speeds, "°/s", feeds)), [[360, -180]]);
  assert.deepEqual(shown(inUnit(speeds, "rad/s", feeds)), [[6.283185, -3.141593]]);
  assert.deepEqual(shown(inUnit(speeds, "m/s", feeds)), [[0.5, -0.25]]);
  const angles = pane("°", [line(4, [360]), line(5, [720]), line(6, [90])]);
  assert.deepEqual(shown(inUnit(angles, "turns", feeds)), [[1], [2], [0.25]]);
  // Node 6 moves nothing along: it has no line in mm.
  const along = inUnit(angles, "mm", feeds);
  assert.deepEqual([shown(along), along.unit, along.key], [[[500], [20]], "mm", "x in mm"]);
});

test("what is not chosen stays as it is, and what was kept is not changed", () => {
  const own = pane("r/min", [line(4, [60])], { level: 30 });
  assert.equal(inUnit(own, "r/min", feeds), own);
  assert.equal(inUnit(own, undefined, feeds), own);
  assert.equal(inUnit(own, "mm", feeds), own, "a unit of another quantity");
  const seen = inUnit(own, "turns/s", feeds);
  assert.deepEqual([seen.level, [...own.lines[0].series.values]], [0.5, [60]]);
  assert.equal(inUnit(pane("°", [line(4, [1]), line(5, [1])], { level: 1 }), "mm", feeds).level, undefined, "two nodes, two places");
});

test("the values of a capture are converted once, those of a running picture as they come", () => {
  const kept = line(4, [60], { isCapture: true });
  const values = () => inUnit(pane("r/min", [kept]), "rad/s", feeds).lines[0].series.values;
  assert.equal(values(), values());
  const live = line(4, [60]);
  const last = () => [...inUnit(pane("r/min", [live]), "turns/s", feeds).lines[0].series.values][0];
  assert.equal(last(), 1);
  live.series.values[0] = 120;
  assert.equal(last(), 2);
});

test("a conversion is a factor, and none where nothing is known to move", () => {
  const factor = (...of) => Number(conversion(...of)?.factor.toPrecision(9) ?? NaN);
  assert.equal(factor("°", "turns"), 0.00277777778);
  // A wheel of 0.5 m around: 360 degrees are 500 mm, and 60 r/min are 0.5 m/s.
  assert.deepEqual([factor("°", "mm", 0.5) * 360, factor("r/min", "m/s", 0.5) * 60].map((value) => Number(value.toPrecision(6))), [500, 0.5]);
  for (const [unit, chosen, feed_m] of [["°", "mm", null], ["°", "°", 1], ["°", undefined, 1], ["V", "mm", 1]]) assert.equal(conversion(unit, chosen, feed_m), null, `${unit} ${chosen}`);
});

test("what a field says is the same in another unit", () => {
  assert.equal(inOther(90, 1, 1 / 360), 0.25);
  assert.equal(inOther(0.25, 1 / 360, Math.PI / 180), 1.5708);
  assert.deepEqual(["r/min", "rad/s", "mm/s"].map(perSecond), ["r/min/s", "rad/s²", "mm/s²"]);
});
