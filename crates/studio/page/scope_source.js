// What the scope draws: panes, from the values that are shown and the captures that are laid over them. Independent of the page.
//
// A source is `{ name, columns }` with columns of `{ field, node, label, unit, decimals, steps, series }`; the first one is what the scope
// shows, without a name, and the others are captures. Values of one field stand in one pane.

import { computed, difference, seriesOf, shiftOf } from "./capture.js";

/** A capture as a source over a picture, moved as `alignment` says. Moved samples are kept while they stay where they are. */
export function overlaid() {
  const moved = new WeakMap();
  return (capture, alignment, picture) => {
    const shift_s = shiftOf(capture, alignment, picture);
    const columns = capture.columns.map((column) => {
      if (moved.get(column)?.shift_s !== shift_s) moved.set(column, { shift_s, series: seriesOf(column, shift_s) });
      return { ...column, series: moved.get(column).series };
    });
    return { name: capture.name, columns };
  };
}

/** The field of a computed quantity. */
export const fieldOf = ({ name }) => `=${name}`;

/** The computed quantities of a source, for each node that has what they take. */
function computedColumns({ columns }, definitions) {
  const nodes = [...new Set(columns.map(({ node }) => node))];
  return definitions.flatMap((one) => {
    const { name, unit, parsed } = one;
    // Objects name their node themselves.
    const isOfOne = parsed.fields.every((field) => field.includes(":"));
    return (isOfOne ? [null] : nodes)
      .map((node) => {
        const series = (field) => columns.find((column) => column.field === field && (field.includes(":") || column.node === node))?.series ?? null;
        return { field: fieldOf(one), node, label: name, unit, decimals: 3, series: computed(parsed, series) };
      })
      .filter(({ series }) => series.length > 0);
  });
}

const nameOf = (source, { node }) => [node === null ? "" : `node ${node}`, source.name].filter(Boolean).join(", ");

/**
 * The panes of these sources. `definitions` are computed quantities `{ name, unit, parsed }`; fields in `hidden` are left out; with
 * `subtracts`, a further pane for each has the shown values less those of each capture.
 */
export function panesOf(sources, { definitions = [], hidden = new Set(), subtracts = false }) {
  const panes = new Map();
  const differences = new Map();
  const add = (to, key, column, line) => {
    const { label, unit, decimals, steps } = column;
    if (!to.has(key)) to.set(key, { key, field: column.field, label, unit, decimals, steps, lines: [] });
    to.get(key).lines.push(line);
  };
  const whole = sources.map((source) => ({ ...source, columns: [...source.columns, ...computedColumns(source, definitions)] }));
  const [base, ...others] = whole;
  for (const source of whole) {
    for (const column of source.columns) {
      const { field, series } = column;
      if (hidden.has(field) || series.length === 0) continue;
      add(panes, field, column, { name: nameOf(source, column), series });
    }
  }
  if (subtracts) {
    for (const source of others) {
      for (const column of source.columns) {
        const { field, node } = column;
        const own = base.columns.find((one) => one.field === field && one.node === node);
        if (hidden.has(field) || !own) continue;
        const series = difference(own.series, column.series);
        if (series.length) add(differences, `${field} −`, { ...column, label: `${column.label}: difference`, steps: false }, { name: `less ${nameOf(source, column)}`, series });
      }
    }
  }
  return [...panes.values()].flatMap((one) => [one, differences.get(`${one.key} −`)]).filter(Boolean);
}
