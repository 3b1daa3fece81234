// The speed limit of this page: a field that the browser keeps, and that the studio enforces.

import { ask, link, on } from "./link.js";
import { h, setText } from "./dom.js";

const KEY = "speed-limit-rpm";

export function speedLimit(report) {
  const input = h("input", { id: "speed-limit", type: "number", step: "any", min: "0", placeholder: "none", inputmode: "decimal", value: localStorage.getItem(KEY) ?? "" });
  const status = h("span", { class: "quiet", role: "status" });
  const root = h("div", { class: "bar" }, h("label", { for: "speed-limit" }, "Speed limit ", input, " r/min"), status);
  /** The welcome message of the session to which the limit was sent. */
  let given_to = null;

  async function send() {
    const text = input.value.trim();
    const { ok } = report("Speed limit", await ask({ do: "limit_speed", rpm: text === "" ? null : Number(text) }));
    setText(status, !ok ? "Not set: the previous limit stays." : text === "" ? "" : "The studio refuses every motion of this page that is faster, or may be.");
    if (ok) localStorage.setItem(KEY, text);
  }
  // The browser gives an empty value for what is not a number: that must not remove the limit.
  input.addEventListener("change", () => (input.validity.badInput ? setText(status, "Not set: expected a number, such as 60.") : send()));

  // Each connection is a new session without a limit. It must take control only after this.
  on("state", () => {
    if (link.welcome === given_to) return;
    given_to = link.welcome;
    if (given_to !== null && input.value.trim() !== "") send();
  });

  return root;
}
