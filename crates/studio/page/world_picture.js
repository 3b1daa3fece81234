// A drawing of a drive as it truly is: its shaft where it stands, not where the encoder reports it. What is drawn depends on what there
// is: an arm behind a reducer, a carriage on a spindle where the drive does not measure its rotor, a wheel otherwise.

import { h, number, s, setText } from "./dom.js";

const [WIDTH, HEIGHT] = [260, 190];
const [MIDDLE_X, MIDDLE_Y] = [130, 88];
const RADIUS = 62;
/** Turns of the spindle from one end of the drawing to the other; the carriage re-enters on the other side. */
const SPINDLE_TURNS = 10;
const SPINDLE = [24, 236];
/** A winding is cold at ambient temperature and red at the limit of the usual insulation, class B (IEC 60085). */
const [COLD_C, HOT_C] = [25, 130];

const degrees = (rad) => (rad * 180) / Math.PI;
const turned = (angle) => `rotate(${angle.toFixed(2)} ${MIDDLE_X} ${MIDDLE_Y})`;

function wheel() {
  const spokes = [0, 60, 120].map((angle) => s("line", { x1: MIDDLE_X, y1: MIDDLE_Y - RADIUS + 10, x2: MIDDLE_X, y2: MIDDLE_Y + RADIUS - 10, transform: turned(angle), class: "part" }));
  const mark = s("circle", { cx: MIDDLE_X, cy: MIDDLE_Y - RADIUS + 6, r: 6, class: "mark" });
  const hub = s("circle", { cx: MIDDLE_X, cy: MIDDLE_Y, r: 22, class: "heat" });
  const moving = s("g", {}, s("circle", { cx: MIDDLE_X, cy: MIDDLE_Y, r: RADIUS, class: "body" }), ...spokes, hub, mark);
  const ground = s("line", { x1: 30, y1: MIDDLE_Y + RADIUS + 3, x2: 230, y2: MIDDLE_Y + RADIUS + 3, class: "part" });
  return { parts: [ground, moving], hub, move: (node) => moving.setAttribute("transform", turned(degrees(node.shaft_angle_rad))) };
}

function arm() {
  const hub = s("circle", { cx: MIDDLE_X, cy: MIDDLE_Y, r: 24, class: "heat" });
  const link = s("g", {}, s("rect", { x: MIDDLE_X - 10, y: MIDDLE_Y - RADIUS - 14, width: 20, height: RADIUS + 14, rx: 10, class: "body" }), s("circle", { cx: MIDDLE_X, cy: MIDDLE_Y - RADIUS - 4, r: 6, class: "mark" }));
  const rotor = s("line", { x1: MIDDLE_X, y1: MIDDLE_Y, x2: MIDDLE_X, y2: MIDDLE_Y - 20, class: "mark-line" });
  const foot = s("path", { d: `M${MIDDLE_X - 34} ${MIDDLE_Y + RADIUS + 3} L${MIDDLE_X - 18} ${MIDDLE_Y + 14} H${MIDDLE_X + 18} L${MIDDLE_X + 34} ${MIDDLE_Y + RADIUS + 3} Z`, class: "part" });
  return {
    parts: [foot, link, hub, rotor],
    hub,
    move: (node) => {
      link.setAttribute("transform", turned(node.output_shaft.angle_deg));
      rotor.setAttribute("transform", turned(degrees(node.shaft_angle_rad)));
    },
  };
}

function spindle() {
  const y = MIDDLE_Y + 30;
  const [left, right] = SPINDLE;
  const hub = s("circle", { cx: MIDDLE_X, cy: MIDDLE_Y - 30, r: 30, class: "heat" });
  const mark = s("line", { x1: MIDDLE_X, y1: MIDDLE_Y - 30, x2: MIDDLE_X, y2: MIDDLE_Y - 57, class: "mark-line" });
  const carriage = s("rect", { x: -16, y: y - 16, width: 32, height: 32, rx: 4, class: "body" });
  const rails = [-8, 8].map((off) => s("line", { x1: left, y1: y + off, x2: right, y2: y + off, class: "part" }));
  return {
    parts: [...rails, carriage, hub, mark],
    hub,
    move: (node) => {
      const turns = node.shaft_angle_rad / (2 * Math.PI);
      mark.setAttribute("transform", `rotate(${(turns * 360).toFixed(2)} ${MIDDLE_X} ${MIDDLE_Y - 30})`);
      const part = (((turns / SPINDLE_TURNS + 0.5) % 1) + 1) % 1;
      carriage.setAttribute("transform", `translate(${(left + part * (right - left)).toFixed(1)} 0)`);
    },
  };
}

const shapeOf = (node) => (node.output_shaft ? "arm" : node.rotor_position !== undefined ? "spindle" : "wheel");
const SHAPES = { arm, spindle, wheel };

/** Inputs, each with a lamp. */
function lamps(levels) {
  return Object.entries(levels).map(([name, level]) => h("span", { class: level ? "lamp on" : "lamp", title: level ? "on" : "off" }, `${level ? "●" : "○"} ${name}`));
}

/** A card for one drive, with its title. */
export function drivePicture(title) {
  const drawing = s("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": `${title} as it truly is` });
  const readings = h("p");
  const inputs = h("p", { class: "lamps" });
  const state = h("p", { class: "quiet" });
  const root = h("button", { type: "button", class: "world-card" }, h("b", {}, title), drawing, readings, inputs, state);
  let shape = null;
  let kind = "";
  const words = s("text", { x: MIDDLE_X, y: HEIGHT - 8, "text-anchor": "middle" });
  const brake = s("text", { x: MIDDLE_X, y: 14, "text-anchor": "middle", class: "brake" });

  function update(node) {
    if (kind !== shapeOf(node)) {
      kind = shapeOf(node);
      shape = SHAPES[kind]();
      drawing.replaceChildren(...shape.parts, words, brake);
    }
    shape.move(node);
    const heat = Math.min(1, Math.max(0, ((node.winding_c ?? COLD_C) - COLD_C) / (HOT_C - COLD_C)));
    shape.hub.style.fill = `color-mix(in srgb, #d62d20 ${Math.round(heat * 100)}%, var(--now))`;
    const load = node.load_torque_nm ? ` · load ${number(node.load_torque_nm, 2)} N·m` : "";
    setText(words, `${number(node.velocity_rpm, 1)} r/min${load}`);
    setText(brake, node.brake === "engaged" ? "▣ brake holds" : "");
    const celsius = node.winding_c === undefined ? "" : `, winding ${number(node.winding_c, 0)} °C`;
    setText(readings, `${number(node.supply_v, 1)} V, ${number(node.current_a, 2)} A${celsius}`);
    const levels = { ...node.inputs, ...node.outputs };
    const key = JSON.stringify(levels);
    if (inputs.dataset.key !== key) {
      inputs.dataset.key = key;
      inputs.replaceChildren(...lamps(levels));
    }
    setText(state, `power ${node.power}, bus ${node.bus}${node.damage ? `, ${node.damage}` : ""}`);
    state.classList.toggle("bad", Boolean(node.damage));
    root.classList.toggle("dead", node.power === "off");
  }

  return { root, update };
}
