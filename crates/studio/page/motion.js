// The Motion view: everything that moves a drive. A jog lasts as long as its button is held.

import { ask, inControl, link } from "./link.js";
import { h, renew, setText, toggle } from "./dom.js";
import { VALUES, chooser, tiles } from "./drive.js";
import { groupMotion } from "./group.js";
import { guarding } from "./guarding.js";
import { speedLimit } from "./limit.js";
import { homingWizard } from "./homing.js";
import { series } from "./kept.js";
import { HOLD_MS, heldButtons, motionForm } from "./motion_form.js";
import { sequencePanel } from "./sequence_panel.js";
import { isSeenMoving } from "./sight.js";
import { host_name } from "./transport.js";
import { unitField } from "./unit_field.js";

/** Hold to run: turns while held, stops when released in any way. */
function jogger(shared, speed, report, isAccepted) {
  let held = null;

  async function begin(direction) {
    if (held || !inControl() || !isAccepted()) return;
    const node = shared.node;
    const jog = { node, timer: setInterval(() => hold(jog), HOLD_MS) };
    held = jog;
    const answer = await ask({ do: "jog", node, rpm: direction * speed() });
    // A press of stop, or another command, reports itself.
    if (!answer.ok && answer.error.kind !== "stopped" && answer.error.kind !== "replaced") {
      report("Jog", answer);
      if (held === jog) end();
    }
  }

  async function hold(jog) {
    const answer = await ask({ do: "jog_hold", node: jog.node });
    // Stopped, or held again too late: it does not restart by itself.
    if (!answer.ok && held === jog) end();
  }

  /** Asked for also where the studio has stopped it already: a recorded jog ends with its stop. */
  function end() {
    if (!held) return;
    clearInterval(held.timer);
    const { node } = held;
    held = null;
    ask({ do: "jog_end", node });
  }

  const heldButton = heldButtons(end);
  const button = (text, direction, title) => heldButton({ title }, text, () => begin(direction));
  addEventListener("keyup", (event) => (event.key === "ArrowLeft" || event.key === "ArrowRight") && end());
  return { begin, end, button, isHeld: () => held !== null };
}

export function motionView(shared, report) {
  const choose = chooser(shared);
  const large = tiles(VALUES.slice(0, 4), "motion");
  const title = h("h2");
  const status = h("p", { class: "status", role: "status" });

  const ANGLE = { field: "angle_degrees", unit: "°" };
  const SPEED = { field: "velocity_rpm", unit: "r/min" };
  const CURRENT = { field: "current_a", unit: "A" };
  const read = (of) => of.read();
  const required = (of) => {
    const value = of.read();
    if (value === null || !Number.isFinite(value)) {
      of.input.focus();
      return null;
    }
    return value;
  };

  const send = async (name, command) => {
    if (command) report(`Node ${command.node}: ${name}`, await ask(command));
  };
  /** The buttons that start a motion; they enable the drive if needed. */
  const starts = [];
  const act = (name, make) => () => {
    const command = make();
    if (command && risk.isAccepted()) send(name, { ...command, node: shared.node });
  };
  const form = (name, make, ...fields) => {
    const go = h("button", { type: "button", id: `go-${name.toLowerCase()}`, title: "Ctrl+Enter in a field", onclick: act(name, make) }, name);
    starts.push([go, name]);
    return motionForm(name, go, ...fields);
  };

  const jogSpeed = unitField("jog-speed", "Speed", SPEED, "60");
  const risk = guarding("guarding", report);
  const jog = jogger(shared, () => Math.abs(required(jogSpeed) ?? 0), report, risk.isAccepted);
  const speed = unitField("velocity-rpm", "Speed", SPEED, "60");
  const ramp = unitField("velocity-ramp", "Ramp", SPEED, "", { optional: true, rate: true });
  const angle = unitField("move-degrees", "Distance", ANGLE, "90");
  const moveSpeed = unitField("move-rpm", "at", SPEED, "", { optional: true });
  const relative = toggle("move-relative", "relative, from the last target", true);
  const amperes = unitField("torque-amperes", "Current", CURRENT, "0.5");
  const fields = [jogSpeed, speed, ramp, angle, moveSpeed, amperes];
  const homing = homingWizard(shared, report, risk.isAccepted);
  const group = groupMotion(report);

  const power = (id, name, what, key) =>
    h("button", { type: "button", id, title: key ? `${name} (key ${key})` : name, onclick: () => send(name, { do: what, node: shared.node }) }, name);

  /** Why nothing can be commanded here, with the button for it. */
  const why = h("div", { class: "bar", id: "motion-why", role: "status" });
  function tellWhy(state, node) {
    const [mine, other] = [inControl(), state.controller];
    const what = !node?.drive ? "nothing" : mine ? "" : other === null ? "free" : state.asking === link.welcome?.session ? "asked" : "other";
    const button = (id, text, command) => h("button", { type: "button", id, class: "primary", onclick: async () => report("Control", await ask({ do: command })) }, text);
    why.hidden = what === "";
    renew(why, `${what} ${other}`, () => ({
      "": [],
      nothing: ["Nothing can be commanded here: no drive is chosen, or it has not answered yet."],
      free: ["Nothing can be commanded here until this page has control of the drives.", button("motion-take", "Take control", "take_control")],
      other: [`Session ${other} has control of the drives: nothing can be commanded here until it hands over.`, button("motion-ask", "Ask for control", "ask_control")],
      asked: [`Session ${other} was asked for control of the drives.`],
    })[what]);
  }

  const enables = h("p", { class: "quiet" }, "Holding a button also enables the drive.");
  /** Shaft position of a node one second before its last reading. */
  const before_degrees = (node) => {
    const angles = series(node, "angle_degrees");
    return angles.value(angles.last_s() - 1);
  };

  /** Whether all these drives may be moved; of one that nothing stops the question is its own, when it is chosen. */
  function areAccepted(nodes) {
    const open = link.state?.nodes.find(({ node, goes_on, accepted }) => nodes.has(node) && goes_on && !accepted);
    if (!open) return true;
    shared.node = open.node;
    update(link.state);
    return risk.isAccepted();
  }

  const controls = h(
    "fieldset",
    {},
    h(
      "div",
      { class: "bar" },
      power("enable", "Enable", "enable"),
      power("disable", "Disable", "disable", "d"),
      power("reset-fault", "Reset fault", "reset_fault", "r"),
      power("gentle-stop", "Stop (ramp)", "stop", "s"),
    ),
    h(
      "div",
      { class: "forms" },
      h(
        "div",
        { class: "form" },
        h("h3", {}, "Jog (hold to run)"),
        jogSpeed.row,
        enables,
        h("div", { class: "bar" }, jog.button("◀", -1, "Hold to turn backward (left arrow)"), jog.button("▶", 1, "Hold to turn forward (right arrow)")),
      ),
      form("Turn", () => {
        const rpm = required(speed);
        return rpm === null ? null : { do: "velocity", rpm, rpm_per_s: read(ramp) };
      }, speed.row, ramp.row),
      form("Move", () => {
        const degrees = required(angle);
        return degrees === null ? null : { do: "move", degrees, relative: relative.checked, rpm: read(moveSpeed) };
      }, angle.row, moveSpeed.row, relative),
      form("Push", () => {
        const value = required(amperes);
        return value === null ? null : { do: "torque", amperes: value };
      }, amperes.row, h("p", { class: "quiet" }, "The resulting speed depends on the load.")),
    ),
    homing.root,
    group.root,
  );
  const root = h("section", { class: "motion" }, h("div", { class: "bar" }, title, choose.root), large.root, status, why, risk.root, speedLimit(report), controls, sequencePanel(areAccepted));

  function update(state) {
    choose.update(state);
    const node = state.nodes.find((node) => node.node === shared.node);
    setText(title, node ? `Node ${node.node}: ${node.title ?? "unknown model"}` : "No drive");
    large.update(node?.drive ?? null, node?.feed_m ?? null);
    for (const one of fields) one.update(node?.feed_m ?? null);
    const seen = node && isSeenMoving(node.drive, before_degrees(node.node));
    const parts = [node?.trouble ?? node?.drive?.state ?? "–", node?.doing, seen ? (node.moving ? "in motion by this studio" : "in motion") : null];
    setText(status, parts.filter(Boolean).join(" · "));
    const enabled = node?.drive?.state === "Operation enabled";
    for (const [go, name] of starts) setText(go, enabled ? name : `Enable and ${name.toLowerCase()}`);
    enables.hidden = enabled;
    risk.update(node ? [node] : [], inControl());
    homing.update(state);
    group.update(state);
    controls.disabled = !inControl() || !node?.drive;
    tellWhy(state, node);
  }

  function hide() {
    jog.end();
    group.hide();
  }

  /** A stale state is not shown, and nothing can be moved. */
  function lose() {
    hide();
    setText(status, `Unknown: the state of ${host_name} is stale`);
    controls.disabled = true;
  }

  function key(event) {
    if (event.repeat || controls.disabled) return;
    const pressed = { d: "disable", r: "reset-fault", s: "gentle-stop" }[event.key];
    if (pressed) document.getElementById(pressed).click();
    else if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
      event.preventDefault();
      jog.begin(event.key === "ArrowLeft" ? -1 : 1);
    }
  }

  return { root, update, key, hide, lose };
}
