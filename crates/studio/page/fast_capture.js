// What a fast capture asks of the studio, and what it makes of the answer. Independent of the page.

import { number } from "./dom.js";
import { QUANTITIES, fieldOf } from "./quantities.js";

/** Times between two readings that are offered, in ms. */
export const PERIODS_MS = [0.5, 1, 2, 5, 10, 20, 50, 100];

/** The names in a text: `6041h, true_winding`. */
export const namesIn = (text) => text.split(/[\s,]+/).filter(Boolean);

/** The number in a field in these units; throws where it has none. */
function numberIn(text, what) {
  const value = Number(text);
  if (text.trim() === "" || !Number.isFinite(value)) throw new Error(`expected ${what}, got '${text}'`);
  return value;
}

/** How often it is captured, one after the other: as many as a browser keeps; throws for what is not such a number. */
export function timesIn(text, most) {
  const times = numberIn(text, "a number of captures");
  if (!Number.isInteger(times) || times < 1 || times > most) throw new Error(`expected 1 to ${most} captures, got ${text}`);
  return times;
}

/** The command of a capture, from what the fields have; throws what is wrong with it. */
export function orderOf(node, { chosen, more, period_ms, duration_s, trigger, pre_ms, take, sdo }) {
  const quantities = [...new Set([...chosen, ...namesIn(more)])];
  if (!quantities.length) throw new Error("choose a quantity first, such as velocity");
  const duration_ms = numberIn(duration_s, "a time in s") * 1e3;
  if (!(duration_ms > 0)) throw new Error(`expected a time above 0 s, got ${duration_s}`);
  const when = trigger.trim() === "" ? null : trigger.trim();
  const before_ms = when && pre_ms.trim() !== "" ? numberIn(pre_ms, "a time before the trigger in ms") : 0;
  return { do: "capture", node, quantities, period_ms: Number(period_ms), duration_ms, trigger: when, pre_ms: before_ms, take: namesIn(take), sdo };
}

/** A column of the scope from a trace of the answer. */
function columnOf({ quantity, unit, values }, node, at) {
  const field = fieldOf(quantity);
  const known = QUANTITIES.find((one) => one.field === field);
  const has = values.flatMap((value, row) => (value === null ? [] : [row]));
  return {
    field,
    node,
    label: known?.label ?? quantity,
    unit: known?.unit ?? unit,
    decimals: known?.decimals ?? 3,
    steps: known?.steps,
    times: Float64Array.from(has, (row) => at[row]),
    values: Float64Array.from(has, (row) => values[row]),
  };
}

/** The bytes of an object as pairs of hexadecimal digits. */
const hexOf = (bytes) => bytes.map((byte) => byte.toString(16).toUpperCase().padStart(2, "0")).join("");

/** What the studio captured, as a capture of the scope: its times are those of the bus. */
export function captureOfAnswer(result, { id = crypto.randomUUID(), now = new Date() } = {}) {
  const at = result.time_s.map((time_s) => result.begun_s + time_s);
  const columns = result.traces.map((trace) => columnOf(trace, result.node, at)).filter(({ times }) => times.length > 0);
  const zero_s = result.begun_s + (result.trigger_s ?? 0);
  const name = `${now.toLocaleTimeString("en-GB")} fast`;
  const parameters = Object.fromEntries(result.objects.map(([object, bytes]) => [object, hexOf(bytes)]));
  return { id, name, notes: "", taken: now.toISOString(), zero_s, shift_s: 0, columns, marks: [], model: result.model, parameters };
}

const ms = (time_s) => (time_s === null ? "–" : `${number(time_s * 1e3, 3)} ms`);

/** What was had of each quantity, in words: rows of a table. */
export const rowsOf = ({ traces }) =>
  traces.map(({ quantity, by, values, period_s, jitter_s, gaps }) => [quantity, by, String(values.filter((value) => value !== null).length), ms(period_s), ms(jitter_s), String(gaps)]);

/** How the drive was made to send, and that it is as it was. */
export function remarkOf({ pace, load, nmt_back, lacks, time_s }) {
  const how = pace === null ? "Read without a TPDO." : `By ${pace}; this node's TPDOs and SYNC took ${number(load * 100, 0)} % of the bus at most.`;
  const length = `${time_s.length} rows in ${number(time_s.at(-1) ?? 0, 3)} s.`;
  const back = lacks.length ? lacks.join("; ") : `The PDOs are as they were${nmt_back ? `; ${nmt_back}` : ""}.`;
  return `${length} ${how} ${back}`;
}
