// The trigger of the scope: the value, the level and edge that it has to cross, and how much is shown before it.

import { choice } from "./choice.js";
import { h, setText } from "./dom.js";

/** How long, in s, the other values may lag behind the source: the picture waits for them. */
const LAG_S = 0.5;

/** `release` is called when a held picture is to be released. `offer` sets the possible sources. */
export function trigger(release) {
  const of = (id, label, options) => choice(id, label, options.map(([value, text]) => ({ value, text })));
  const mode = of("trigger-mode", "Trigger", [["off", "off"], ["once", "once"], ["again", "repeat"]]);
  const field = of("trigger-field", "Value", []);
  const edge = of("trigger-edge", "Edge", [["rising", "rising through"], ["falling", "falling through"], ["either", "through"]]);
  const level = h("input", { id: "trigger-level", type: "number", value: "10", step: "any", "aria-label": "Level", size: "7" });
  const before = h("input", { id: "trigger-before", type: "number", value: "20", min: "0", max: "100", "aria-label": "Per cent shown before", size: "4" });
  const status = h("span", { id: "trigger-status", class: "quiet", role: "status" });
  const root = h("span", { class: "trigger bar" }, h("span", { class: "quiet" }, "Trigger"), mode, field, edge, level, h("span", { class: "quiet" }, "with"), before, h("span", { class: "quiet" }, "% before it"), status);
  /** Only crossings after this time count; null before the first reading. */
  let armed_s = null;
  let came_s = null;

  function arm() {
    [armed_s, came_s] = [null, null];
    release();
  }
  for (const one of [mode, field, edge, level, before]) one.addEventListener("change", arm);

  /** The picture that is to be held: `end_s`, and `zero_s`, when it crossed; or null. `crossing` returns when a series crosses a level after a time; `least_s` is when the value that lags most was read. */
  function look(series, span_s, crossing, least_s) {
    if (mode.value === "off" || !series.length) {
      setText(status, "");
      return null;
    }
    armed_s ??= series.last_s();
    came_s ??= crossing(series, Number(level.value), edge.value, armed_s);
    setText(status, came_s === null ? "waiting" : `fired at ${came_s.toFixed(3)} s`);
    const after_s = span_s * (1 - Math.min(100, Math.max(0, Number(before.value))) / 100);
    const missing_s = came_s === null ? Infinity : came_s + after_s - series.last_s();
    if (missing_s > 0 || (least_s < came_s + after_s && missing_s > -LAG_S)) return null;
    const held = { end_s: came_s + after_s, zero_s: came_s };
    [armed_s, came_s] = [held.end_s, null];
    return held;
  }

  /** Waits for the next crossing if it is to repeat; else switches off. */
  function rearm(from_s) {
    if (mode.value === "once") mode.value = "off";
    [armed_s, came_s] = [from_s, null];
  }

  /** The possible sources: `{ field, label, unit }`. The trigger is switched off when its source disappears. */
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
