// The step response against closed forms, sampled as slowly and as fast as a scope is: what it says is within what it says it may be
// off by, or it says nothing.

import assert from "node:assert/strict";
import { test } from "node:test";

import { stepResponse, within } from "../page/analysis.js";
import { Series } from "../page/series.js";

const RATES_HZ = [9, 100, 1000];
/** Where the first sample lies between two of the grid. */
const PHASES = [0, 0.21, 0.5, 0.83];

/** A series of what `value` is, `lead_s` of rest before. */
function sampled(value, rate_hz, phase, lead_s, length_s) {
  const series = new Series(Infinity);
  for (let at = phase / rate_hz; at < lead_s + length_s; at += 1 / rate_hz) series.push(at, at < lead_s ? value(0) : value(at - lead_s));
  return series;
}

const seen = (series) => stepResponse(series, -Infinity, Infinity);
const near = (found, truth, tolerance, what) => assert.ok(Math.abs(found - truth) <= tolerance + 1e-9, `${what}: ${found}, not ${truth} ± ${tolerance}`);

/** 1 - exp(-t/T): from 10 to 90 % in T ln 9; within 2 % after T ln 50, counted from T ln(10/9). */
const first = (T) => ({ value: (t) => 40 - 100 * (1 - Math.exp(-t / T)), rise_s: T * Math.log(9), settling_s: T * Math.log(45), overshoot: 0 });

/** A lag of second order with a damping of 0.5: overshoot exp(-pi z / sqrt(1 - z²)); rise and settling by bisection of the closed form. */
function second(w) {
  const z = 0.5;
  const d = w * Math.sqrt(1 - z * z);
  const value = (t) => 1 - Math.exp(-z * w * t) * (Math.cos(d * t) + ((z * w) / d) * Math.sin(d * t));
  const reaches = (level, low, high) => {
    for (let step = 0; step < 60; step += 1) {
      const middle = (low + high) / 2;
      if (value(middle) < level) low = middle;
      else high = middle;
    }
    return low;
  };
  const at10_s = reaches(0.1, 0, Math.PI / d);
  // Peaks lie at n pi / d. The second one, 1 - exp(..)² = 0.973, is beyond 2 %, the third, 1.004, is not.
  const last_s = reaches(0.98, (2 * Math.PI) / d, (3 * Math.PI) / d);
  return { value: (t) => 5 + 60 * value(t), rise_s: reaches(0.9, 0, Math.PI / d) - at10_s, settling_s: last_s - at10_s, overshoot: Math.exp((-Math.PI * z) / Math.sqrt(1 - z * z)) };
}

test("a lag of first or second order is measured within its stated uncertainty", () => {
  let measured = 0;
  for (const rate_hz of RATES_HZ) {
    for (const phase of PHASES) {
      for (const readings of [12, 25, 80]) {
        for (const lag of [first(readings / rate_hz / Math.log(9)), second(1.64 / (readings / rate_hz))]) {
          const found = seen(sampled(lag.value, rate_hz, phase, 3 * lag.rise_s, 12 * lag.rise_s));
          const what = `${rate_hz} Hz, ${readings} readings, phase ${phase}`;
          assert.ok(found && found.few === undefined, `${what}: ${JSON.stringify(found)}`);
          assert.ok(found.grid_s <= 1.001 / rate_hz, `${what}: the grid is that of the readings`);
          near(found.rise_s, lag.rise_s, found.grid_s, `rise, ${what}`);
          near(found.settling_s, lag.settling_s, found.grid_s, `settling, ${what}`);
          near(found.overshoot, lag.overshoot, found.overshoot_grid, `overshoot, ${what}`);
          assert.ok(found.overshoot_grid < 0.02, `${what}: ${found.overshoot_grid}`);
          measured += 1;
        }
      }
    }
  }
  assert.equal(measured, RATES_HZ.length * PHASES.length * 3 * 2);
});

test("a rise that is too fast for the readings is reported to have too few of them", () => {
  for (const rate_hz of RATES_HZ) {
    for (const phase of PHASES) {
      for (const readings of [0.01, 0.5, 1, 3, 8]) {
        for (const lag of [first(readings / rate_hz / Math.log(9)), second(1.64 / (readings / rate_hz))]) {
          const found = seen(sampled(lag.value, rate_hz, phase, 20 / rate_hz, 200 / rate_hz));
          assert.ok(found.few <= readings + 1 && found.rise_s === undefined, JSON.stringify(found));
        }
      }
    }
  }
});

test("neither a ramp nor its beginning or end is a step", () => {
  const shapes = {
    ramp: (t) => 1028.9 + 360 * t,
    falling: (t) => -17.3 * t,
    begins: (t) => Math.max(0, t - 4) * 360,
    ceases: (t) => Math.min(4, t) * 360,
    parabola: (t) => t * t,
    sine: (t) => Math.sin(1.3 * t),
    nothing: () => 4,
    there_and_back: (t) => (t > 3 && t < 6 ? 60 : 0),
  };
  for (const [name, value] of Object.entries(shapes)) {
    for (const rate_hz of RATES_HZ) {
      for (const noise of [0, 0.001, 0.02]) {
        // Without chance: the same in each run.
        const shaken = (t) => value(t) + noise * 100 * Math.sin(t * 7919);
        const found = seen(sampled(shaken, rate_hz, 0.3, 0, 10));
        assert.equal(found, null, `${name} at ${rate_hz} Hz: ${JSON.stringify(found)}`);
      }
    }
  }
});

test("noise on a step changes its uncertainty, not its value", () => {
  const lag = second(4);
  const series = sampled((t) => lag.value(t) + 0.2 * Math.sin(t * 7919), 100, 0.4, 1, 9);
  const found = seen(series);
  near(found.rise_s, lag.rise_s, 2 * found.grid_s, "rise");
  near(found.overshoot, lag.overshoot, found.overshoot_grid + 0.4 / 60, "overshoot");
});

test("an overshoot of a few readings is not reported", () => {
  // A rise by a ramp of a second, and a peak of 20 ms.
  const value = (t) => (t < 1 ? 60 * t : 60 + (t < 1.1 ? 6 * Math.sin((Math.PI * (t - 1)) / 0.1) : 0));
  assert.equal(seen(sampled(value, 12, 0.55, 2, 6)).overshoot, null);
  near(seen(sampled(value, 1000, 0.5, 2, 6)).overshoot, 0.1, 1e-3, "overshoot");
});

test("a number has no more decimals than its uncertainty", () => {
  assert.equal(within(1.23456, 0.113), "1.2 ± 0.2");
  assert.equal(within(0.108, 0.001), "0.108 ± 0.001");
  assert.equal(within(16.3, 2.4), "16 ± 3");
  assert.equal(within(0.5, 0.02), "0.50 ± 0.02");
});
