// Units of what drives report, and what they are in others. Independent of the page.

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

/**
 * What a value is multiplied by to be in a unit, with its decimals: `{ unit, factor, decimals }`; null where it stays in its own, because
 * that is chosen, or the other one is along a way and nothing is known to move: `feed_m` is what a turn moves, or null.
 */
export function conversion(unit, chosen, feed_m = null) {
  const to = (FAMILIES[unit] ?? []).find((one) => one.unit === chosen);
  if (!to || (to.feed && !Number.isFinite(feed_m))) return null;
  return { unit: to.unit, factor: (to.feed ? feed_m : 1) * to.factor, decimals: to.decimals };
}
