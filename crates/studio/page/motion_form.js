// A motion command as a group of fields with its button. Enter in a field moves nothing: only the button does, or Ctrl+Enter.

import { h } from "./dom.js";

/** `go` is the button that sends the command. */
export function motionForm(name, go, ...fields) {
  const root = h("div", { class: "form", role: "group", "aria-label": name }, h("h3", {}, name), ...fields, go);
  root.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" || !event.ctrlKey || event.repeat || !event.target.matches("input")) return;
    event.preventDefault();
    go.click();
  });
  return root;
}
