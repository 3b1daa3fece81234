// What the scope draws: panes, from the values that are shown and the captures that are laid over them. Independent of the page.
//
// A source is `{ name, columns }` with columns of `{ field, node, label, unit, decimals, steps, series }`; the first one is what the scope
// shows, without a name, and the others are captures. Values of one field stand in one pane.

import { computed, difference, seriesOf, shiftOf } from "./capture.js";

/**
 * A capture as a source over a picture, moved as `alignment` says. Over a running picture it moves with each frame: its times are moved
 * in place then, in an array of their own that is made once.
 */
export function overlaid() {
  const moved = new WeakMap();
  return (capture, alignment, picture) => {
    const shift_s = shiftOf(capture, alignment, picture);
    const columns = capture.columns.map((column) => {
      if (!moved.has(column)) moved.set(column, { shift_s: 0, series: Object.assign(seriesOf(column), { times: column.times.slice() }) });
      const own = moved.get(column);
      if (own.shift_s !== shift_s) {
        for (let at = 0; at < column.times.length; at += 1) own.series.times[at] = column.times[at] + shift_s;
        own.shift_s = shift_s;
      }
      return { ...column, series: own.series };
    });
    return { name: capture.name, columns };
  };
}

/** The field of a computed quantity. */
export const fieldOf = ({ name }) => `=${name}`;

/** The computed quantities of a source, for each node that has what they take. */
function computedColumns({ columns }, definitions, from_s) {
  const nodes = [...new Set(columns.map(({ node }) => node))];
  return definitions.flatMap((one) => {
    const { name, unit, parsed } = one;
    // Objects name their node themselves.
    const isOfOne = parsed.fields.every((field) => field.includes(":"));
    return (isOfOne ? [null] : nodes)
      .map((node) => {
        const series = (field) => columns.find((column) => column.field === field && (field.includes(":") || column.node === node))?.series ?? null;
        return { field: fieldOf(one), node, label: name, unit, decimals: 3, series: computed(parsed, series, from_s) };
      })
      .filter(({ series }) => series.length > 0);
  });
}

const nameOf = (source, { node }) => [node === null ? "" : `node ${node}`, source.name].filter(Boolean).join(", ");

/** Two units that are both known, and are not the same. */
const differ = (one, other) => Boolean(one && other && one !== other);

/** The line of the same source and node, or one of that source without a node; undefined where there is none. */
export const partnerOf = ({ source, node }, lines) => [node, null].map((of) => lines.find((one) => one.source === source && one.node === of)).find(Boolean);

/**
 * The panes of these sources. `definitions` are computed quantities `{ name, unit, parsed }`; fields in `hidden` are left out; with
 * `subtracts`, a further pane for each has the shown values less those of each capture. Integrals begin at `from_s`, those of captures at their
 * own begin. A line has its `source`, an index, and its `node`.
 */
export function panesOf(sources, { definitions = [], hidden = new Set(), subtracts = false, from_s = -Infinity }) {
  const panes = new Map();
  const differences = new Map();
  const add = (to, key, column, line) => {
    const { label, unit, decimals, steps } = column;
    // A file may have a value in another unit.
    const own = differ(to.get(key)?.unit, unit) ? `${key} ${unit}` : key;
    if (!to.has(own)) to.set(own, { key: own, field: column.field, label, unit, decimals, steps, lines: [] });
    to.get(own).lines.push(line);
  };
  const whole = sources.map((source, at) => ({ ...source, at, columns: [...source.columns, ...computedColumns(source, definitions, at ? -Infinity : from_s)] }));
  const [base, ...others] = whole;
  for (const source of whole) {
    for (const column of source.columns) {
      const { field, node, series } = column;
      if (hidden.has(field) || series.length === 0) continue;
      add(panes, field, column, { name: nameOf(source, column), source: source.at, isCapture: source.at > 0, node, series });
    }
  }
  if (subtracts) {
    for (const source of others) {
      for (const column of source.columns) {
        const { field, node } = column;
        const own = base.columns.find((one) => one.field === field && one.node === node);
        if (hidden.has(field) || !own || differ(own.unit, column.unit)) continue;
        const series = difference(own.series, column.series);
        if (series.length) add(differences, `${field} −`, { ...column, label: `${column.label}: difference`, steps: false }, { name: `less ${nameOf(source, column)}`, source: source.at, isCapture: true, node, series });
      }
    }
  }
  return [...panes.values()].flatMap((one) => [one, differences.get(`${one.key} −`)]).filter(Boolean);
}
