// The Trace view: the frames on the bus, in words. The studio keeps the frames; this page has a part of their lines,
// requests new ones while it is in view, and older ones when the list is scrolled there.

import { choice } from "./choice.js";
import { h, number, setText, toggle } from "./dom.js";
import { pointed } from "./help.js";
import { linkTo, linked } from "./linked.js";
import { identifierTable } from "./trace_identifiers.js";
import { sendWindow } from "./trace_send.js";
import { DELTAS, lineAt, timeOf } from "./trace_sum.js";
import { request } from "./transport.js";

const ASK_MS = 100;
/** The table by identifier is read by eye. */
const ASK_IDENTIFIERS_MS = 500;
const PART = 500;
/** Lines kept in the page while it shows the newest; older ones are fetched again from the studio. */
const LINES_KEPT = 20_000;
/** The most lines in the page, as many as the studio keeps. A reader of old lines beyond it is shown nothing new meanwhile. */
const MOST_LINES = 200_000;
const ROW_PX = 24;
const KINDS = ["nmt", "sync", "time", "emcy", "pdo", "sdo", "heartbeat", "lss", "other"];
/** An object as it is written in a line. */
const OBJECT = /[0-9A-F]{4}h:[0-9A-F]{2}/;
/** Forms in which the kept frames are saved, as by `ferrodrive convert`. */
const FORMS = [
  ["log", "candump"],
  ["asc", "ASC"],
  ["blf", "BLF"],
  ["pcapng", "pcapng"],
];
/** Frames of a loaded log that are asked for at once: each of them may be a line. */
const WINDOW = 2000;
const WINDOW_IDENTIFIERS = 20_000;
/** Lines before and after the cursor of the scope that are fetched for it. */
const AROUND_S = 1;
const COLUMNS = ["Time (s)", "From", "COB-ID", "What", "Bytes", "Took", "In words"];

/** The column titles. */
export const headRow = () => h("div", { class: "trace-row head" }, ...COLUMNS.map((title) => h("span", {}, title)));

/** A line of the trace; `time_s` is what its first column shows. */
export function lineRow(line, time_s = line.at_s) {
  const took = line.took_ms === undefined ? "" : `${number(line.took_ms, 1)} ms`;
  const cells = [number(time_s, 6), line.from, line.id, line.kind, line.data, took, line.text];
  const spans = cells.map((cell) => h("span", {}, cell));
  const row = h("div", { class: `trace-row ${line.kind}`, "data-number": String(line.number), title: line.text }, ...spans);
  // `?` on the words explains the object that they name; elsewhere in the line, the service.
  const object = OBJECT.exec(line.text)?.[0];
  if (object) pointed(spans.at(-1), "object", object, line.node ?? null);
  return pointed(row, "service", line.kind);
}

export function traceView() {
  const nodes = h("input", { id: "trace-nodes", size: "8", placeholder: "all nodes", "aria-label": "Node-IDs, separated by commas", oninput: again });
  const words = h("input", { id: "trace-text", size: "24", placeholder: "words, separated by commas", "aria-label": "Words that a line must contain, separated by commas", oninput: again });
  const kinds = h("div", { class: "chooser", role: "group", "aria-label": "Kinds of frames; none for all" }, ...KINDS.map((kind) => h("button", { type: "button", "data-kind": kind, "aria-pressed": "false", onclick: choose }, kind)));
  const whole = toggle("trace-transfers", "whole SDO transfers", true, () => again());
  const quiet = toggle("trace-quiet", "without the studio's readings", true, () => again());
  const byId = toggle("trace-by-id", "by COB-ID", false, () => again(), { title: "A line for each COB-ID, with its period" });
  const delta = choice("trace-delta", "Time shown", DELTAS, { value: "none", onchange: () => draw() });
  const pause = h("button", { type: "button", id: "trace-pause", "aria-pressed": "false", onclick: pauseOrGoOn }, "Pause");
  const saves = FORMS.map(([ending, name]) => h("a", { id: `trace-save-${ending}`, class: "button", download: `trace.${ending}`, title: `All kept frames of these nodes and kinds, as ${name}`, "data-form": ending }, name));
  const toCursor = h("button", { type: "button", id: "trace-cursor", hidden: true, title: "The lines around cursor A of the scope", onclick: goToCursor }, "At the scope's cursor");
  const table = identifierTable((id) => {
    words.value = id;
    byId.checked = false;
    again();
  });
  const room = h("div", { class: "room" });
  const list = h("div", { class: "trace-list", tabindex: "0", role: "log", "aria-label": "Frames", onscroll: draw, onclick: chooseLine, onkeydown: moveLine }, room);
  const listed = h("div", { class: "wide" }, headRow(), list);
  const status = h("p", { class: "quiet", role: "status", id: "trace-status" });
  const file = h("input", { id: "trace-file", type: "file", class: "unseen-input", accept: ".log,.txt,.asc,.blf,.trc,.pcap,.pcapng", onchange: load });
  const live = h("button", { type: "button", id: "trace-live", class: "primary", hidden: true, onclick: () => show(null) }, "Back to the bus");
  const saving = h("span", { class: "bar" }, h("span", { class: "quiet" }, "Save as"), ...saves);
  const root = h(
    "section",
    { class: "trace" },
    h("div", { class: "bar" }, h("label", {}, "Nodes ", nodes), h("label", {}, "Text ", words), whole, quiet, byId, pause),
    h("div", { class: "bar" }, kinds, delta, toCursor),
    listed,
    h("div", { class: "by-id", tabindex: "0", role: "region", "aria-label": "Frames by COB-ID" }, table.root),
    status,
    h("div", { class: "bar" }, saving, h("label", { class: "button", title: "A log of frames: candump, ASC, BLF, TRC, pcap, pcapng" }, "Load a log", file), live),
    sendWindow(),
  );

  let shown = false;
  let paused = false;
  let timer = null;
  /** Counts the filters: an answer to an older one is ignored. */
  let generation = 0;
  let lines = [];
  /** Range of the frame numbers of the lines: from, up to and not including to. */
  let [from, to] = [null, null];
  let oldest = 0;
  let next = 0;
  let skipped = 0;
  let trouble = null;
  let fetching = false;
  /** The newest line is kept in view. */
  let follows = true;
  let seen = linked.changes;
  /** Whether lines of another time than the newest are shown. */
  let elsewhere = false;
  /** The log that is shown in place of the bus: `{ name, number, frames, oldest, remark, at_s }`; null for the bus. */
  let log = null;

  /** When the chosen line was: of the bus also where cursor A of the scope stands, whose times are not those of a log. */
  const chosenAt = () => (log ? log.at_s : linked.at_s);
  function chooseAt(at_s) {
    if (log) log.at_s = at_s;
    else linkTo(at_s);
    seen = linked.changes;
  }

  async function load() {
    const [one] = file.files;
    file.value = "";
    if (!one) return;
    setText(status, `Loading ${one.name} …`);
    try {
      const answer = await request(`/api/trace/load?${new URLSearchParams({ name: one.name })}`, { method: "POST", body: one });
      const body = await answer.json();
      if (!answer.ok) throw new Error(body.error.message);
      show({ ...body, name: one.name, at_s: null });
    } catch (error) {
      trouble = error.message;
      draw();
    }
  }

  /** Shows a log, from its first frame on, or the bus again. */
  function show(next) {
    log = next;
    live.hidden = log === null;
    saving.hidden = pause.hidden = log !== null;
    // Whose readings the frames of a log are is not known.
    quiet.disabled = log !== null;
    again();
  }

  function filter() {
    const chosen = [...kinds.children].filter((button) => button.getAttribute("aria-pressed") === "true").map((button) => button.dataset.kind);
    const asked = new URLSearchParams();
    if (nodes.value.trim()) asked.set("node", nodes.value);
    if (chosen.length) asked.set("kind", chosen.join());
    return asked;
  }

  function choose(event) {
    const button = event.currentTarget;
    button.setAttribute("aria-pressed", String(button.getAttribute("aria-pressed") !== "true"));
    again();
  }

  /** Starts again, with the newest lines of another filter. */
  function again() {
    generation += 1;
    [lines, from, to, skipped, follows, elsewhere, oldest, next] = [[], null, null, 0, log === null, false, log?.oldest ?? 0, log?.frames ?? 0];
    trouble = null;
    for (const save of saves) save.href = `/api/trace.${save.dataset.form}?${filter()}`;
    table.clear();
    listed.hidden = byId.checked;
    table.root.parentElement.hidden = !byId.checked;
    whole.disabled = delta.disabled = byId.checked;
    fetching = false;
    draw();
    ask();
  }

  /** Asks the studio; null where the answer does not count any more, or there is none. */
  async function part(more, what = "") {
    const path = log ? `/api/trace/loaded/${log.number}${what}` : `/api/trace${what}`;
    const asked = filter();
    asked.set("count", String(log ? WINDOW : PART));
    if (words.value.trim()) asked.set("text", words.value);
    if (whole.checked) asked.set("transfers", "true");
    if (quiet.checked && !log) asked.set("quiet", "true");
    for (const [name, value] of Object.entries(more)) asked.set(name, String(value));
    const mine = generation;
    fetching = true;
    let body = null;
    try {
      const answer = await request(`${path}?${asked}`);
      body = await answer.json();
      if (!answer.ok) throw new Error(body.error.message);
    } catch (error) {
      if (mine === generation) [trouble, fetching] = [error.message, false];
      return null;
    }
    // The filter has changed since.
    if (mine !== generation) return null;
    [trouble, fetching, oldest, next] = [null, false, body.oldest ?? oldest, body.next ?? next];
    return body;
  }

  const wantsNew = () => to === null || (log ? to < next && lines.length < MOST_LINES : !paused && (follows || lines.length < MOST_LINES));

  /** Which frames are asked for: of a log those that come next, of the bus the newest. */
  function wanted(window) {
    if (!log) return to === null ? {} : { after: to };
    const after = to ?? oldest;
    return { after, before: after + window };
  }

  async function ask() {
    clearTimeout(timer);
    if (!shown) return;
    const mine = generation;
    if (byId.checked) return askIdentifiers(mine);
    // The first lines of a filter are shown even while paused; a hidden tab requests nothing.
    if (wantsNew() && !document.hidden && !fetching) {
      const body = await part(wanted(WINDOW));
      if (body) {
        if (to === null) from = body.from;
        skipped += body.skipped;
        to = body.to;
        for (const line of body.lines) lines.push(line);
        if (follows && lines.length > LINES_KEPT) {
          lines = lines.slice(-LINES_KEPT);
          from = lines[0].number;
        }
      }
      if (mine === generation) draw();
    }
    if (mine === generation) {
      clearTimeout(timer);
      timer = setTimeout(ask, ASK_MS);
    }
  }

  async function askIdentifiers(mine) {
    if (!document.hidden && !fetching && (log ? to === null || to < next : !paused || to === null)) {
      const body = await part(wanted(WINDOW_IDENTIFIERS), "/identifiers");
      if (body) {
        to = body.to;
        skipped += body.skipped;
        table.add(body);
      }
      if (mine === generation) draw();
    }
    if (mine !== generation) return;
    clearTimeout(timer);
    timer = setTimeout(ask, ASK_IDENTIFIERS_MS);
  }

  /** Shows the lines around the cursor of the scope, as after Pause. */
  async function goToCursor() {
    const at_s = linked.at_s;
    if (at_s === null) return;
    byId.checked = false;
    if (!paused) pauseOrGoOn();
    again();
    generation += 1;
    const body = await part({ until_s: at_s + AROUND_S });
    if (!body) return;
    [lines, from, to, follows, elsewhere] = [body.lines, body.from, body.to, false, true];
    // So many lines that the one of the cursor is among them.
    while (lines.length && lines[0].at_s > at_s && from > oldest) {
      const before = from;
      await askOlder();
      if (from === before) break;
    }
    draw();
    showLine(lineAt(lines, at_s));
  }

  function showLine(at) {
    if (at < 0) return;
    room.style.height = `${lines.length * ROW_PX}px`;
    list.scrollTop = Math.max(0, at * ROW_PX - list.clientHeight / 2);
    draw();
  }

  /** A line that is pressed is where cursor A of the scope stands. */
  function chooseLine(event) {
    const row = event.target.closest(".trace-row");
    const line = row && lines.find(({ number: of }) => String(of) === row.dataset.number);
    if (!line) return;
    chooseAt(line.at_s);
    draw();
  }

  function moveLine(event) {
    const by = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (by === undefined || event.altKey || event.ctrlKey || event.metaKey || chosenAt() === null) return;
    const at = Math.min(lines.length - 1, Math.max(0, lineAt(lines, chosenAt()) + by));
    if (!lines[at]) return;
    follows = false;
    chooseAt(lines[at].at_s);
    const top = at * ROW_PX;
    if (top < list.scrollTop || top + 2 * ROW_PX > list.scrollTop + list.clientHeight) showLine(at);
    else draw();
    event.preventDefault();
  }

  /** Fetches the lines before the first one. */
  async function askOlder() {
    if (fetching || from === null || from <= oldest || lines.length >= MOST_LINES) return;
    const body = await part({ before: from });
    if (!body) return;
    from = body.from;
    lines = body.lines.concat(lines);
    // The lines in view stay there.
    const top = list.scrollTop + body.lines.length * ROW_PX;
    room.style.height = `${lines.length * ROW_PX}px`;
    list.scrollTop = top;
    draw();
  }

  function pauseOrGoOn() {
    if (log) return;
    paused = !paused;
    pause.setAttribute("aria-pressed", String(paused));
    setText(pause, paused ? "Resume" : "Pause");
    if (!paused && elsewhere) return again();
    if (!paused) follows = true;
    draw();
  }

  const row = (line, at, chosen) => {
    const element = lineRow(line, timeOf(lines, at, delta.value, chosenAt()));
    element.classList.toggle("chosen-line", at === chosen);
    element.style.top = `${at * ROW_PX}px`;
    return element;
  };

  /** Draws only the lines in view. */
  function draw(event) {
    if (event) follows = log === null && list.scrollTop + list.clientHeight >= list.scrollHeight - ROW_PX;
    room.style.height = `${lines.length * ROW_PX}px`;
    if (follows && !event) list.scrollTop = list.scrollHeight;
    const first = Math.max(0, Math.floor(list.scrollTop / ROW_PX) - 2);
    const last = Math.min(lines.length, first + Math.ceil(list.clientHeight / ROW_PX) + 4);
    const chosen = chosenAt() === null ? -1 : lineAt(lines, chosenAt());
    room.replaceChildren(...lines.slice(first, last).map((line, at) => row(line, first + at, chosen)));
    toCursor.hidden = log !== null || linked.at_s === null;
    if (event && list.scrollTop < ROW_PX) askOlder();
    // With a filter that few lines pass, the lines that fill the view are further back.
    else if (lines.length * ROW_PX < list.clientHeight) askOlder();
    const missed = skipped ? ` ${skipped} frames are not shown: too many for this page.` : "";
    const kept = next - oldest;
    const searched = from === null ? 0 : next - from;
    const ofLog = log && `${lines.length} ${lines.length === 1 ? "line" : "lines"} of ${log.name}: ${searched === 0 ? 0 : to - oldest} of ${log.frames} frames read${oldest ? `, the first ${oldest} are not kept` : ""}${log.remark ? `; ${log.remark}` : ""}. Times are from its first frame on.`;
    const byIdentifier = `${table.size()} COB-IDs${quiet.checked ? ", without the studio's readings" : ""}.${missed}${paused ? " Paused." : ""}`;
    setText(status, trouble ?? (byId.checked ? byIdentifier : ofLog ?? `${lines.length} ${lines.length === 1 ? "line" : "lines"} of the last ${searched} frames; the studio keeps ${kept}.${missed}${paused ? " Paused: the studio keeps recording." : ""}`));
    status.classList.toggle("bad", trouble !== null);
  }

  function update() {
    if (shown && seen !== linked.changes) {
      seen = linked.changes;
      draw();
    }
    if (shown) return;
    shown = true;
    seen = linked.changes;
    // After a pause only the newest frames are fetched, not each one since.
    if (paused || log) ask();
    else again();
  }

  function hide() {
    shown = false;
    clearTimeout(timer);
  }

  function key(event) {
    if (event.key === "p") pauseOrGoOn();
  }

  return { root, update, key, hide };
}
