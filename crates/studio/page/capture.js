// A capture: the values of some time, kept by themselves. Independent of the page.
//
// `{ id, name, notes, taken, zero_s, from_s, shift_s, columns, marks, model, parameters }`: `notes`, `model` and `parameters` (objects and their
// bytes as hexadecimal digits) may be absent; `taken` is the date and time of the day as text; `from_s` is where its
// picture begins, behind a first sample that only draws the line to the edge (absent: at the first sample); `zero_s` is the time that is laid
// over that of other captures, of the trigger or of the begin; `shift_s` moves it by hand. A column is
// `{ field, node, label, unit, decimals, steps, times, values }` with times in s, rising; a mark `{ time_s, node, text }`.
//
// Whatever makes a capture gives this value: the scope of what it has drawn, or a file that was loaded.

import { between } from "./analysis.js";
import { Series } from "./series.js";

/** How captures are laid over a picture. */
export const ALIGNMENTS = [
  { value: "zero", text: "by trigger" },
  { value: "start", text: "by begin" },
  { value: "time", text: "by time of the bus" },
];

/** A column's samples as a series: the same arrays. */
export function seriesOf({ times, values }) {
  const series = new Series(Infinity);
  series.times = times;
  series.values = values;
  series.end = times.length;
  return series;
}

/** The samples of a series, for a column. */
export const samplesOf = (series) => ({ times: series.times.slice(series.start, series.end), values: series.values.slice(series.start, series.end) });

export const firstOf = ({ columns }) => Math.min(...columns.map(({ times }) => times[0]));
export const lastOf = ({ columns }) => Math.max(...columns.map(({ times }) => times.at(-1)));

/** How much later a capture is drawn over a picture that begins at `from_s` and has its own zero at `zero_s`, null without one. */
export function shiftOf(capture, alignment, { from_s, zero_s }) {
  const by = { zero: (zero_s ?? from_s) - capture.zero_s, start: from_s - (capture.from_s ?? firstOf(capture)), time: 0 }[alignment];
  return by + capture.shift_s;
}

/** `one` less `other` at the times of `one` at which `other` has values before and after; straight lines between its samples. */
export function difference(one, other) {
  const found = new Series(Infinity);
  for (let at = one.start; at < one.end; at += 1) {
    const time_s = one.times[at];
    if (other.length > 1 && time_s >= other.first_s() && time_s <= other.last_s()) found.push(time_s, one.values[at] - between(other, time_s));
  }
  return found;
}

/**
 * A formula over series: `series(field)` gives one or null. It is computed at the times of the one with the most samples, within the
 * times that all have; the others are straight lines between their samples. Empty without values.
 * Integrals begin at `begin_s`.
 */
export function computed({ fields, compute }, series, begin_s = -Infinity) {
  const all = new Map(fields.map((field) => [field, series(field)]));
  const given = [...all.values()];
  if (!given.length || given.some((one) => one === null || one.length < 2)) return new Series(Infinity);
  const [from_s, to_s] = [Math.max(...given.map((one) => one.first_s())), Math.min(...given.map((one) => one.last_s()))];
  const finest = given.reduce((most, one) => (one.length > most.length ? one : most));
  let [first, end] = [finest.at(from_s), finest.at(to_s)];
  if (end < finest.end && finest.times[end] === to_s) end += 1;
  const times = finest.times.subarray(first, Math.max(first, end));
  const column = (field) => {
    const one = all.get(field);
    return one === finest ? finest.values.subarray(first, end) : Float64Array.from(times, (time_s) => between(one, time_s));
  };
  const found = new Series(Infinity);
  if (!times.length) return found;
  const values = compute(times, column, begin_s);
  // What is not a number (a root of a negative one, a division by zero) is left out.
  values.forEach((value, at) => Number.isFinite(value) && found.push(times[at], value));
  return found;
}

/** The values of one series over those of another, at the times of the one with more samples: `{ xs, ys }` in the order of time. */
export function against(across, up, from_s, to_s) {
  const [begin_s, end_s] = [Math.max(from_s, across.first_s(), up.first_s()), Math.min(to_s, across.last_s(), up.last_s())];
  const finest = across.length > up.length ? across : up;
  if (across.length < 2 || up.length < 2 || !(begin_s <= end_s)) return { xs: [], ys: [] };
  const times = [];
  for (let at = finest.at(begin_s); at < finest.end && finest.times[at] <= end_s; at += 1) times.push(finest.times[at]);
  const of = (series) => Float64Array.from(times, (time_s) => between(series, time_s));
  return { xs: of(across), ys: of(up) };
}

/** Bounds of what a browser keeps: captures, and bytes of their samples. */
const MOST = 40;
const MOST_BYTES = 96 << 20;

const bytesOf = ({ columns }) => columns.reduce((sum, { times, values }) => sum + times.byteLength + values.byteLength, 0);

/** Why a further capture is not kept; null if there is room. */
export function noRoomFor(capture, kept) {
  if (kept.length >= MOST) return `not kept: the browser keeps ${MOST} captures; delete one first`;
  const used = kept.reduce((sum, one) => sum + bytesOf(one), bytesOf(capture));
  return used > MOST_BYTES ? `not kept: the captures would take ${Math.ceil(used / 2 ** 20)} MB, expected at most ${MOST_BYTES >> 20} MB; delete one first` : null;
}

/** A name that no kept capture has. */
export function freeName(wanted, kept) {
  const names = new Set(kept.map(({ name }) => name));
  let name = wanted;
  for (let number = 2; names.has(name); number += 1) name = `${wanted} (${number})`;
  return name;
}
