// Small helpers for building the page. Text is always set as text, never as markup.

const SVG = "http://www.w3.org/2000/svg";

function fill(element, properties, children) {
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "class") element.setAttribute("class", value);
    else if (typeof value === "boolean") element.toggleAttribute(name, value);
    else if (value !== null) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null));
  return element;
}

/** An element with attributes; `onclick` and the like add listeners. Autocomplete is off: its list would take the keys of Stop. */
export const h = (tag, properties = {}, ...children) => fill(document.createElement(tag), tag === "input" ? { autocomplete: "off", ...properties } : properties, children);

/** A table with these heads. A row is its cells, or `{ cells, kind }` with a class; in a narrow window each cell shows its head. */
export const table = (heads, rows) =>
  h(
    "table",
    {},
    h("thead", {}, h("tr", {}, ...heads.map((head) => h("th", { scope: "col" }, head)))),
    h("tbody", {}, ...rows.map((row) => (Array.isArray(row) ? { cells: row, kind: "" } : row)).map(({ cells, kind }) => h("tr", { class: kind ?? "" }, ...cells.map((cell, at) => h("td", { "data-label": heads[at] }, cell))))),
  );

/** A toggle button with `checked`: pressed by the pointer and by Enter, since Space is Stop. `id` may be null. */
export function toggle(id, text, on, onchange = () => {}, properties = {}) {
  const button = h("button", { type: "button", id, class: "toggle", "aria-pressed": String(on), ...properties }, text);
  Object.defineProperty(button, "checked", {
    get: () => button.getAttribute("aria-pressed") === "true",
    set: (value) => button.setAttribute("aria-pressed", String(value)),
  });
  button.addEventListener("click", () => {
    button.checked = !button.checked;
    onchange();
  });
  return button;
}

/** The same for SVG. */
export const s = (tag, properties = {}, ...children) => fill(document.createElementNS(SVG, tag), properties, children);

/** Sets a text, and touches the document only if it differs, which keeps a selection and does not repeat it to a screen reader. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Replaces the children, unless `key` is that of the last call. */
export function renew(element, key, make) {
  if (element.dataset.key === key) return;
  element.dataset.key = key;
  element.replaceChildren(...make());
}

/** A number with a fixed number of decimals, or a dash. */
export const number = (value, decimals) => (value === null || value === undefined ? "–" : value.toFixed(decimals));

/** `1 write`, `2 writes`. */
export const count = (many, one) => `${many} ${one}${many === 1 ? "" : "s"}`;

/** `6041h`. */
export const hex = (value, digits) =>
  value === null || value === undefined ? "–" : `${value.toString(16).toUpperCase().padStart(digits, "0")}h`;
