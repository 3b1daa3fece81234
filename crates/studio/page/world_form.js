// Commands to the world, as forms: each made from the usage text of the simulator, such as
// "NODE supply VOLTS [limit AMPERES] [resistance OHMS]". There is no table of commands here.

import { choice } from "./choice.js";
import { h } from "./dom.js";

/** Each list of the forms has its own id. */
let ids = 0;
const nextId = () => `world-choice-${(ids += 1)}`;
const named = (word) => ({ value: word, text: word });

const isWord = (token) => /^[a-z]+$/.test(token);
const isChoice = (token) => token.includes("|") && token.split("|").every((one) => /^[a-z0-9]+$/.test(one));

/** The single commands of a usage text, which may name several: "NODE cable cut, or bus corrupt off". */
export const alternatives = (text) => text.split(/,\s+(?:or\s+)?(?=NODE |bus |body )/);

/** The parts of a command: `{ word }`, `{ choice }` or `{ hint }`; in brackets with `optional`, and `before` for the words that go with it. */
export function parts(command) {
  const hint = /\(([^)]*)\)/.exec(command)?.[1] ?? "";
  const tokens = command.replace(/\([^)]*\)/g, " ").replace(/[[\]]/g, " $& ").trim().split(/\s+/);
  const found = [];
  let depth = 0;
  let before = [];
  for (const token of tokens) {
    if (token === "[") depth += 1;
    else if (token === "]") depth -= 1;
    else if (depth > 0 && isWord(token)) before.push(token);
    else {
      const optional = depth > 0;
      if (isWord(token)) found.push({ word: token });
      else if (isChoice(token)) found.push({ choice: token.split("|"), optional, before });
      else found.push({ hint: token.replace("|", " or "), optional, before });
      before = [];
    }
  }
  return { found, hint };
}

/** The subject of a command: its words before the first choice. */
export function subject(command) {
  const { found } = parts(command);
  return found[0].word ?? found[1]?.word ?? command;
}

/** A form for one command. `names(word)`: the names that may follow a word; `run(line)`: performs it; `place()`: the node. */
export function commandForm(command, { place, names, run }) {
  const { found, hint } = parts(command);
  const fields = [];
  const shown = [];
  /** @type {any} */
  let last = null;
  found.forEach((part, at) => {
    const before = found[at - 1]?.word;
    if (part.word) {
      fields.push(() => [part.word]);
      shown.push(h("b", {}, part.word));
    } else if (part.hint === "NODE") {
      fields.push(() => [place()]);
    } else if (part.choice && at === found.length - 1) {
      last = part.choice;
    } else if (part.choice) {
      const list = choice(nextId(), part.choice.join(", "), part.choice.map(named));
      fields.push(() => [list.value]);
      shown.push(list);
    } else {
      const of = part.hint === "NAME" ? names(before) : null;
      const label = [...part.before, part.hint].join(" ");
      const field = of ? choice(nextId(), label, of.map(named)) : h("input", { size: "9", placeholder: label, "aria-label": label, required: !part.optional, autocomplete: "off" });
      fields.push(() => (field.value.trim() === "" ? [] : [...part.before, field.value.trim()]));
      shown.push(field);
    }
  });
  const line = (end = undefined) => [...fields.flatMap((field) => field()), ...(end === undefined ? [] : [end])].join(" ");
  const buttons = last
    ? last.map((end) => h("button", { type: "button", "data-line": `${found.map((part) => part.word).filter(Boolean).join(" ")} ${end}`, onclick: () => form.reportValidity() && run(line(end)) }, end))
    : [h("button", {}, "Do")];
  const form = h(
    "form",
    {
      class: "world-form",
      title: hint || command,
      onsubmit: (event) => {
        event.preventDefault();
        // If the last part is a choice, choosing performs the command.
        if (!last) run(line());
      },
    },
    ...shown,
    ...buttons,
  );
  return form;
}
