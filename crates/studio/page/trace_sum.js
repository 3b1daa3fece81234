// What the trace adds up: times between lines, frames by identifier, and the frame of the send window. Independent of the page.

/** How a line's time is shown. */
export const DELTAS = [
  { value: "none", text: "time of the bus" },
  { value: "before", text: "since the line before" },
  { value: "same", text: "since the same COB-ID" },
  { value: "chosen", text: "since the chosen line" },
];

/** The time to show of the line `at`, in s; null where there is none to count from. `chosen_s` is the time of the chosen line. */
export function timeOf(lines, at, delta, chosen_s) {
  const { at_s, id } = lines[at];
  if (delta === "none") return at_s;
  if (delta === "chosen") return chosen_s === null ? null : at_s - chosen_s;
  for (let before = at - 1; before >= 0; before -= 1) {
    if (delta === "before" || lines[before].id === id) return at_s - lines[before].at_s;
  }
  return null;
}

/** The last line that is not later than a time; -1 before the first. Lines are in the order of time. */
export function lineAt(lines, at_s) {
  let [low, high] = [0, lines.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (lines[middle].at_s <= at_s) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

const least = (...values) => values.reduce((low, value) => (value === null || (low !== null && low <= value) ? low : value), null);
const most = (...values) => values.reduce((high, value) => (value === null || (high !== null && high >= value) ? high : value), null);

/** Adds a part of `/api/trace/identifiers` to what was known before, by COB-ID: `{ id, count, first_s, least_ms, most_ms, last }`. */
export function addIdentifiers(known, { identifiers }) {
  for (const one of identifiers) {
    const before = known.get(one.id);
    if (!before) {
      known.set(one.id, { ...one });
      continue;
    }
    const between_ms = (one.first_s - before.last.at_s) * 1e3;
    before.least_ms = least(before.least_ms, one.least_ms, between_ms);
    before.most_ms = most(before.most_ms, one.most_ms, between_ms);
    before.count += one.count;
    before.last = one.last;
  }
  return known;
}

/** The mean time between two frames in ms; null of a single one. */
export const periodOf = ({ count, first_s, last }) => (count > 1 ? ((last.at_s - first_s) * 1e3) / (count - 1) : null);

/** How a table of identifiers is ordered: by COB-ID as a number (extended ones after standard ones), by count, by period. */
export const ORDERS = {
  id: (one, other) => one.id.length - other.id.length || parseInt(one.id, 16) - parseInt(other.id, 16),
  count: (one, other) => other.count - one.count,
  period: (one, other) => (periodOf(one) ?? Infinity) - (periodOf(other) ?? Infinity),
};

/** The shortest time between two cyclic frames of a page: its clock is not finer. */
export const SHORTEST_MS = 20;

/** The frame of two fields, as candump writes it: `604#4041600000000000`, `604#R`. Throws what is wrong. */
export function frameOf(id, data) {
  const [name, bytes] = [id.trim().replace(/^0x|h$/gi, ""), data.trim().replace(/[\s.]+/g, "")];
  const value = parseInt(name, 16);
  if (!/^([0-9a-f]{1,3}|[0-9a-f]{8})$/i.test(name) || value > (name.length > 3 ? 0x1fffffff : 0x7ff)) throw new Error(`'${id}' is not a COB-ID: expected 0 to 7FF, or eight digits of an extended one`);
  if (/^r[0-8]?$/i.test(bytes)) return `${name.toUpperCase().padStart(3, "0")}#${bytes.toUpperCase()}`;
  if (!/^([0-9a-f]{2}){0,8}$/i.test(bytes)) throw new Error(`'${data}' is not the data of a frame: expected up to eight bytes of two hexadecimal digits, or R`);
  return `${name.toUpperCase().padStart(3, "0")}#${bytes.toUpperCase()}`;
}

/** A period in ms from a field; null without one. Throws what is wrong. */
export function cycleOf(text) {
  if (text.trim() === "") return null;
  const ms = Number(text);
  if (!Number.isFinite(ms) || ms < SHORTEST_MS || ms > 3_600_000) throw new Error(`'${text}' is not a period: expected ${SHORTEST_MS} to 3600000 ms`);
  return ms;
}
