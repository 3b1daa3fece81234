// Drawing of the scope, on anything with the interface of a canvas context: lines over time, over frequency or over each other.
//
// A pane has `key`, `label`, `unit`, `decimals` and lines of `{ name, xs, ys, from, to }`; each pane has an area of its own, or all of them
// one area, in which each keeps its own scale. Every picture gives the areas that it drew, `{ key, top, bottom, low, high }` from above.

import { number } from "./dom.js";

const [LEFT, RIGHT, BELOW] = [72, 12, 24];

/** Room above the lines of a pane for its labels. */
const TITLE = 20;

/** Each line of a pane has its own colour and dash pattern. */
const PATTERNS = [[], [7, 3], [2, 3], [9, 3, 2, 3]];

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
function thinned({ xs, ys, from, to, rises = true }, x, pixels) {
  const [across, values] = [[], []];
  let [least, most] = [Infinity, -Infinity];
  const put = (column, value) => {
    across.push(column);
    values.push(value);
  };
  // Where samples do not rise from left to right, as over another value, none can be left out.
  if (to - from <= 2 * pixels || !rises) {
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

/** The grid of a scale, and its figures. */
function grid(pen, colours, { left, right, top, bottom }, [low, high], y) {
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
}

/** The newest values of a pane beside its label; returns where the text ends. */
function legend(pen, colours, { label, unit, decimals, showsNewest = true }, lines, at, y, colour) {
  pen.textAlign = "left";
  pen.fillStyle = colour;
  pen.fillText(label, at, y);
  at += pen.measureText(label).width + 10;
  lines.forEach(({ name, ys, to, from, look, isCapture }) => {
    const newest = showsNewest && to > from ? ` ${number(ys[to - 1], decimals)} ${unit}` : "";
    const text = `${lines.length > 1 || isCapture ? `${name}:` : ""}${newest}`.trim();
    pen.fillStyle = lines.length > 1 || colour !== colours.text ? colours.lines[look % colours.lines.length] : colours.text;
    pen.fillText(text, at, y);
    at += pen.measureText(text).width + 14;
  });
  return at;
}

/** The range of lines that are drawn. */
const rangeOf = (drawn) => [Math.min(...drawn.map((one) => one.least)), Math.max(...drawn.map((one) => one.most))];

/**
 * Panes in one area: each has its own scale, and the figures are those of the first one. A `level` is a line across. Returns the areas.
 */
function shared(pen, colours, panes, area, x, scales) {
  const { left, right, top, bottom } = area;
  const all = panes.map(({ lines, ...one }) => {
    const drawn = lines.map((line) => thinned(line, x, right - left));
    const [low, high] = scales.of(one.key, ...rangeOf(drawn));
    return { ...one, lines, drawn, low, high, y: (value) => bottom - ((value - low) / (high - low)) * (bottom - top - TITLE) };
  });
  if (all.length) grid(pen, colours, area, [all[0].low, all[0].high], all[0].y);
  pen.save();
  pen.beginPath();
  pen.rect(left, top, right - left, bottom - top);
  pen.clip();
  for (const { lines, drawn, y, level, low, high } of all) {
    drawn.forEach((one, which) => {
      const { look } = lines[which];
      pen.strokeStyle = colours.lines[look % colours.lines.length];
      // Without a graphics unit a line of at most one pixel is drawn in a third of the time of a wider one.
      pen.lineWidth = one.across.length > right - left ? 1 : 1.6;
      pen.setLineDash(PATTERNS[Math.floor(look / colours.lines.length + (look % colours.lines.length)) % PATTERNS.length]);
      line(pen, one, y);
    });
    if (level === undefined || level < low || level > high) continue;
    pen.setLineDash([4, 4]);
    pen.strokeStyle = colours.warn;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(left, y(level));
    pen.lineTo(right, y(level));
    pen.stroke();
  }
  pen.setLineDash([]);
  pen.restore();
  let at = left + 8;
  for (const one of all) at = legend(pen, colours, one, one.lines, at, top + 12, all.length > 1 ? colours.lines[one.lines[0].look % colours.lines.length] : colours.text);
  return all.map(({ key, low, high }) => ({ key, top: top + TITLE, bottom, low, high }));
}

/** Colour and pattern of each line: counted in each area. */
function looks(panes, together) {
  let look = 0;
  return panes.map((one) => {
    if (!together) look = 0;
    const lines = one.lines.map((line) => ({ ...line, look: look++ }));
    return { ...one, lines };
  });
}

/** `together`: all panes in one area, the one named `first` with the figures. */
function each(pen, colours, panes, width, height, x, { scales, together = false, first }) {
  const { left, right } = frame(width);
  const all = looks(panes, together);
  if (together) {
    const ordered = [...all.filter(({ key }) => key === first), ...all.filter(({ key }) => key !== first)];
    return shared(pen, colours, ordered, { left, right, top: 6, bottom: height - BELOW - 8 }, x, scales);
  }
  const tall = (height - BELOW) / Math.max(panes.length, 1);
  return all.flatMap((one, at) => shared(pen, colours, [one], { left, right, top: at * tall + 6, bottom: (at + 1) * tall - 8 }, x, scales));
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

/** The cursors that are in the picture. */
function drawCursors(pen, colours, cursors, [from, to], x, height) {
  cursors.forEach((at, which) => {
    if (at !== null && at >= from && at <= to) upright(pen, colours.warn, x(at), height, "AB"[which]);
  });
}

/** Values over time. Lines of the panes have `name` and `series`; `cursors` are times or null, `markers` have `time_s` and `text`. */
export function overTime(pen, width, height, colours, { panes, from_s, to_s, cursors, markers }, layout) {
  const { left, right } = frame(width);
  const x = (at_s) => left + ((at_s - from_s) / (to_s - from_s)) * (right - left);
  const drawn = panes.map((one) => {
    const lines = one.lines.map(({ name, isCapture, series }) => {
      const from = Math.max(series.at(from_s) - 1, series.start);
      return { name, xs: series.times, ys: series.values, from, to: Math.min(series.at(to_s) + 1, series.end) };
    });
    return { ...one, lines };
  });
  const areas = each(pen, colours, drawn, width, height, x, layout);
  axis(pen, colours, from_s, to_s, x, height, "s");
  for (const { time_s, text } of markers) {
    if (time_s >= from_s && time_s <= to_s) upright(pen, colours.quiet, x(time_s), height, text, [2, 4]);
  }
  drawCursors(pen, colours, cursors, [from_s, to_s], x, height);
  return areas;
}

/** The highest frequency of the spectra of panes: the right edge of their picture. */
export const highestOf = (panes) => Math.max(1, ...panes.flatMap(({ lines }) => lines.map(({ spectrum }) => spectrum?.hertz.at(-1) ?? 0)));

/** Amplitudes over frequency: lines of the panes have a `spectrum` or null; `cursors` are frequencies or null. */
export function overFrequency(pen, width, height, colours, { panes, cursors }, layout) {
  const { left, right } = frame(width);
  const most = highestOf(panes);
  const x = (hertz) => left + (hertz / most) * (right - left);
  const drawn = panes.map((one) => {
    const lines = one.lines
      .filter(({ spectrum }) => spectrum)
      .map(({ name, spectrum }) => ({ name, xs: spectrum.hertz, ys: spectrum.amplitude, from: 0, to: spectrum.hertz.length }));
    const strongest = lines.map(({ xs, ys }) => xs[ys.indexOf(ys.reduce((high, value) => Math.max(high, value), 0))]);
    const label = lines.length ? `${one.label} (${one.unit}): strongest at ${strongest.map((hertz) => number(hertz, 2)).join(", ")} Hz` : `${one.label}: too few samples`;
    return { ...one, lines, label, level: undefined, showsNewest: false };
  });
  const areas = each(pen, colours, drawn, width, height, x, { ...layout, together: false });
  axis(pen, colours, 0, most, x, height, "Hz");
  drawCursors(pen, colours, cursors, [0, most], x, height);
  return areas;
}

/** One value over another: lines of the panes have `xs` and `ys` in the order of time; `across` names the value below, with its unit. */
export function overEach(pen, width, height, colours, panes, across, layout) {
  const { left, right } = frame(width);
  let [low, high] = [Infinity, -Infinity];
  for (const { lines } of panes) {
    for (const { xs } of lines) {
      for (const value of xs) [low, high] = [Math.min(low, value), Math.max(high, value)];
    }
  }
  [low, high] = layout.scales.of(`x ${across.key}`, low, high);
  const x = (value) => left + ((value - low) / (high - low)) * (right - left);
  const drawn = panes.map((one) => ({ ...one, level: undefined, lines: one.lines.map((line) => ({ ...line, from: 0, to: line.xs.length, rises: false })) }));
  const areas = each(pen, colours, drawn, width, height, x, { ...layout, together: false });
  axis(pen, colours, low, high, x, height, across.unit);
  return areas;
}
