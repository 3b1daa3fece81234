// The World view: the machine around virtual drives, as it truly is and not as the drives setText, and what may be done to it.

import { ask, inControl } from "./link.js";
import { h, number, setText } from "./dom.js";
import { alternatives, commandForm, subject } from "./world_form.js";
import { drivePicture } from "./world_picture.js";
import { worldSliders } from "./world_sliders.js";

/** Drawings a second: the next state is requested when the previous one has come. */
const PICTURE_MS = 33;
const RETRY_MS = 1000;
const CHANGES_SHOWN = 200;
/** Ending of the name of a group that is not about a single drive. */
const ALL = " of all";

const NOT_VIRTUAL =
  "The drives on this bus are real, or belong to another program: their surroundings cannot be changed here. " +
  "Use ferrodrive world to change the surroundings in a running ferrodrive sim, or start the studio without --bus for its own virtual machine.";

export function worldView(shared, report) {
  const about = h("p", { class: "quiet", role: "status" });
  const cards = h("div", { class: "world-cards", role: "group", "aria-label": "The drives as they truly are" });
  const line = h("input", { id: "world-line", size: "36", placeholder: "4 supply 30 limit 5", "aria-label": "A command in words", autocomplete: "off" });
  const free = h("form", { class: "bar", onsubmit: (event) => { event.preventDefault(); perform(line.value); } }, line, h("button", { id: "world-do" }, "Do"), h("span", { class: "quiet" }, "Any command of ferrodrive sim"));
  const groups = h("div", { class: "world-groups" });
  const answer = h("p", { id: "world-answer", role: "status" });
  const list = h("ol", { class: "world-changes", reversed: true });
  const sliders = worldSliders(perform);
  const controls = h("fieldset", { class: "world-controls" }, sliders.root, free, h("h2", { class: "small" }, "Done so far"), list, groups);
  const root = h("section", { class: "world" }, about, cards, answer, controls);

  /** The drawing of each drive, by place. */
  const pictures = new Map();
  let forms = null;
  let place = null;
  let namesKey = "";
  let inputs = [];
  let bodies = [];
  let newest = null;
  let shown = false;
  let running = false;

  async function perform(text) {
    const reply = report("World", await ask({ do: "change_world", line: text }));
    setText(answer, reply.ok ? (reply.notes ?? []).join(" ") : reply.error.message);
    answer.className = reply.ok ? "quiet" : "bad";
    if (reply.ok) line.value = "";
  }

  /** A group of forms for each subject of commands. */
  function drawForms() {
    const names = (word) => (word === "body" ? bodies : inputs);
    const found = new Map();
    for (const command of forms.flatMap(alternatives)) {
      if (command.startsWith("body") && bodies.length === 0) continue;
      if (/^NODE (input|switch) NAME/.test(command) && inputs.length === 0) continue;
      const name = command.startsWith("NODE") ? subject(command) : `${subject(command)}${ALL}`;
      found.set(name, [...(found.get(name) ?? []), commandForm(command, { place: () => place, names, run: perform })]);
    }
    groups.replaceChildren(...[...found].map(([name, of]) => h("div", { class: "form", "data-group": name }, name.endsWith(ALL) ? h("p", { class: "quiet" }, "The bus, for every node") : null, ...of)));
  }

  function choose(next) {
    place = next;
    for (const [of, { root: card }] of pictures) card.setAttribute("aria-pressed", String(of === place));
    setText(about, `Chosen: drive ${place}. The drawings show where the shafts truly are. The forms below are for the chosen drive; press a drawing to choose another.`);
  }

  /** As everywhere else: by node-ID, whatever the order of the machine file. */
  const inOrder = (one, other) => one.localeCompare(other, "en", { numeric: true });

  function take(seen) {
    const before = pictures.size;
    for (const node of seen.nodes) {
      if (!pictures.has(node.place)) {
        const picture = drivePicture(`${node.place} ${node.model}`);
        picture.root.addEventListener("click", () => choose(node.place));
        picture.root.dataset.place = node.place;
        pictures.set(node.place, picture);
      }
      pictures.get(node.place).update(node);
    }
    if (pictures.size !== before) cards.replaceChildren(...[...pictures.keys()].sort(inOrder).map((of) => pictures.get(of).root));
    if (!pictures.has(place)) choose(pictures.has(String(shared.node)) ? String(shared.node) : seen.nodes[0]?.place);
    const chosen = seen.nodes.find((node) => node.place === place);
    if (chosen) sliders.update(chosen);
    inputs = Object.keys(chosen?.inputs ?? {});
    bodies = seen.bodies;
    const key = JSON.stringify([inputs, bodies]);
    if (forms && namesKey !== key) {
      namesKey = key;
      drawForms();
    }
    for (const change of seen.changes) {
      newest = change.number;
      const back = change.back ? h("button", { type: "button", title: change.back, onclick: () => perform(change.back) }, `Undo: ${change.back}`) : null;
      list.prepend(h("li", {}, h("time", {}, `${number(change.time_s, 1)} s`), " ", h("b", {}, change.line), change.note ? ` – ${change.note} ` : " ", back));
      while (list.children.length > CHANGES_SHOWN) list.lastElementChild.remove();
    }
  }

  async function loop() {
    if (running) return;
    running = true;
    while (shown) {
      const began = performance.now();
      // A hidden page requests nothing.
      if (!document.hidden) {
        if (!forms) await fetchForms();
        if (forms) {
          const reply = await ask({ do: "look_around", after: newest });
          if (reply.ok) take(reply.result);
          else if (reply.error.kind === "no_world") break;
        }
      }
      const wait = forms && !document.hidden ? PICTURE_MS : RETRY_MS;
      await new Promise((resolve) => setTimeout(resolve, Math.max(0, wait - (performance.now() - began))));
    }
    running = false;
  }

  async function fetchForms() {
    const reply = await ask({ do: "world_forms" });
    if (!reply.ok) return;
    forms = reply.result.forms;
    const { is_virtual } = reply.result;
    controls.hidden = !is_virtual;
    if (!is_virtual) setText(about, NOT_VIRTUAL);
  }

  function update() {
    controls.disabled = !inControl();
    controls.title = controls.disabled ? "Take control to change the world" : "";
    if (!shown) {
      shown = true;
      loop();
    }
  }

  return { root, update, hide: () => (shown = false) };
}
