// A remedy with its buttons, which need control.

import { ask, inControl } from "./link.js";
import { h } from "./dom.js";

/** Buttons `{ name, command }`; `report` takes a title and the answer. */
export function remedyBar(buttons, report) {
  const send = (name, command) => async () => {
    if (!inControl()) return report(name, { ok: false, error: { message: "Take control first." } });
    report(name, await ask(command));
  };
  return buttons.length ? h("div", { class: "bar remedy" }, ...buttons.map(({ name, command }) => h("button", { type: "button", "data-does": command.do, onclick: send(name, command) }, name))) : null;
}
