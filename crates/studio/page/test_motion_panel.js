// The form of a test motion in the Scope view: shape, limits and runs; then the figures of each run, and its traces in the picture.

import { captures } from "./capture_store.js";
import { choice } from "./choice.js";
import { h, setText, table } from "./dom.js";
import { guarding } from "./guarding.js";
import { ask, inControl } from "./link.js";
import { kept, keep } from "./settings.js";
import { FIELDS, LIMITS, MOST_KEPT, SHAPES, capturesOf, figureRows, orderOf, otherDrive, pathOf, remarkOf } from "./test_motion.js";
import { unitField } from "./unit_field.js";

const SETTINGS = "test-motion";
const DOING = "test motion";
const HEAD = ["Run", "What", "Figure"];

/**
 * A field in the unit that is chosen for its quantity, or with its own: `text` is in its own unit.
 * @param {string} name
 * @param {Record<string, any>} field
 * @param {string} value
 * @param {() => void} onchange
 */
function fieldOf(name, { label, unit, usual, title, quantity, rate, optional }, value, onchange) {
  const id = `test-${name}`;
  if (quantity) {
    const { input, row, read, update } = unitField(id, label, quantity, value, { optional, rate });
    Object.assign(input, { onchange, placeholder: usual === "" ? "–" : "" });
    row.title = title ?? "";
    return { row, update, text: () => (input.validity.badInput ? "no number" : read() === null ? "" : String(read())) };
  }
  const input = h("input", { id, value, class: "short", inputmode: "decimal", spellcheck: "false", "aria-label": unit ? `${label} in ${unit}` : label, placeholder: usual === "" ? "–" : "", onchange });
  return { row: h("label", { title: title ?? "" }, `${label} `, input, unit ? ` ${unit}` : ""), update: () => {}, text: () => input.value };
}

/** `taken` gets the captures of the runs when they are there, those to keep first; `open` shows one. */
export function testMotionPanel(shared, report, { taken, open }) {
  const before = kept(SETTINGS, {});
  const texts = { ...before.texts };
  const inputs = Object.fromEntries(Object.entries(FIELDS).map(([name, field]) => [name, fieldOf(name, field, String(texts[name] ?? field.usual), store)]));
  const known = SHAPES.some(({ value }) => value === before.shape);
  const shape = choice("test-shape", "Shape", SHAPES, { value: known ? before.shape : "steps", onchange: () => (store(), show()) });
  const path = choice("test-path", "Capture whose position is the path", [], { onopen: offerPaths });
  const pathRow = h("span", {}, "along ", path);
  const quantities = h("input", { id: "test-quantities", value: String(before.quantities ?? ""), size: "34", placeholder: "velocity, target_velocity, current", "aria-label": "Quantities to capture; empty: what the figures need", spellcheck: "false", onchange: store });
  const about = h("p", { class: "quiet", id: "test-about" });
  const risk = guarding("test-guarding", report);
  const start = h("button", { type: "button", id: "test-start", class: "primary", onclick: run }, "Run");
  const stop = h("button", { type: "button", id: "test-stop", class: "danger", hidden: true, onclick: end }, "Stop");
  const status = h("p", { role: "status", id: "test-status" });
  const had = h("div", { id: "test-had" });
  const root = h(
    "details",
    { class: "plain-details", id: "test-motion" },
    h("summary", {}, "Test motion"),
    h("div", { class: "bar" }, shape, ...SHAPES.flatMap(({ fields }) => fields).filter((name, at, all) => name !== "path" && all.indexOf(name) === at).map((name) => inputs[name].row), pathRow, inputs.count.row),
    about,
    h("div", { class: "bar" }, h("span", { class: "quiet" }, "Limits"), ...LIMITS.map((name) => inputs[name].row)),
    h("div", { class: "bar" }, h("label", {}, "Captured ", quantities), inputs.capture_ms.row),
    risk.root,
    h("div", { class: "bar" }, start, stop),
    status,
    had,
    h("p", { class: "quiet" }, "This moves the drive, for as long as this page is there: Stop, a closed tab and control that changes hands end it. At its end the shaft stands without power."),
  );
  /** A run was asked for, and is not answered yet. */
  let busy = false;
  /** The chosen drive, as the state has it. */
  let drive = null;

  const textsNow = () => Object.fromEntries(Object.entries(inputs).map(([name, { text }]) => [name, text()]));

  function store() {
    keep(SETTINGS, { shape: shape.value, texts: textsNow(), quantities: quantities.value });
  }

  /** Shows the fields of the shape. */
  function show() {
    const { fields, about: text } = SHAPES.find(({ value }) => value === shape.value);
    for (const name of SHAPES.flatMap((one) => one.fields)) {
      if (name === "path") pathRow.hidden = !fields.includes(name);
      else inputs[name].row.hidden = !fields.includes(name);
    }
    const isSteps = shape.value === "steps";
    for (const name of ["following_error_deg", "period_ms"]) inputs[name].row.hidden = isSteps;
    setText(about, text);
  }

  function offerPaths() {
    path.offer(captures.filter((one) => pathOf(one)).map(({ id, name }) => ({ value: id, text: name })));
  }

  const say = (text, bad = false) => {
    setText(status, text);
    status.className = bad ? "bad" : "";
  };

  async function run() {
    const node = shared.node;
    let order;
    let other = "";
    try {
      const along = shape.value === "path" ? captures.find(({ id }) => id === path.value) : null;
      other = along ? otherDrive(along, drive) : "";
      order = orderOf(node, { shape: shape.value, texts: textsNow(), quantities: quantities.value, path: along ? pathOf(along) : null });
    } catch (error) {
      return say(error.message, true);
    }
    if (!risk.isAccepted()) return;
    busy = true;
    start.disabled = true;
    had.replaceChildren();
    say(`Node ${node}: setting the capture up, then ${order.motion.count === 1 ? "1 run" : `${order.motion.count} runs`} … ${other}`);
    const answer = await ask(order);
    busy = false;
    if (!answer.ok) return say(answer.error.message, true);
    draw(node, answer.result, other);
  }

  function draw(node, result, other) {
    const made = capturesOf(result);
    const left = made.length > MOST_KEPT ? ` The first ${MOST_KEPT} runs are kept as captures.` : "";
    say(`Node ${node}: ${remarkOf(result)}${left} ${other}`.trim(), result.lacks.length > 0);
    const shows = made.map((capture) => h("button", { type: "button", onclick: () => open(capture) }, `Show ${capture.name}`));
    had.replaceChildren(table(HEAD, figureRows(result)), h("div", { class: "bar" }, ...shows));
    taken(made);
  }

  async function end() {
    report(`Node ${shared.node}: Stop`, await ask({ do: "quick_stop", node: shared.node }));
  }

  show();

  return {
    root,
    update({ nodes }) {
      const node = nodes.find((one) => one.node === shared.node);
      drive = node ?? null;
      for (const { update } of Object.values(inputs)) update(node?.feed_m ?? null);
      if (!root.open) return;
      risk.update(node ? [node] : [], inControl());
      const isMoved = node?.doing === DOING;
      stop.hidden = !isMoved;
      start.disabled = busy || isMoved || !inControl() || !node?.drive;
      start.title = inControl() ? "" : "Take control first";
      setText(start, node?.drive?.state === "Operation enabled" ? "Run" : "Enable and run");
    },
  };
}
