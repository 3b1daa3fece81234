// The quantities that the scope computes from others, as a person has defined them; the browser keeps them.

import { h, setText } from "./dom.js";
import { LANGUAGE, formula } from "./formula.js";
import { kept, keep } from "./settings.js";

const KEY = "scope-computed";
const MOST = 12;

/** A definition `{ name, unit, text, parsed }`; throws what is wrong with it. */
export function defined({ name, unit = "", text }) {
  const [of, has] = [String(name ?? "").trim(), String(unit).trim()];
  if (!of) throw new Error("expected a name, such as acceleration");
  return { name: of, unit: has, text: String(text), parsed: formula(String(text)) };
}

/** What the browser has kept; a definition that is not valid any more is left out. */
export const keptDefinitions = (list) =>
  (Array.isArray(list) ? list : []).slice(0, MOST).flatMap((one) => {
    try {
      return [defined(one)];
    } catch {
      return [];
    }
  });

/** A form that defines a quantity, and the defined ones with a button that removes each. */
export function computedPanel() {
  const field = (id, label, size, placeholder) => h("input", { id, size: String(size), placeholder, "aria-label": label, spellcheck: "false" });
  const [name, text, unit] = [field("computed-name", "Name of the quantity", 10, "acceleration"), field("computed-formula", "Formula", 34, "d(speed)"), field("computed-unit", "Unit", 6, "r/min/s")];
  const status = h("span", { class: "bad", role: "status", id: "computed-status" });
  const shown = h("span", { class: "chooser", role: "group", "aria-label": "Computed quantities" });
  const form = h("form", { class: "bar", onsubmit: add }, name, h("span", { class: "quiet" }, "="), text, unit, h("button", { id: "computed-add" }, "Compute"), shown, status);
  const root = h("details", { class: "plain-details" }, h("summary", {}, "Compute a quantity"), form, h("p", { class: "quiet" }, `A formula may have ${LANGUAGE}. d is the derivative in 1/s, int the integral in s from where the picture begins, mean(x, y) the mean of the last y seconds. What is kept or saved has the values that are read; a computed quantity is computed anew from them.`));
  let definitions = keptDefinitions(kept(KEY, []));

  function store() {
    keep(KEY, definitions.map(({ name: of, unit: has, text: is }) => ({ name: of, unit: has, text: is })));
    draw();
  }

  function add(event) {
    event.preventDefault();
    try {
      const one = defined({ name: name.value, unit: unit.value, text: text.value });
      const others = definitions.filter(({ name: of }) => of !== one.name);
      if (others.length >= MOST) throw new Error(`at most ${MOST} quantities`);
      definitions = [...others, one];
      setText(status, "");
      store();
    } catch (error) {
      setText(status, error.message);
    }
  }

  function remove(one) {
    definitions = definitions.filter((other) => other !== one);
    store();
  }

  const draw = () => shown.replaceChildren(...definitions.map((one) => h("button", { type: "button", title: one.text, "aria-label": `Remove ${one.name} = ${one.text}`, "data-computed": one.name, onclick: () => remove(one) }, `× ${one.name}`)));
  draw();
  return { root, definitions: () => definitions };
}
