// The scope's panes in the units in which a person looks at a value. Independent of the page. What is kept, saved and computed with stays in
// the units of records.

import { Series } from "./series.js";
import { conversion, unitsOf } from "./unit_table.js";

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
  if (chosen === pane.unit || !unitsOf(pane.unit, [1]).includes(chosen)) return pane;
  // Of a line that nothing is known to move, only the unit is known.
  const to = conversion(pane.unit, chosen, 1);
  const factorOf = ({ node }) => conversion(pane.unit, chosen, feed_m(node))?.factor ?? NaN;
  const lines = pane.lines.filter((line) => Number.isFinite(factorOf(line))).map((line) => ({ ...line, series: times(line.series, factorOf(line), line.isCapture) }));
  const factors = new Set(lines.map(factorOf));
  // A level has one place only where all lines have one factor.
  const level = pane.level !== undefined && factors.size === 1 ? pane.level * [...factors][0] : undefined;
  // A scale that was set is one in this unit.
  return { ...pane, key: `${pane.key} in ${to.unit}`, unit: to.unit, decimals: to.decimals, lines, level };
}
