// What a change of PDOs would write, in order, and its effect on the bus: requested from the studio a moment after each change.

import { ask } from "./link.js";
import { count, h, number, setText, table } from "./dom.js";

/** Time without a change before the request. */
const SETTLED_MS = 300;

/** `write` applies the plan, `forget` discards it. */
export function pdoPlan({ write, forget }) {
  const cycle = h("input", { id: "pdo-cycle", type: "number", min: "0.25", max: "60000", step: "any", value: "10" });
  const rate = h("input", { id: "pdo-rate", type: "number", min: "10", max: "1000", step: "any", placeholder: "unknown" });
  const apply = h("button", { type: "button", id: "pdo-apply", class: "primary", onclick: go }, "Apply");
  const drop = h("button", { type: "button", id: "pdo-drop", onclick: forget }, "Discard the changes");
  const notice = h("p", { role: "status", id: "pdo-notice" });
  const shown = h("div", { id: "pdo-plan" });
  const inputs = h("div", { class: "bar", hidden: true }, h("label", {}, "SYNC period (ms) ", cycle), h("label", {}, "Bit rate (kbit/s) ", rate), apply, drop);
  const root = h("div", {}, inputs, notice, shown);
  let timer = null;
  let wanted = [];
  let node = null;
  let mine = false;
  let ready = false;
  /** Counts the requests: the answer to an older one is ignored. */
  let generation = 0;

  for (const input of [cycle, rate]) input.addEventListener("input", () => plan(node, wanted));

  function notify(kind, text) {
    notice.className = kind;
    setText(notice, text);
  }

  function clear() {
    clearTimeout(timer);
    generation += 1;
    [wanted, ready] = [[], false];
    inputs.hidden = true;
    shown.replaceChildren();
    notify("quiet", "");
  }

  /** Requests the effect of these changes, once they have been left alone for a moment. */
  function plan(of, changes) {
    if (!changes.length) return clear();
    clearTimeout(timer);
    generation += 1;
    [node, wanted, ready] = [of, changes, false];
    inputs.hidden = false;
    update(mine);
    if (!cycle.validity.valid || cycle.value === "" || !rate.validity.valid) return notify("bad", "Expected a SYNC period from 0.25 to 60000 ms and a bit rate from 10 to 1000 kbit/s.");
    notify("quiet", "Planning the writes …");
    timer = setTimeout(look, SETTLED_MS);
  }

  async function look() {
    const own = generation;
    const asked = { do: "plan_pdos", node, pdos: wanted, cycle_ms: Number(cycle.value) };
    if (rate.value) asked.bitrate = Math.round(Number(rate.value) * 1000);
    const answer = await ask(asked);
    if (own !== generation) return;
    if (!answer.ok) return notify("bad", answer.error.message);
    ready = true;
    update(mine);
    draw(answer.result);
  }

  function draw({ steps, pdos, bus, left }) {
    notify("quiet", steps.length ? `${count(steps.length, "write")}, in this order, each read back; if the drive refuses one, all are undone. Nothing has been written yet.` : "Nothing to write: the drive has this configuration already.");
    const stays = pdos.flatMap((pdo) => pdo.silent.map((why) => h("p", { class: "quiet" }, `${pdo.pdo} afterwards: ${why}`)));
    shown.replaceChildren(
      ...stays,
      ...left.map((of) => h("p", { class: "quiet" }, `${of.object} ${of.name ?? ""} is omitted: ${of.why}`)),
      h("div", { class: "columns" }, h("div", {}, h("h3", {}, "Bus load before and after"), ...load(bus)), h("div", {}, h("h3", {}, "Writes"), table(["Object", "Now", "New", "Purpose"], steps.map((step) => ({ cells: [`${step.object} ${step.name ?? ""}`, step.before ?? "?", step.after, step.purpose] }))))),
    );
  }

  function load(bus) {
    if (!bus) return [h("p", { class: "bad" }, "The bit rate of the bus is unknown: enter it above.")];
    const change = ({ before, after }) => `${number(before, 1)} % → ${number(after, 1)} %`;
    const worst = (timing) => (!timing ? "–" : timing.worst_ms === null ? "no bound" : `${number(timing.worst_ms, 2)} ms${timing.in_time ? "" : ", late"}`);
    const rows = bus.frames.map(({ frame, node, id, before, after }) => ({
      cells: [`${node === null ? "" : `${node} `}${frame}`, `${id}h`, `${number((after ?? before).every_ms, 1)} ms`, worst(before), after ? worst(after) : "removed"],
      kind: after && !after.in_time ? "late" : worst(before) === worst(after) ? "" : "changed",
    }));
    return [
      h("p", { id: "pdo-load" }, h("b", {}, `Load ${change(bus.load_percent)}`), ` worst case, ${change(bus.cycle_load_percent)} in a cycle without SDO and EMCY. `, h("b", { class: bus.fits.after ? "good" : "bad" }, bus.fits.after ? "Every frame arrives in time." : "Not every frame arrives in time.")),
      h("p", { class: "quiet" }, `Assumed: SYNC every ${bus.cycle_ms} ms at ${bus.bitrate / 1000} kbit/s; ${bus.assumed}. ${bus.nodes} nodes.`),
      h("div", { class: "frames" }, table(["Frame", "Id", "Every", "Longest delay now", "afterwards"], rows)),
      ...bus.notes.map((note) => h("p", { class: "quiet" }, note)),
    ];
  }

  async function go() {
    ready = false;
    update(mine);
    notify("quiet", "Writing …");
    const answer = await write();
    if (!answer.ok) notify("bad", answer.error.message);
    ready = wanted.length > 0;
    update(mine);
  }

  function update(control) {
    mine = control;
    apply.disabled = !mine || !ready;
    apply.title = mine ? "" : "Take control first";
  }

  /** The bit rate of the bus, if the studio knows it. */
  const know = (bitrate) => (rate.placeholder = bitrate ? `${bitrate / 1000}` : "unknown");

  return { root, plan, clear, update, notify, know };
}
