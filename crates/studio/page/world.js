// The World view: the machine around virtual drives, as it truly is and not as the drives say, and what may be done to it.

import { ask, inControl } from "./link.js";
import { h, number, say } from "./dom.js";
import { alternatives, commandForm, subject } from "./world_form.js";
import { drivePicture } from "./world_picture.js";

/** Pictures a second: the next is asked for when the one before has come. */
const PICTURE_MS = 33;
const RETRY_MS = 1000;
const CHANGES_SHOWN = 200;
/** Of a group that is about no single drive. */
const ALL = " of all";

const NOT_VIRTUAL =
  "The drives on this bus are real, or another program's: nothing here can change what is around them. " +
  "A simulator that serves its bus (ferrodrive sim) takes such commands on its standard input and by ferrodrive world; without --bus the studio has a virtual machine of its own.";

export function worldView(shared, report) {
  const about = h("p", { class: "quiet", role: "status" });
  const cards = h("div", { class: "world-cards", role: "group", "aria-label": "The drives as they are" });
  const line = h("input", { id: "world-line", size: "36", placeholder: "4 supply 30 limit 5", "aria-label": "A command in words", autocomplete: "off" });
  const free = h("form", { class: "bar", onsubmit: (event) => { event.preventDefault(); perform(line.value); } }, line, h("button", { id: "world-do" }, "Do"), h("span", { class: "quiet" }, "Any command in words, as ferrodrive sim takes it"));
  const groups = h("div", { class: "world-groups" });
  const answer = h("p", { id: "world-answer", role: "status" });
  const list = h("ol", { class: "world-changes", reversed: true });
  const controls = h("fieldset", { class: "world-controls" }, free, h("h3", {}, "Done so far"), list, groups);
  const root = h("section", { class: "world" }, about, cards, answer, controls);

  /** By place: the picture of a drive. */
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
    const told = report("World", await ask({ do: "change_world", line: text }));
    say(answer, told.ok ? (told.notes ?? []).join(" ") : told.error.message);
    answer.className = told.ok ? "quiet" : "bad";
    if (told.ok) line.value = "";
  }

  /** A group of forms for each thing that can be done something with. */
  function drawForms() {
    const names = (word) => (word === "body" ? bodies : inputs);
    const found = new Map();
    for (const command of forms.flatMap(alternatives)) {
      if (command.startsWith("body") && bodies.length === 0) continue;
      if (/^NODE (input|switch) NAME/.test(command) && inputs.length === 0) continue;
      const name = command.startsWith("NODE") ? subject(command) : `${subject(command)}${ALL}`;
      found.set(name, [...(found.get(name) ?? []), commandForm(command, { place: () => place, names, run: perform })]);
    }
    groups.replaceChildren(...[...found].map(([name, of]) => h("div", { class: "form", "data-group": name }, name.endsWith(ALL) ? h("p", { class: "quiet" }, "The wire, for every node") : null, ...of)));
  }

  function choose(next) {
    place = next;
    for (const [of, { root: card }] of pictures) card.setAttribute("aria-pressed", String(of === place));
    say(about, `Chosen: drive ${place}. Drawn is where the shafts truly are. The forms below are for the chosen drive; choose another by its picture.`);
  }

  function take(seen) {
    for (const node of seen.nodes) {
      if (!pictures.has(node.place)) {
        const picture = drivePicture(`${node.place} ${node.model}`);
        picture.root.addEventListener("click", () => choose(node.place));
        picture.root.dataset.place = node.place;
        pictures.set(node.place, picture);
        cards.append(picture.root);
      }
      pictures.get(node.place).update(node);
    }
    if (!pictures.has(place)) choose(pictures.has(String(shared.node)) ? String(shared.node) : seen.nodes[0]?.place);
    inputs = Object.keys(seen.nodes.find((node) => node.place === place)?.inputs ?? {});
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
      // A page that nobody sees asks for nothing.
      if (!document.hidden) {
        if (!forms) await fetchForms();
        if (forms) {
          const told = await ask({ do: "look_around", after: newest });
          if (told.ok) take(told.result);
          else if (told.error.kind === "no_world") break;
        }
      }
      const wait = forms && !document.hidden ? PICTURE_MS : RETRY_MS;
      await new Promise((resolve) => setTimeout(resolve, Math.max(0, wait - (performance.now() - began))));
    }
    running = false;
  }

  async function fetchForms() {
    const told = await ask({ do: "world_forms" });
    if (!told.ok) return;
    forms = told.result.forms;
    const { is_virtual } = told.result;
    controls.hidden = !is_virtual;
    if (!is_virtual) say(about, NOT_VIRTUAL);
  }

  function update() {
    controls.disabled = !inControl();
    controls.title = controls.disabled ? "Take control to change the world; everybody may look" : "";
    if (!shown) {
      shown = true;
      loop();
    }
  }

  return { root, update, hide: () => (shown = false) };
}
