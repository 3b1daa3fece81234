// The homing wizard of the Motion view: which methods the drive has and what each does, its speeds, its switches as they are
// now, and the progress of a run. The meaning of a method comes from the studio, which has it from the drive's description.

import { ask } from "./link.js";
import { choice } from "./choice.js";
import { h, number, renew, setText } from "./dom.js";
import { helped } from "./help.js";
import { described, homingPicture } from "./homing_picture.js";

/** How often the switches are read while they are looked at, and while homing runs. */
const LOOK_MS = 1000;
const RUNNING_MS = 250;

/** `isAccepted` returns whether the drive may be moved; it asks first where nothing would stop the drive if the studio died. */
export function homingWizard(shared, report, isAccepted) {
  const choose = choice("home-method", "Method", [], { onchange: () => drawMethod() });
  const about = h("p", { id: "home-described" });
  const picture = h("div");
  const missing = h("p", { class: "bad", id: "home-missing" });
  const remark = h("p", { class: "quiet" });
  const inputs = h("ul", { class: "inputs", id: "home-inputs" });
  const settings = h("form", { class: "settings", onsubmit: write });
  const notice = h("p", { role: "status", id: "home-notice" });
  const progress = h("p", { class: "status", role: "status", id: "home-progress" });
  const start = h("button", { type: "button", id: "home-start", class: "primary", onclick: run }, "Start homing");
  const body = h(
    "div",
    { class: "columns" },
    h("div", {}, h("p", {}, "Method ", choose), about, picture, missing, remark),
    h("div", {}, h("h3", {}, "Switches now"), inputs, h("h3", {}, "Settings"), settings, notice),
  );
  const none = h("p", { class: "quiet" }, "Open to read the methods of the drive.");
  const details = h("details", { class: "homing", id: "homing" }, h("summary", {}, "Homing: find the reference position"), none, body, h("div", { class: "bar" }, start, progress));
  details.addEventListener("toggle", () => details.open && look(true));

  let node = null;
  let seen = null;
  let asked_at = 0;
  let asking = false;
  let outcome = "";
  let position = null;

  function forget(next) {
    node = next;
    seen = null;
    outcome = "";
    asked_at = 0;
    body.hidden = true;
    none.hidden = false;
    setText(notice, "");
    setText(progress, "");
    start.disabled = true;
  }

  /** Reads the drive; `fresh` also refills the fields. */
  async function look(fresh) {
    if (asking || shared.node === null) return;
    if (shared.node !== node) forget(shared.node);
    asking = true;
    asked_at = performance.now();
    const of = node;
    const answer = await ask({ do: "homing", node: of });
    asking = false;
    if (of !== node) return;
    if (!answer.ok) {
      if (answer.error.kind === "busy" || answer.error.kind === "no_connection") return;
      seen = null;
      body.hidden = true;
      none.hidden = false;
      setText(none, answer.error.message);
      return;
    }
    const first = seen === null;
    seen = answer.result;
    body.hidden = false;
    none.hidden = true;
    if (first || fresh) fill();
    drawInputs();
    drawProgress();
  }

  function fill() {
    const kept = choose.value;
    choose.offer(seen.methods.map(({ method, title }) => ({ value: String(method), text: title ? `${method}: ${title}` : String(method) })));
    const wanted = [kept, String(seen.method)].find((value) => seen.methods.some(({ method }) => String(method) === value));
    if (wanted !== undefined) choose.value = wanted;
    setText(remark, seen.remark);
    settings.replaceChildren(...seen.settings.map(field), ...(seen.settings.length ? [h("button", { type: "submit", id: "home-write" }, "Write")] : [h("p", { class: "quiet" }, "This model has no objects for homing.")]));
    drawMethod();
  }

  const field = (setting) =>
    h(
      "label",
      { title: setting.takes ?? "" },
      h("span", {}, `${setting.title} (${setting.object}) `),
      h("input", { type: "text", inputmode: "decimal", value: setting.value, "data-object": setting.object, autocomplete: "off" }),
      helped(h("button", { type: "button", class: "term", "aria-label": `What is ${setting.name}?` }, "?"), "object", setting.object, node),
      h("span", { class: "quiet" }, ` ${setting.unit} · now ${setting.text}${setting.takes ? `; range ${setting.takes}` : ""}`),
    );

  const method = () => seen?.methods.find(({ method }) => String(method) === choose.value) ?? null;

  function drawMethod() {
    const of = method();
    renew(picture, JSON.stringify(of), () => (of ? [homingPicture(of)] : []));
    setText(about, of ? described(of) : "The drive has no homing method.");
    const parts = [];
    if (of?.missing.length) parts.push(`No input of this drive is configured as ${of.missing.join(" or ")}: the search would not end by itself.`);
    if (of?.no_turn.length) parts.push(`Without ${of.no_turn.join(" and ")} it does not reverse there.`);
    setText(missing, parts.join(" "));
  }

  function drawInputs() {
    renew(inputs, JSON.stringify(seen.inputs), () =>
      seen.inputs.length
        ? seen.inputs.map(({ name, signal, active }) =>
            h("li", { class: active ? "on" : "" }, `${name}${signal && signal !== name ? ` (${signal})` : signal ? "" : " (no switch)"}: ${active === null ? "unknown" : active ? "on" : "off"}`))
        : [h("li", { class: "quiet" }, "This model has no object for its switches.")]);
  }

  function drawProgress() {
    const ended = { attained: "Statusword: homing attained.", failed: "Statusword: homing error." }[seen?.ended] ?? "";
    const now = seen?.running ? `Homing: ${seen.phase ?? "under way"}${position === null ? "" : `, at ${number(position, 1)}°`}` : outcome || ended;
    progress.className = seen?.running ? "status" : outcome.startsWith("Home not") || seen?.ended === "failed" ? "status bad" : "status good";
    setText(progress, now);
  }

  async function write(event) {
    event.preventDefault();
    const of = node;
    const changed = [...settings.querySelectorAll("input")].filter((input) => input.value.trim() !== seen.settings.find(({ object }) => object === input.dataset.object)?.value);
    if (!changed.length) return setText(notice, "Nothing to write: the drive has these values.");
    const values = changed.map((input) => ({ object: input.dataset.object, value: input.value.trim() }));
    const answer = await ask({ do: "write_parameters", node: of, values });
    if (of !== node) return;
    notice.className = answer.ok ? "good" : "bad";
    setText(notice, answer.ok ? "Written and read back." : answer.error.message);
    // Refused values stay as typed.
    await look(answer.ok);
  }

  async function run() {
    const of = method();
    if (!of || !isAccepted()) return;
    const on = node;
    outcome = "";
    asked_at = 0;
    const answer = report(`Node ${on}: Home`, await ask({ do: "home", node: on, method: of.method }));
    if (on !== node) return;
    outcome = answer.ok ? `Home found by method ${of.method}.` : `Home not found: ${answer.error.message}`;
    await look(false);
  }

  function update(state) {
    const found = state.nodes.find((known) => known.node === shared.node);
    if (shared.node !== node) forget(shared.node);
    position = found?.drive?.angle_degrees ?? null;
    const running = found?.doing === "homing";
    start.disabled = !seen || running || !method();
    setText(start, found?.drive?.state === "Operation enabled" ? "Start homing" : "Enable and start homing");
    if (seen) seen.running = running;
    if (!details.open || !found?.drive) return;
    if (seen) drawProgress();
    if (performance.now() - asked_at > (running ? RUNNING_MS : LOOK_MS)) look(seen === null);
  }

  return { root: details, update };
}
