// The Console view: lines of the command line, carried out by the host as any other command of this page, and what they say.

import { ask, isVirtual, stopAll } from "./link.js";
import { history, stops } from "./console_lines.js";
import { h } from "./dom.js";
import { keep, kept } from "./settings.js";

const KEY = "console-lines";
/** Outputs that are shown. */
const SHOWN = 200;

export function consoleView() {
  const before = kept(KEY, []);
  const past = history(Array.isArray(before) ? before.filter((line) => typeof line === "string") : []);
  const log = h("div", { class: "console-log", id: "console-log", role: "log", tabindex: "0", "aria-label": "What the lines said" });
  const field = h("input", { id: "console-line", "aria-label": "A line of the command line", placeholder: "state 4", spellcheck: "false", autocapitalize: "off", onkeydown: step });
  const form = h("form", { class: "bar console-form", onsubmit: give }, h("span", { "aria-hidden": "true" }, ">"), field, h("button", { id: "console-run" }, "Run"));
  const about = h("p", { class: "quiet", id: "console-about" });
  const root = h("section", { class: "console" }, log, form, about);

  function step(event) {
    const go = { ArrowUp: past.older, ArrowDown: past.newer }[event.key];
    if (!go) return;
    event.preventDefault();
    field.value = go(field.value);
    field.setSelectionRange(field.value.length, field.value.length);
  }

  function append(text, kind) {
    // As text: what a device is called is never markup.
    const element = h("pre", { class: kind }, text);
    log.append(element);
    while (log.childElementCount > SHOWN) log.firstElementChild.remove();
    log.scrollTop = log.scrollHeight;
    return element;
  }

  async function give(event) {
    event.preventDefault();
    const line = field.value.trim();
    if (line === "") return;
    past.add(line);
    keep(KEY, past.lines);
    field.value = "";
    append(`> ${line}`, "typed");
    const said = append("…", "quiet");
    // As the key does: also past a socket that is stuck, and a page with too many lines under way.
    if (stops(line) === "all") stopAll();
    const answer = await ask({ do: "console", line });
    const { text, status } = answer.ok ? answer.result : { text: `error: ${answer.error.message}`, status: 1 };
    said.textContent = text === "" ? "done" : text;
    said.className = status === 0 ? "" : "bad";
    log.scrollTop = log.scrollHeight;
  }

  function update() {
    const space = isVirtual() ? "" : " While something moves, Space is Stop here too.";
    const text = `The words of ferrodrive, without its name and --bus; help lists them, help move describes one. What moves a drive needs control, and is stopped by all that stops this page's motions.${space} Up and Down: lines before.`;
    if (about.textContent !== text) about.textContent = text;
  }
  update();
  return { root, update };
}
