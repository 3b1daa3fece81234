// The Trace view by identifier: a line for each COB-ID, with how often it comes and what it said last.

import { h, number, setText } from "./dom.js";
import { ORDERS, addIdentifiers, periodOf } from "./trace_sum.js";

const COLUMNS = ["COB-ID", "From", "What", "Frames", "Period (ms)", "Shortest to longest", "Last (s)", "Bytes", "In words"];

/** `choose` is called with the COB-ID of a row that is pressed. */
export function identifierTable(choose) {
  const body = h("tbody");
  const order = { by: "id" };
  const sorted = { "COB-ID": "id", Frames: "count", "Period (ms)": "period" };
  const heads = COLUMNS.map((title) => h("th", { scope: "col" }, sorted[title] ? h("button", { type: "button", class: "plain", onclick: () => sortBy(sorted[title]) }, title) : title));
  const table = h("table", { class: "identifiers" }, h("thead", {}, h("tr", {}, ...heads)), body);
  const known = new Map();
  const rows = new Map();

  function sortBy(by) {
    order.by = by;
    draw();
  }

  function row(id) {
    const cells = COLUMNS.map((title) => h("td", { "data-label": title }));
    const press = h("button", { type: "button", class: "plain", title: "Its lines", onclick: () => choose(id) }, id);
    cells[0].append(press);
    const element = h("tr", { "data-id": id }, ...cells);
    rows.set(id, { element, cells });
    return rows.get(id);
  }

  function draw() {
    for (const one of known.values()) {
      const { cells } = rows.get(one.id) ?? row(one.id);
      const { last, least_ms, most_ms, count } = one;
      const range = least_ms === null ? "–" : `${number(least_ms, 2)} to ${number(most_ms, 2)}`;
      const texts = [last.from, last.kind, String(count), number(periodOf(one), 2), range, number(last.at_s, 3), last.data, last.text];
      texts.forEach((text, at) => setText(cells[at + 1], text));
    }
    const all = [...known.values()].sort((one, other) => ORDERS[order.by](one, other) || ORDERS.id(one, other));
    const elements = all.map(({ id }) => rows.get(id).element);
    // Rows that stay where they are keep the focus.
    if (elements.some((element, at) => body.children[at] !== element) || body.children.length !== elements.length) body.replaceChildren(...elements);
    heads.forEach((head, at) => head.setAttribute("aria-sort", sorted[COLUMNS[at]] === order.by ? (order.by === "count" ? "descending" : "ascending") : "none"));
  }

  return {
    root: table,
    add(part) {
      addIdentifiers(known, part);
      draw();
    },
    clear() {
      known.clear();
      rows.clear();
      draw();
    },
    size: () => known.size,
  };
}
