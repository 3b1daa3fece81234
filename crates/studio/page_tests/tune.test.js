// What the wizard for gains asks for, and what becomes of its answers.

import assert from "node:assert/strict";
import { test } from "node:test";

import { FIELDS, bodePanes, digits, foundRows, identifiedRows, marginRows, moveRows, orderOf, rampRows, remarkOf, stepPane, unwrapped, warning, writingOf } from "../page/tune.js";
import { decades, range, ticks } from "../page/tune_picture.js";

const texts = (finds, more = {}) => ({ ...Object.fromEntries(Object.entries(FIELDS[finds]).map(([name, { usual }]) => [name, usual])), speed_rpm: "120", ...more });
const gains = (wish, more = {}) => orderOf(4, { finds: "gains", wish, position: false, texts: texts("gains", more) });

test("an order has one objective, and the limits in the units of their names", () => {
  assert.deepEqual(gains("margin", { phase_margin_deg: "50", bandwidth_hz: "fast" }), {
    do: "tune", node: 4, phase_margin_deg: 50, bandwidth_hz: null, speed_rpm: 120, current_a: 15, travel_turns: 40, period_ms: 5, torque_constant_nm_a: null, position: false,
  });
  const { phase_margin_deg, bandwidth_hz } = gains("bandwidth", { bandwidth_hz: "12.5", phase_margin_deg: "" });
  assert.deepEqual([phase_margin_deg, bandwidth_hz], [40, 12.5]);
  assert.throws(() => gains("bandwidth", { bandwidth_hz: "fast" }), /Bandwidth: expected a number in Hz, got 'fast'/);
  assert.throws(() => gains("margin", { travel_turns: "" }), /Travel at most: expected a number in turns/);
  assert.deepEqual(orderOf(2, { finds: "ramps", wish: "margin", position: true, texts: texts("ramps", { inertia_kg_m2: "3e-5" }) }), {
    do: "tune_ramps", node: 2, inertia_kg_m2: 3e-5, friction_nm: 0, load_nm: 0, speed_rpm: 120, margin: 1.5, ramp_ms: null,
  });
});

test("speed, travel and current are said before anything moves", () => {
  const said = warning({ in_cycles: true }, { speed_rpm: "90", current_a: "8", travel_turns: "10" });
  for (const part of ["90 r/min", "10 turns", "8 A", "excitation"]) assert.ok(said.includes(part), said);
  assert.match(warning({ in_cycles: false }, { speed_rpm: "600", current_a: "15", travel_turns: "40" }), /by its own ramps/);
});

const margins = (crossover_hz, stable = true) => ({ crossover_hz, phase_deg: 41.6, sensitivity: 1.44, stable });
const report = (more = {}) => ({
  node: 4, inertia_kg_m2: 0.020134, dry_friction_nm: 0.1, viscous_friction_nm_s: 0.00512, load_nm: 0.0001, anti_resonance_hz: null, resonance_hz: null, loop_delay_ms: 1.26,
  coherent: 90, frequencies: 100, model_off: 0.031, twin_off: 0.052, peak_a: 7.5, travel_turns: 12.34, gains: [], before: margins(8), after: margins(20), position: null,
  twin_error: [3, 1], drive_error: null, applied: false, lacks: [], notes: [], ...more,
});

test("what was found is shown with its units, and what was not found as that", () => {
  const rows = Object.fromEntries(foundRows(report()));
  assert.equal(rows.Inertia, "0.0201 kg·m²");
  assert.equal(rows["Anti-resonance, resonance"], "none was found");
  assert.equal(rows["Twin and drive differ by"], "5 %");
  assert.equal(rows.Coherent, "at 90 of 100 frequencies");
  assert.equal(rows["Delay of the speed loop"], "1.3 ms");
  // A joint is measured by SDO, which is too slow for a frequency response.
  const joint = Object.fromEntries(foundRows(report({ frequencies: 0, anti_resonance_hz: 12.34, resonance_hz: 20 })));
  assert.equal(joint["Anti-resonance, resonance"], "12.3 Hz, 20.0 Hz, by the data of its reducer");
  assert.ok(!("Coherent" in joint) && joint["Currents of twin and drive differ by"] === "5.2 %", JSON.stringify(joint));
  assert.deepEqual([digits(0.0000301234), digits(null), digits(1234.5)], ["0.0000301", "–", "1230"]);
  assert.deepEqual(marginRows(report({ position: margins(3, false) })).map((row) => [row[0], row[1], row[4]]), [
    ["Speed loop, as it is", "8.0 Hz", "stable"], ["Speed loop, proposed", "20.0 Hz", "stable"], ["Position loop around it", "3.0 Hz", "NOT stable"],
  ]);
});

test("what a capture shows is said in what is known of its motor", () => {
  const captured = { inertia_kg_m2: 0.03, viscous_friction_nm_s: 0.01, gain_rad_s2_a: 28, viscous_per_s: 0.333, anti_resonance_hz: null, resonance_hz: null, delay_ms: 1.24, model_off: 0.052, coherent: 40, frequencies: 60, proportional_a_s_rad: 2.4, integral_a_rad: 30 };
  const rows = Object.fromEntries(identifiedRows(captured));
  assert.deepEqual(rows, {
    Inertia: "0.03 kg·m²", "Viscous friction": "0.01 N·m·s/rad", "Anti-resonance, resonance": "none was found", Delay: "1.2 ms", "Its speed loop": "2.4 A/(rad/s), 30 A/rad",
    Coherent: "at 40 of 60 frequencies", "Model and captured response differ by": "5 %",
  });
  // Without its torque per ampere, and its set-point.
  const other = Object.fromEntries(identifiedRows({ ...captured, inertia_kg_m2: null, viscous_friction_nm_s: null, proportional_a_s_rad: null, integral_a_rad: null, anti_resonance_hz: 12, resonance_hz: 20.04 }));
  assert.deepEqual([other["Acceleration for each A"], other["Viscous friction"], other["Anti-resonance, resonance"], other["Its speed loop"]], ["28 rad/s²", "0.333 1/s of its inertia", "12.0 Hz, 20.0 Hz", undefined]);
});

test("a move is shown on the twin, and on the drive once it was tried there", () => {
  const twin_move = [{ overshoot_deg: 0.25, settled_s: 1.234 }, { overshoot_deg: 9, settled_s: null }];
  const on_twin = ["On its twin", "settled after 1.23 s, 0.3° beyond", "does not settle, 9.0° beyond"];
  assert.deepEqual(moveRows({ twin_move, drive_move: null }), [on_twin]);
  assert.deepEqual(moveRows({ twin_move, drive_move: [...twin_move].reverse() })[1], ["On the drive", on_twin[2], on_twin[1]]);
});

test("it is said what the drive has", () => {
  assert.deepEqual(remarkOf(report()), { text: "On its twin, the error after a step and a load is 3.00 r/min·s before, 1.00 after. The drive has what it had.", good: true });
  const kept = remarkOf(report({ drive_error: [2, 1], applied: true }));
  assert.ok(kept.good && kept.text.includes("not stored yet"), kept.text);
  const back = remarkOf(report({ drive_error: [2, 3], lacks: ["1600h:00: no answer"] }));
  assert.ok(!back.good && /former gains\. 1600h:00: no answer$/.test(back.text), back.text);
});

test("ramps are shown with what the twin lost, and written as one transaction", () => {
  const rows = rampRows({ inertia_kg_m2: 5e-5, supply_v: 24, speed_rpm: 600, pull_out_nm: 0.4, needed_nm: 0.1, highest_rpm: 900, start_rpm: 60, margin_before: 1.2, margin_after: 1.6, margin: 1.5, twin: [{ load: 1, lost_steps: 0 }, { load: 3, lost_steps: null }] });
  assert.deepEqual(rows.at(-1), ["Its twin", "0 full steps lost with 1.00 times the load; a fault with 3.00 times the load"]);
  assert.deepEqual(writingOf(2, [{ object: "2000h:00", name: "current", before: 3, after: 5 }]), { do: "write_parameters", node: 2, values: [{ object: "2000h:00", value: "5" }] });
});

test("a phase goes on where its angle steps by a whole turn", () => {
  assert.deepEqual(unwrapped([-90, -170, 170, 100, -170]), [-90, -170, -190, -260, -170]);
  assert.deepEqual(unwrapped([]), []);
});

test("a Bode plot has drive, twin and model, and leaves out what is not known", () => {
  const row = (hz, db) => ({ hz, coherence: 0.9, drive: { db, deg: -90 }, twin: { db: null, deg: -80 }, model: { db: 1, deg: -85 } });
  const [gain, phase, coherence] = bodePanes([row(1, 10), row(10, -10)]);
  assert.deepEqual(gain.lines.map(({ name, points }) => [name, points]), [["drive", [[1, 10], [10, -10]]], ["twin", []], ["model", [[1, 1], [10, 1]]]]);
  assert.equal(phase.lines.length, 3);
  // What a capture shows has no twin.
  const [captured] = bodePanes([{ ...row(1, 10), twin: null }, { ...row(10, 4), twin: null }]);
  assert.deepEqual(captured.lines.map(({ name }) => name), ["drive", "model"]);
  assert.deepEqual([coherence.low, coherence.high, coherence.lines[0].points], [0, 1, [[1, 0.9], [10, 0.9]]]);
  assert.deepEqual(stepPane("A step", [{ period_s: 0.002, speed_rpm: [60, 90] }, { period_s: 0.001, speed_rpm: [60] }]).lines, [{ name: "before", points: [[0, 60], [2, 90]] }, { name: "after", points: [[0, 60]] }]);
});

test("scales have round values within their range", () => {
  assert.deepEqual(ticks(-41, 12), [-40, -20, 0]);
  assert.deepEqual(ticks(0, 1, 2), [0, 0.5, 1]);
  assert.deepEqual(ticks(0.11, 0.29), [0.15, 0.2, 0.25]);
  assert.deepEqual(decades(0.9, 60), [1, 2, 5, 10, 20, 50]);
  assert.deepEqual(range([{ points: [[1, 5]] }, { points: [[3, 5]] }], 0), [1, 3]);
  assert.deepEqual([range([{ points: [[1, 5]] }], 1), range([], 0)], [[4, 6], [0, 1]]);
});
