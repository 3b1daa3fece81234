// What the wizard for gains and ramps asks of the studio, and what it makes of the answers. Independent of the page.

import { number } from "./dom.js";

/** Fields of a number by what is found: label, unit, usual value, and whether it may be left empty. */
export const FIELDS = {
  gains: {
    phase_margin_deg: { label: "Phase margin", unit: "°", usual: "40", of: "margin", title: "10 to 80: the less, the faster, and the more it overshoots" },
    bandwidth_hz: { label: "Bandwidth", unit: "Hz", usual: "20", of: "bandwidth", title: "Where the gain of the speed loop falls to one" },
    speed_rpm: { label: "Speed at most", unit: "r/min", usual: "", limit: true, title: "Of the motor's shaft, before a reducer" },
    current_a: { label: "Current at most", unit: "A", usual: "15", limit: true, title: "More that the speed loop asks for stops it" },
    travel_turns: { label: "Travel at most", unit: "turns", usual: "40", limit: true, title: "Of the motor's shaft, to either side of where it stands: beyond it is stopped" },
    period_ms: { label: "Readings every", unit: "ms", usual: "5", limit: true, title: "The period of SYNC: 1 ms shows more, on a bus and a computer that keep up; 10 ms at most" },
    torque_constant_nm_a: { label: "Torque constant", unit: "N·m/A", usual: "", optional: true, limit: true, title: "Empty: that of the model's own motor" },
  },
  ramps: {
    inertia_kg_m2: { label: "Inertia of the load", unit: "kg·m²", usual: "0", title: "Of all that it turns, without its rotor" },
    friction_nm: { label: "Friction of the load", unit: "N·m", usual: "0" },
    load_nm: { label: "Torque of the load", unit: "N·m", usual: "0", title: "What pushes its shaft in one direction, such as a weight" },
    speed_rpm: { label: "Speed to reach", unit: "r/min", usual: "600" },
    margin: { label: "Margin of torque", unit: "times", usual: "1.5", title: "How many times the torque that is needed there is to be" },
    ramp_ms: { label: "Ramp", unit: "ms", usual: "", optional: true, title: "Empty: the shortest that keeps the margin" },
  },
};

function valueOf({ label, unit, optional }, text) {
  if (text.trim() === "" && optional) return null;
  const value = Number(text);
  if (text.trim() === "" || !Number.isFinite(value)) throw new Error(`${label}: expected a number in ${unit}, got '${text}'`);
  return value;
}

/** The command of a measurement, or of ramps, from the texts of the fields; throws what is wrong. `wish` is "margin" or "bandwidth". */
export function orderOf(node, { finds, wish, position, texts }) {
  /** @type {Record<string, any>} */
  const order = { do: finds === "gains" ? "tune" : "tune_ramps", node };
  for (const [name, field] of Object.entries(FIELDS[finds])) {
    // The field of the other objective has no say.
    if (field.of && field.of !== wish) order[name] = name === "bandwidth_hz" ? null : Number(field.usual);
    else order[name] = valueOf(field, texts[name]);
  }
  return finds === "gains" ? { ...order, position } : order;
}

/**
 * What is going to happen, before it is agreed to.
 * @param {{ in_cycles: boolean }} form
 * @param {Record<string, any>} limits
 */
export function warning({ in_cycles }, { speed_rpm, current_a, travel_turns }) {
  const how = in_cycles ? "to and fro at steady speeds, and then at one speed with a small excitation on top" : "round and back by its own ramps";
  return `The shaft turns ${how}, for about half a minute: at ${speed_rpm} r/min at most, and up to ${travel_turns} turns to either side of where it stands. More travel, or more than ${current_a} A, stops it. Nothing is written that is not put back.`;
}

/** A number with three digits that say something: a joint's inertia is a thousandth of a wheel's. */
export const digits = (value) => (value === null || value === undefined ? "–" : Number(value.toPrecision(3)).toString());

/** What was found, as rows of a name and a figure. */
export function foundRows(report) {
  const { frequencies, anti_resonance_hz, resonance_hz } = report;
  const measured = frequencies > 0;
  const hz = (value) => `${number(value, 1)} Hz`;
  return [
    ["Inertia", `${digits(report.inertia_kg_m2)} kg·m²`],
    ["Dry friction", `${digits(report.dry_friction_nm)} N·m`],
    ["Viscous friction", `${digits(report.viscous_friction_nm_s)} N·m·s/rad`],
    measured ? ["Load to one side", `${digits(report.load_nm)} N·m`] : null,
    ["Anti-resonance, resonance", anti_resonance_hz === null ? "none was found" : `${hz(anti_resonance_hz)}, ${hz(resonance_hz)}${measured ? "" : ", by the data of its reducer"}`],
    measured ? ["Delay of the speed loop", `${number(report.loop_delay_ms, 1)} ms`] : null,
    measured ? ["Coherent", `at ${report.coherent} of ${frequencies} frequencies`] : null,
    measured ? ["Model and measured response differ by", `${number(100 * report.model_off, 0)} %`] : null,
    [measured ? "Twin and drive differ by" : "Currents of twin and drive differ by", `${number(100 * report.twin_off, measured ? 0 : 1)} %`],
    ["It took", `${number(report.peak_a, 1)} A and ${number(report.travel_turns, 1)} turns to one side, at most`],
  ].filter(Boolean);
}

/** What a capture shows, as rows of a name and a figure. */
export function identifiedRows(report) {
  const { inertia_kg_m2, anti_resonance_hz, resonance_hz, proportional_a_s_rad } = report;
  const masses = inertia_kg_m2 === null
    ? [["Acceleration for each A", `${digits(report.gain_rad_s2_a)} rad/s²`], ["Viscous friction", `${digits(report.viscous_per_s)} 1/s of its inertia`]]
    : [["Inertia", `${digits(inertia_kg_m2)} kg·m²`], ["Viscous friction", `${digits(report.viscous_friction_nm_s)} N·m·s/rad`]];
  return [
    ...masses,
    ["Anti-resonance, resonance", resonance_hz === null ? "none was found" : `${number(anti_resonance_hz, 1)} Hz, ${number(resonance_hz, 1)} Hz`],
    ["Delay", `${number(report.delay_ms, 1)} ms`],
    ...(proportional_a_s_rad === null ? [] : [["Its speed loop", `${digits(proportional_a_s_rad)} A/(rad/s), ${digits(report.integral_a_rad)} A/rad`]]),
    ["Coherent", `at ${report.coherent} of ${report.frequencies} frequencies`],
    ["Model and captured response differ by", `${number(100 * report.model_off, 0)} %`],
  ];
}

/** Where a response is drawn to have its anti-resonance and resonance. */
export const resonanceMarks = ({ anti_resonance_hz, resonance_hz }) => [[anti_resonance_hz, "anti-resonance"], [resonance_hz, "resonance"]].filter(([hz]) => hz);

/** Margins of the loops as rows: loop, crossover, phase, sensitivity, state. */
export function marginRows({ before, after, position }) {
  const row = (name, { crossover_hz, phase_deg, sensitivity, stable }) => [name, `${number(crossover_hz, 1)} Hz`, `${number(phase_deg, 0)}°`, number(sensitivity, 1), stable ? "stable" : "NOT stable"];
  return [row("Speed loop, as it is", before), row("Speed loop, proposed", after), ...(position ? [row("Position loop around it", position)] : [])];
}

/** A move by its own ramps, on the twin and on the drive, as rows: where, before, proposed; none without the position loop. */
export function moveRows({ twin_move, drive_move }) {
  const shown = ({ overshoot_deg, settled_s }) => `${settled_s === null ? "does not settle" : `settled after ${number(settled_s, 2)} s`}, ${number(overshoot_deg, 1)}° beyond`;
  return [["On its twin", twin_move], ["On the drive", drive_move]].filter(([, rows]) => rows).map(([where, rows]) => [where, ...rows.map(shown)]);
}

/** What came of a trial, in a sentence, and whether it is good. */
export function remarkOf(report) {
  const error = ([before, after]) => `${number(before, 2)} r/min·s before, ${number(after, 2)} after`;
  const lacks = report.lacks.length ? ` ${report.lacks.join("; ")}` : "";
  if (!report.drive_error) return { text: `On its twin, the error after a step and a load is ${error(report.twin_error)}. The drive has what it had.${lacks}`, good: !lacks };
  const on_drive = `On the drive, the error after a step is ${error(report.drive_error)}.`;
  if (report.applied) return { text: `${on_drive} It has the proposed gains, which are not stored yet: Parameters, Store in the drive.${lacks}`, good: !lacks };
  return { text: `${on_drive} It has its former gains.${lacks}`, good: false };
}

/** What of ramps was computed, as rows of a name and a figure. */
export function rampRows(report) {
  const twin = report.twin.map(({ load, lost_steps }) => `${lost_steps === null ? "a fault" : `${lost_steps} full steps lost`} with ${number(load, 2)} times the load`);
  return [
    ["Inertia with its rotor", `${digits(report.inertia_kg_m2)} kg·m²`],
    ["Supply", `${number(report.supply_v, 0)} V`],
    [`Torque at ${number(report.speed_rpm, 0)} r/min`, `${number(report.pull_out_nm, 3)} N·m at most, ${number(report.needed_nm, 3)} N·m needed`],
    ["With the margin up to", `${number(report.highest_rpm, 0)} r/min; begins at ${number(report.start_rpm, 0)} r/min at most`],
    ["Least margin on the ramp", `${number(report.margin_before, 2)} as it is, ${number(report.margin_after, 2)} proposed, ${number(report.margin, 2)} asked for`],
    ["Its twin", twin.join("; ")],
  ];
}

/** The transaction that writes proposed ramps. */
export const writingOf = (node, values) => ({ do: "write_parameters", node, values: values.map(({ object, after }) => ({ object, value: String(after) })) });

/** A phase without steps of a whole turn. */
export function unwrapped(degrees) {
  let before = degrees[0] ?? 0;
  return degrees.map((angle) => (before = angle - 360 * Math.round((angle - before) / 360)));
}

/** The panes of a Bode plot: each with lines of points over the frequency. A point that is not known is left out. */
export function bodePanes(response) {
  const hz = response.map((row) => row.hz);
  const lines = [["drive", "drive"], ["twin", "twin"], ["model", "model"]].filter(([key]) => response.every((row) => row[key]));
  const line = (name, values) => ({ name, points: values.map((value, at) => [hz[at], value]).filter(([, value]) => Number.isFinite(value)) });
  const of = (name, values) => lines.map(([key, label]) => line(label, values(response.map((row) => row[key][name]))));
  return [
    { label: "Speed per current", unit: "dB", lines: of("db", (values) => values.map((value) => value ?? NaN)) },
    { label: "Phase", unit: "°", lines: of("deg", unwrapped) },
    { label: "Coherence", unit: "", low: 0, high: 1, lines: [line("drive", response.map((row) => row.coherence))] },
  ];
}

/** A step of the set-point or a load, before and after, as a pane over time in ms. */
export function stepPane(label, [before, after]) {
  const line = (name, { period_s, speed_rpm }) => ({ name, points: speed_rpm.map((rpm, at) => [1e3 * at * period_s, rpm]) });
  return { label, unit: "r/min", lines: [line("before", before), line("after", after)] };
}
