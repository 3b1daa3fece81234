// The report of a node: one page of HTML, made by the studio, saved by the browser.

import { h, setText } from "./dom.js";
import { ask } from "./link.js";
import { kept, keep } from "./settings.js";

/** A button with the name of who makes the report, and what came of it. */
export function reportBar(shared) {
  const by = h("input", { id: "report-by", size: "16", maxlength: "100", placeholder: "made by", "aria-label": "Who makes the report", value: String(kept("report-by", "")), onchange: () => keep("report-by", by.value) });
  const status = h("span", { class: "quiet", role: "status", id: "report-status" });
  const button = h("button", { type: "button", id: "report", title: "Identity, what differs from delivery, limits, guard, faults, PDOs and fast captures, as one page that prints", onclick: make }, "Save a report");

  async function make() {
    button.disabled = true;
    setText(status, "reading the drive …");
    const at = `${new Date().toISOString().slice(0, 16).replace("T", " ")} UTC`;
    const answer = await ask({ do: "report", node: shared.node, at, by: by.value });
    button.disabled = false;
    if (!answer.ok) return setText(status, answer.error.message);
    const { file, html } = answer.result;
    const url = URL.createObjectURL(new Blob([html], { type: "text/html" }));
    h("a", { href: url, download: file }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
    setText(status, `saved as ${file}`);
  }

  return h("div", { class: "bar" }, by, button, status);
}
