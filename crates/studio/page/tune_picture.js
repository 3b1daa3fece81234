// Pictures of a tuning: panes over the logarithm of the frequency, or over time, with the lines of drive, twin and model.

import { s } from "./dom.js";

const [LEFT, RIGHT, TOP, PANE, LOW, GAP, BELOW] = [56, 12, 44, 130, 60, 26, 34];

/** Values of a scale that are multiples of 1, 2 or 5 times a power of ten, some four of them. */
export function ticks(low, high, many = 4) {
  const rough = (high - low) / many;
  const power = 10 ** Math.floor(Math.log10(rough));
  const size = [1, 2, 5, 10].map((times) => times * power).find((one) => one >= rough * 0.999);
  const first = Math.ceil(low / size - 1e-9);
  const count = Math.floor(high / size + 1e-9) - first + 1;
  return Array.from({ length: count }, (_, at) => Number(((first + at) * size).toPrecision(12)));
}

/** 1, 2 and 5 times each power of ten within a range of frequencies. */
export function decades(low, high) {
  const powers = Array.from({ length: Math.ceil(Math.log10(high)) - Math.floor(Math.log10(low)) + 1 }, (_, at) => 10 ** (Math.floor(Math.log10(low)) + at));
  return powers.flatMap((power) => [1, 2, 5].map((times) => Number((times * power).toPrecision(12)))).filter((hz) => hz >= low && hz <= high);
}

/** The least and the greatest of all points of lines, by their coordinate. */
export function range(lines, coordinate) {
  let [low, high] = [Infinity, -Infinity];
  for (const { points } of lines) {
    for (const point of points) {
      low = Math.min(low, point[coordinate]);
      high = Math.max(high, point[coordinate]);
    }
  }
  if (low > high) return [0, 1];
  return low === high ? [low - 1, high + 1] : [low, high];
}

/** Panes above each other with one axis below. `marks` are `[at, text]` on that axis. The picture says in words what it shows. `width` is that of its letters' size. */
export function picture(panes, { logarithmic, unit, marks = [], says, width }) {
  const all = panes.flatMap((pane) => pane.lines);
  const [low, high] = range(all, 0);
  const scale = logarithmic ? Math.log10 : (value) => value;
  const x = (value) => LEFT + ((scale(value) - scale(low)) / (scale(high) - scale(low))) * (width - LEFT - RIGHT);
  const parts = [];
  let top = TOP;
  for (const [at, pane] of panes.entries()) {
    const tall = pane.high === undefined ? PANE : LOW;
    const [least, most] = pane.high === undefined ? range(pane.lines, 1) : [pane.low, pane.high];
    const y = (value) => top + tall - ((value - least) / (most - least)) * tall;
    parts.push(s("rect", { x: LEFT, y: top, width: width - LEFT - RIGHT, height: tall, class: "frame" }));
    for (const value of ticks(least, most, tall === PANE ? 4 : 2)) {
      parts.push(s("path", { d: `M${LEFT} ${y(value)}H${width - RIGHT}`, class: "grid" }), s("text", { x: LEFT - 6, y: y(value) + 4, "text-anchor": "end" }, String(value)));
    }
    for (const value of logarithmic ? decades(low, high) : ticks(low, high, width < 500 ? 3 : 6)) {
      parts.push(s("path", { d: `M${x(value)} ${top}v${tall}`, class: "grid" }));
      if (at === panes.length - 1) parts.push(s("text", { x: x(value), y: top + tall + 16, "text-anchor": "middle" }, String(value)));
    }
    for (const [where] of marks) parts.push(s("path", { d: `M${x(where)} ${top}v${tall}`, class: "mark" }));
    // The drive is above its twin and the model.
    for (const line of [...pane.lines].reverse()) parts.push(s("path", { d: `M${line.points.map(([one, other]) => `${x(one).toFixed(1)} ${y(other).toFixed(1)}`).join("L")}`, class: `line ${line.name}` }));
    parts.push(s("text", { x: LEFT, y: top - 7, class: "title" }, `${pane.label}${pane.unit ? `, ${pane.unit}` : ""}`));
    if (at === 0) {
      for (const [nth, { name }] of pane.lines.entries()) {
        const from = LEFT + 84 * nth;
        parts.push(s("path", { d: `M${from} ${top - 32}h26`, class: `line ${name}` }), s("text", { x: from + 32, y: top - 28 }, name));
      }
      // One above the other, towards the middle.
      for (const [nth, [where, text]] of marks.entries()) {
        const is_right = x(where) > width / 2;
        parts.push(s("text", { x: x(where) + (is_right ? -4 : 4), y: top + tall - 6 - 14 * nth, "text-anchor": is_right ? "end" : "start", class: "mark" }, text));
      }
    }
    top += tall + GAP;
  }
  const height = top - GAP + BELOW;
  parts.push(s("text", { x: width - RIGHT, y: height - 3, "text-anchor": "end" }, unit));
  return s("svg", { viewBox: `0 0 ${width} ${height}`, class: "tune-picture", role: "img", "aria-label": says }, ...parts);
}
