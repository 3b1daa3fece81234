// A tour of ten steps for a first visit: what to do next, with the control for it marked. A step is done when the state of the bus
// shows it, not on a press of "next". It can be left and resumed.

import { inControl, link } from "./link.js";
import { h, setText } from "./dom.js";

const KEPT = "tour";
/** Name of the embedded virtual bus. */
const EMBEDDED = "sim";
/** Least speed at which a shaft counts as turning, in r/min. */
const TURNS_RPM = 5;

const drives = (state) => state.nodes.filter((node) => node.drive);
const fast = (node) => Math.abs(node.drive.velocity_rpm ?? 0) > TURNS_RPM;
const sum = (state, field) => state.nodes.reduce((all, node) => all + node[field], 0);
const enabled = (node) => node.drive.state === "Operation enabled";
/** A quick stop may end with the motor held. */
const powered = (node) => ["Operation enabled", "Quick stop active", "Fault reaction active"].includes(node.drive.state);
/** A parameter was rolled back. */
const isBack = (state, before) => sum(state, "can_roll_back") < sum(before, "can_roll_back");
/** Nothing turns, and no motor has power. */
const isAtRest = (state) => !drives(state).some((node) => fast(node) || powered(node));
const faulty = (node) => Boolean(node.drive.fault_code);

/**
 * Each step: what to do, the view and the control, and the condition on the state. `before` is the state at which the step
 * began; a step that leads through two views chooses by both. Motion, parameters and PDOs are for any drive of the bus; the
 * fault is the ZLAC8030L's.
 */
const STEPS = [
  { title: "Enable", view: "motion", mark: () => (inControl() ? "#enable" : "#take"), text: "Take control, then enable a drive.", done: (state) => drives(state).some(enabled) },
  { title: "Jog", view: "motion", mark: () => "button.jog:last-child", text: "Hold ▶, or the right arrow key. The shaft turns as long as you hold it.", done: (state) => drives(state).some((node) => node.doing === "jogging" || (node.moving && fast(node))) },
  { title: "Scope", view: "scope", mark: () => "canvas", text: "Press Turn in Motion, then look at the speed in the scope.", done: (state, _, view) => view === "scope" && drives(state).some(fast) },
  { title: "Parameter", view: (state) => (isAtRest(state) ? "parameters" : "motion"), mark: (state) => (isAtRest(state) ? "#parameters-search" : drives(state).some(enabled) ? "#stop" : "#disable"), text: "Press STOP, Esc or Space: it stops every drive, in every view; then Disable. On the wheel (zlac8030l): search 2013, choose 2013h:01, the protection temperature of the motor, and write 100. That is 10 °C, and the motor is warmer.", done: (state, before) => sum(state, "can_roll_back") > sum(before, "can_roll_back") },
  { title: "Fault", view: "faults", mark: () => ".timeline", text: "The drive is in fault now: the motor is warmer than the limit you wrote. Read here what may have caused it and what to do.", done: (state, _, view) => view === "faults" && drives(state).some(faulty) },
  { title: "Reset", view: (state, before) => (isBack(state, before) ? "motion" : "parameters"), mark: (state, before) => (isBack(state, before) ? "#reset-fault" : "#parameters-back"), text: "Press Roll back: the parameter gets its old value and the cause of the fault is gone. Then reset the fault in Motion.", done: (state) => drives(state).length > 0 && !drives(state).some(faulty) },
  { title: "PDO", view: "pdo", mark: () => (document.querySelector("#pdo-apply:not([disabled])") ? "#pdo-apply" : document.querySelector("#pdo-search") ? "#pdo-search" : "button[data-edit=TPDO1]"), text: "On the wheel (zlac8030l): change TPDO1, add an object, and apply. Before that you see what it would write and its effect on the bus.", done: (state, before) => sum(state, "mapped") > sum(before, "mapped") },
  { title: "Save", view: "parameters", mark: () => "#parameters-store", text: "Store the parameters in the drive, so that it keeps them over a restart.", done: (state, before) => sum(state, "stored") > sum(before, "stored") },
  { title: "Scenario", view: "world", mark: () => "[data-line='cable cut']", text: "Change the surroundings of the machine: cut the cable of a drive, see the effect in Bus and Faults, and undo it. ferrodrive run plays such scenarios from a file.", done: (state, before) => state.changes > before.changes },
  { title: "Recording", view: "trace", mark: () => "#trace-save-log", text: "Save the frames of the bus, for ferrodrive dump and replay.", done: (state, before) => state.logs_saved > before.logs_saved },
];

const read = () => {
  try {
    return JSON.parse(localStorage.getItem(KEPT)) ?? {};
  } catch {
    return {};
  }
};

/** `view` gives the name of the view that is shown, `show` shows one. */
export function tourBar(view, show) {
  const title = h("b");
  const text = h("span");
  const go = h("button", { type: "button", id: "tour-go", onclick: () => show(viewOf(STEPS[kept.step])) }, "Show me");
  const start = h("button", { type: "button", id: "tour-start", class: "primary", onclick: () => keep({ on: true, step: 0 }) });
  const leave = h("button", { type: "button", id: "tour-leave", onclick: () => keep({ ...kept, on: false }) }, "Not now");
  const root = h("section", { id: "tour", "aria-label": "Tour", role: "status", hidden: true }, title, text, h("span", { class: "grow" }), go, start, leave);
  let kept = read();
  // A step stored by another version of the page.
  if (!Number.isInteger(kept.step) || kept.step < 0 || kept.step > STEPS.length) kept = { ...kept, step: 0 };
  /** The tour moves drives and writes to them: on the embedded virtual bus only. */
  let embedded = false;
  /** The state at which the step began; not kept over a reload, since the studio may be another one. */
  let before = null;

  /** The view of a step; for some it changes on the way. */
  const viewOf = (step) => (typeof step.view === "string" ? step.view : link.state ? step.view(link.state, before ?? link.state) : null);

  function keep(next) {
    kept = next;
    before = null;
    localStorage.setItem(KEPT, JSON.stringify(kept));
    draw();
  }

  function mark(selector) {
    const marked = document.querySelector(".tour-mark");
    const wanted = selector ? document.querySelector(selector) : null;
    if (marked === wanted) return;
    marked?.classList.remove("tour-mark");
    wanted?.classList.add("tour-mark");
  }

  function draw() {
    const isNew = kept.on === undefined;
    const ended = kept.step === STEPS.length;
    root.hidden = !embedded || kept.on === false;
    const step = kept.on ? STEPS[kept.step] : null;
    setText(title, step ? `${kept.step + 1} of ${STEPS.length}: ${step.title}. ` : ended ? "The tour is done. " : isNew ? "Here for the first time? " : "");
    setText(text, step ? step.text : ended ? "You have moved a drive, resolved a fault and saved a recording." : isNew ? "Ten steps show the studio, in about five minutes." : "");
    go.hidden = !step || viewOf(step) === view();
    start.hidden = Boolean(step);
    setText(start, ended ? "Again" : "Start the tour");
    setText(leave, step ? "Leave the tour" : ended ? "Close" : "Not now");
    mark(step && viewOf(step) === view() ? step.mark(link.state, before ?? link.state) : null);
  }

  function update(state) {
    embedded = state.bus.name === EMBEDDED;
    const step = embedded && kept.on ? STEPS[kept.step] : null;
    if (step) {
      before ??= state;
      if (step.done(state, before, view())) {
        const next = kept.step + 1;
        return keep({ on: next < STEPS.length ? true : null, step: next });
      }
    }
    draw();
  }

  /** Resumes the tour where it was left, or starts it. */
  function resume() {
    keep({ on: true, step: kept.step === STEPS.length ? 0 : kept.step });
  }

  return { root, update, resume, isOffered: () => embedded };
}
