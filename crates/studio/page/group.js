// Several drives as one motion, in the Motion view: to positions together, at speeds together, or as the two wheels of a base.
// The studio plans the paths; held motions last as long as their button is held.

import { ask, inControl, link } from "./link.js";
import { choice } from "./choice.js";
import { h, number, renew, setText, toggle } from "./dom.js";
import { guarding } from "./guarding.js";
import { HOLD_MS, heldButtons, motionForm } from "./motion_form.js";

/** Hold to run, for a group: begins with `make`, goes on with `hold`, ends with `group_end`. */
function holder(report) {
  let held = null;

  async function begin(name, make, hold) {
    if (held || !inControl()) return;
    const command = make();
    if (!command) return;
    const mine = { timer: setInterval(() => renewed(mine, hold), HOLD_MS) };
    held = mine;
    const answer = await ask(command);
    // The answer comes at the end. A recorded motion ends with it, also where the studio has ended it.
    report(name, answer);
    if (held === mine) end();
  }

  async function renewed(mine, hold) {
    const answer = await ask(hold());
    // Stopped, or held again too late: it does not restart by itself.
    if (!answer.ok && held === mine) end();
  }

  function drop() {
    if (!held) return false;
    clearInterval(held.timer);
    held = null;
    return true;
  }

  function end() {
    if (drop()) ask({ do: "group_end" });
  }

  return { begin, end, button: heldButtons(end) };
}

const input = (id, value, extra = {}) => h("input", { id, type: "number", step: "any", value, inputmode: "decimal", ...extra });
const row = (label, field, unit) => h("label", { for: field.id }, `${label} `, field, ` ${unit}`);
const read = (field) => (field.value.trim() === "" ? null : Number(field.value));

export function groupMotion(report) {
  /** Node to the fields of its line, in the order of the bus. */
  const lines = new Map();
  const body = h("tbody");
  const heads = ["Node", "In the group", "Angle", "Speed", "Now", "Counts", "State"];
  const table = h("table", {}, h("thead", {}, h("tr", {}, ...heads.map((head) => h("th", {}, head)))), body);
  const relative = toggle("group-relative", "relative, from where each is", true);
  const rpm = input("group-rpm", "", { placeholder: "30" });
  const ramp = input("group-ramp", "", { placeholder: "60" });
  const within = input("group-within", "", { placeholder: "shortest" });
  const notice = h("p", { role: "status", id: "group-notice", class: "quiet" });
  const held = holder((name, answer) => showAnswer(name, answer));
  const risk = guarding("group-guarding", report);
  /** The drives of the last request to move. */
  let asked = [];

  const showAnswer = (name, answer) => {
    notice.className = answer.ok ? "good" : "bad";
    setText(notice, answer.ok ? (answer.notes ?? []).join(" ") || `${name}: at rest, power stage off.` : answer.error.message);
    // A press of stop, or another command, has its own news.
    if (answer.ok || (answer.error.kind !== "stopped" && answer.error.kind !== "replaced")) report(name, answer);
  };

  const chosen = () => [...lines].filter(([, line]) => line.in.checked);
  /** The axes of a command with one value each; null, with the focus where it is missing. */
  function axes(name, of) {
    const found = chosen().map(([node, line]) => ({ node, [name]: read(line[of]) }));
    if (found.length < 2) {
      notice.className = "bad";
      setText(notice, "Choose two or more drives.");
      return null;
    }
    const bad = found.find((axis) => axis[name] === null || !Number.isFinite(axis[name]));
    if (bad) {
      lines.get(bad.node)[of].focus();
      return null;
    }
    return found;
  }

  async function move() {
    const to = axes("degrees", "angle");
    if (!to || !isAccepted(chosen().map(([node]) => node))) return;
    notice.className = "quiet";
    setText(notice, "Moving …");
    showAnswer("Group", await ask({ do: "group_move", axes: to, relative: relative.checked, rpm: read(rpm), rpm_per_s: read(ramp), within_s: read(within) }));
  }

  const turn = (sign) => () => {
    /** @type {any} */
    const at = axes("rpm", "speed");
    return at && isAccepted(at.map(({ node }) => node)) && { do: "group_jog", axes: at.map(({ node, rpm }) => ({ node, rpm: sign * rpm })), rpm_per_s: read(ramp) };
  };
  const hold = () => ({ do: "group_hold" });
  const spin = (id, text, sign, title) => held.button({ id, title }, text, () => held.begin("Group", turn(sign), hold));

  // The base: which drives are its wheels, how it is built, and how fast.
  const [left, right] = [choice("base-left", "Left wheel"), choice("base-right", "Right wheel")];
  const [turns_left, turns_right] = [input("base-turns-left", "1", { "aria-label": "Turns of the left drive for a turn of its wheel" }), input("base-turns-right", "-1", { "aria-label": "Turns of the right drive for a turn of its wheel" })];
  const [base_m, radius_m] = [input("base-wheel-base", "0.5"), input("base-wheel-radius", "0.08")];
  const [speed, most, ramp_m] = [input("base-speed", "0.1"), input("base-most", "0.3"), input("base-ramp", "0.5")];
  const twist = (forward, round) => {
    const [v, b] = [Math.abs(read(speed) ?? 0), read(base_m)];
    // On the spot its wheels turn as fast as they do straight on.
    return { linear_m_s: forward * v, angular_rad_s: round * (b ? (2 * v) / b : 0) * (forward === 0 ? 1 : 0.5) };
  };
  let wanted = null;
  const drive = (forward, round) => () => {
    const wheels = [Number(left.value), Number(right.value)];
    if (!isAccepted(wheels)) return;
    wanted = twist(forward, round);
    const begin = () => ({ do: "base_jog", wheels, turns: [read(turns_left) ?? 1, read(turns_right) ?? -1], wheel_base_m: read(base_m) ?? 0, wheel_radius_m: read(radius_m) ?? 0, most_m_s: read(most) ?? 0, m_per_s2: read(ramp_m) ?? 0, ...wanted });
    held.begin("Base", begin, () => ({ do: "base_twist", ...wanted }));
  };
  const go = (id, text, title, forward, round) => held.button({ id, title }, text, drive(forward, round));

  const fields = h(
    "div",
    {},
    table,
    risk.root,
    h(
      "div",
      { class: "forms" },
      motionForm("Move together", h("button", { type: "button", id: "group-move", onclick: move }, "Enable and move together"), relative, row("Speed", rpm, "r/min maximum"), row("Ramp", ramp, "r/min/s maximum"), row("Within", within, "s")),
      h("div", { class: "form" }, h("h3", {}, "Turn together (hold to run)"), h("p", { class: "quiet" }, "Each at its own speed from the table; all reach it together."), h("div", { class: "bar" }, spin("group-back", "◀", -1, "Hold to turn all backward"), spin("group-forward", "▶", 1, "Hold to turn all forward"))),
      h(
        "div",
        { class: "form base" },
        h("h3", {}, "Two-wheeled base (hold to run)"),
        h("p", {}, "Left wheel ", left, " turns ", turns_left),
        h("p", {}, "Right wheel ", right, " turns ", turns_right),
        row("Wheel base", base_m, "m"),
        row("Wheel radius", radius_m, "m"),
        row("Speed", speed, "m/s"),
        row("Maximum", most, "m/s at the wheel"),
        row("Ramp", ramp_m, "m/s²"),
        h("div", { class: "bar" }, go("base-left-turn", "↺", "Hold to turn left on the spot", 0, 1), go("base-forward", "▲", "Hold to drive forward", 1, 0), go("base-back", "▼", "Hold to drive back", -1, 0), go("base-right-turn", "↻", "Hold to turn right on the spot", 0, -1)),
      ),
    ),
    notice,
  );
  const details = h("details", { class: "homing", id: "group" }, h("summary", {}, "Groups: several drives as one motion"), h("p", { class: "quiet" }, "All start with one SYNC and end together. When one faults, is lost or lags, all stop. The drives are enabled for the motion, also by a held button, and disabled afterwards. Their PDO mapping is changed for it."), fields);

  function line(node) {
    const fields = { in: toggle(`group-in-${node}`, "", false, () => link.state && update(link.state), { "aria-label": `Node ${node} is in the group` }), angle: input(`group-angle-${node}`, "90", { "aria-label": `Angle of node ${node} in degrees` }), speed: input(`group-speed-${node}`, "30", { "aria-label": `Speed of node ${node} in r/min` }), now: h("td"), counts: h("td"), does: h("td") };
    lines.set(node, fields);
    return fields;
  }

  function update(state) {
    if (!details.open) return;
    const drives = state.nodes.filter((node) => node.drive || node.trouble);
    renew(body, drives.map(({ node, model }) => `${node}${model}`).join(), () => {
      const before = new Map(lines);
      lines.clear();
      const options = drives.map(({ node }) => ({ value: String(node), text: `node ${node}` }));
      for (const [at, wheel] of [left, right].entries()) {
        const kept = wheel.value;
        wheel.offer(options);
        if (wheel.value !== kept) wheel.value = String(drives[at]?.node ?? "");
      }
      return drives.map(({ node, model }) => {
        const of = before.get(node) ?? line(node);
        lines.set(node, of);
        const cells = [`${node} ${model ?? ""}`, of.in, h("span", {}, of.angle, " °"), h("span", {}, of.speed, " r/min")];
        return h("tr", { "data-node": String(node) }, ...cells.map((cell, at) => h("td", { "data-label": heads[at] }, cell)), of.now, of.counts, of.does);
      });
    });
    const moved = new Set([...chosen().map(([node]) => node), ...asked]);
    risk.update(drives.filter(({ node, goes_on }) => goes_on && moved.has(node)), inControl());
    for (const { node, drive, doing, trouble } of drives) {
      const of = lines.get(node);
      setText(of.now, `${number(drive?.angle_degrees, 1)}° ${number(drive?.velocity_rpm, 1)} r/min`);
      setText(of.counts, number(drive?.position_counts, 0));
      setText(of.does, trouble ?? doing ?? drive?.state ?? "–");
    }
  }

  /** True if these may be moved; else asks for confirmation. */
  function isAccepted(nodes) {
    asked = nodes;
    if (link.state) update(link.state);
    return risk.isAccepted();
  }

  details.addEventListener("toggle", () => details.open && link.state && update(link.state));
  return { root: details, update, hide: held.end };
}
