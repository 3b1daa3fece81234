// What a test motion asks for, and what becomes of its answer.

import assert from "node:assert/strict";
import { test } from "node:test";

import { FIELDS, SHAPES, capturesOf, figureRows, orderOf, otherDrive, pathOf, remarkOf } from "../page/test_motion.js";

const texts = (more = {}) => ({ ...Object.fromEntries(Object.entries(FIELDS).map(([name, { usual }]) => [name, usual])), ...more });
const order = (shape, more = {}, path = null) => orderOf(4, { shape, texts: texts(more), quantities: "", path });

test("an order has all that the studio asks for, in the units of its names, and empty limits as null", () => {
  const { motion, ...rest } = order("steps", { speed_rpm: "-30", count: "2", acceleration_rpm_s: "500" });
  assert.deepEqual(rest, { do: "test_motion", node: 4, quantities: [], capture_ms: null, sdo: false });
  assert.deepEqual(motion, {
    shape: "steps", by_deg: 20, speed_rpm: -30, frequency_hz: 1, to_frequency_hz: 5, periods: 3, time_s: 0.5, path: [], count: 2,
    velocity_rpm: 60, acceleration_rpm_s: 500, travel_turns: null, following_error_deg: 72, period_ms: 10,
  });
  assert.deepEqual(orderOf(4, { shape: "sine", texts: texts({ capture_ms: "2" }), quantities: "position, 6041h position", path: null }).quantities, ["position", "6041h"]);
});

test("what is wrong with a field of the shape is said before anything is sent, and other fields do not matter", () => {
  assert.throws(() => order("steps", { speed_rpm: "fast" }), /Speed: expected a number in r\/min, got 'fast'/);
  assert.throws(() => order("steps", { speed_rpm: "" }), /Speed: expected a number/);
  assert.throws(() => order("sine", { velocity_rpm: "" }), /Speed at most: expected a number/);
  assert.throws(() => order("sine", { periods: "1.5" }), /Periods: expected a whole number from 1 on, got 1.5/);
  assert.throws(() => order("sine", { count: "0" }), /Runs: expected a whole number/);
  assert.throws(() => order("path"), /choose a capture that has a position/);
  assert.equal(order("sine", { speed_rpm: "fast" }).motion.speed_rpm, 60);
  for (const { value } of SHAPES.filter(({ value }) => value !== "path")) assert.equal(order(value).motion.shape, value);
});

test("a path is the position of a capture from its begin, thinned so that it fits into a message", () => {
  const times = Float64Array.from({ length: 6001 }, (_, at) => 50 + at / 1000);
  const long = { columns: [{ field: "velocity_rpm", times, values: times }, { field: "angle_degrees", times, values: times.map((time) => 10 * (time - 50)) }] };
  const path = pathOf(long);
  assert.ok(path.length <= 1502 && JSON.stringify(path).length < 60_000, String(path.length));
  assert.deepEqual([path[0], path.at(-1)], [[0, 0], [6, 60]]);
  assert.ok(path.every(([at, degrees]) => Math.abs(degrees - 10 * at) < 1e-4));
  assert.deepEqual(order("path", {}, path).motion.path, path);
  assert.equal(pathOf({ columns: [long.columns[0]] }), null);
});

test("a path of another drive is named as that", () => {
  const of = (node, model) => ({ columns: [{ field: "velocity_rpm", node: 9 }, { field: "angle_degrees", node }], model });
  const own = { node: 5, model: "zlac8030l" };
  assert.equal(otherDrive(of(5, "zlac8030l"), own), "");
  assert.equal(otherDrive(of(5), own), "", "a log does not name its model");
  assert.equal(otherDrive(of(null), own), "", "a column that names no node");
  assert.equal(otherDrive(of(4, "zlac8030l"), own), "The path was captured of node 4 (zlac8030l), and node 5 (zlac8030l) is moved along it.");
  assert.equal(otherDrive(of(5, "zlim42c"), own), "The path was captured of node 5 (zlim42c), and node 5 (zlac8030l) is moved along it.");
});

const capture = (begun_s, values) => ({
  node: 4, model: "zlac8030l", begun_s, trigger_s: null, time_s: [0, 0.001], objects: [],
  traces: [{ quantity: "velocity_rpm", unit: "r/min", by: "TPDO1", values, period_s: 0.001, jitter_s: 0, gaps: 0 }],
});
const answer = (more = {}) => ({
  node: 4, shape: "steps", limits: { velocity_rpm: 60, acceleration_rpm_s: null, following_error_deg: null, travel_turns: null }, nmt_back: null, lacks: [],
  runs: [
    { run: 1, followed: null, steps: [{ from: 0, to: 60, rise_s: { value: 0.0663, grid: 0.001 }, overshoot: { why: "too few readings" }, settling_s: { value: 0.2, grid: 0.001 } }], no_steps: null, heating: { rms_a: 1.5, a2s: 2.25 }, capture: capture(100, [0, 60]) },
    { run: 2, followed: { took_s: 4, most_deg: 12.3456, rms_deg: 8 }, steps: [], no_steps: null, heating: null, capture: capture(102, [null, null]) },
  ],
  ...more,
});

test("the figures of each run are shown with what the sampling leaves open, or why there are none", () => {
  assert.deepEqual(figureRows(answer()), [
    ["1", "rise, 0 to 60 r/min", "66.3 ± 1.0 ms"],
    ["1", "overshoot, 0 to 60 r/min", "too few readings"],
    ["1", "settling, 0 to 60 r/min", "200.0 ± 1.0 ms"],
    ["1", "current", "1.500 A r.m.s., 2.250 A²·s"],
    ["2", "following error", "12.346° at most, 8.000° r.m.s."],
    ["2", "time", "4.000 s"],
  ]);
  const none = answer({ runs: [{ ...answer().runs[0], steps: [], no_steps: "velocity was not captured", heating: null }] });
  assert.deepEqual(figureRows(none), [["1", "steps", "velocity was not captured"]]);
});

test("it is said within which limits it was, and what is as it was or is not", () => {
  assert.equal(remarkOf(answer()), "2 runs within 60 r/min, the drive's own ramps. The drive stands without power, and its PDOs are as they were.");
  const sine = answer({ shape: "sine", limits: { velocity_rpm: 60, acceleration_rpm_s: 600, following_error_deg: 72, travel_turns: 0.5 } });
  assert.match(remarkOf(sine), /^2 runs within 60 r\/min, 600 r\/min\/s, 72° of following error, 0.5 turns of travel\. .*its PDOs are as they were\.$/);
  assert.match(remarkOf(answer({ lacks: ["it was stopped"] })), /own ramps\. it was stopped$/);
});

test("each run is a capture of the scope with the times of the bus; one without readings is left out", () => {
  const [one, ...none] = capturesOf(answer(), { id: () => "a", now: new Date("2026-01-02T03:04:05Z") });
  assert.deepEqual([none, one.zero_s, one.columns[0].label], [[], 100, "Speed"]);
  assert.ok(one.name.endsWith(" steps 1"), one.name);
  // Steps are laid over each other by their demand.
  const demand = { ...capture(100, [0, 60]).traces[0], quantity: "target_velocity_rpm" };
  const stepped = answer({ runs: [{ ...answer().runs[0], capture: { ...capture(100, [0, 0]), traces: [demand] } }] });
  assert.equal(capturesOf(stepped, { id: () => "b" })[0].zero_s, 100.001);
});
