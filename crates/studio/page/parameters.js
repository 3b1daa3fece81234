// The Parameters view: every object of the drive's description, read when it is in view; changed, compared with a file,
// backed up and restored, in transactions of the studio.

import { ask, inControl } from "./link.js";
import { count, h, setText, toggle } from "./dom.js";
import { chooser } from "./drive.js";
import { helped } from "./help.js";
import { parameterFile } from "./parameter_file.js";

/** Period at which an open group is read again. */
const REFRESH_MS = 2000;
/** Objects per request. */
const AT_ONCE = 32;
/** The most rows that a search shows. */
const MOST_FOUND = 100;

export function parametersView(shared, report) {
  const choose = chooser(shared);
  const search = h("input", { type: "search", id: "parameters-search", placeholder: "Index, name or text", "aria-label": "Search objects", oninput: draw });
  const changed = toggle("parameters-changed", "changed only", false, () => draw());
  const all = h("button", { type: "button", id: "parameters-read", onclick: readAll }, "Read all");
  const store = h("button", { type: "button", id: "parameters-store", title: "Keep the parameters over a restart", onclick: () => keep() }, "Store in the drive");
  const back = h("button", { type: "button", id: "parameters-back", onclick: rollBack }, "Roll back");
  const progress = h("progress", { hidden: true, max: 1, value: 0 });
  const about = h("p", { class: "quiet", role: "status" });
  const list = h("div", { class: "parameters-list" });
  const file = parameterFile({ node: () => node, report, mark: (bytes) => ((fileBytes = bytes), draw()), written: refreshAll });
  const root = h(
    "section",
    { class: "parameters" },
    h("div", { class: "bar" }, choose.root, search, changed, all, progress, back, store),
    about,
    file.root,
    list,
  );

  let node = null;
  let model = null;
  let objects = [];
  let values = new Map();
  let fileBytes = new Map();
  let open = new Set();
  let chosen = null;
  let reading = false;
  let asked_at = 0;
  let shownRows = [];

  async function fetchObjects(of, name) {
    [node, model, objects, values, fileBytes, open, chosen] = [of, name, [], new Map(), new Map(), new Set(), null];
    file.clear();
    setText(about, "Loading the description …");
    draw();
    const answer = await ask({ do: "objects", node: of });
    if (node !== of || model !== name) return;
    if (answer.ok) {
      objects = answer.result.objects;
      setText(about, `${objects.length} objects of the ${answer.result.model}, from: ${answer.result.manual}. Open a group to read its values.`);
    } else setText(about, answer.error.message);
    draw();
  }

  /** Reads these, a few at a time; true if all were read. */
  async function read(rows, step = (_) => {}) {
    const [of, wanted] = [node, rows.filter((row) => row.readable)];
    for (let from = 0; from < wanted.length; from += AT_ONCE) {
      const some = wanted.slice(from, from + AT_ONCE);
      const answer = await ask({ do: "read_objects", node: of, objects: some.map((row) => row.object) });
      if (node !== of) return false;
      if (!answer.ok) {
        setText(about, answer.error.message);
        return false;
      }
      for (const value of answer.result.values) values.set(value.object, value);
      for (const row of some) row.show?.();
      step((from + some.length) / wanted.length);
    }
    return true;
  }

  async function readAll() {
    all.disabled = true;
    progress.hidden = false;
    await read(objects, (part) => (progress.value = part));
    all.disabled = false;
    progress.hidden = true;
    draw();
  }

  async function refresh() {
    if (reading) return;
    reading = true;
    asked_at = performance.now();
    await read(shownRows);
    reading = false;
  }

  async function refreshAll() {
    await read(objects.filter((row) => values.has(row.object)));
    draw();
  }

  async function keep() {
    const of = node;
    const answer = report(`Node ${of}: Store`, await ask({ do: "store", node: of }));
    if (answer.ok) report("Store", { ok: true, notes: [`node ${of} stored its parameters`] });
  }

  async function rollBack() {
    const of = node;
    const answer = report("Roll back", await ask({ do: "roll_back", node: of }));
    if (answer.ok) report("Roll back", { ok: true, notes: [`node ${of}: ${count(answer.result.steps.length, "write")} undone`] });
    if (node === of) refreshAll();
  }

  const isChanged = (row) => row.parameter && values.get(row.object)?.is_default === false;
  const isOther = (row) => {
    const bytes = fileBytes.get(row.object);
    return bytes !== undefined && values.get(row.object)?.bytes !== undefined && values.get(row.object).bytes !== bytes;
  };
  const words = (row) => `${row.object} ${row.name} ${row.title} ${row.meanings.map(([, text]) => text).join(" ")}`.toLowerCase();

  function draw() {
    const sought = search.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    const filtered = objects.filter((row) => sought.every((word) => words(row).includes(word)) && (!changed.checked || isChanged(row)));
    shownRows = [];
    if (sought.length || changed.checked) {
      const some = filtered.slice(0, MOST_FOUND);
      const more = filtered.length > some.length ? `, the first ${some.length}` : "";
      const unread = changed.checked ? " Only values that were read can be compared: press Read all." : "";
      list.replaceChildren(h("p", { class: "quiet" }, `${filtered.length} ${filtered.length === 1 ? "object" : "objects"}${more}.${unread}`), table(some));
    } else {
      const groups = [...new Set(objects.map((row) => row.group))];
      list.replaceChildren(...groups.map((group) => groupOf(group, objects.filter((row) => row.group === group))));
    }
    asked_at = 0;
  }

  function groupOf(name, rows) {
    const body = h("div");
    const many = rows.filter(isChanged).length;
    const details = h("details", { class: "group", open: open.has(name) }, h("summary", {}, `${name} (${rows.length})${many ? ` · ${many} changed` : ""}`), body);
    if (open.has(name)) body.append(table(rows));
    details.addEventListener("toggle", () => {
      if (details.open === open.has(name)) return;
      if (details.open) open.add(name);
      else open.delete(name);
      draw();
    });
    return details;
  }

  function table(rows) {
    const body = h("tbody");
    for (const row of rows) {
      shownRows.push(row);
      body.append(line(row));
      if (chosen === row.object) body.append(h("tr", { class: "chosen" }, h("td", { colspan: 7 }, detail(row))));
    }
    const heads = ["Object", "Name", "Value", "One count", "Default", "Range", "Access"];
    return h("table", {}, h("thead", {}, h("tr", {}, ...heads.map((head) => h("th", {}, head)))), body);
  }

  function line(row) {
    const value = h("span");
    // A parameter is changed in its row.
    const edits = row.parameter && chosen === row.object ? form(row) : null;
    const range = row.range ? `${row.range}${row.range_times ? ` × ${row.range_times}` : ""}` : "";
    const of = h(
      "tr",
      { tabindex: "0", "data-object": row.object, onclick: (event) => event.target.closest("form") || choose_row(row), onkeydown: (event) => event.key === "Enter" && event.target === of && choose_row(row) },
      h("td", { "data-label": "Object" }, row.object),
      h("td", { "data-label": "Name" }, row.name),
      h("td", { "data-label": "Value" }, value, edits),
      h("td", { "data-label": "One count" }, row.unit || "–"),
      h("td", { "data-label": "Default" }, row.default ?? "–"),
      h("td", { "data-label": "Range" }, range),
      h("td", { "data-label": "Access" }, `${row.access}${row.kept ? ", kept" : ""}`),
    );
    helped(of, "object", row.object, node);
    row.show = () => {
      const known = values.get(row.object);
      setText(value, known ? (known.text ?? `refused: ${known.refused}`) : row.readable ? "…" : "–");
      of.classList.toggle("changed", isChanged(row));
      of.classList.toggle("other", isOther(row));
      of.title = `${isChanged(row) ? "Not the default. " : ""}${isOther(row) ? "Differs from the file." : ""}`;
    };
    row.show();
    return of;
  }

  function choose_row(row) {
    chosen = chosen === row.object ? null : row.object;
    draw();
    list.querySelector("#parameter-value")?.focus();
  }

  /** The description of an object, and the form that changes it. */
  function detail(row) {
    const terms = [
      ["Name in the manual", row.title],
      ["Type", row.type],
      ["Values", row.meanings.map(([value, text]) => `${value}: ${text}`).join("; ")],
    ].filter(([, text]) => text);
    const bytes = h("dd");
    const facts = h("dl", {}, ...terms.flatMap(([term, text]) => [h("dt", {}, term), h("dd", {}, text)]), h("dt", {}, "Bytes on the wire"), bytes);
    const show_line = row.show;
    row.show = () => {
      show_line();
      setText(bytes, values.get(row.object)?.bytes ?? "–");
    };
    row.show();
    return h("div", {}, facts, row.parameter ? null : h("p", { class: "quiet" }, refusal(row)));
  }

  const refusal = (row) =>
    row.access === "ro" || row.access === "const"
      ? "Read-only."
      : "A command or a set-point: not written here. Use the Motion view to move the drive.";

  function form(row) {
    const input = h("input", { id: "parameter-value", size: "16", autocomplete: "off", "aria-label": `New value of ${row.name}`, placeholder: row.unit ? "number, or with unit" : "number" });
    const notice = h("span", { role: "status", id: "parameter-notice" });
    const write = h("button", { type: "submit", id: "parameter-write", class: "primary", title: inControl() ? "" : "Take control first" }, "Write");
    const submit = async (event) => {
      event.preventDefault();
      const of = node;
      write.disabled = true;
      const answer = await ask({ do: "write_parameters", node: of, values: [{ object: row.object, value: input.value.trim() }] });
      write.disabled = false;
      if (node !== of) return;
      await read([row]);
      notice.className = answer.ok ? "good" : "bad";
      setText(notice, answer.ok ? outcome(answer.result) : answer.error.message);
    };
    return h("form", { class: "bar in-row", onsubmit: submit }, input, write, notice);
  }

  function outcome(result) {
    if (!result.steps.length) return "Nothing written: the drive has this value already.";
    const rounded = result.rounded.map((found) => ` The drive rounded ${found.asked} to ${found.found}.`).join("");
    return `Written and read back.${rounded} The value is in effect; store it in the drive unless it stores by itself.`;
  }

  function update(state) {
    choose.update(state);
    const found = state.nodes.find((known) => known.node === shared.node);
    const name = found?.model ?? null;
    if (shared.node !== node || name !== model) fetchObjects(shared.node, name);
    back.disabled = store.disabled = !inControl();
    back.title = inControl() ? "Undo the last write" : "Take control first";
    file.update();
    if (shownRows.length && performance.now() - asked_at > REFRESH_MS) refresh();
  }

  return { root, update };
}
