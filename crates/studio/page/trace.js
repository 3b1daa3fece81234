// The Trace view: the frames on the bus, in words. The studio keeps the frames; this page has a part of their lines,
// requests new ones while it is in view, and older ones when the list is scrolled there.

import { h, number, setText, toggle } from "./dom.js";
import { pointed } from "./help.js";
import { request } from "./transport.js";

const ASK_MS = 100;
const PART = 500;
/** Lines kept in the page while it shows the newest; older ones are fetched again from the studio. */
const LINES_KEPT = 20_000;
/** The most lines in the page, as many as the studio keeps. A reader of old lines beyond it is shown nothing new meanwhile. */
const MOST_LINES = 200_000;
const ROW_PX = 24;
const KINDS = ["nmt", "sync", "time", "emcy", "pdo", "sdo", "heartbeat", "lss", "other"];
/** An object as it is written in a line. */
const OBJECT = /[0-9A-F]{4}h:[0-9A-F]{2}/;
const COLUMNS = ["Time (s)", "From", "COB-ID", "What", "Bytes", "Took", "In words"];

/** The column titles. */
export const headRow = () => h("div", { class: "trace-row head" }, ...COLUMNS.map((title) => h("span", {}, title)));

/** A line of the trace. */
export function lineRow(line) {
  const took = line.took_ms === undefined ? "" : `${number(line.took_ms, 1)} ms`;
  const cells = [number(line.at_s, 6), line.from, line.id, line.kind, line.data, took, line.text];
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
  const quiet = toggle("trace-quiet", "without the studio's readings", false, () => again());
  const pause = h("button", { type: "button", id: "trace-pause", "aria-pressed": "false", onclick: pauseOrGoOn }, "Pause");
  const save = h("a", { id: "trace-save", class: "button", download: "trace.log", title: "All kept frames of these nodes and kinds, as a candump log" }, "Save candump");
  const room = h("div", { class: "room" });
  const list = h("div", { class: "trace-list", tabindex: "0", role: "log", "aria-label": "Frames", onscroll: draw }, room);
  const status = h("p", { class: "quiet", role: "status" });
  const root = h(
    "section",
    { class: "trace" },
    h("div", { class: "bar" }, h("label", {}, "Nodes ", nodes), h("label", {}, "Text ", words), whole, quiet, pause, save),
    h("div", { class: "bar" }, kinds),
    h("div", { class: "wide" }, headRow(), list),
    status,
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
    [lines, from, to, skipped, follows] = [[], null, null, 0, true];
    save.href = `/api/trace.log?${filter()}`;
    fetching = false;
    draw();
    ask();
  }

  async function part(more) {
    const asked = filter();
    asked.set("count", String(PART));
    if (words.value.trim()) asked.set("text", words.value);
    if (whole.checked) asked.set("transfers", "true");
    if (quiet.checked) asked.set("quiet", "true");
    for (const [name, value] of Object.entries(more)) asked.set(name, String(value));
    const mine = generation;
    fetching = true;
    let body = null;
    try {
      const answer = await request(`/api/trace?${asked}`);
      body = await answer.json();
      if (!answer.ok) throw new Error(body.error.message);
    } catch (error) {
      if (mine === generation) [trouble, fetching] = [error.message, false];
      return null;
    }
    // The filter has changed since.
    if (mine !== generation) return null;
    [trouble, fetching, oldest, next] = [null, false, body.oldest, body.next];
    return body;
  }

  const wantsNew = () => to === null || (!paused && (follows || lines.length < MOST_LINES));

  async function ask() {
    clearTimeout(timer);
    if (!shown) return;
    const mine = generation;
    // The first lines of a filter are shown even while paused; a hidden tab requests nothing.
    if (wantsNew() && !document.hidden && !fetching) {
      const body = await part(to === null ? {} : { after: to });
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
    paused = !paused;
    pause.setAttribute("aria-pressed", String(paused));
    setText(pause, paused ? "Resume" : "Pause");
    if (!paused) follows = true;
    draw();
  }

  const row = (line, at) => {
    const element = lineRow(line);
    element.style.top = `${at * ROW_PX}px`;
    return element;
  };

  /** Draws only the lines in view. */
  function draw(event) {
    if (event) follows = list.scrollTop + list.clientHeight >= list.scrollHeight - ROW_PX;
    room.style.height = `${lines.length * ROW_PX}px`;
    if (follows && !event) list.scrollTop = list.scrollHeight;
    const first = Math.max(0, Math.floor(list.scrollTop / ROW_PX) - 2);
    const last = Math.min(lines.length, first + Math.ceil(list.clientHeight / ROW_PX) + 4);
    room.replaceChildren(...lines.slice(first, last).map((line, at) => row(line, first + at)));
    if (event && list.scrollTop < ROW_PX) askOlder();
    // With a filter that few lines pass, the lines that fill the view are further back.
    else if (lines.length * ROW_PX < list.clientHeight) askOlder();
    const missed = skipped ? ` ${skipped} frames are not shown: too many for this page.` : "";
    const kept = next - oldest;
    const searched = from === null ? 0 : next - from;
    setText(status, trouble ?? `${lines.length} ${lines.length === 1 ? "line" : "lines"} of the last ${searched} frames; the studio keeps ${kept}.${missed}${paused ? " Paused: the studio keeps recording." : ""}`);
    status.classList.toggle("bad", trouble !== null);
  }

  function update() {
    if (shown) return;
    shown = true;
    // After a pause only the newest frames are fetched, not each one since.
    if (paused) ask();
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
