// The captures of the scope: kept, loaded from a file, chosen to be laid over the picture.

import { ALIGNMENTS, freeName } from "./capture.js";
import { captures, deleteCapture, keepCapture, loadCaptures, storeCapture } from "./capture_store.js";
import { choice } from "./choice.js";
import { count, h, setText, toggle } from "./dom.js";
import { identifiedPanel } from "./identified_panel.js";
import { readRecording } from "./recordings.js";

const LONGEST_NAME = 60;
const LONGEST_NOTES = 2000;

/** `take` gives a capture of what is shown, or null; `open` shows one by itself. */
export function capturePanel(shared, { take, open }) {
  const found = identifiedPanel(shared);
  const status = h("span", { role: "status", id: "capture-status" });
  const file = h("input", { type: "file", id: "capture-file", class: "unseen-input", accept: ".mcap,.csv,.log,.candump,.txt,.blf,.asc,.trc,.pcap,.pcapng", "aria-label": "A record or a log to load", onchange: load });
  const align = choice("capture-align", "Lay over", ALIGNMENTS, { value: "zero" });
  const subtracts = toggle("capture-subtract", "Differences", false, () => {}, { title: "For each value what is shown less what each capture laid over has" });
  const list = h("ul", { class: "captures", "aria-label": "Captures" });
  const root = h(
    "div",
    {},
    h(
      "div",
      { class: "bar" },
      h("button", { type: "button", id: "capture-keep", title: "Keep what is shown, also over a reload of the page", onclick: () => keep() }, "Keep"),
      h("label", { class: "button" }, "Load a file …", file),
      h("span", { class: "quiet" }, "laid over"),
      align,
      subtracts,
      status,
    ),
    list,
    found.root,
  );
  /** The ids of the captures that are laid over the picture. */
  const over = new Set();

  const say = (text, bad = false) => {
    setText(status, text);
    status.className = bad ? "bad" : "quiet";
  };

  /** Carries out what changes the store; what the browser does not do is said. */
  async function trying(work) {
    try {
      await work();
    } catch (error) {
      say(error.message, true);
    }
    draw();
  }

  /** Keeps what is shown now, or a given capture. */
  async function keep(capture = take()) {
    if (!capture) return say("nothing is shown that could be kept", true);
    await trying(async () => {
      await keepCapture(capture);
      over.add(capture.id);
      say(`kept as ${capture.name}`);
    });
  }

  async function load() {
    const chosen = file.files[0];
    if (!chosen) return;
    say(`reading ${chosen.name} …`);
    await trying(async () => {
      const { capture, remark } = await readRecording(chosen);
      open(capture);
      await keepCapture(capture);
      say([`${capture.name}: ${count(capture.columns.length, "value")}`, remark].filter(Boolean).join("; "));
    });
    // The same file can be chosen again.
    file.value = "";
  }

  function row(capture) {
    const pressed = toggle(`over-${capture.id}`, "Lay over", over.has(capture.id), () => (pressed.checked ? over.add(capture.id) : over.delete(capture.id)), { "aria-label": `Lay over: ${capture.name}` });
    const name = h("input", { value: capture.name, size: "28", maxlength: LONGEST_NAME, "aria-label": "Name of the capture" });
    name.addEventListener("change", () => {
      if (name.value.trim() === "") return (name.value = capture.name);
      capture.name = freeName(name.value.trim(), captures.filter((one) => one !== capture));
      trying(() => storeCapture(capture));
    });
    const notes = h("input", { value: capture.notes ?? "", size: "28", maxlength: LONGEST_NOTES, placeholder: "notes", title: capture.notes ?? "", "aria-label": `Notes about ${capture.name}`, "data-notes": true });
    notes.addEventListener("change", () => {
      capture.notes = notes.value.trim();
      trying(() => storeCapture(capture));
    });
    const shift = h("input", { type: "number", step: "any", value: String(capture.shift_s), class: "short", "aria-label": `Move ${capture.name} by so many seconds` });
    shift.addEventListener("change", () => {
      if (shift.validity.badInput || shift.value === "") return (shift.value = String(capture.shift_s));
      capture.shift_s = Number(shift.value);
      trying(() => storeCapture(capture));
    });
    const remove = () =>
      trying(async () => {
        over.delete(capture.id);
        await deleteCapture(capture);
      });
    return h(
      "li",
      { class: "bar", "data-capture": capture.name },
      pressed,
      name,
      notes,
      h("label", {}, "by ", shift, " s"),
      h("button", { type: "button", "aria-label": `Show ${capture.name} by itself`, onclick: () => open(capture) }, "Show"),
      h("button", { type: "button", title: "Frequency response, masses and speed loop by demanded current, motion and set-point; nothing moves", "aria-label": `Identify the drive from ${capture.name}`, onclick: () => found.show(capture) }, "Identify"),
      h("button", { type: "button", "aria-label": `Delete ${capture.name}`, onclick: remove }, "Delete"),
      h("span", { class: "quiet" }, `${capture.taken.slice(0, 19).replace("T", " ")}, ${capture.columns.length} values`),
    );
  }

  const draw = () => list.replaceChildren(...captures.map(row));
  trying(loadCaptures);

  return {
    root,
    keep,
    /** The captures that are laid over the picture. */
    chosen: () => captures.filter(({ id }) => over.has(id)),
    alignment: () => align.value,
    subtracts: () => subtracts.checked,
  };
}
