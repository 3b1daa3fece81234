// The form of a fast capture in the Scope view: what, how fast, how long, from when on; and what was had of it.

import { choice } from "./choice.js";
import { h, renew, setText, toggle } from "./dom.js";
import { PERIODS_MS, captureOfAnswer, orderOf, remarkOf, rowsOf, timesIn } from "./fast_capture.js";
import { ask, inControl } from "./link.js";
import { kept, keep } from "./settings.js";
import { MOST_KEPT } from "./test_motion.js";

const SETTINGS = "fast-capture";
const USUAL = ["velocity", "target_velocity", "current"];
const HEAD = ["Quantity", "By", "Readings", "Every", "Jitter", "Gaps"];

/** `taken` gets the capture when it is there. */
export function fastCapturePanel(shared, { taken }) {
  const before = kept(SETTINGS, {});
  const field = (id, label, value, properties = {}) => h("input", { id, value, "aria-label": label, title: label, spellcheck: "false", onchange: store, ...properties });
  const chosen = new Set(Array.isArray(before.chosen) ? before.chosen : USUAL);
  const quantities = h("span", { class: "chooser", role: "group", "aria-label": "Quantities to capture" });
  const more = field("fast-more", "More: objects such as 6041h, or true values", String(before.more ?? ""), { size: "30", placeholder: "6041h, …" });
  const truths = choice("fast-true", "Add what is true of the virtual drive", [], { onchange: addTrue });
  truths.hidden = true;
  const period = choice("fast-period", "Time between two readings", PERIODS_MS.map((ms) => ({ value: String(ms), text: `every ${ms} ms` })), { value: PERIODS_MS.includes(Number(before.period_ms)) ? String(before.period_ms) : "1", onchange: store });
  const duration = field("fast-time", "Length in s", String(before.duration_s ?? "2"), { class: "short", inputmode: "decimal" });
  const trigger = field("fast-trigger", "Begin when a quantity passes a value: velocity>10 rising, velocity<10 falling; at once without one", String(before.trigger ?? ""), { size: "18", placeholder: "at once, or velocity>10" });
  const pre = field("fast-pre", "Kept of before the trigger, in ms", String(before.pre_ms ?? "0"), { class: "short", inputmode: "decimal" });
  const times = field("fast-times", "How often: armed again after each, and each is kept", String(before.times ?? "1"), { class: "short", inputmode: "numeric" });
  const take = field("fast-take", "TPDOs to use although they are in use: tpdo1; who listens to them misses them meanwhile", String(before.take ?? ""), { size: "8", placeholder: "tpdo1, …" });
  const sdo = toggle("fast-sdo", "SDO for the rest", before.sdo === true, store, { title: "Read by SDO what has no room in a TPDO: slower, and at times of its own (--sdo)" });
  const begin = h("button", { type: "button", id: "fast-begin", class: "primary", onclick: capture }, "Capture");
  const end = h("button", { type: "button", id: "fast-end", hidden: true, onclick: endIt }, "End now");
  const status = h("p", { role: "status", id: "fast-status" });
  const had = h("div", { id: "fast-had" });
  const root = h(
    "details",
    { class: "plain-details", id: "fast-capture", ontoggle: () => (offered = root.open ? offered : null) },
    h("summary", {}, "Fast capture"),
    h("div", { class: "bar" }, quantities),
    h("div", { class: "bar" }, more, truths),
    h("div", { class: "bar" }, period, h("label", {}, "for ", duration, " s"), h("label", {}, "from ", trigger), h("label", {}, "with ", pre, " ms before it"), h("label", {}, times, " times"), sdo, h("label", {}, "taking ", take)),
    h("div", { class: "bar" }, begin, end),
    status,
    had,
    h("p", { class: "quiet" }, "The drive itself sends what is asked for, mapped into its spare TPDOs. Nothing is moved, and everything is put back at the end: also when this page is closed meanwhile, and after a kill of the studio by ferrodrive params rollback."),
  );
  /** The node that is being captured; null for none. */
  let busy = null;
  /** It was ended by hand: what is there is kept, and no further one begins. */
  let ended = false;
  /** The node and model whose quantities are offered, asked for or refused: asked once, and again when the form is opened again. */
  let offered = null;

  function store() {
    keep(SETTINGS, { chosen: [...chosen], more: more.value, period_ms: period.value, duration_s: duration.value, trigger: trigger.value, pre_ms: pre.value, times: times.value, take: take.value, sdo: sdo.checked });
  }

  function addTrue() {
    if (truths.value) more.value = [more.value.trim(), truths.value].filter(Boolean).join(", ");
    truths.value = "";
    store();
  }

  const say = (text, bad = false) => {
    setText(status, text);
    status.className = bad ? "bad" : "";
  };

  async function offer(node, key) {
    offered = key;
    renew(quantities, key, () => []);
    truths.hidden = true;
    const answer = await ask({ do: "capture_quantities", node });
    if (offered !== key) return;
    if (!answer.ok) {
      // Of these the studio has said nothing.
      if (["no_connection", "no_picture"].includes(answer.error.kind)) offered = null;
      return say(answer.error.message, true);
    }
    const { quantities: names, true_values } = answer.result;
    truths.hidden = true_values.length === 0;
    truths.offer([{ value: "", text: "+ a true value" }, ...true_values.map((name) => ({ value: name, text: name }))]);
    renew(quantities, `${key} ${names.join()}`, () => names.map((name) => toggle(null, name, chosen.has(name), () => {
      if (!chosen.delete(name)) chosen.add(name);
      store();
    }, { "data-quantity": name })));
  }

  /** What is chosen of what this drive has. */
  const chosenHere = () => [...quantities.querySelectorAll("[aria-pressed=true]")].map((one) => one.dataset.quantity);

  function work(node) {
    busy = node;
    begin.disabled = node !== null;
    end.hidden = node === null;
  }

  async function capture() {
    const node = shared.node;
    let order, count;
    try {
      count = timesIn(times.value, MOST_KEPT);
      if (!inControl()) throw new Error("Take control first: the drive's TPDOs are mapped for it.");
      order = orderOf(node, { chosen: chosenHere(), more: more.value, period_ms: period.value, duration_s: duration.value, trigger: trigger.value, pre_ms: pre.value, take: take.value, sdo: sdo.checked });
    } catch (error) {
      return say(error.message, true);
    }
    work(node);
    ended = false;
    for (let number = 1; number <= count && !ended; number++) {
      if (!(await captureOnce(order, count > 1 ? `, ${number} of ${count}` : ""))) break;
    }
    work(null);
  }

  /** True if there is a capture. */
  async function captureOnce(order, which) {
    had.replaceChildren();
    say(order.trigger ? `Node ${order.node}: armed${which}, waits for ${order.trigger} …` : `Node ${order.node}: capturing${which} …`);
    const answer = await ask(order);
    if (!answer.ok) {
      say(answer.error.message, true);
      return false;
    }
    const { result } = answer;
    say(`Node ${order.node}${which}: ${remarkOf(result)}`, result.lacks.length > 0);
    had.replaceChildren(h("table", {}, h("thead", {}, h("tr", {}, ...HEAD.map((text) => h("th", { scope: "col" }, text)))), h("tbody", {}, ...rowsOf(result).map((row) => h("tr", {}, ...row.map((text) => h("td", {}, text)))))));
    taken(captureOfAnswer(result));
    return result.lacks.length === 0;
  }

  async function endIt() {
    ended = true;
    const answer = await ask({ do: "end_capture", node: busy });
    if (!answer.ok) say(answer.error.message, true);
  }

  return {
    root,
    update({ nodes }) {
      const node = nodes.find((one) => one.node === shared.node);
      if (!root.open || !node) return;
      const key = `${node.node} ${node.model}`;
      if (offered !== key) offer(node.node, key);
    },
  };
}
