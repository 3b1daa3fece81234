// Quantities computed from others: held to closed forms.

import assert from "node:assert/strict";
import { test } from "node:test";

import { computed, seriesOf } from "../page/capture.js";
import { formula } from "../page/formula.js";

/** The value of a formula without fields. */
const value = (text) => formula(text).compute([0], () => assert.fail("it has no fields"))[0];
const column = (times, of) => ({ times: Float64Array.from(times), values: Float64Array.from(times, of) });
const grid = (count, step_s) => Array.from({ length: count }, (_, at) => at * step_s);

test("signs bind as in mathematics", () => {
  for (const [text, expected] of [
    ["1 + 2 * 3", 7],
    ["(1 + 2) * 3", 9],
    ["10 - 4 - 3", 3],
    ["24 / 4 / 3", 2],
    ["2 ^ 3 ^ 2", 512],
    ["-2 ^ 2", -4],
    ["2 ^ -1", 0.5],
    ["- -3", 3],
    ["3 - -3", 6],
    ["1.5e2 + .5", 150.5],
    ["2 * pi", 2 * Math.PI],
    ["hypot(3, 4)", 5],
    ["atan2(1, 1)", Math.PI / 4],
    ["max(2, min(7, 5))", 5],
    ["sqrt(abs(-16)) + sign(-2)", 3],
    ["log(e)", 1],
  ]) {
    assert.ok(Math.abs(value(text) - expected) < 1e-12, `${text}: ${value(text)}`);
  }
});

test("what is wrong with a formula is said", () => {
  for (const [text, why] of [
    ["", /the end where/],
    ["speed *", /the end where/],
    ["(speed", /the end where '\)' was expected/],
    ["speed speed", /'speed' where an operator was expected/],
    ["speed)", /'\)' where an operator/],
    ["power", /'power' is not known; expected speed, position/],
    ["constructor", /'constructor' is not known/],
    ["toString(1)", /'toString' is not a function; expected abs/],
    ["hypot(1)", /hypot takes 2 values, not 1/],
    ["abs(1, 2)", /abs takes 1 value, not 2/],
    ["[4:606C]", /\[4:606C\] is not an object of a node/],
    ["mean(speed, t)", /mean takes a number of seconds/],
    ["mean(1, [4:606C:00])", /mean takes a number of seconds/],
    ["1 $ 2", /'\$' where an operator/],
    [`${"(".repeat(5000)}1${")".repeat(5000)}`, /more than 60 brackets/],
    [`${"-".repeat(5000)}1`, /more than 60 brackets/],
  ]) {
    assert.throws(() => formula(text), why, text.slice(0, 30));
  }
});

test("a quantity is computed at the times of the finest of what it takes", () => {
  // 60 r/min at 2 N·m/A and 3 A: 2 pi rad/s times 6 N·m.
  const speed = column(grid(11, 0.1), () => 60);
  const current = column(grid(101, 0.01), (time_s) => 3 + time_s);
  const power = computed(formula("speed * 2 * pi / 60 * 2 * current"), (field) => seriesOf({ velocity_rpm: speed, current_a: current }[field]));
  assert.equal(power.length, 101);
  assert.ok(Math.abs(power.value(0.5) - 2 * Math.PI * 2 * 3.5) < 1e-9);
});

test("the derivative of a parabola is a line, and the integral of a sine is one less the cosine", () => {
  const times = grid(1001, 0.001);
  const parabola = seriesOf(column(times, (time_s) => 5 * time_s ** 2));
  const slope = computed(formula("d(position)"), () => parabola);
  // Between its neighbours a parabola has the slope of its middle.
  for (const time_s of [0.1, 0.5, 0.9]) assert.ok(Math.abs(slope.value(time_s + 1e-6) - 10 * time_s) < 1e-6, `${time_s}`);
  const sine = seriesOf(column(times, (time_s) => Math.sin(time_s)));
  const area = computed(formula("int(speed)"), () => sine);
  assert.ok(Math.abs(area.value(1) - (1 - Math.cos(1))) < 1e-7);
});

test("the mean of the last seconds lags a ramp by half of them", () => {
  const ramp = seriesOf(column(grid(1001, 0.001), (time_s) => 7 * time_s));
  const smooth = computed(formula("mean(speed, 0.2)"), () => ramp);
  assert.ok(Math.abs(smooth.value(0.8 + 1e-6) - 7 * 0.7) < 7 * 0.001);
  const object = computed(formula("[4:606c:00] / 10"), (field) => (field === "4:606C:00" ? ramp : null));
  assert.ok(Math.abs(object.value(1) - 0.7) < 1e-12);
});

test("an integral begins where it is wanted, and a sample without a value spoils neither it nor a mean", () => {
  const times = grid(1001, 0.001);
  const line = seriesOf(column(times, (time_s) => 2 * time_s));
  const area = computed(formula("int(speed)"), () => line, 0.5);
  assert.deepEqual([area.first_s(), area.value(0.5)], [0.5, 0]);
  assert.ok(Math.abs(area.value(1) - (1 - 0.25)) < 1e-9);
  // 1/x is infinite at 0.5 s: what is before and behind stays known.
  const through = seriesOf(column(grid(11, 0.1), (time_s) => Math.round(time_s * 10) - 5));
  const inverse = computed(formula("int(1 / speed)"), () => through);
  assert.equal(inverse.length, 11);
  assert.ok(Math.abs(inverse.value(1)) < 1e-12, "odd around its middle");
  const smooth = computed(formula("mean(1 / speed, 0.15)"), () => through);
  assert.ok(Math.abs(smooth.value(1) - (1 / 4 + 1 / 5) / 2) < 1e-12, `${smooth.value(1)}`);
  // One second, given as a sum.
  assert.equal(computed(formula("mean(speed, 0.5 + 0.5)"), () => line).length, 1001);
});

test("what has no value, or is not a number, is left out", () => {
  const line = seriesOf(column(grid(11, 0.1), (time_s) => time_s - 0.5));
  assert.equal(computed(formula("sqrt(speed)"), () => line).length, 6);
  assert.equal(computed(formula("speed + current"), (field) => (field === "velocity_rpm" ? line : null)).length, 0);
  const later = seriesOf(column([5, 6], () => 1));
  assert.equal(computed(formula("speed + current"), (field) => (field === "velocity_rpm" ? line : later)).length, 0, "no common time");
  assert.equal(computed(formula("1 + 1"), () => line).length, 0, "of nothing");
});
