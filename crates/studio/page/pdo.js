// The PDO view: the configuration of each PDO of a drive and why it is not sent; changes are made in drafts, shown with what they would
// write and do to the bus, and applied together or not at all.

import { ask, inControl } from "./link.js";
import { h, hex, number, setText } from "./dom.js";
import { chooser } from "./drive.js";
import { pdoEditor } from "./pdo_editor.js";
import { pdoPlan } from "./pdo_plan.js";

const COLUMNS = ["PDO", "COB-ID", "When", "Inhibit", "Event timer", "Carries", "Bits", "Why it is not sent", ""];
/** Why a PDO is not sent changes with the bus. All PDOs of a drive are about sixty objects to read. */
const REFRESH_MS = 5000;

const ms = (time) => (time === null ? "–" : `${number(time, time % 1 ? 1 : 0)} ms`);

/** The request for a draft: unchanged fields are omitted. */
const asked = (draft, now) => {
  const request = { pdo: draft.pdo, valid: draft.valid };
  if (JSON.stringify(draft.objects) !== JSON.stringify(now.objects)) request.objects = draft.objects.map(({ object, bits }) => ({ object, bits }));
  for (const field of ["transmission", "inhibit_ms", "event_ms", "id"]) if (draft[field] !== now[field]) request[field] = draft[field];
  return request;
};

const differs = (draft, now) => draft.valid !== now.valid || Object.keys(asked(draft, now)).length > 2;

export function pdoView(shared, report) {
  const choose = chooser(shared);
  const about = h("p", { class: "quiet", role: "status" });
  const nmt = h("button", { type: "button", id: "pdo-nmt", onclick: command });
  const undo = h("button", { type: "button", id: "pdo-undo", onclick: goBack }, "Undo the last change");
  const store = h("button", { type: "button", id: "pdo-store", title: "Keep the parameters over a restart", onclick: keep }, "Store in the drive");
  const rows = h("tbody");
  const table = h("table", { class: "pdos" }, h("thead", {}, h("tr", {}, ...COLUMNS.map((title) => (title === "" ? h("td") : h("th", { scope: "col" }, title))))), rows);
  const place = h("div");
  const plan = pdoPlan({ write, forget: forgetAll });
  const root = h("section", { class: "pdo" }, h("div", { class: "bar" }, choose.root, nmt, undo, store), about, table, place, plan.root);

  let node = null;
  let model = null;
  let seen_pdos = null;
  let objects = null;
  let drafts = new Map();
  let open = null;
  let seen = "";
  let asked_at = 0;
  /** The node that is being read. */
  let reading = null;
  let shownKey = "";

  const now = (name) => seen_pdos?.pdos.find((pdo) => pdo.pdo === name);
  const changes = () => [...drafts.values()].filter((draft) => differs(draft, now(draft.pdo))).map((draft) => asked(draft, now(draft.pdo)));

  async function fetchPdos() {
    if (reading === node) return;
    const of = node;
    [reading, asked_at] = [of, performance.now()];
    const answer = await ask({ do: "pdos", node: of });
    if (reading === of) reading = null;
    if (node !== of) return;
    if (!answer.ok) return setText(about, answer.error.message);
    const untouched = [...drafts].filter(([name, draft]) => now(name) && !differs(draft, now(name)));
    seen_pdos = answer.result;
    plan.know(seen_pdos.bitrate);
    for (const name of [...drafts.keys()]) if (!now(name)) drafts.delete(name);
    // An unchanged draft follows what other clients write.
    for (const [name, draft] of untouched) {
      if (!now(name) || !differs(draft, now(name))) continue;
      drafts.delete(name);
      if (open !== name) continue;
      open = null;
      show(name);
    }
    draw();
  }

  async function begin(of, name) {
    [node, model, seen_pdos, objects, drafts, open, shownKey] = [of, name, null, null, new Map(), null, ""];
    asked_at = performance.now();
    rows.replaceChildren();
    place.replaceChildren();
    plan.clear();
    setText(about, of === null ? "No drive found." : "Reading the PDOs …");
    if (of === null) return;
    if (name !== null) {
      const answer = await ask({ do: "objects", node: of });
      if (node !== of || model !== name) return;
      if (answer.ok) objects = answer.result.objects;
    }
    await fetchPdos();
  }

  function draw() {
    const known = seen_pdos.model ? "" : " Its model is unknown: its PDOs can be read, not changed.";
    const sync = seen_pdos.sync_heard === false ? " No SYNC on the bus." : "";
    setText(about, `${seen_pdos.pdos.length} PDOs, numbered as in CiA 301. NMT state: ${seen_pdos.nmt ?? "unknown"}.${sync}${known}`);
    const key = JSON.stringify([seen_pdos, [...drafts], open]);
    if (key === shownKey) return;
    shownKey = key;
    rows.replaceChildren(...seen_pdos.pdos.map(row));
  }

  function row(pdo) {
    const draft = drafts.get(pdo.pdo);
    const changed = draft && differs(draft, pdo);
    const edit = h("button", { type: "button", "data-edit": pdo.pdo, disabled: pdo.takes === null, title: pdo.takes === null ? "Its model is unknown" : "", onclick: () => show(pdo.pdo) }, open === pdo.pdo ? "Close" : "Change");
    const cells = [
      h("span", {}, h("b", {}, pdo.pdo), pdo.manual ? h("span", { class: "quiet" }, ` (manual: ${pdo.manual})`) : null),
      pdo.valid ? hex(pdo.id, 3) : `${hex(pdo.id, 3)}, off`,
      `${pdo.when} (${pdo.transmission})`,
      ms(pdo.inhibit_ms),
      ms(pdo.event_ms),
      pdo.objects.map(({ object, name, bits }) => `${object} ${name ?? ""} (${bits})`).join(", ") || "nothing",
      String(pdo.bits),
      pdo.silent.join("; "),
      edit,
    ];
    return h("tr", { "data-pdo": pdo.pdo, class: changed ? "changed" : "" }, ...cells.map((cell, at) => h("td", { "data-label": COLUMNS[at] }, cell)));
  }

  /** Opens the editor of a PDO, or closes it. */
  function show(name) {
    open = open === name ? null : name;
    place.replaceChildren();
    if (open) {
      const draft = drafts.get(open) ?? structuredClone(now(open));
      drafts.set(open, draft);
      const editor = pdoEditor({ draft, objects: objects ?? [], node, changed: again });
      place.append(editor.root);
      editor.root.scrollIntoView({ block: "nearest" });
    }
    draw();
  }

  function again() {
    draw();
    plan.plan(node, changes());
  }

  function forgetAll() {
    drafts = new Map();
    open = null;
    place.replaceChildren();
    plan.clear();
    draw();
  }

  async function write() {
    const [of, wanted] = [node, changes()];
    const answer = report(`Node ${of}: PDOs`, await ask({ do: "write_pdos", node: of, pdos: wanted }));
    if (node !== of) return answer;
    if (answer.ok) {
      forgetAll();
      const rounded = answer.result.rounded.map(({ object, asked, found }) => ` The drive rounded ${asked} to ${found} (${object}).`).join("");
      plan.notify("good", `${wanted.map((pdo) => pdo.pdo).join(", ")}: written and read back.${rounded} The change is in effect; ${seen_pdos.can_store ? "Store in the drive keeps it over a restart." : "it is lost when the supply is switched off."}`);
    }
    await fetchPdos();
    return answer;
  }

  async function goBack() {
    const of = node;
    const answer = report(`Node ${of}: Undo`, await ask({ do: "roll_back", node: of }));
    if (node !== of) return;
    if (answer.ok) {
      forgetAll();
      plan.notify("good", "The PDOs are back as before the last change.");
    } else plan.notify("bad", answer.error.message);
    await fetchPdos();
  }

  async function keep() {
    const of = node;
    const answer = report(`Node ${of}: Store`, await ask({ do: "store", node: of }));
    if (answer.ok) report("Store", { ok: true, notes: [`node ${of} stored its parameters`] });
  }

  async function command() {
    report(`Node ${node}: NMT`, await ask({ do: "nmt", node, command: seen_pdos?.nmt === "operational" ? "pre_operational" : "start" }));
    setTimeout(fetchPdos, 300);
  }

  function update(state) {
    choose.update(state);
    const found = state.nodes.find((known) => known.node === shared.node);
    const name = found?.model ?? null;
    if (shared.node !== node || name !== model) begin(shared.node, name);
    // Another client wrote, or the node has changed its state; and once more where they could not be read.
    const key = `${node} ${found?.can_roll_back} ${found?.mapped} ${found?.nmt}`;
    if (node !== null && ((seen_pdos && key !== seen) || performance.now() - asked_at > REFRESH_MS)) fetchPdos();
    seen = key;
    const mine = inControl();
    const moves = Boolean(found?.moving || found?.doing);
    setText(nmt, seen_pdos?.nmt === "operational" ? "To pre-operational" : "Start the node (NMT)");
    nmt.disabled = !mine || !seen_pdos || (seen_pdos.nmt === "operational" && moves);
    undo.disabled = !mine || !seen_pdos?.can_undo;
    undo.title = mine ? (seen_pdos?.can_undo ? "" : "The last write was not a change of PDOs") : "Take control first";
    store.disabled = !mine || !seen_pdos?.can_store;
    plan.update(mine);
  }

  function hide() {
    // The next view reads again.
    asked_at = 0;
  }

  return { root, update, hide };
}
