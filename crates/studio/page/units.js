// The units in which a person looks at a value. Independent of the page. What is kept, saved and computed with stays in the units of records.

import { Series } from "./series.js";

/** By unit of a record: its name in the list, what one of it is, decimals; `feed` where it is along what a turn moves. */
const FAMILIES = {
  "°": [
    { unit: "rad", factor: Math.PI / 180, decimals: 3 },
    { unit: "turns", factor: 1 / 360, decimals: 3 },
    { unit: "mm", factor: 1e3 / 360, decimals: 2, feed: true },
    { unit: "m", factor: 1 / 360, decimals: 4, feed: true },
  ],
  "r/min": [
    { unit: "rad/s", factor: Math.PI / 30, decimals: 2 },
    { unit: "°/s", factor: 6, decimals: 1 },
    { unit: "turns/s", factor: 1 / 60, decimals: 3 },
    { unit: "mm/s", factor: 1e3 / 60, decimals: 1, feed: true },
    { unit: "m/s", factor: 1 / 60, decimals: 3, feed: true },
  ],
  A: [{ unit: "mA", factor: 1e3, decimals: 0 }],
};
// True angles of a virtual drive are in radians.
FAMILIES.rad = [
  { unit: "°", factor: 180 / Math.PI, decimals: 1 },
  { unit: "turns", factor: 1 / (2 * Math.PI), decimals: 3 },
];

/** The units that a value can be shown in, its own first; those along a way only where a node of it has one, `feeds` in m for a turn. */
export function unitsOf(unit, feeds = []) {
  const has = feeds.some((feed_m) => feed_m !== null && feed_m !== undefined);
  return [unit, ...(FAMILIES[unit] ?? []).filter(({ feed }) => !feed || has).map((one) => one.unit)];
}

/** Values times a factor: those of a capture once, since they do not change. */
const scaled = new WeakMap();
function times(series, factor, isKept) {
  const known = isKept ? scaled.get(series.values) : undefined;
  const values = known?.factor === factor ? known.values : series.values.map((value) => value * factor);
  if (isKept) scaled.set(series.values, { factor, values });
  return Object.assign(Object.create(Series.prototype), { ...series, values });
}

/**
 * A pane in the unit that was chosen for its field. `feed_m(node)` is what a turn of a node's output moves, null where nothing does: its lines
 * are left out of a pane in a unit along it.
 */
export function inUnit(pane, chosen, feed_m) {
  const to = (FAMILIES[pane.unit] ?? []).find(({ unit }) => unit === chosen);
  if (!to) return pane;
  const factorOf = ({ node }) => (to.feed ? (feed_m(node) ?? NaN) : 1) * to.factor;
  const lines = pane.lines.filter((line) => Number.isFinite(factorOf(line))).map((line) => ({ ...line, series: times(line.series, factorOf(line), line.isCapture) }));
  const factors = new Set(lines.map(factorOf));
  // A level has one place only where all lines have one factor.
  const level = pane.level !== undefined && factors.size === 1 ? pane.level * [...factors][0] : undefined;
  // A scale that was set is one in this unit.
  return { ...pane, key: `${pane.key} in ${to.unit}`, unit: to.unit, decimals: to.decimals, lines, level };
}
