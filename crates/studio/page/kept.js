// The values of the last minute: a series for each value of each drive, kept also while another view is shown, and what
// happened meanwhile.

import { on } from "./link.js";
import { QUANTITIES } from "./quantities.js";
import { Series } from "./series.js";

const KEPT_S = 60;
const MARKERS_KEPT = 200;

/** By node: by field, a series. */
const kept = new Map();

/** What happened: `{ time_s, node, text }`, oldest first; node is null where it concerns no node. */
export const markers = [];

/** The series of a value; an empty one before it was ever read. */
export function series(node, field) {
  return kept.get(node)?.get(field) ?? new Series(KEPT_S);
}

/** When the newest value of a node was read. */
export const newest_s = (node) => Math.max(0, ...[...(kept.get(node)?.values() ?? [])].map((one) => one.last_s()));

/** Every value of these nodes, each at the times of its own, as columns of the scope. */
export const everything = (nodes) => nodes.flatMap((node) => QUANTITIES.map((quantity) => ({ ...quantity, node, series: series(node, quantity.field) })));

on("state", (state) => {
  for (const { node, drive } of state.nodes) {
    if (!drive) continue;
    const fields = kept.get(node) ?? new Map();
    kept.set(node, fields);
    for (const { field } of QUANTITIES) {
      if (drive[field] === null || drive[field] === undefined) continue;
      const one = fields.get(field) ?? new Series(KEPT_S);
      fields.set(field, one);
      one.push(drive.at_s, drive[field]);
    }
  }
});

on("news", ({ time_s, node, text }) => {
  if (time_s === null || time_s === undefined) return;
  // The time of the bus restarts with the studio.
  if (markers.length && time_s < markers.at(-1).time_s - 1) markers.length = 0;
  markers.push({ time_s, node: node ?? null, text });
  if (markers.length > MARKERS_KEPT) markers.shift();
});
