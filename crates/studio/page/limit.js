// The speed limit of this page: a field that the browser keeps, and the studio holds whatever is asked for to.

import { ask, link, on } from "./link.js";
import { h, say } from "./dom.js";

const KEY = "speed-limit-rpm";

export function speedLimit(report) {
  const input = h("input", { id: "speed-limit", type: "number", step: "any", min: "0", placeholder: "none", inputmode: "decimal", value: localStorage.getItem(KEY) ?? "" });
  const status = h("span", { class: "quiet", role: "status" });
  const root = h("div", { class: "bar" }, h("label", { for: "speed-limit" }, "Speed limit ", input, " r/min"), status);
  /** The welcome message of the session that has been given the limit. */
  let given_to = null;

  async function send() {
    const text = input.value.trim();
    const { ok } = report("Speed limit", await ask({ do: "limit_speed", rpm: text === "" ? null : Number(text) }));
    say(status, !ok ? "Not set: the limit before holds." : text === "" ? "" : "The studio refuses what this page asks for beyond it, and what may be beyond it.");
    if (ok) localStorage.setItem(KEY, text);
  }
  // What cannot be read as a number comes as an empty field: that takes no limit away.
  input.addEventListener("change", () => (input.validity.badInput ? say(status, "Not set: expected a number, such as 60.") : send()));

  // Each connection is a session of its own, and knows of no limit. It has to take control after this.
  on("state", () => {
    if (link.welcome === given_to) return;
    given_to = link.welcome;
    if (given_to !== null && input.value.trim() !== "") send();
  });

  return root;
}
