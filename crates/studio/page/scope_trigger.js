// The trigger of the scope: which value has to cross which level, and how much is shown of what was before.

import { choice } from "./choice.js";
import { h, say } from "./dom.js";

/** `release` is called when a held picture is to go. What it may look at is offered by `offer`. */
export function trigger(release) {
  const of = (id, label, options) => choice(id, label, options.map(([value, text]) => ({ value, text })));
  const mode = of("trigger-mode", "Trigger", [["off", "off"], ["once", "once"], ["again", "again and again"]]);
  const field = of("trigger-field", "Value", []);
  const edge = of("trigger-edge", "Edge", [["rising", "rising through"], ["falling", "falling through"], ["either", "through"]]);
  const level = h("input", { id: "trigger-level", type: "number", value: "10", step: "any", "aria-label": "Level", size: "7" });
  const before = h("input", { id: "trigger-before", type: "number", value: "20", min: "0", max: "100", "aria-label": "Per cent shown before", size: "4" });
  const status = h("span", { id: "trigger-status", class: "quiet", role: "status" });
  const root = h("span", { class: "trigger bar" }, h("span", { class: "quiet" }, "Trigger"), mode, field, edge, level, h("span", { class: "quiet" }, "with"), before, h("span", { class: "quiet" }, "% before it"), status);
  /** What comes after this time counts; null until something was read. */
  let armed_s = null;
  let came_s = null;

  function arm() {
    [armed_s, came_s] = [null, null];
    release();
  }
  for (const one of [mode, field, edge, level, before]) one.addEventListener("change", arm);

  /** The end of the picture that is to be held, or null. `crossing` says when a series crosses a level after a time. */
  function look(series, span_s, crossing) {
    if (mode.value === "off" || !series.length) {
      say(status, "");
      return null;
    }
    armed_s ??= series.last_s();
    came_s ??= crossing(series, Number(level.value), edge.value, armed_s);
    say(status, came_s === null ? "waits" : `came at ${came_s.toFixed(3)} s`);
    const after_s = span_s * (1 - Math.min(100, Math.max(0, Number(before.value))) / 100);
    if (came_s === null || series.last_s() < came_s + after_s) return null;
    const end_s = came_s + after_s;
    [armed_s, came_s] = [end_s, null];
    return end_s;
  }

  /** Waits for the next one, if it is to come again; else it is off. */
  function rearm(from_s) {
    if (mode.value === "once") mode.value = "off";
    [armed_s, came_s] = [from_s, null];
  }

  /** The values that it may look at: `{ field, label, unit }`. One that is not there any more ends it. */
  function offer(quantities) {
    const key = quantities.map(({ field }) => field).join(" ");
    if (field.dataset.key === key) return;
    const before = field.value;
    field.dataset.key = key;
    field.offer(quantities.map(({ field, label, unit }) => ({ value: field, text: unit ? `${label} (${unit.replace(/^\[(.*)\]$/, "$1")})` : label })));
    if (before && field.value !== before) {
      mode.value = "off";
      arm();
    }
  }

  return { root, look, rearm, offer, isOn: () => mode.value !== "off", comesAgain: () => mode.value === "again", field: () => field.value, level: () => Number(level.value) };
}
