// The fields that set the vertical scale of a pane, for whom the wheel and fingers are not at hand.

import { choice } from "./choice.js";
import { h, setText } from "./dom.js";
import { ZOOM } from "./scale.js";

/** `areas` gives what is drawn now; `changed` is called when a scale was set. */
export function scalePanel(scales, areas, changed) {
  const pane = choice("scale-pane", "Scale of", [], { onchange: show });
  const field = (id, label) => h("input", { id, type: "number", step: "any", class: "short", "aria-label": label, onchange: set });
  const [low, high] = [field("scale-low", "From"), field("scale-high", "To")];
  const status = h("span", { class: "bad", role: "status" });
  const button = (id, text, title, onclick) => h("button", { type: "button", id, title, "aria-label": text.length > 1 ? null : title, onclick }, text);
  const zoomBy = (times) => act((key, bounds) => scales.zoom(key, bounds, times));
  const moveBy = (part) => act((key, bounds) => scales.move(key, bounds, part));
  const root = h(
    "span",
    { class: "bar", role: "group", "aria-label": "Scale" },
    h("span", { class: "quiet" }, "Scale of"),
    pane,
    low,
    h("span", { class: "quiet" }, "to"),
    high,
    button("scale-in", "+", "Enlarge (arrow up on the picture)", () => zoomBy(1 / ZOOM)),
    button("scale-out", "−", "Reduce (arrow down on the picture)", () => zoomBy(ZOOM)),
    button("scale-up", "↑", "Higher values (Shift+arrow up on the picture)", () => moveBy(0.25)),
    button("scale-down", "↓", "Lower values (Shift+arrow down on the picture)", () => moveBy(-0.25)),
    button("scale-free", "auto", "As the values are (End on the picture)", () => act((key) => scales.free(key))),
    status,
  );

  const chosen = () => areas().find(({ key }) => key === pane.value);

  function act(work) {
    const area = chosen();
    if (!area) return;
    work(area.key, [area.low, area.high]);
    changed();
    setText(status, "");
  }

  function set() {
    const bounds = [low.valueAsNumber, high.valueAsNumber];
    if (scales.fix(pane.value, ...bounds)) changed();
    setText(status, scales.isSet(pane.value) && bounds.every(Number.isFinite) && bounds[1] > bounds[0] ? "" : "expected two numbers, the second one larger");
  }

  /** Shows the bounds of the chosen pane, except in a field that is being typed in. */
  function show() {
    const area = chosen();
    const text = (value) => (area ? String(Number(value.toPrecision(4))) : "");
    for (const [input, value] of [[low, area?.low], [high, area?.high]]) {
      if (document.activeElement !== input && input.value !== text(value)) input.value = text(value);
    }
  }

  /** Offers the panes that are drawn: `{ key, label }`. */
  function offer(panes) {
    const key = panes.map((one) => `${one.key} ${one.label}`).join("\n");
    if (pane.dataset.key !== key) {
      pane.dataset.key = key;
      pane.offer(panes.map((one) => ({ value: one.key, text: one.label })));
    }
    show();
  }

  return { root, offer, pane: () => pane.value, choose: (key) => (pane.value = key) };
}
