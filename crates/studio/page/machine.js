// The power drive state machine (CiA 402-2, 8.2), drawn. States and transitions come from the server; where they are
// drawn is decided here, as in the figure of the standard: enabled at the bottom, faults at the right.

import { s } from "./dom.js";
import { helped } from "./help.js";

const WIDTH = 190;
const HEIGHT = 40;

const PLACES = {
  "Not ready to switch on": [260, 30],
  "Switch on disabled": [260, 110],
  "Ready to switch on": [260, 190],
  "Switched on": [260, 270],
  "Operation enabled": [260, 350],
  "Quick stop active": [560, 350],
  "Fault reaction active": [560, 30],
  Fault: [560, 110],
};

// By the number of the standard: the line, and the place of the number.
const LINES = {
  1: ["M260 50V88", 248, 74],
  2: ["M235 130V168", 223, 154],
  7: ["M285 170V132", 297, 154],
  3: ["M235 210V248", 223, 234],
  6: ["M285 250V212", 297, 234],
  4: ["M235 290V328", 223, 314],
  5: ["M285 330V292", 297, 314],
  8: ["M165 345C112 325 112 215 163 195", 113, 284],
  10: ["M165 265C80 245 80 140 163 118", 86, 194],
  9: ["M165 358C20 340 20 120 163 105", 40, 234],
  11: ["M355 342H463", 410, 336],
  16: ["M465 358H357", 410, 374],
  12: ["M540 330C540 210 460 135 357 122", 532, 216],
  13: ["M405 30H463", 425, 24],
  14: ["M560 50V88", 574, 74],
  15: ["M465 105H357", 410, 99],
};

/** The drawing, and the function that shows the present state and the steps to Operation enabled in it. */
export function powerMachine(table) {
  const boxes = new Map();
  const arrows = new Map();
  const root = s("svg", { class: "machine", viewBox: "0 0 680 384", role: "img", "aria-label": "Power drive state machine" });
  const head = (id) =>
    s("marker", { id, viewBox: "0 0 8 8", refX: "7", refY: "4", markerWidth: "7", markerHeight: "7", orient: "auto" }, s("path", { d: "M0 0L8 4L0 8z", class: id }));
  root.append(s("defs", {}, head("head"), head("head-way")));
  const known = [...table.transitions, { number: 13, from: "any state", to: "Fault reaction active", event: "fault" }];
  for (const { number, from, to, event } of known) {
    if (!LINES[number] || arrows.has(number)) continue;
    const [d, x, y] = LINES[number];
    const arrow = s("g", { class: "arrow" }, s("title", {}, `${number}: ${from} → ${to}: ${event}`), s("path", { d }), s("text", { x: String(x), y: String(y) }, String(number)));
    arrows.set(number, { arrow, from, to });
    root.append(arrow);
  }
  for (const name of table.states) {
    const [x, y] = PLACES[name];
    const box = s(
      "g",
      { class: "state" },
      s("rect", { x: String(x - WIDTH / 2), y: String(y - HEIGHT / 2), width: String(WIDTH), height: String(HEIGHT), rx: "6" }),
      s("text", { x: String(x), y: String(y + 5) }, name),
    );
    helped(box, "state", name);
    boxes.set(name, box);
    root.append(box);
  }

  function update(state, way) {
    for (const [name, box] of boxes) {
      const bad = name.startsWith("Fault");
      box.setAttribute("class", `state${name === state ? (bad ? " now bad" : " now") : ""}${way.some((step) => step.to === name) ? " way" : ""}`);
    }
    const stops = [state, ...way.map((step) => step.to)];
    for (const { arrow, from, to } of arrows.values()) {
      const at = stops.indexOf(from);
      arrow.setAttribute("class", at >= 0 && stops[at + 1] === to ? "arrow way" : "arrow");
    }
  }

  return { root, update };
}
