// A field for a quantity in the unit that is chosen for it. What it says stays true when another unit is chosen: the number changes with it.

import { shownIn } from "./chosen_units.js";
import { h, setText } from "./dom.js";

/** Of a number that is typed; more digits are those of the conversion. */
const DIGITS = 6;
export const inOther = (value, from, to) => Number(((value * to) / from).toPrecision(DIGITS));

/** Of the rate of change of a quantity: `r/min/s`, `rad/s²`. */
export const perSecond = (unit) => `${unit}/s`.replace(/\/s\/s$/, "/s²");

/**
 * A field with its label; `value` is in the quantity's own unit, `{ field, unit }`, as is what `read` gives: null for an empty one. `rate` is
 * true for its rate of change. `update` takes what a turn moves.
 */
export function unitField(id, label, quantity, value, { optional = false, rate = false } = {}) {
  const input = h("input", { id, type: "number", step: "any", value, placeholder: optional ? "as set" : "", inputmode: "decimal" });
  const shown = h("span");
  let now = { unit: quantity.unit, factor: 1 };
  const draw = () => setText(shown, rate ? perSecond(now.unit) : now.unit);
  draw();
  return {
    input,
    row: h("label", { for: id }, `${label} `, input, " ", shown),
    read: () => (input.value.trim() === "" ? null : Number((Number(input.value) / now.factor).toPrecision(12))),
    update(feed_m) {
      const next = quantity.field ? shownIn(quantity, feed_m) : now;
      // Of another drive in the same unit a person means the same number.
      if (next.unit !== now.unit && input.value.trim() !== "") input.value = String(inOther(Number(input.value), now.factor, next.factor));
      now = next;
      draw();
    },
  };
}
