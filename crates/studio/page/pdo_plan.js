// What a change of PDOs would write, in its order, and what it does to the bus: asked of the studio a moment after each change.

import { ask } from "./link.js";
import { count, h, number, say } from "./dom.js";

/** So long nobody has changed anything. */
const SETTLED_MS = 300;

const table = (heads, rows) =>
  h(
    "table",
    {},
    h("thead", {}, h("tr", {}, ...heads.map((head) => h("th", { scope: "col" }, head)))),
    h("tbody", {}, ...rows.map(({ cells, kind }) => h("tr", { class: kind ?? "" }, ...cells.map((cell, at) => h("td", { "data-label": heads[at] }, cell))))),
  );

/** `write` applies what is planned, `forget` drops it. */
export function pdoPlan({ write, forget }) {
  const cycle = h("input", { id: "pdo-cycle", type: "number", min: "0.25", max: "60000", step: "any", value: "10" });
  const rate = h("input", { id: "pdo-rate", type: "number", min: "10", max: "1000", step: "any", placeholder: "not known" });
  const apply = h("button", { type: "button", id: "pdo-apply", class: "primary", onclick: go }, "Apply");
  const drop = h("button", { type: "button", id: "pdo-drop", onclick: forget }, "Drop the changes");
  const told = h("p", { role: "status", id: "pdo-told" });
  const shown = h("div", { id: "pdo-plan" });
  const inputs = h("div", { class: "bar", hidden: true }, h("label", {}, "With SYNC every (ms) ", cycle), h("label", {}, "Bit rate (kbit/s) ", rate), apply, drop);
  const root = h("div", {}, inputs, told, shown);
  let timer = null;
  let wanted = [];
  let node = null;
  let mine = false;
  let ready = false;
  /** Counts the questions: the answer to an older one is of no use. */
  let generation = 0;

  for (const input of [cycle, rate]) input.addEventListener("input", () => plan(node, wanted));

  function tell(kind, text) {
    told.className = kind;
    say(told, text);
  }

  function clear() {
    clearTimeout(timer);
    generation += 1;
    [wanted, ready] = [[], false];
    inputs.hidden = true;
    shown.replaceChildren();
    tell("quiet", "");
  }

  /** Asks what these changes would do, as soon as nobody changes them any more. */
  function plan(of, changes) {
    if (!changes.length) return clear();
    clearTimeout(timer);
    generation += 1;
    [node, wanted, ready] = [of, changes, false];
    inputs.hidden = false;
    update(mine);
    if (!cycle.validity.valid || cycle.value === "" || !rate.validity.valid) return tell("bad", "A period of SYNC from 0.25 to 60000 ms and a bit rate from 10 to 1000 kbit/s are expected.");
    tell("quiet", "Looking what this would write …");
    timer = setTimeout(look, SETTLED_MS);
  }

  async function look() {
    const own = generation;
    const asked = { do: "plan_pdos", node, pdos: wanted, cycle_ms: Number(cycle.value) };
    if (rate.value) asked.bitrate = Math.round(Number(rate.value) * 1000);
    const answer = await ask(asked);
    if (own !== generation) return;
    if (!answer.ok) return tell("bad", answer.error.message);
    ready = true;
    update(mine);
    draw(answer.result);
  }

  function draw({ steps, pdos, bus, left }) {
    tell("quiet", steps.length ? `${count(steps.length, "write")}, in this order, each read back; on a refusal everything is put back. Nothing has been written yet.` : "Nothing is to be written: the drive has this already.");
    const stays = pdos.flatMap((pdo) => pdo.silent.map((why) => h("p", { class: "quiet" }, `${pdo.pdo} then: ${why}`)));
    shown.replaceChildren(
      ...stays,
      ...left.map((of) => h("p", { class: "quiet" }, `${of.object} ${of.name ?? ""} is left out: ${of.why}`)),
      h("div", { class: "columns" }, h("div", {}, h("h3", {}, "The bus, without and with it"), ...load(bus)), h("div", {}, h("h3", {}, "Writes"), table(["Object", "Has", "Gets", "What for"], steps.map((step) => ({ cells: [`${step.object} ${step.name ?? ""}`, step.before ?? "?", step.after, step.purpose] }))))),
    );
  }

  function load(bus) {
    if (!bus) return [h("p", { class: "bad" }, "The bit rate of the bus is not known: give it above.")];
    const change = ({ before, after }) => `${number(before, 1)} % → ${number(after, 1)} %`;
    const worst = (timing) => (!timing ? "–" : timing.worst_ms === null ? "no bound" : `${number(timing.worst_ms, 2)} ms${timing.in_time ? "" : ", late"}`);
    const rows = bus.frames.map(({ frame, node, id, before, after }) => ({
      cells: [`${node === null ? "" : `${node} `}${frame}`, `${id}h`, `${number((after ?? before).every_ms, 1)} ms`, worst(before), after ? worst(after) : "gone"],
      kind: after && !after.in_time ? "late" : worst(before) === worst(after) ? "" : "changed",
    }));
    return [
      h("p", { id: "pdo-load" }, h("b", {}, `Load ${change(bus.load_percent)}`), ` at most, ${change(bus.cycle_load_percent)} in a cycle without SDO and EMCY. `, h("b", { class: bus.fits.after ? "good" : "bad" }, bus.fits.after ? "Everything is there in time." : "Not everything is there in time.")),
      h("p", { class: "quiet" }, `Taken for granted: SYNC every ${bus.cycle_ms} ms at ${bus.bitrate / 1000} kbit/s; ${bus.assumed}. ${bus.nodes} nodes.`),
      h("div", { class: "frames" }, table(["Frame", "Id", "Every", "Longest time now", "then"], rows)),
      ...bus.notes.map((note) => h("p", { class: "quiet" }, note)),
    ];
  }

  async function go() {
    ready = false;
    update(mine);
    tell("quiet", "Writing …");
    const answer = await write();
    if (!answer.ok) tell("bad", answer.error.message);
    ready = wanted.length > 0;
    update(mine);
  }

  function update(control) {
    mine = control;
    apply.disabled = !mine || !ready;
    apply.title = mine ? "" : "Take control first";
  }

  /** The bit rate of the bus, where the studio knows it. */
  const know = (bitrate) => (rate.placeholder = bitrate ? `${bitrate / 1000}` : "not known");

  return { root, plan, clear, update, tell, know };
}
