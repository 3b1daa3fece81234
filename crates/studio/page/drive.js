// The Drive view: what one drive reports, and why it does not move yet.

import { ask } from "./link.js";
import { chosenNodes, hasFault, isSilent } from "./bus_rows.js";
import { choice } from "./choice.js";
import { chooseUnit, shownIn } from "./chosen_units.js";
import { h, hex, number, renew, setText } from "./dom.js";
import { term, terms } from "./help.js";
import { powerMachine } from "./machine.js";
import { request } from "./transport.js";
import { buttonsOf } from "./remedy.js";
import { remedyBar } from "./remedy_bar.js";
import { reportBar } from "./report.js";
import { unitsOf } from "./unit_table.js";

/** Label, field, decimals, unit. */
export const VALUES = [
  ["Position", "angle_degrees", 1, "°"],
  ["Counts", "position_counts", 0, ""],
  ["Speed", "velocity_rpm", 1, "r/min"],
  ["Current", "current_a", 2, "A"],
  ["Supply", "supply_v", 1, "V"],
  ["Motor", "motor_celsius", 0, "°C"],
  ["Power stage", "driver_celsius", 0, "°C"],
];

/** More drives than this are a list with a filter. */
const FEW = 8;
let choosers = 0;

/** Buttons that choose a drive; a list where there are many. */
export function chooser(shared) {
  const buttons = h("div", { class: "chooser", role: "group", "aria-label": "Drive" });
  const list = choice(`drive-list-${(choosers += 1)}`, "Drive", [], { onchange: () => (shared.node = Number(list.value)) });
  const words = h("input", { type: "search", size: "12", placeholder: "filter drives", "aria-label": "Words that a drive of the list must have" });
  const many = h("span", { class: "bar many-drives", hidden: true }, list, words);
  const root = h("div", {}, buttons, many);
  const isBad = (node) => hasFault(node) || isSilent(node);
  const text = (node) => `${isBad(node) ? "⚠ " : ""}${node.node} ${node.model ?? ""}`;

  function updateList(drives) {
    const found = chosenNodes(drives, { words: words.value }).map(({ node }) => node);
    // The chosen one stays in the list: to filter chooses nothing.
    const some = drives.filter(({ node }) => node === shared.node || found.includes(node));
    const key = some.map(text).join("\n");
    if (many.dataset.key !== key) list.offer(some.map((node) => ({ value: String(node.node), text: text(node) })));
    many.dataset.key = key;
    if (list.value !== String(shared.node)) list.value = String(shared.node);
  }

  const update = (state) => {
    const drives = state.nodes.filter((node) => node.drive || node.trouble);
    buttons.hidden = drives.length > FEW;
    many.hidden = !buttons.hidden;
    if (buttons.hidden) return updateList(drives);
    renew(buttons, `${shared.node} ${drives.map(text).join()}`, () =>
      drives.map((node) =>
        h("button", { type: "button", "aria-pressed": String(node.node === shared.node), class: isBad(node) ? "bad" : "", title: isBad(node) ? "A fault, or no answer" : "", onclick: () => (shared.node = node.node) }, text(node))));
  };
  return { root, update };
}

/** Large numbers, each in a unit that can be chosen; `view` names them. */
export function tiles(values, view) {
  const of = values.map(([label, field, decimals, unit]) => {
    const value = h("b");
    const units = unitsOf(unit).length > 1 ? choice(`${view}-unit-${field}`, `Unit of ${label.toLowerCase()}`, [], { onchange: () => chooseUnit(field, units.value) }) : null;
    return { field, decimals, unit, value, units, tile: h("div", { class: "tile" }, h("span", {}, label), h("div", {}, value, " ", units ?? unit)) };
  });
  const root = h("div", { class: "tiles" }, ...of.map(({ tile }) => tile));
  const update = (drive, feed_m = null) =>
    of.forEach(({ field, decimals, unit, value, units, tile }) => {
      const known = drive?.[field] ?? null;
      tile.hidden = drive !== null && known === null;
      const as = shownIn({ field, unit, decimals }, feed_m);
      setText(value, number(known === null ? null : known * as.factor, as.decimals));
      if (!units) return;
      const offered = unitsOf(unit, [feed_m]);
      if (units.dataset.key !== offered.join()) units.offer(offered.map((one) => ({ value: one, text: one })));
      units.dataset.key = offered.join();
      if (units.value !== as.unit) units.value = as.unit;
    });
  return { root, update };
}

export function driveView(shared, report) {
  const choose = chooser(shared);
  const large = tiles(VALUES, "drive");
  const title = h("h2");
  const remark = h("p", { class: "quiet" });
  const trouble = h("p", { class: "bad", role: "status" });
  const way = h("p");
  const faults = h("ul", { class: "faults" });
  const words = h("dl", { class: "words" });
  const picture = h("div", { class: "picture" });
  const findings = h("div", { class: "findings" });
  const why = h("button", { type: "button", id: "why", onclick: explain }, "Why does it not move?");
  let machine = null;
  request("/api/power-states")
    .then((answer) => answer.json())
    .then((table) => {
      machine = powerMachine(table);
      picture.append(machine.root);
    })
    .catch(() => picture.append("The state machine could not be loaded. Reload the page."));
  const root = h(
    "section",
    { class: "drive" },
    h("div", { class: "bar" }, title, choose.root),
    remark,
    trouble,
    large.root,
    reportBar(shared),
    h("div", { class: "columns" }, h("div", {}, h("h3", {}, "Power state"), picture, way), h("div", {}, h("h3", {}, "Fault"), faults, h("h3", {}, "Bits"), words, h("h3", {}, "Why"), why, findings)),
  );

  let explained = null;
  async function explain() {
    const node = shared.node;
    explained = node;
    why.disabled = true;
    findings.replaceChildren(h("p", { class: "quiet" }, "Listening to the bus, then reading the drive …"));
    const answer = await ask({ do: "explain", node });
    why.disabled = false;
    if (explained !== node) return;
    if (!answer.ok) findings.replaceChildren(h("p", { class: "bad" }, answer.error.message));
    else if (!answer.result.findings.some((finding) => finding.cause)) {
      findings.replaceChildren(h("p", { class: "good" }, `Node ${node}: found nothing that keeps it from moving.`), ...answer.result.findings.map(shown));
    } else findings.replaceChildren(...answer.result.findings.map(shown));
  }

  const shown = (finding) =>
    h(
      "details",
      { class: finding.cause ? "cause" : "warning", open: finding.cause },
      h("summary", {}, `${finding.cause ? "Cause" : "Warning"} (${finding.topic}): ${finding.found}`),
      h("dl", {}, h("dt", {}, "Expected"), h("dd", {}, finding.expected), h("dt", {}, "Consequence"), h("dd", {}, finding.follows), h("dt", {}, "Remedy"), h("dd", {}, finding.remedy)),
      remedyBar(buttonsOf(finding.remedy), report),
    );

  function update(state) {
    choose.update(state);
    const node = state.nodes.find((node) => node.node === shared.node);
    const drive = node?.drive ?? null;
    if (explained !== null && explained !== shared.node) {
      explained = null;
      findings.replaceChildren();
    }
    setText(title, node ? `Node ${node.node}: ${node.title ?? "unknown model"}` : "No drive");
    setText(remark, node?.remark ?? "");
    setText(trouble, node?.trouble ?? (node && !drive ? "Not a drive, or not read yet." : ""));
    large.update(drive, node?.feed_m ?? null);
    machine?.update(drive?.state ?? null, drive?.way ?? []);
    const steps = drive?.way.map((step) => `${hex(step.controlword, 2)} → ${step.to}`).join(", then ");
    const without = drive && !drive.has_state_machine ? " This model has no power state machine: its statusword echoes the controlword, and the state shown is the closest one." : "";
    setText(way, !drive ? "" : drive.state === "Operation enabled" ? `The drive follows set-points.${without}` : (steps ? `To Operation enabled: ${steps}.` : "Waiting for a transition that the drive makes itself.") + without);
    renew(faults, drive ? `${node.node} ${drive.fault_code} ${drive.faults.length}` : "", () => {
      if (!drive) return [];
      if (drive.fault_code === 0) return [h("li", { class: "good" }, "None")];
      if (drive.fault_code === null) return [h("li", {}, "Not known: the drive refuses to show its fault code")];
      const rows = drive.faults.map((row) => h("li", { class: "bad" }, term("fault", row.name, node.node), h("p", {}, row.remedy)));
      const reset = h("li", { class: "plain" }, remedyBar(buttonsOf(`ferrodrive reset ${node.node}`), report));
      return [...(rows.length ? rows : [h("li", { class: "bad" }, `${hex(drive.fault_code, 4)}: not in the drive's description`)]), reset];
    });
    renew(words, drive ? `${node.node} ${drive.statusword} ${drive.controlword} ${drive.mode}` : "", () =>
      !drive
        ? []
        : [
            h("dt", {}, `Statusword ${hex(drive.statusword, 4)}`),
            h("dd", {}, ...(drive.status_bits.length ? terms("status_bit", drive.status_bits, node.node) : ["no bit is set"])),
            h("dt", {}, `Controlword ${hex(drive.controlword, 4)}`),
            h("dd", {}, ...(drive.control_bits.length ? terms("control_bit", drive.control_bits, node.node) : [drive.controlword === null ? "this drive does not report it" : "no bit is set"])),
            h("dt", {}, "Mode"),
            h("dd", {}, drive.mode === null ? "–" : `${drive.mode} `, drive.mode_name ? term("mode", drive.mode_name, node.node) : ""),
          ]);
  }

  return { root, update };
}
