// How motions are commanded: a command as a group of fields with its button, and buttons that are held. Enter in a field moves nothing: only the button does, or Ctrl+Enter.

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

// Three within the 200 ms after which the studio stops what is not held.
export const HOLD_MS = 60;

/** Maker of buttons that are held: `begun` is called when one is pressed, `end` when it is released in any way or its page is not looked at any more. */
export function heldButtons(end) {
  addEventListener("blur", end);
  addEventListener("pagehide", end);
  document.addEventListener("visibilitychange", () => document.hidden && end());
  return (attributes, text, begun) => {
    const element = h("button", { type: "button", class: "jog", ...attributes }, text);
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      begun();
    });
    for (const gone of ["pointerup", "pointercancel", "lostpointercapture"]) element.addEventListener(gone, end);
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    return element;
  };
}
