// A drawing of a homing method, like the figures of CiA 402-2, clause 11: the axis from its negative to its positive end, the
// switches on it, the path of the shaft, and the home position. Drawn from the studio's description of the method; there
// is no table of methods here.

import { s } from "./dom.js";

const LEFT = 40;
const RIGHT = 600;
const MIDDLE = (LEFT + RIGHT) / 2;
/** The range in which each switch is on. */
const NEGATIVE_LIMIT = [LEFT, 110];
const POSITIVE_LIMIT = [530, RIGHT];
const HOME = [280, 360];
/** How far the shaft goes on before it reverses, and beyond an edge before it crosses it. */
const TURN = 26;
/** Distance of two index pulses. */
const PULSE = 70;

const sign = (direction) => (direction === "negative" ? -1 : 1);

/** Where the switch of the method is on. If the method does not reverse at a limit, its switch reaches to that end. */
function stretch(method) {
  if (method.switch === "negative limit") return NEGATIVE_LIMIT;
  if (method.switch === "positive limit") return POSITIVE_LIMIT;
  if (method.reverses_at_limit) return HOME;
  return method.search === "positive" ? [HOME[1], RIGHT] : [LEFT, HOME[0]];
}

/** The edge at the home position, by the direction in which it is crossed. */
function edgeOf(method, [low, high]) {
  const going_on = method.edge === "on";
  return (method.crossing === "positive") === going_on ? low : high;
}

/** The turning points from a start, with the shaft reaching the switch in `direction`. */
function way(method, from, direction, before = []) {
  const [low, high] = stretch(method);
  const edge = edgeOf(method, [low, high]);
  const crossing = sign(method.crossing);
  const points = [from, ...before];
  const met = direction > 0 ? low : high;
  if (method.edge === "on") {
    // The switch has to be off before it can go on: leave it on the side from which the edge is crossed.
    if (direction === crossing) points.push(met + direction * TURN);
    points.push(edge - crossing * TURN);
  } else if (direction !== crossing) points.push(met + direction * TURN);
  points.push(edge);
  if (method.index) points.push(pulseAfter(edge, sign(method.index)));
  return points;
}

const pulseAfter = (x, direction) => x + direction * (PULSE / 2);

/** The paths that are drawn: from the side on which the search begins, and where it reverses also from the other. */
function ways(method) {
  if (method.here) return [[MIDDLE]];
  if (!method.switch) return [[MIDDLE, pulseAfter(MIDDLE, sign(method.index))]];
  const search = sign(method.search);
  const first = way(method, search > 0 ? 170 : 470, search);
  if (!method.reverses_at_limit) return [first];
  const [from, limit] = search > 0 ? [420, POSITIVE_LIMIT[0] + 14] : [220, NEGATIVE_LIMIT[1] - 14];
  return [first, way(method, from, -search, [limit])];
}

const text = (x, y, words, kind = "") => s("text", { x: String(x), y: String(y), class: kind }, words);
const line = (d, kind) => s("path", { d, class: kind });

function switchRow(name, [low, high], y, kind) {
  const off = y + 8;
  const on = y - 8;
  const level = `M${LEFT} ${low > LEFT ? off : on}H${low}V${on}H${high}V${high < RIGHT ? off : on}${high < RIGHT ? `H${RIGHT}` : ""}`;
  return s("g", { class: `switch ${kind}` }, line(level, ""), text(RIGHT + 8, y + 4, name));
}

/** One path, a step down at each reversal. */
function drawn(points, y, dashed) {
  const group = s("g", { class: dashed ? "homing-way other" : "homing-way" });
  let d = `M${points[0]} ${y}`;
  points.slice(1).forEach((x, at) => {
    if (at > 0) d += `v12`;
    d += `H${x}`;
  });
  const end_y = y + Math.max(0, points.length - 2) * 12;
  if (points.length > 1) group.append(line(d, ""), s("circle", { cx: String(points[0]), cy: String(y), r: "4", class: "start" }));
  return { group, end: [points[points.length - 1], end_y] };
}

/** The drawing in words. */
export function described(method) {
  if (method.here) return "Nothing moves: the present position becomes home.";
  const index = method.index ? `the first index pulse in ${method.index} direction` : "";
  if (!method.switch) return `The shaft turns slowly in ${method.index} direction; home is ${index}.`;
  const turn = method.reverses_at_limit ? ", and reverses at a limit switch" : "";
  const edge = `the edge at which the ${method.switch} goes ${method.edge} while the shaft moves in ${method.crossing} direction`;
  const home = index ? `Home is ${index} after ${edge}.` : `Home is ${edge}.`;
  return `The shaft searches for the ${method.switch} in ${method.search} direction${turn}. ${home}`;
}

export function homingPicture(method) {
  const all = ways(method);
  const root = s("svg", { class: "homing-picture", viewBox: "0 0 720 240", role: "img", "aria-label": described(method) });
  const head = s("marker", { id: "homing-head", viewBox: "0 0 8 8", refX: "7", refY: "4", markerWidth: "7", markerHeight: "7", orient: "auto" }, s("path", { d: "M0 0L8 4L0 8z" }));
  root.append(s("defs", {}, head), text(LEFT, 16, "negative ←"), text(RIGHT - 62, 16, "→ positive"));
  let y = 40;
  /** @type {any} */
  let end = null;
  all.forEach((points, at) => {
    const { group, end: reached } = drawn(points, y, at > 0);
    root.append(group);
    end ??= reached;
    y += Math.max(1, points.length - 1) * 12 + 16;
  });
  const [home_x] = end;
  y = Math.max(y, 120) + 8;
  const rows = [];
  if (method.switch) rows.push([method.switch, stretch(method)]);
  if (method.reverses_at_limit) rows.push(["negative limit", NEGATIVE_LIMIT], ["positive limit", POSITIVE_LIMIT]);
  root.append(line(`M${home_x} 24V${y + rows.length * 26 + (method.index ? 22 : 0)}`, "homing-line"), s("circle", { cx: String(end[0]), cy: String(end[1]), r: "6", class: "home" }), text(home_x + 8, 32, "home", "home"));
  rows.forEach(([name, where], at) => root.append(switchRow(name, where, y + 12 + at * 26, at === 0 ? "own" : "")));
  y += rows.length * 26;
  if (method.index) {
    let d = `M${LEFT} ${y + 18}`;
    for (let x = home_x - Math.floor((home_x - LEFT) / PULSE) * PULSE; x <= RIGHT; x += PULSE) d += `H${x - 1.5}v-12h3v12`;
    root.append(line(`${d}H${RIGHT}`, "pulses"), text(RIGHT + 8, y + 16, "index pulse"));
    y += 26;
  }
  root.setAttribute("viewBox", `0 0 720 ${y + 12}`);
  return root;
}
