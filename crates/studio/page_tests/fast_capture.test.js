// What a fast capture asks for, and what becomes of its answer.

import assert from "node:assert/strict";
import { test } from "node:test";

import { captureOfAnswer, namesIn, orderOf, remarkOf, rowsOf, timesIn } from "../page/fast_capture.js";

const fields = (more = {}) => ({ chosen: ["velocity"], more: "", period_ms: "1", duration_s: "2", trigger: "", pre_ms: "0", take: "", sdo: false, ...more });

test("an order has what the fields have, each quantity once, and times in ms", () => {
  assert.deepEqual(orderOf(4, fields({ more: "6041h, true_winding velocity", duration_s: "0.25", period_ms: "0.5" })), {
    do: "capture", node: 4, quantities: ["velocity", "6041h", "true_winding"], period_ms: 0.5, duration_ms: 250, trigger: null, pre_ms: 0, take: [], sdo: false,
  });
  const armed = orderOf(4, fields({ trigger: " velocity>10 ", pre_ms: "50", take: "tpdo1, tpdo2", sdo: true }));
  assert.deepEqual([armed.trigger, armed.pre_ms, armed.take, armed.sdo], ["velocity>10", 50, ["tpdo1", "tpdo2"], true]);
  // What is kept of before a trigger has no meaning without one.
  assert.equal(orderOf(4, fields({ pre_ms: "50" })).pre_ms, 0);
  assert.deepEqual(namesIn(" a,b  c,"), ["a", "b", "c"]);
});

test("what is wrong with a field is said before anything is sent", () => {
  const wrong = (more, says) => assert.throws(() => orderOf(4, fields(more)), says);
  wrong({ chosen: [] }, /choose a quantity first/);
  wrong({ duration_s: "" }, /expected a time in s, got ''/);
  wrong({ duration_s: "fast" }, /expected a time in s, got 'fast'/);
  wrong({ duration_s: "-1" }, /expected a time above 0 s/);
  wrong({ duration_s: "Infinity" }, /expected a time in s/);
  wrong({ trigger: "velocity>1", pre_ms: "soon" }, /expected a time before the trigger in ms, got 'soon'/);
});

test("it is captured as often as a browser keeps captures", () => {
  assert.deepEqual([timesIn("1", 12), timesIn(" 12 ", 12)], [1, 12]);
  for (const text of ["0", "13", "1.5", "-1", "", "many"]) assert.throws(() => timesIn(text, 12), /expected/, text);
});

const answer = (more = {}) => ({
  node: 4, model: "zlac8030l", begun_s: 100, trigger_s: 0.002, time_s: [0, 0.001, 0.002, 0.003], pace: "event timer", load: 0.234, nmt_back: "by its heartbeat it is pre-operational again", lacks: [],
  objects: [["6083h:00", [0xe8, 3, 0, 0]], ["1008h:00", []]],
  traces: [
    { quantity: "velocity_rpm", unit: "r/min", by: "TPDO1", values: [1, 2, 3, 4], period_s: 0.001, jitter_s: 0.00002, gaps: 0 },
    { quantity: "position_deg", unit: "°", by: "SDO", values: [null, 5, null, 7], period_s: 0.002, jitter_s: 0, gaps: 1 },
    { quantity: "true_winding_c", unit: "°C", by: "world", values: [null, null, null, null], period_s: null, jitter_s: null, gaps: 0 },
  ],
  ...more,
});

test("a capture has the times of the bus, its trigger as zero, and the panes of what the studio reads", () => {
  const capture = captureOfAnswer(answer(), { id: "a", now: new Date("2026-01-02T03:04:05Z") });
  const [speed, position, ...none] = capture.columns;
  assert.deepEqual([speed.field, speed.label, speed.node], ["velocity_rpm", "Speed", 4]);
  assert.deepEqual([[...speed.times], [...speed.values]], [[100, 100.001, 100.002, 100.003], [1, 2, 3, 4]]);
  // By SDO it has readings of its own times; the studio reads it as angle_degrees.
  assert.deepEqual([position.field, [...position.times], [...position.values]], ["angle_degrees", [100.001, 100.003], [5, 7]]);
  assert.deepEqual(none, [], "what has no value has no column");
  assert.equal(capture.zero_s, 100.002);
  assert.deepEqual([capture.model, capture.parameters, capture.notes], ["zlac8030l", { "6083h:00": "E8030000", "1008h:00": "" }, ""]);
  assert.equal(captureOfAnswer(answer({ trigger_s: null }), { id: "b" }).zero_s, 100);
});

test("the rate that was had and its jitter are shown of each quantity, and that the drive is as it was", () => {
  assert.deepEqual(rowsOf(answer()), [
    ["velocity_rpm", "TPDO1", "4", "1.000 ms", "0.020 ms", "0"],
    ["position_deg", "SDO", "2", "2.000 ms", "0.000 ms", "1"],
    ["true_winding_c", "world", "0", "–", "–", "0"],
  ]);
  assert.equal(remarkOf(answer()), "4 rows in 0.003 s. By event timer; this node's TPDOs and SYNC took 23 % of the bus at most. The PDOs are as they were; by its heartbeat it is pre-operational again.");
  const left = remarkOf(answer({ pace: null, load: null, nmt_back: null, lacks: ["node 4: not everything was put back"] }));
  assert.equal(left, "4 rows in 0.003 s. Read without a TPDO. node 4: not everything was put back");
});
