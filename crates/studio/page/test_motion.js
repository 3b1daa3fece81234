// What a test motion asks of the studio, and what it makes of the answer. Independent of the page.

import { count, number } from "./dom.js";
import { captureOfAnswer, namesIn } from "./fast_capture.js";

/** Each shape with the fields that it has; `about` says what it does. */
export const SHAPES = [
  { value: "steps", text: "Steps of velocity", fields: ["speed_rpm", "time_s"], about: "To the speed at once, kept for the time, and back to 0, by the drive's own ramps or the acceleration below." },
  { value: "back-and-forth", text: "Back and forth", fields: ["by_deg"], about: "There and back, at rest at both ends, as fast as the limits allow." },
  { value: "ramp", text: "Ramps of velocity", fields: ["speed_rpm", "time_s"], about: "Up to the speed, kept for the time, down, and the same backwards." },
  { value: "sine", text: "Sine", fields: ["by_deg", "frequency_hz", "periods"], about: "A cosine from rest to rest, between the start and twice the amplitude." },
  { value: "chirp", text: "Chirp", fields: ["by_deg", "frequency_hz", "to_frequency_hz", "time_s"], about: "A cosine whose frequency rises evenly, for at least the time." },
  { value: "prbs", text: "PRBS of velocity", fields: ["speed_rpm", "time_s"], about: "The speed with a pseudo-random sign of 127 bits, each as long as the time." },
  { value: "path", text: "A recorded path", fields: ["path"], about: "The position of a capture that is kept here, from where the shaft stands." },
];

const [ANGLE, SPEED] = [{ field: "angle_degrees", unit: "°" }, { field: "velocity_rpm", unit: "r/min" }];

/**
 * Fields of a number: label, unit, usual value, and whether it may be left empty. One with a `quantity` is shown in the unit that is chosen for
 * that, `rate` being its rate of change.
 */
export const FIELDS = {
  by_deg: { label: "Amplitude", unit: "°", quantity: ANGLE, usual: "20" },
  speed_rpm: { label: "Speed", unit: "r/min", quantity: SPEED, usual: "60" },
  frequency_hz: { label: "Frequency", unit: "Hz", usual: "1" },
  to_frequency_hz: { label: "to", unit: "Hz", usual: "5" },
  periods: { label: "Periods", unit: "", usual: "3" },
  time_s: { label: "Time", unit: "s", usual: "0.5" },
  count: { label: "Runs", unit: "", usual: "3" },
  velocity_rpm: { label: "Speed at most", unit: "r/min", quantity: SPEED, usual: "60" },
  acceleration_rpm_s: { label: "Acceleration", unit: "r/min/s", quantity: SPEED, rate: true, usual: "", optional: true, title: "Empty: 600 r/min/s; for steps the drive's own ramps" },
  travel_turns: { label: "Travel at most", unit: "turns", usual: "", optional: true, title: "From where the shaft stands: farther points are refused, and steps are stopped. Empty: any" },
  following_error_deg: { label: "Following error at most", unit: "°", quantity: ANGLE, usual: "72", title: "Beyond it points are stopped; steps have no set-point to follow" },
  period_ms: { label: "Points every", unit: "ms", usual: "10", title: "The period of SYNC; steps are sent by SDO" },
  capture_ms: { label: "Readings every", unit: "ms", usual: "", optional: true, title: "Empty: with each point, and every millisecond of steps" },
};

/** The fields that every shape has. */
export const LIMITS = ["velocity_rpm", "acceleration_rpm_s", "travel_turns", "following_error_deg", "period_ms"];

/** Runs that are kept as captures by themselves. */
export const MOST_KEPT = 8;
/** Points of a path that fit into a message to the studio. */
const MOST_POINTS = 1500;

function valueOf(name, text) {
  const { label, unit, optional } = FIELDS[name];
  if (text.trim() === "" && optional) return null;
  const value = Number(text);
  if (text.trim() === "" || !Number.isFinite(value)) throw new Error(`${label}: expected a number${unit ? ` in ${unit}` : ""}, got '${text}'`);
  return value;
}

/** Times in s from its begin, and degrees, of the position in a capture; null if it has none. */
export function pathOf({ columns }) {
  const column = columns.find(({ field }) => field === "angle_degrees");
  if (!column || column.times.length < 2) return null;
  const step = Math.ceil(column.times.length / MOST_POINTS);
  const at = Array.from(column.times.keys()).filter((row) => row % step === 0 || row === column.times.length - 1);
  const rounded = (value) => Math.round(value * 1e5) / 1e5;
  return at.map((row) => [rounded(column.times[row] - column.times[0]), rounded(column.values[row])]);
}

/** Of which other drive a path was captured, in a sentence; empty where it is this one's, or that is not known. */
export function otherDrive({ columns, model = "" }, { node, model: own }) {
  const of = columns.find(({ field }) => field === "angle_degrees")?.node ?? node;
  if (of === node && (model === "" || model === own)) return "";
  return `The path was captured of node ${of}${model ? ` (${model})` : ""}, and node ${node} (${own}) is moved along it.`;
}

/** The command of a test motion, from the texts of the fields; a field that the shape does not have keeps its usual value. Throws what is wrong. */
export function orderOf(node, { shape, texts, quantities, path }) {
  const has = [...SHAPES.find(({ value }) => value === shape).fields, ...LIMITS, "count"];
  const of = (name) => valueOf(name, has.includes(name) ? texts[name] : FIELDS[name].usual);
  const names = ["by_deg", "speed_rpm", "frequency_hz", "to_frequency_hz", "periods", "time_s", "count", ...LIMITS];
  /** @type {Record<string, any>} */
  const motion = { shape, ...Object.fromEntries(names.map((name) => [name, of(name)])), path: [] };
  for (const name of ["periods", "count"]) {
    if (!Number.isInteger(motion[name]) || motion[name] < 1) throw new Error(`${FIELDS[name].label}: expected a whole number from 1 on, got ${motion[name]}`);
  }
  if (shape === "path") {
    if (!path) throw new Error("choose a capture that has a position first");
    motion.path = path;
  }
  return { do: "test_motion", node, motion, quantities: [...new Set(namesIn(quantities))], capture_ms: valueOf("capture_ms", texts.capture_ms), sdo: false };
}

/** Rows of a table: run, what, and the figure with how exactly it is known. As `ferrodrive test-motion` has them. */
export function figureRows({ runs }) {
  return runs.flatMap(({ run, followed, steps, no_steps, heating }) => {
    const rows = [];
    const add = (what, figure) => rows.push([String(run), what, figure]);
    if (followed) {
      add("following error", `${number(followed.most_deg, 3)}° at most, ${number(followed.rms_deg, 3)}° r.m.s.`);
      add("time", `${number(followed.took_s, 3)} s`);
    }
    for (const { from, to, rise_s, overshoot, settling_s } of steps) {
      for (const [what, figure, unit, times] of [["rise", rise_s, "ms", 1e3], ["overshoot", overshoot, "%", 100], ["settling", settling_s, "ms", 1e3]]) {
        add(`${what}, ${number(from, 0)} to ${number(to, 0)} r/min`, figure.why ?? `${number(figure.value * times, 1)} ± ${number(figure.grid * times, 1)} ${unit}`);
      }
    }
    if (no_steps) add("steps", no_steps);
    if (heating) add("current", `${number(heating.rms_a, 3)} A r.m.s., ${number(heating.a2s, 3)} A²·s`);
    return rows;
  });
}

/** What was done, within which limits, and that the drive is as it was. */
export function remarkOf({ runs, limits, lacks, nmt_back }) {
  const { velocity_rpm, acceleration_rpm_s, following_error_deg, travel_turns } = limits;
  const within = [
    `${number(velocity_rpm, 0)} r/min`,
    acceleration_rpm_s === null ? "the drive's own ramps" : `${number(acceleration_rpm_s, 0)} r/min/s`,
    following_error_deg === null ? null : `${number(following_error_deg, 0)}° of following error`,
    travel_turns === null ? null : `${travel_turns} turns of travel`,
  ];
  const back = lacks.length ? lacks.join("; ") : `The drive stands without power, and its PDOs are as they were${nmt_back ? `; ${nmt_back}` : ""}.`;
  return `${count(runs.length, "run")} within ${within.filter(Boolean).join(", ")}. ${back}`;
}

/** When the demand of a step begins, so that runs are laid over each other by it; null where no demand was captured. */
function demandOf({ columns }) {
  const demand = columns.find(({ field }) => field === "target_velocity_rpm");
  const at = demand ? demand.values.findIndex((value) => value !== demand.values[0]) : -1;
  return at < 0 ? null : demand.times[at];
}

/** The runs as captures of the scope; one in which nothing was captured has none. */
export function capturesOf({ shape, runs }, { id = () => crypto.randomUUID(), now = new Date() } = {}) {
  return runs.flatMap(({ run, capture }) => {
    const of = captureOfAnswer(capture, { id: id(), now });
    const name = `${now.toLocaleTimeString("en-GB")} ${shape} ${run}`;
    return of.columns.length ? [{ ...of, name, zero_s: demandOf(of) ?? of.zero_s }] : [];
  });
}
