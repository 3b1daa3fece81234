// A drop-down list of the page's own: the popup of a native <select> takes the keys while it is open, and Esc
// and Space must reach Stop whatever is open.

import { h, setText } from "./dom.js";

/** The choice whose list is open; null for none. */
let open = null;

/** Closes the list that is open. */
export function closeChoice() {
  open?.close();
}

addEventListener("pointerdown", (event) => open && !open.root.contains(event.target) && open.close(), true);

/**
 * An element with `value` and `disabled`, which fires "change" when an option is chosen. `offer` sets its options: `{ value, text,
 * disabled, title }`; the value stays if it is still among them, else it is the first one's. `onopen` is called, and what it
 * promises awaited, before its list is shown: no line moves away from under the pointer.
 */
export function choice(id, label, options = [], { value = undefined, onopen = () => {}, onchange = () => {} } = {}) {
  const shown = h("span", { class: "choice-text" });
  const button = h("button", { type: "button", role: "combobox", "aria-haspopup": "listbox", "aria-expanded": "false", "aria-label": label, onclick: () => (mine === open ? close() : show()) }, shown);
  const list = h("ul", { role: "listbox", "aria-label": label, hidden: true });
  const root = h("span", { class: "choice", id, onchange }, button, list);
  const mine = { root, close };
  let all = [];
  let chosen = "";
  let active = -1;

  const name = (at) => `${id}-option-${at}`;
  const place = () => all.findIndex((option) => option.value === chosen);

  function draw() {
    const text = all[place()]?.text ?? "";
    setText(shown, text);
    button.title = text;
    list.replaceChildren(
      ...all.map(({ value, text, disabled, title }, at) =>
        h("li", { role: "option", id: name(at), "data-value": value, "aria-selected": String(value === chosen), "aria-disabled": String(Boolean(disabled)), title: title ?? "", class: at === active ? "active" : "", onclick: (event) => pick(event, at) }, text)),
    );
    if (active >= 0) button.setAttribute("aria-activedescendant", name(active));
    else button.removeAttribute("aria-activedescendant");
  }

  async function show() {
    await onopen();
    closeChoice();
    open = mine;
    active = Math.max(0, place());
    button.setAttribute("aria-expanded", "true");
    list.hidden = false;
    draw();
    list.children[active]?.scrollIntoView({ block: "nearest" });
  }

  function close() {
    if (open === mine) open = null;
    active = -1;
    button.setAttribute("aria-expanded", "false");
    list.hidden = true;
    draw();
  }

  function pick(event, at) {
    // A label around it would click the button again.
    event.preventDefault();
    if (!all[at] || all[at].disabled) return;
    const changed = all[at].value !== chosen;
    chosen = all[at].value;
    close();
    button.focus();
    if (changed) root.dispatchEvent(new Event("change"));
  }

  function move(to) {
    active = Math.min(all.length - 1, Math.max(0, to));
    draw();
    list.children[active]?.scrollIntoView({ block: "nearest" });
  }

  button.addEventListener("keydown", (event) => {
    const isOpen = open === mine;
    const to = { ArrowDown: active + 1, ArrowUp: active - 1, Home: 0, End: all.length - 1 }[event.key];
    if (!isOpen && (event.key === "ArrowDown" || event.key === "ArrowUp")) show();
    else if (isOpen && to !== undefined) move(to);
    else if (isOpen && event.key === "Enter") pick(event, active);
    else {
      if (isOpen && event.key === "Tab") close();
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  });
  // The focus has moved elsewhere.
  button.addEventListener("blur", () => setTimeout(() => open === mine && !root.contains(document.activeElement) && close()));
  // A press in the list does not move the focus.
  list.addEventListener("pointerdown", (event) => event.preventDefault());

  root.offer = (options) => {
    all = options;
    if (place() < 0) chosen = all.find((option) => !option.disabled)?.value ?? "";
    draw();
  };
  Object.defineProperty(root, "value", {
    get: () => chosen,
    set: (value) => {
      chosen = value;
      draw();
    },
  });
  Object.defineProperty(root, "disabled", { get: () => button.disabled, set: (off) => (button.disabled = off) });
  if (value !== undefined) chosen = value;
  root.offer(options);
  return root;
}
