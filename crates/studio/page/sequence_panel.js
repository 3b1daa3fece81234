// The sequence of the Motion view: recorded, kept by the browser, shown as code, and played again.

import { ask, inControl, link, on, stopAll } from "./link.js";
import { choice } from "./choice.js";
import { h, setText, toggle } from "./dom.js";
import { HOLD_MS } from "./motion_form.js";
import { commandLine, isAwaited, keptSteps, nodesOf, python, recorder, scenario, shownStep } from "./sequence.js";
import { isHeld } from "./sequence_held.js";
import { keep, kept } from "./settings.js";

const KEY = "sequence";
const MOST = 200;
const STOPS = ["stop", "quick_stop", "group_end"];
const FORMS = [
  { value: "line", text: "as command line", file: "sequence.sh" },
  { value: "python", text: "as Python", file: "sequence.py" },
  { value: "scenario", text: "as scenario", file: "sequence.toml" },
];

/** `isAccepted` asks once about drives that nothing stops if the studio dies. */
export function sequencePanel(isAccepted) {
  const record = toggle("sequence-record", "Record", false, () => (record.checked ? begin() : end()), { title: "Records what is commanded in this page, until pressed again" });
  const play = toggle("sequence-play", "Play", false, () => (play.checked ? run() : halt("ended by the button")), { title: "Sends the recorded commands with their pauses. Whatever ends it before the last one stops the drives that it has commanded" });
  const clear = h("button", { type: "button", id: "sequence-clear", onclick: () => change([]) }, "Clear");
  const form = choice("sequence-form", "Show", FORMS, { value: "line", onchange: () => draw() });
  const save = h("button", { type: "button", id: "sequence-save", onclick: saveText }, "Save");
  const status = h("span", { class: "quiet", role: "status", id: "sequence-status" });
  const list = h("ol", { class: "sequence", "aria-label": "Recorded commands" });
  const text = h("pre", { class: "code", id: "sequence-text", tabindex: "0", "aria-label": "The sequence as text" });
  const hint = h("p", { class: "quiet" }, "Recorded are power, motions, motions of several drives together (held ones too), homing, NMT, PDOs, parameters that are typed in their row and stored, captures, test motions, gains that are found and tried, and values that are put back. A jog is recorded as a turn that ends with a stop, and Stop as a quick stop of each drive. Motions are sent with the pauses between what was done, whether they were reached or not; what follows gains that are found waits for them.");
  const root = h("details", { class: "homing", id: "sequence" }, h("summary", {}, "Sequence: record, play, show as code"), h("div", { class: "bar" }, record, play, clear, form, save, status), list, text, hint);
  let steps = keptSteps(kept(KEY, []));
  /** What records; null while nothing is recorded. */
  let recording = null;
  /** When the step before was sent. */
  let before = 0;
  /** The play under way, a new object each time: the nodes that it has commanded. */
  let playing = null;
  /** What holds a motion of several drives that is played. */
  let holding = 0;

  function change(to) {
    steps = to;
    keep(KEY, steps);
    draw();
  }

  function begin() {
    halt("");
    change([]);
    recording = recorder();
    setText(status, "recording");
  }

  function end() {
    if (recording) append(recording.end());
    recording = null;
    setText(status, "");
  }

  function append(commands) {
    if (!commands.length) return;
    const now = performance.now();
    const after_s = steps.length ? (now - before) / 1e3 : 0;
    before = now;
    change([...steps, ...commands.map((command, at) => ({ after_s: at > 0 ? 0 : after_s, command }))]);
  }

  on("asked", (command) => {
    if (!recording || playing) return;
    const commands = recording.take(command);
    const full = commands.length > 0 && steps.length >= MOST;
    // Stops are kept also behind the last one.
    append(full ? commands.filter(({ do: word }) => STOPS.includes(word)) : commands);
    if (!full) return;
    record.click();
    setText(status, `at most ${MOST} commands: recording has ended`);
  });

  /** Ends a play. What it has commanded is stopped, unless `stops` is false: something else does. */
  function halt(why, stops = true) {
    if (!playing) return;
    const { nodes } = playing;
    clearInterval(holding);
    playing = null;
    play.checked = false;
    setText(status, why);
    if (stops) stopNodes(nodes);
  }

  /** By their ramps; where that is refused, everything is quick-stopped. */
  async function stopNodes(nodes) {
    const answers = await Promise.all([...nodes].map((node) => ask({ do: "stop", node })));
    // A drive that has got a later command, or a quick stop, obeys that.
    if (answers.some(({ ok, error }) => !ok && error.kind !== "replaced" && error.kind !== "stopped")) stopAll();
  }

  /** A press of stop has ended the play. Behind one from elsewhere a command may have been sent: stops again. */
  function stopped(here, why = "ended by Stop") {
    const again = playing && !here && inControl();
    halt(why, false);
    if (again) stopAll();
  }

  // `here`: the press follows at once.
  on("halt", (here) => stopped(here));
  on("change", (connected) => connected || halt("ended: the connection to the studio was lost"));
  on("sight", ({ fresh }) => fresh || halt("ended: the state of the studio was stale"));
  // Timers of a hidden page are late.
  document.addEventListener("visibilitychange", () => document.hidden && halt("ended: the page was hidden"));

  async function run() {
    play.checked = false;
    if (!steps.length) return setText(status, "nothing is recorded");
    if (!inControl()) return setText(status, "take control first");
    if (!isAccepted(new Set(steps.flatMap(({ command }) => nodesOf(command))))) return;
    if (record.checked) record.click();
    const mine = { nodes: new Set() };
    playing = mine;
    play.checked = true;
    /** The answer that the next command waits for. */
    let awaited = null;
    for (const [at, { after_s, command }] of steps.entries()) {
      if (at > 0) await new Promise((resolve) => setTimeout(resolve, after_s * 1e3));
      await awaited;
      if (playing !== mine) return;
      setText(status, `${at + 1} of ${steps.length}: ${shownStep(steps[at], 0)}`);
      for (const node of nodesOf(command)) mine.nodes.add(node);
      if (isHeld(command) || command.do === "group_end") clearInterval(holding);
      if (isHeld(command)) holding = setInterval(() => ask({ do: "group_hold" }), HOLD_MS);
      // The next command comes when it came, and replaces a motion that is not done; one that needs what this finds waits for it.
      const answered = ask(command).then((answer) => {
        // The Scope view keeps what was captured.
        if (answer.ok) dispatchEvent(new CustomEvent("played", { detail: { command, result: answer.result } }));
        if (playing !== mine || answer.ok || answer.error.kind === "replaced") return;
        // The answer to a command may come before the news of the stop that ended it.
        const why = `ended at ${at + 1}: ${answer.error.message}`;
        if (answer.error.kind === "stopped") stopped(false, why);
        else halt(why);
      });
      awaited = isAwaited(command) ? answered : null;
    }
    await awaited;
    if (playing === mine) halt(`all ${steps.length} commands were sent`, false);
  }

  function code() {
    const bus = link.state?.bus.name ?? "can0";
    const models = (link.state?.nodes ?? []).filter(({ model }) => model);
    return { line: () => commandLine(steps, bus, models), python: () => python(steps, bus, models), scenario: () => scenario(steps, models) }[form.value]();
  }

  function saveText() {
    const address = URL.createObjectURL(new Blob([code()], { type: "text/plain" }));
    h("a", { href: address, download: FORMS.find(({ value }) => value === form.value).file }).click();
    URL.revokeObjectURL(address);
  }

  function draw() {
    list.replaceChildren(...steps.map((step, at) => h("li", {}, shownStep(step, at))));
    text.hidden = steps.length === 0;
    setText(text, steps.length ? code() : "");
    for (const button of [play, clear, save]) button.disabled = steps.length === 0;
  }
  draw();
  // The bus and its models are known later.
  root.addEventListener("toggle", draw);
  return root;
}
