// Help: the `?` key on the element that has the focus or the pointer, or a press on a word with a dotted line.
// Every text comes from the studio: the description of the drive with the section of its manual, or the clause of the standard.

import { ask } from "./link.js";
import { h } from "./dom.js";

/** Marks an element that has help; `node` where the answer depends on the model. */
export function pointed(element, topic, name, node = null) {
  element.dataset.help = topic;
  element.dataset.name = name;
  if (node !== null) element.dataset.of = String(node);
  return element;
}

/** The same, and it can have the focus. */
export function helped(element, topic, name, node = null) {
  if (element.tabIndex < 0) element.setAttribute("tabindex", "0");
  return pointed(element, topic, name, node);
}

/** Help texts that came with their element, and need no request. */
const texts = new WeakMap();

/** Marks an element whose help came with it: `{ title, text, source }`. */
export function documented(element, meaning) {
  texts.set(element, meaning);
  return pointed(element, "documented", meaning.title);
}

/** A word that shows its help when pressed. */
export const term = (topic, name, node = null) => helped(h("button", { type: "button", class: "term", title: "What is this? (?)" }, name), topic, name, node);

/** Words separated by commas. */
export const terms = (topic, names, node) => names.flatMap((name, at) => [...(at ? [", "] : []), term(topic, name, node)]);

/** `settings` is at its end, whatever it shows. */
export function helpPanel(shared, settings) {
  const title = h("h3");
  const body = h("div");
  const close = h("button", { type: "button", id: "help-close", onclick: () => hide() }, "Close");
  const root = h("aside", { id: "help", role: "dialog", "aria-label": "Help", hidden: true }, h("div", { class: "bar" }, title, close), body, h("div", { class: "bar" }, settings));
  let before = null;
  /** Further entries: name, whether it is offered now, and what to call. */
  const offers = [];

  function hide() {
    if (root.hidden) return;
    root.hidden = true;
    if (before?.isConnected) before.focus();
  }

  function open(heading, ...children) {
    if (root.hidden) before = document.activeElement;
    title.textContent = heading;
    body.replaceChildren(...children);
    root.hidden = false;
  }

  async function about(element) {
    const known = texts.get(element);
    if (known) return open(known.title, h("p", {}, known.text), ...(known.source ? [h("p", { class: "quiet" }, `Source: ${known.source}`)] : []));
    const { help, name, of: node } = element.dataset;
    const answer = await ask({ do: "help", node: node ? Number(node) : shared.node, topic: help, name });
    if (!answer.ok) return open(name, h("p", {}, answer.error.message));
    const meaning = answer.result;
    const facts = [
      ["Values", (meaning.meanings ?? []).map(([value, text]) => `${value}: ${text}`).join("; ")],
      ["Range", meaning.range],
      ["Unit of one count", meaning.unit],
      ["Default", meaning.default],
      ["Access", meaning.access],
    ].filter(([, text]) => text);
    const list = facts.flatMap(([what, text]) => [h("dt", {}, what), h("dd", {}, text)]);
    open(meaning.title, h("p", {}, meaning.text), ...(list.length ? [h("dl", {}, ...list)] : []), h("p", { class: "quiet" }, `Source: ${meaning.source}`));
  }

  /** Where no element has the focus or the pointer: a list of what has help in this view. */
  function overview() {
    const seen = new Set();
    /** @type {any[]} */
    const marked = [...document.querySelectorAll("#view [data-help]")];
    const all = marked.filter((element) => {
      const key = `${element.dataset.help} ${element.dataset.name}`;
      return element.getClientRects().length && !seen.has(key) && seen.add(key);
    });
    const some = all.slice(0, 40).map((element) => h("li", {}, h("button", { type: "button", class: "term", onclick: () => about(element) }, element.dataset.name)));
    open("Help in this view", h("p", {}, "Press ? on an element that has the focus or the pointer, or press a word."), h("ul", { class: "plain-list" }, ...some), ...offers.filter(([, is_there]) => is_there()).map(([name, , take]) => h("button", { type: "button", class: "offer", onclick: () => (hide(), take()) }, name)));
  }

  function key() {
    const focused = document.activeElement?.closest?.("[data-help]");
    const under = [...document.querySelectorAll("[data-help]:hover")].at(-1);
    const element = focused ?? under;
    if (element) about(element);
    else if (root.hidden) overview();
    else hide();
  }

  document.addEventListener("click", (event) => {
    const pressed = event.target instanceof Element && event.target.closest("button.term[data-help]");
    if (pressed) about(pressed);
  });
  const offer = (name, is_there, take) => offers.push([name, is_there, take]);
  return { root, key, hide, offer, overview: () => (root.hidden ? overview() : hide()) };
}
