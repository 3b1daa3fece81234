// The editor of one PDO in the PDO view: its mapped objects, in order, within 64 bits; its transmission; its identifier. It
// changes the draft that it was given and calls back; what the drive does not let a client change is grey, with the reason.

import { choice } from "./choice.js";
import { h, setText, toggle } from "./dom.js";
import { helped, pointed } from "./help.js";

const BITS = 64;
const MOST_FOUND = 12;

/** `objects` are the rows of the drive's description; `changed` is called after each change of `draft`. */
export function pdoEditor({ draft, objects, node, changed }) {
  const { takes } = draft;
  const direction = draft.pdo.startsWith("R") ? "rpdo" : "tpdo";
  const fixed = takes.mapping;
  const bar = h("div", { class: "bit-bar", role: "img" });
  const budget = h("p", { class: "quiet", role: "status", id: "pdo-bits" });
  const list = h("ol", { class: "mapped", "aria-label": "Objects in order; Alt and the arrow keys move one, Delete removes it", onpointerdown: grasp, onpointermove: carry, onpointerup: letGo, onpointercancel: letGo });
  const search = h("input", { type: "search", id: "pdo-search", placeholder: "Index, name or text", "aria-label": "Search for an object to map", autocomplete: "off", oninput: find, onkeydown: (event) => event.key === "Enter" && found.querySelector("button:not([disabled])")?.click() });
  const found = h("ul", { class: "found" });
  /** The index of the object that the pointer drags; null for none. */
  let carried = null;

  const bits = () => draft.objects.reduce((all, { bits }) => all + bits, 0);

  /** Why an object cannot be added; null if it can. */
  function refusal(row) {
    if (typeof row[direction] === "string") return row[direction];
    if (draft.objects.length >= takes.objects) return `at most ${takes.objects} objects`;
    const free = BITS - bits();
    return row[direction] > free ? `${row[direction]} bits, ${free} free` : null;
  }

  function find() {
    const sought = search.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    const words = (row) => `${row.object} ${row.name} ${row.title}`.toLowerCase();
    const fits = (row) => typeof row[direction] === "number";
    // Without a search, what may be mapped; with one, also what may not, and why.
    const rows = objects.filter((row) => (sought.length ? sought.every((word) => words(row).includes(word)) : fits(row)));
    const first = [...rows].sort((one, other) => Number(fits(other)) - Number(fits(one)));
    found.replaceChildren(...first.slice(0, MOST_FOUND).map(offer), rows.length > MOST_FOUND ? h("li", { class: "quiet" }, `and ${rows.length - MOST_FOUND} more`) : "");
  }

  function offer(row) {
    const why = refusal(row);
    const add = h("button", { type: "button", "data-add": row.object, disabled: why !== null, title: why ?? row.title, onclick: () => put(row) }, `+ ${row.object} ${row.name}${typeof row[direction] === "number" ? ` (${row[direction]})` : ""}`);
    const line = h("li", {}, add, why === null ? null : h("span", { class: "quiet" }, ` ${why}`));
    return pointed(line, "object", row.object, node);
  }

  function put(row) {
    draft.objects.push({ object: row.object, name: row.name, bits: row[direction] });
    drawMap();
    changed();
  }

  /** Moves an object in the order; the focus stays where it is. */
  function move(from, to) {
    if (to < 0 || to >= draft.objects.length || from === to) return;
    draft.objects.splice(to, 0, ...draft.objects.splice(from, 1));
    drawMap();
    list.children[to].focus();
    changed();
  }

  function remove(at) {
    draft.objects.splice(at, 1);
    drawMap();
    (list.children[Math.min(at, draft.objects.length - 1)] ?? search).focus();
    changed();
  }

  const places = () => [...list.children];

  /** By pointer events instead of the browser's dragging, which touch does not start. */
  function grasp(event) {
    const place = places().indexOf(event.target.closest("li"));
    if (fixed !== null || place < 0 || event.target.closest("button")) return;
    carried = place;
    // The lines are redrawn while dragging.
    list.setPointerCapture(event.pointerId);
  }

  function carry(event) {
    if (carried === null) return;
    const over = places().findIndex((place) => event.clientY < place.getBoundingClientRect().bottom);
    const to = over < 0 ? places().length - 1 : over;
    if (to === carried) return;
    move(carried, to);
    carried = to;
  }

  function letGo() {
    carried = null;
  }

  function key(event, at) {
    if (event.target !== event.currentTarget || fixed !== null) return;
    if (event.altKey && event.key === "ArrowUp") move(at, at - 1);
    else if (event.altKey && event.key === "ArrowDown") move(at, at + 1);
    else if (event.key === "Delete") remove(at);
    else return;
    event.preventDefault();
  }

  function line({ object, name, bits }, at) {
    const button = (text, title, act, off) => h("button", { type: "button", title, "aria-label": `${title}: ${object}`, disabled: off || fixed !== null, onclick: act }, text);
    const last = draft.objects.length - 1;
    const of = h(
      "li",
      { tabindex: "0", "data-mapped": object, class: `field-${at % 8}`, onkeydown: (event) => key(event, at) },
      h("span", { class: "grow" }, `${object} ${name ?? ""} `, h("span", { class: "quiet" }, `${bits} bits`)),
      button("↑", "Earlier", () => move(at, at - 1), at === 0),
      button("↓", "Later", () => move(at, at + 1), at === last),
      button("×", "Remove", () => remove(at), false),
    );
    return helped(of, "object", object, node);
  }

  /** A part of the bar, with a width in proportion to its bits. */
  function field(bits, kind, title, text) {
    const element = h("div", { class: `field ${kind}`, title }, text);
    element.style.flexGrow = String(bits);
    return element;
  }

  function drawMap() {
    const free = BITS - bits();
    list.replaceChildren(...draft.objects.map(line));
    bar.replaceChildren(
      ...draft.objects.map(({ object, name, bits }, at) => field(bits, `field-${at % 8}`, `${object} ${name ?? ""}: ${bits} bits`, name ?? object)),
      ...(free > 0 ? [field(free, "free", `${free} bits are free`, `${free} free`)] : []),
    );
    const words = `${bits()} of ${BITS} bits, ${draft.objects.length} of ${takes.objects} objects`;
    bar.setAttribute("aria-label", words);
    setText(budget, words);
    find();
  }

  function numberField(id, label, value, why, properties, set) {
    const input = h("input", { id, type: "number", disabled: why !== null, title: why ?? "", value: value ?? "", ...properties });
    input.addEventListener("input", () => {
      if (input.value === "" || !input.validity.valid) return;
      set(Number(input.value));
      changed();
    });
    return h("label", {}, `${label} `, input, why === null ? null : h("small", { class: "quiet" }, ` ${why}`));
  }

  /** A choice of the transmission types; a range of types has a number field beside it. */
  function typeField() {
    const same = (type) => draft.transmission >= type.from && draft.transmission <= type.to;
    const title = (type) => `${type.from === type.to ? type.from : `${type.from} to ${type.to}`}: ${type.words}${type.why_not ? ` (${type.why_not})` : ""}`;
    const options = takes.types.map((type, at) => ({ value: String(at), text: title(type), disabled: type.why_not !== null }));
    const known = takes.types.findIndex(same);
    const unknown = known >= 0 ? [] : [{ value: "", text: `${draft.transmission}: not defined in CiA 301` }];
    const select = choice("pdo-type", "Transmission type", [...unknown, ...options], { value: known >= 0 ? String(known) : "" });
    select.disabled = takes.type !== null;
    select.title = takes.type ?? "";
    const each = h("input", { id: "pdo-each", type: "number", "aria-label": "Transmission type", disabled: takes.type !== null });
    const range = () => {
      const type = takes.types[Number(select.value)];
      each.hidden = select.value === "" || type.from === type.to;
      [each.min, each.max, each.value] = [type?.from, type?.to, draft.transmission];
    };
    select.addEventListener("change", () => {
      const type = takes.types[Number(select.value)];
      if (select.value === "") return;
      if (!same(type)) draft.transmission = type.from;
      range();
      changed();
    });
    each.addEventListener("input", () => {
      if (each.value === "" || !each.validity.valid) return;
      draft.transmission = Number(each.value);
      changed();
    });
    range();
    return h("span", {}, "Transmission type ", select, " ", each);
  }

  function identifier() {
    const input = h("input", { id: "pdo-id", size: "5", value: draft.id.toString(16).toUpperCase(), pattern: "[0-9A-Fa-f]{1,3}", title: takes.id ?? "Hexadecimal, 11 bits", disabled: takes.id !== null, autocomplete: "off" });
    input.addEventListener("input", () => {
      if (input.value === "" || !input.validity.valid) return;
      draft.id = Number.parseInt(input.value, 16);
      changed();
    });
    return h("label", {}, "COB-ID ", input, " h");
  }

  function switched() {
    const box = toggle(
      "pdo-valid",
      "on",
      draft.valid,
      () => {
        draft.valid = box.checked;
        changed();
      },
      { disabled: takes.id !== null, title: takes.id ?? "Bit 31 of its COB-ID" },
    );
    return box;
  }

  const time = (field, label, { why_not, step_ms, most_ms }) =>
    numberField(`pdo-${field}`, `${label} (ms)`, draft[field], why_not, { min: "0", max: String(most_ms), step: String(step_ms) }, (value) => (draft[field] = value));

  const root = h(
    "section",
    { class: "tile pdo-editor", "aria-label": `Change ${draft.pdo}` },
    h("h3", {}, `${draft.pdo}${draft.manual ? `; ${draft.manual} in the manual` : ""}`),
    fixed === null ? null : h("p", { class: "quiet", id: "pdo-fixed" }, `${fixed[0].toUpperCase()}${fixed.slice(1)}.`),
    bar,
    budget,
    h("div", { class: "columns" }, h("div", {}, list), fixed === null ? h("div", {}, search, found) : null),
    h("div", { class: "bar settings" }, switched(), identifier(), typeField(), time("inhibit_ms", "Inhibit time", takes.inhibit), time("event_ms", "Event timer", takes.event)),
  );
  drawMap();
  return { root };
}
