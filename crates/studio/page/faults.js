// The Faults view: what has happened to the drives, what to do about it, and the frames around it. The studio keeps the list, so that
// what happened before this page was opened is there too.

import { h, hex, number, renew, setText, toggle } from "./dom.js";
import { documented, pointed } from "./help.js";
import { buttonsOf } from "./remedy.js";
import { remedyBar } from "./remedy_bar.js";
import { headRow, lineRow } from "./trace.js";
import { request } from "./transport.js";

/** Least time between two requests. */
const ASK_MS = 250;
/** Frames before and after an entry, in seconds. */
const AROUND_S = 0.05;
const COLUMNS = ["Time (s)", "Node", "What", "Code", "In words", "Ended"];
const KINDS = { emcy: "EMCY", fault: "fault", silent: "silent", state: "power state", nmt: "NMT", stop: "stop" };
/** The kinds that have an end. */
const LASTING = ["emcy", "fault", "silent"];

export function faultsView(report) {
  const only = toggle("faults-only", "faults only", false, () => draw());
  const here = h("span", { class: "quiet", role: "status" });
  const list = h("div", { class: "timeline", tabindex: "0", role: "log", "aria-label": "What happened, newest first" });
  const detail = h("div", { class: "fault-detail" });
  const frames = h("div", { class: "around", hidden: true });
  const root = h(
    "section",
    { class: "faults-view" },
    h("div", { class: "bar" }, only, here),
    h("div", { class: "wide" }, h("div", { class: "happening head" }, ...COLUMNS.map((title) => h("span", {}, title))), list),
    detail,
    frames,
  );

  const entries = new Map();
  let revision = 0;
  let oldest = 0;
  let asking = false;
  let asked_at = 0;
  let chosen = null;
  let trouble = null;

  async function ask() {
    asking = true;
    asked_at = performance.now();
    try {
      const answer = await request(`/api/faults?since=${revision}`);
      const news = await answer.json();
      if (!answer.ok) throw new Error(news.error.message);
      [revision, oldest, trouble] = [news.revision, news.oldest, null];
      for (const entry of news.entries) entries.set(entry.number, entry);
      for (const known of entries.keys()) if (known < oldest) entries.delete(known);
    } catch (error) {
      trouble = error.message;
    }
    asking = false;
    draw();
  }

  const over = (entry) => {
    if (!LASTING.includes(entry.kind)) return "";
    const times = entry.count > 1 ? `${entry.count} times, ` : "";
    return `${times}${entry.gone_s === null ? "lasting" : `after ${number(entry.gone_s - entry.at_s, 2)} s`}`;
  };

  function row(entry) {
    const lasts = LASTING.includes(entry.kind) && entry.gone_s === null;
    const cells = [number(entry.at_s, 3), String(entry.node), KINDS[entry.kind], entry.code === null ? "" : hex(entry.code, 4), entry.what, over(entry)];
    const look = () => choose(entry.number);
    const state = { type: "button", class: `happening ${entry.kind}${lasts ? " lasts" : ""}`, "data-number": String(entry.number), onclick: look };
    return explained(h("button", state, ...cells.map((cell) => h("span", {}, cell))), entry);
  }

  /** The help of a row on `?`: its own remedy where a description has one, else what such an entry is. */
  function explained(row, { node, kind, code, what, remedy, source }) {
    if (remedy) return documented(row, { title: `${KINDS[kind]}${code === null ? "" : ` ${hex(code, 4)}`}: ${what}`, text: remedy, source });
    if (kind === "state") return pointed(row, "state", what.split(" → ").at(-1), node);
    if (kind !== "nmt") return pointed(row, "service", kind, node);
    const state = /^NMT state (.*)$/.exec(what)?.[1];
    return state ? pointed(row, "nmt", state, node) : pointed(row, "service", what === "booted" ? "booted" : "alarm", node);
  }

  function draw() {
    const shown = [...entries.values()].filter((entry) => !only.checked || LASTING.includes(entry.kind)).sort((a, b) => b.number - a.number);
    const open = shown.filter((entry) => LASTING.includes(entry.kind) && entry.gone_s === null).length;
    const older = oldest > 0 ? ` The first ${oldest} are no longer kept.` : "";
    setText(here, trouble ?? `${shown.length} shown, ${open} of them still lasting.${older}`);
    const top = list.scrollTop;
    const active = document.activeElement;
    const focused = active instanceof HTMLElement && list.contains(active) ? active.dataset.number : undefined;
    renew(list, `${revision} ${only.checked}`, () => shown.map(row));
    list.scrollTop = top;
    for (const element of list.children) {
      element.setAttribute("aria-pressed", String(element.dataset.number === String(chosen)));
      // Rows that are made anew keep the focus of the one they replace.
      if (element.dataset.number === focused) element.focus({ preventScroll: true });
    }
    explain();
  }

  function explain() {
    const entry = entries.get(chosen);
    if (!entry) return;
    renew(detail, JSON.stringify(entry), () => {
      const code = entry.code === null ? "" : ` ${hex(entry.code, 4)}`;
      const rows = [h("dt", {}, "Cause and remedy"), h("dd", { id: "remedy" }, entry.remedy ?? (LASTING.includes(entry.kind) ? "Not in the drive's description: see its manual." : "Nothing to do."))];
      if (entry.source) rows.push(h("dt", {}, "Source"), h("dd", { id: "fault-source" }, entry.source));
      const lasts = LASTING.includes(entry.kind) && entry.kind !== "silent" && entry.gone_s === null;
      const buttons = lasts ? remedyBar(buttonsOf(`ferrodrive reset ${entry.node}`), report) : null;
      return [h("h2", {}, `Node ${entry.node}: ${KINDS[entry.kind]}${code}, ${entry.what}`), h("dl", {}, ...rows), ...(buttons ? [buttons] : [])];
    });
  }

  list.addEventListener("keydown", (event) => {
    const way = { ArrowDown: "nextElementSibling", ArrowUp: "previousElementSibling" }[event.key];
    const next = way ? event.target.closest(".happening")?.[way] : null;
    if (!next) return;
    event.preventDefault();
    next.focus();
    choose(Number(next.dataset.number));
  });

  async function choose(number_) {
    chosen = number_;
    const entry = entries.get(chosen);
    draw();
    frames.hidden = false;
    frames.replaceChildren(h("p", { class: "quiet" }, "Loading the frames around it …"));
    // The frames after it may still be to come.
    await new Promise((resolve) => setTimeout(resolve, 2 * AROUND_S * 1000));
    const asked = new URLSearchParams({ from_s: Math.max(0, entry.at_s - AROUND_S).toFixed(6), until_s: (entry.at_s + AROUND_S).toFixed(6), count: "2000" });
    let lines = [];
    try {
      const answer = await request(`/api/trace?${asked}`);
      const body = await answer.json();
      if (!answer.ok) throw new Error(body.error.message);
      lines = body.lines;
    } catch (error) {
      frames.replaceChildren(h("p", { class: "bad" }, error.message));
      return;
    }
    if (chosen !== number_) return;
    if (lines.length === 0) {
      frames.replaceChildren(h("p", { class: "quiet" }, "There are no frames of that time, or they are no longer kept."));
      return;
    }
    const rows = lines.map((line) => lineRow(line));
    // The frame that reported it: the last one of the node up to then.
    const at = lines.findLastIndex((line) => line.node === entry.node && line.at_s <= entry.at_s + 1e-6);
    rows[at]?.classList.add("marked");
    asked.delete("count");
    const save = h("a", { class: "button", href: `/api/trace.log?${asked}`, download: `node${entry.node}_fault.log` }, "Save candump");
    frames.replaceChildren(h("p", { class: "quiet" }, `The kept frames from ${AROUND_S * 1000} ms before to ${AROUND_S * 1000} ms after `, save), headRow(), ...rows);
    rows[at]?.scrollIntoView({ block: "nearest" });
  }

  function update(state) {
    if (state.happenings !== revision && !asking && performance.now() - asked_at >= ASK_MS) ask();
  }

  return { root, update };
}
