// Drawing of the scope, on anything with the interface of a canvas context: lines over time or frequency, one pane for each quantity.

import { number } from "./dom.js";

const [LEFT, RIGHT, BELOW] = [72, 12, 24];

/** Room above the lines of a pane for its labels. */
const TITLE = 20;

/** Each line of a pane has its own colour and dash pattern. */
const PATTERNS = [[], [7, 3], [2, 3], [9, 3, 2, 3]];

/** Bounds with some margin, never equal. */
function bounds(low, high) {
  const room = Math.max((high - low) * 0.1, Math.abs(high) * 0.01, 1e-3);
  return [low - room, high + room];
}

/** A step of 1, 2 or 5 times a power of ten that makes at most `count` steps. */
function step(span, count) {
  const rough = span / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((times) => times * power).find((size) => size >= rough);
}

const decimalsOf = (size) => (size < 1 ? Math.min(6, Math.ceil(-Math.log10(size) - 1e-9)) : 0);

/** Layout of the panes, shared by the drawing and the pointer. */
export const frame = (width) => ({ left: LEFT, right: width - RIGHT });

/**
 * The points drawn for a line, in pixels across and values: each sample where they are few; where many share a pixel, the least, the
 * greatest and the last of them. Also the least and the greatest of all.
 */
function thinned({ xs, ys, from, to }, x, pixels) {
  const [across, values] = [[], []];
  let [least, most] = [Infinity, -Infinity];
  const put = (column, value) => {
    across.push(column);
    values.push(value);
  };
  if (to - from <= 2 * pixels) {
    for (let at = from; at < to; at += 1) {
      const value = ys[at];
      if (value < least) least = value;
      if (value > most) most = value;
      put(x(xs[at]), value);
    }
    return { across, values, least, most };
  }
  // As `x`, but without a call for each sample: a minute has many.
  const first = xs[from];
  const begin = x(first) + 0.5;
  const per = (x(xs[to - 1]) + 0.5 - begin) / (xs[to - 1] - first);
  let column = Math.floor(begin);
  let low = ys[from];
  let [high, last] = [low, low];
  // A level part of a line is added at its last column, once it ends.
  let [level, reached] = [NaN, null];
  const leave = () => {
    if (low < least) least = low;
    if (high > most) most = high;
    if (low === high && high === level) {
      reached = column;
      return;
    }
    if (reached !== null) put(reached, level);
    reached = null;
    if (high !== low) put(column, last === low ? high : low);
    put(column, last === low ? low : high);
    if (last !== low && last !== high) put(column, last);
    level = last;
  };
  for (let at = from + 1; at < to; at += 1) {
    const next = Math.floor(begin + (xs[at] - first) * per);
    const value = ys[at];
    if (next !== column) {
      leave();
      column = next;
      low = high = value;
    } else if (value < low) low = value;
    else if (value > high) high = value;
    last = value;
  }
  leave();
  if (reached !== null) put(reached, level);
  return { across, values, least, most };
}

function line(pen, { across, values }, y) {
  pen.beginPath();
  for (let at = 0; at < across.length; at += 1) {
    if (at === 0) pen.moveTo(across[at], y(values[at]));
    else pen.lineTo(across[at], y(values[at]));
  }
  pen.stroke();
}

/** A pane with its scale, and its lines: `{ name, xs, ys, from, to }` each. */
function pane(pen, colours, { label, unit, decimals, level, showsNewest = true }, lines, area, x) {
  const { left, right, top, bottom } = area;
  const drawn = lines.map((one) => thinned(one, x, right - left));
  let least = Math.min(...drawn.map((one) => one.least));
  let most = Math.max(...drawn.map((one) => one.most));
  if (least > most) [least, most] = [0, 0];
  const [low, high] = bounds(least, most);
  const y = (value) => bottom - ((value - low) / (high - low)) * (bottom - top - TITLE);
  pen.strokeStyle = colours.line;
  pen.fillStyle = colours.quiet;
  pen.lineWidth = 1;
  pen.setLineDash([]);
  pen.strokeRect(left, top, right - left, bottom - top);
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  const size = step(high - low, Math.max(3, Math.floor((bottom - top) / 30)));
  for (let at = Math.ceil(low / size) * size; at <= high; at += size) {
    pen.beginPath();
    pen.moveTo(left, y(at));
    pen.lineTo(right, y(at));
    pen.stroke();
    pen.fillText(number(at, decimalsOf(size)), left - 6, y(at));
  }
  pen.save();
  pen.beginPath();
  pen.rect(left, top, right - left, bottom - top);
  pen.clip();
  drawn.forEach((one, which) => {
    pen.strokeStyle = colours.lines[which % colours.lines.length];
    // Without a graphics unit a line of at most one pixel is drawn in a third of the time of a wider one.
    pen.lineWidth = one.across.length > right - left ? 1 : 1.6;
    pen.setLineDash(PATTERNS[which % PATTERNS.length]);
    line(pen, one, y);
  });
  pen.setLineDash([4, 4]);
  if (level !== undefined && level >= low && level <= high) {
    pen.strokeStyle = colours.warn;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(left, y(level));
    pen.lineTo(right, y(level));
    pen.stroke();
  }
  pen.setLineDash([]);
  pen.restore();
  pen.textAlign = "left";
  let at = left + 8;
  pen.fillStyle = colours.text;
  pen.fillText(label, at, top + 12);
  at += pen.measureText(label).width + 10;
  lines.forEach(({ name, ys, to, from }, which) => {
    const newest = showsNewest && to > from ? ` ${number(ys[to - 1], decimals)} ${unit}` : "";
    const text = `${lines.length > 1 ? `${name}:` : ""}${newest}`.trim();
    pen.fillStyle = lines.length > 1 ? colours.lines[which % colours.lines.length] : colours.text;
    pen.fillText(text, at, top + 12);
    at += pen.measureText(text).width + 14;
  });
}

function each(panes, width, height, draw) {
  const { left, right } = frame(width);
  const tall = (height - BELOW) / Math.max(panes.length, 1);
  panes.forEach((one, at) => draw(one, { left, right, top: at * tall + 6, bottom: (at + 1) * tall - 8 }));
}

function axis(pen, colours, from, to, x, height, unit) {
  pen.fillStyle = colours.quiet;
  pen.textAlign = "center";
  const size = step(to - from, 10);
  for (let at = Math.ceil(from / size) * size; at <= to; at += size) pen.fillText(`${number(at, decimalsOf(size))} ${unit}`, x(at), height - 9);
}

/** A vertical line with a label beside its top. */
function upright(pen, colour, at, height, text, pattern = []) {
  pen.strokeStyle = colour;
  pen.fillStyle = colour;
  pen.lineWidth = 1;
  pen.setLineDash(pattern);
  pen.beginPath();
  pen.moveTo(at, 6);
  pen.lineTo(at, height - BELOW);
  pen.stroke();
  pen.setLineDash([]);
  pen.textAlign = "left";
  pen.fillText(text, at + 4, height - BELOW - 6);
}

/**
 * Values over time. `panes` have `label`, `unit`, `decimals` and `lines` of `{ name, series }`, and may have a `level`; `cursors` are times
 * or null, `markers` have `time_s` and `text`.
 */
export function overTime(pen, width, height, colours, { panes, from_s, to_s, cursors, markers }) {
  const { left, right } = frame(width);
  const x = (at_s) => left + ((at_s - from_s) / (to_s - from_s)) * (right - left);
  each(panes, width, height, (one, area) => {
    const lines = one.lines.map(({ name, series }) => {
      const from = Math.max(series.at(from_s) - 1, series.start);
      return { name, xs: series.times, ys: series.values, from, to: Math.min(series.at(to_s) + 1, series.end) };
    });
    pane(pen, colours, one, lines, area, x);
  });
  axis(pen, colours, from_s, to_s, x, height, "s");
  for (const { time_s, text } of markers) {
    if (time_s >= from_s && time_s <= to_s) upright(pen, colours.quiet, x(time_s), height, text, [2, 4]);
  }
  cursors.forEach((at_s, which) => {
    if (at_s !== null && at_s >= from_s && at_s <= to_s) upright(pen, colours.warn, x(at_s), height, "AB"[which]);
  });
}

/** Amplitudes over frequency: panes as above, whose `lines` have a `spectrum` or null. */
export function overFrequency(pen, width, height, colours, panes) {
  const { left, right } = frame(width);
  const most = Math.max(1, ...panes.flatMap(({ lines }) => lines.map(({ spectrum }) => spectrum?.hertz.at(-1) ?? 0)));
  const x = (hertz) => left + (hertz / most) * (right - left);
  each(panes, width, height, (one, area) => {
    const lines = one.lines
      .filter(({ spectrum }) => spectrum)
      .map(({ name, spectrum }) => ({ name, xs: spectrum.hertz, ys: spectrum.amplitude, from: 0, to: spectrum.hertz.length }));
    const strongest = lines.map(({ xs, ys }) => xs[ys.indexOf(ys.reduce((high, value) => Math.max(high, value), 0))]);
    const label = lines.length ? `${one.label} (${one.unit}): strongest at ${strongest.map((hertz) => number(hertz, 2)).join(", ")} Hz` : `${one.label}: too few samples`;
    pane(pen, colours, { ...one, label, level: undefined, showsNewest: false }, lines, area, x);
  });
  axis(pen, colours, 0, most, x, height, "Hz");
}
