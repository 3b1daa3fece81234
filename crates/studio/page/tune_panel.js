// The wizard for gains and ramps in the Scope view: measured, modelled, proposed, tried on the twin; and then on the drive, if that is wanted.

import { choice } from "./choice.js";
import { h, setText, table, toggle } from "./dom.js";
import { guarding } from "./guarding.js";
import { ask, inControl } from "./link.js";
import { kept, keep } from "./settings.js";
import { FIELDS, bodePanes, foundRows, marginRows, moveRows, orderOf, rampRows, remarkOf, resonanceMarks, stepPane, warning, writingOf } from "./tune.js";
import { picture } from "./tune_picture.js";

const SETTINGS = "tune";
const DOING = "tuning";

const valueTable = (values) => table(["Object", "Name", "Has", "Proposed"], values.map(({ object, name, before, after }) => [object, name, String(before), String(after)]));

export function tunePanel(shared, report) {
  const before = kept(SETTINGS, {});
  const fieldsOf = (finds) =>
    Object.fromEntries(Object.entries(FIELDS[finds]).map(([name, { label, unit, usual, title }]) => {
      const input = h("input", { id: `tune-${finds}-${name}`, value: String(before[finds]?.[name] ?? usual), class: "short", inputmode: "decimal", spellcheck: "false", "aria-label": `${label} in ${unit}`, placeholder: usual === "" ? "–" : "", onchange: store });
      return [name, { input, row: h("label", { title: title ?? "" }, `${label} `, input, ` ${unit}`) }];
    }));
  const inputs = { gains: fieldsOf("gains"), ramps: fieldsOf("ramps") };
  const wish = choice("tune-wish", "Objective", [{ value: "margin", text: "Phase margin" }, { value: "bandwidth", text: "Bandwidth" }], { value: before.wish === "bandwidth" ? "bandwidth" : "margin", onchange: () => (store(), show()) });
  const position = toggle("tune-position", "position loop too", before.position === true, store);
  const agreed = toggle("tune-agreed", "The load is free to turn so, and an emergency stop within reach", false, () => allow());
  const warned = h("p", { id: "tune-warning" });
  const risk = guarding("tune-guarding", report);
  const about = h("p", { class: "quiet", id: "tune-about" });
  const start = h("button", { type: "button", id: "tune-start", class: "primary", onclick: measure }, "Measure");
  const compute = h("button", { type: "button", id: "tune-compute", class: "primary", onclick: computeRamps }, "Compute");
  const stop = h("button", { type: "button", id: "tune-stop", class: "danger", hidden: true, onclick: end }, "Stop");
  const phase = h("span", { class: "quiet", id: "tune-phase" });
  const status = h("p", { role: "status", id: "tune-status" });
  const had = h("div", { id: "tune-had" });
  const write = h("button", { type: "button", id: "tune-write", class: "primary", hidden: true }, "");
  const back = h("button", { type: "button", id: "tune-back", hidden: true, onclick: goBack }, "Back to the former values");
  const rows = (finds, test) => Object.entries(FIELDS[finds]).filter(([, field]) => test(field)).map(([name]) => inputs[finds][name].row);
  const gains = h(
    "div",
    {},
    h("div", { class: "bar" }, wish, ...rows("gains", ({ of }) => of), position),
    h("div", { class: "bar" }, h("span", { class: "quiet" }, "Limits"), ...rows("gains", ({ limit }) => limit)),
    warned,
    h("div", { class: "bar" }, agreed),
    risk.root,
    h("div", { class: "bar" }, start, stop, phase),
  );
  const ramps = h("div", {}, h("div", { class: "bar" }, ...rows("ramps", () => true)), h("div", { class: "bar" }, compute));
  const root = h("details", { class: "plain-details", id: "tune" }, h("summary", {}, "Find gains"), about, gains, ramps, status, had, h("div", { class: "bar" }, write, back));
  /** What can be found for the node, as the studio says; null until it has, or where nothing can. */
  let form = null;
  /** The node and model that were asked about. */
  let offered = null;
  /** An answer is awaited; the node whose values were written, for the way back. */
  let busy = false;
  /** The trial has a move in it. */
  let moves = false;
  let written = null;
  let state = { isMoved: false, drive: false };

  /** @returns {Record<string, any>} */
  const textsOf = (finds) => Object.fromEntries(Object.entries(inputs[finds]).map(([name, { input }]) => [name, input.value]));

  function store() {
    keep(SETTINGS, { wish: wish.value, position: position.checked, gains: textsOf("gains"), ramps: textsOf("ramps") });
    show();
  }

  /** Shows the fields of what can be found. */
  function show() {
    gains.hidden = form?.finds !== "gains";
    ramps.hidden = form?.finds !== "ramps";
    if (form?.finds !== "gains") return;
    for (const [name, { of }] of Object.entries(FIELDS.gains)) inputs.gains[name].row.hidden = Boolean(of) && of !== wish.value;
    setText(warned, warning(form, textsOf("gains")));
    allow();
  }

  function allow() {
    const { isMoved, drive } = state;
    stop.hidden = !isMoved;
    start.disabled = busy || isMoved || !inControl() || !drive || !agreed.checked;
    start.title = !inControl() ? "Take control first" : agreed.checked ? "" : "Read what is going to happen, and agree to it";
    compute.disabled = busy || !drive;
    for (const button of [write, back]) {
      button.disabled = busy || isMoved || !inControl();
      button.title = inControl() ? "" : "Take control first";
    }
  }

  const say = (text, bad = false) => {
    setText(status, text);
    status.className = bad ? "bad" : "";
  };

  async function offer(node, key) {
    offered = key;
    [form, written] = [null, null];
    clear();
    say("");
    setText(about, "");
    const answer = await ask({ do: "tune_form", node });
    if (offered !== key) return;
    if (answer.ok) {
      form = answer.result;
      // That of another model may be far too fast.
      if (form.finds === "gains") {
        inputs.gains.speed_rpm.input.value = String(form.usual_rpm);
        inputs.gains.current_a.input.value = String(form.usual_a);
      }
      setText(about, form.finds === "gains" ? "The drive is measured, a twin of it is made, and gains for one wish are tried on the twin. Then the drive can try them." : "A stepper without an encoder has no gains, and shows no lost step. Ramps and currents are computed from its load and tried on its twin; nothing moves.");
    } else {
      if (["no_connection", "no_picture"].includes(answer.error.kind)) offered = null;
      setText(about, answer.error.message);
    }
    show();
  }

  function clear() {
    had.replaceChildren();
    write.hidden = back.hidden = true;
  }

  /** Asks, and takes the answer for this node; null where it is refused, or another node was chosen meanwhile. */
  async function asked(command, text) {
    const key = offered;
    busy = true;
    allow();
    say(text);
    const answer = await ask(command);
    busy = false;
    allow();
    if (offered !== key) return null;
    if (!answer.ok) say(`Node ${command.node}: ${answer.error.message}`, true);
    return answer.ok ? answer.result : null;
  }

  /** The order of the form; null where something of it is wrong, which is said. */
  function order() {
    try {
      return orderOf(shared.node, { finds: form.finds, wish: wish.value, position: position.checked, texts: textsOf(form.finds) });
    } catch (error) {
      say(error.message, true);
      return null;
    }
  }

  async function measure() {
    const command = order();
    if (!command || !risk.isAccepted()) return;
    clear();
    // Agreed to for this time.
    agreed.checked = false;
    const result = await asked(command, `Node ${command.node}: it is measured, about half a minute; then its twin is …`);
    if (result) draw(command.node, result);
  }

  function draw(node, result) {
    const { text, good } = remarkOf(result);
    say(`Node ${node}: ${text}`, !good);
    const { response, twin, drive } = result.curves;
    // In a narrow window the letters keep their size.
    const width = Math.max(300, Math.min(640, innerWidth - 70));
    const bode = response.length ? picture(bodePanes(response), { logarithmic: true, unit: "Hz", marks: resonanceMarks(result), width, says: "Frequency response of the drive as measured, of its twin and of the model, with the coherence of the measurement" }) : null;
    const steps = [stepPane("A step, on the twin", twin.map(({ step }) => step)), stepPane("A load, on the twin", twin.map(({ load }) => load)), ...(drive ? [stepPane("A step, on the drive", drive)] : [])];
    const trial = picture(steps, { logarithmic: false, unit: "ms", width, says: "Speed after a step and a load with the gains before and those proposed" });
    had.replaceChildren(
      h("div", { class: "columns" }, h("div", {}, bode, trial), h("div", {}, table(["Found", "Figure"], foundRows(result)))),
      h("h2", { class: "small" }, "Proposed"),
      valueTable(result.gains),
      table(["Loop", "Crossover", "Phase margin", "Sensitivity", "State"], marginRows(result)),
      ...(result.twin_move ? [table(["A move", "As it is", "Proposed"], moveRows(result))] : []),
      ...result.notes.map((note) => h("p", { class: "quiet" }, note)),
    );
    write.hidden = result.drive_error !== null;
    setText(write, `Write them, and have the drive try a step${result.twin_move ? " and a move" : ""}`);
    moves = Boolean(result.twin_move);
    write.onclick = () => tryGains(node);
    back.hidden = !result.applied;
    written = result.applied ? node : null;
  }

  async function tryGains(node) {
    if (!risk.isAccepted()) return;
    const result = await asked({ do: "try_gains", node }, `Node ${node}: a step${moves ? " and a move there and back" : ""} with the gains that it has, and the same with those proposed …`);
    write.hidden = true;
    if (result) draw(node, result);
  }

  async function computeRamps() {
    const command = order();
    if (!command) return;
    clear();
    const { node } = command;
    const result = await asked(command, `Node ${node}: its twin turns …`);
    if (!result) return;
    say(`Node ${node}: its twin keeps in step with what is proposed. Nothing of the drive has changed.`);
    had.replaceChildren(table(["Computed", "Figure"], rampRows(result)), h("h2", { class: "small" }, "Proposed"), valueTable(result.values), ...result.notes.map((note) => h("p", { class: "quiet" }, note)));
    write.hidden = false;
    setText(write, "Write them to the drive");
    write.onclick = () => writeRamps(node, result.values);
  }

  async function writeRamps(node, values) {
    const result = await asked(writingOf(node, values), `Node ${node}: writing …`);
    if (!result) return;
    say(`Node ${node}: the drive has the proposed values, read back, and was not turned. They are not stored yet: Parameters, Store in the drive.`);
    write.hidden = true;
    back.hidden = result.steps.length === 0;
    written = node;
  }

  async function goBack() {
    const result = await asked({ do: "roll_back", node: written }, `Node ${written}: going back …`);
    if (!result) return;
    say(`Node ${written}: the drive has its former values, read back.`);
    clear();
    written = null;
  }

  async function end() {
    report(`Node ${shared.node}: Stop`, await ask({ do: "quick_stop", node: shared.node }));
  }

  show();

  return {
    root,
    update({ nodes }) {
      const node = nodes.find((one) => one.node === shared.node);
      if (!root.open) return;
      risk.update(node && form?.finds === "gains" ? [node] : [], inControl());
      state = { isMoved: node?.doing === DOING, drive: Boolean(node?.drive) };
      allow();
      setText(phase, !state.isMoved ? "" : node.moving ? "The drive is in motion." : "The drive stands. Its twin is measured and tried.");
      const key = `${node?.node} ${node?.model}`;
      if (node && offered !== key && !busy) offer(node.node, key);
    },
  };
}
