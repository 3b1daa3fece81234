// Parameter files in the Parameters view: backup, three-way comparison, and applying a file after its dry run.

import { ask, inControl } from "./link.js";
import { count, h, setText, table } from "./dom.js";
import { request } from "./transport.js";

/** A message may have 64 KiB, and a character of the file may take two bytes of it. */
const LARGEST = 30000;
/** The largest file that is read, in bytes. */
const LARGEST_FILE = 2 ** 20;

/** `node` gives the chosen drive; `mark` takes the values of a file; `written` is called after a write. */
export function parameterFile({ node, report, mark, written }) {
  const backups = ["toml", "dcf"].map((form) =>
    h("button", { type: "button", id: form === "toml" ? "parameters-backup" : "parameters-backup-dcf", onclick: () => save(form) }, form === "toml" ? "Back up" : "Back up as DCF"),
  );
  const input = h("input", { type: "file", id: "parameters-file", accept: ".toml,.dcf", "aria-label": "Parameter file", onchange: load });
  const dry = h("button", { type: "button", id: "parameters-plan", onclick: plan, disabled: true }, "Dry run");
  const apply = h("button", { type: "button", id: "parameters-apply", class: "primary", onclick: write, hidden: true }, "Write all");
  const notice = h("p", { role: "status", id: "parameters-notice" });
  const shown = h("div", { class: "parameters-diff" });
  const root = h("div", {}, h("div", { class: "bar" }, ...backups, h("label", {}, "File ", input), dry, apply), notice, shown);
  let text = null;

  const fail = (message) => {
    notice.className = "bad";
    setText(notice, message);
  };
  const inform = (message) => {
    notice.className = "quiet";
    setText(notice, message);
  };

  async function save(form) {
    const of = node();
    for (const one of backups) one.disabled = true;
    inform("Reading all parameters …");
    const answer = await ask({ do: "back_up", node: of, form });
    for (const one of backups) one.disabled = false;
    if (!answer.ok) return fail(answer.error.message);
    const name = `node${of}.${form}`;
    const url = URL.createObjectURL(new Blob([answer.result.file], { type: "text/plain" }));
    h("a", { href: url, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
    const refused = answer.result.refused.map((why) => ` Not included: ${why}.`).join("");
    inform(`${name}: ${answer.result.values} values.${refused}`);
  }

  /** The TOML with the values of a DCF, since a DCF is larger than a message may be. */
  async function ofDcf(file) {
    const answer = await request(`/api/parameters.toml?node=${node()}`, { method: "POST", body: file }).catch(() => null);
    if (answer?.ok) return answer.text();
    throw new Error(answer ? ((await answer.json().catch(() => null))?.error?.message ?? `status ${answer.status}`) : "the studio does not answer");
  }

  function forget() {
    text = null;
    dry.disabled = true;
    apply.hidden = true;
    shown.replaceChildren();
    mark(new Map());
  }

  async function load() {
    forget();
    const [chosen] = input.files;
    if (!chosen) return;
    if (chosen.size > LARGEST_FILE) return fail(`${chosen.name} has ${chosen.size} bytes; a parameter file has at most ${LARGEST_FILE}.`);
    const of = node();
    let read;
    try {
      read = await (/\.(dcf|eds)$/i.test(chosen.name) ? ofDcf(chosen) : chosen.text());
    } catch (error) {
      return fail(`${chosen.name}: ${error.message}`);
    }
    if (of !== node()) return;
    if (read.length > LARGEST) return fail(`${chosen.name} has ${read.length} characters; the studio takes at most ${LARGEST}. Use ferrodrive params apply for a larger file.`);
    inform(`Comparing ${chosen.name} with the drive …`);
    const answer = await ask({ do: "compare_parameters", node: of, file: read });
    if (of !== node()) return;
    if (!answer.ok) return fail(`${chosen.name}: ${answer.error.message}`);
    text = read;
    dry.disabled = false;
    const { objects } = answer.result;
    mark(new Map(objects.map((row) => [row.object, row.file_bytes])));
    const differ = objects.filter((row) => !row.drive_is_file || row.file_is_default === false);
    inform(`${chosen.name}: ${objects.length} values; ${objects.filter((row) => !row.drive_is_file).length} differ from the drive.`);
    const cells = (row) => [row.object, row.name ?? "", row.default ?? "–", row.file, row.drive];
    shown.replaceChildren(
      differ.length
        ? table(["Object", "Name", "Default", "File", "Drive"], differ.map((row) => ({ cells: cells(row), kind: row.drive_is_file ? "" : "other" })))
        : h("p", { class: "good" }, "The drive has the values of the file, and all of them are its defaults."),
    );
  }

  async function plan() {
    const answer = await ask({ do: "plan_parameters", node: node(), file: text });
    if (!answer.ok) return fail(answer.error.message);
    const { steps, left } = answer.result;
    apply.hidden = steps.length === 0;
    inform(steps.length ? `${count(steps.length, "write")}, in this order. Nothing has been written.` : "Nothing to write.");
    shown.replaceChildren(
      table(["Object", "Name", "Now", "New", "Purpose"], steps.map((step) => ({ cells: [step.object, step.name ?? "", step.before ?? "?", step.after, step.purpose] }))),
      ...left.map((of) => h("p", { class: "quiet" }, `${of.object} ${of.name ?? ""} is omitted: ${of.why}`)),
    );
  }

  async function write() {
    apply.disabled = true;
    inform("Writing …");
    const answer = await ask({ do: "write_parameters", node: node(), file: text });
    apply.disabled = false;
    if (!answer.ok) fail(answer.error.message);
    else {
      apply.hidden = true;
      inform(`${count(answer.result.steps.length, "write")} done and read back. The values are in effect; store them in the drive unless it stores by itself.`);
      report("Parameters", { ok: true, notes: answer.result.rounded.map((found) => `${found.object}: the drive rounded ${found.asked} to ${found.found}`) });
    }
    written();
  }

  function update() {
    apply.disabled = !inControl();
    apply.title = inControl() ? "" : "Take control first";
  }

  function clear() {
    forget();
    input.value = "";
    setText(notice, "");
  }

  return { root, update, clear };
}
