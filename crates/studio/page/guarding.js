// Shows in red, before the first motion of a drive, that nothing would stop it if the host died, and asks once for confirmation.

import { ask } from "./link.js";
import { h, renew } from "./dom.js";
import { host_name } from "./transport.js";

/** `report` takes the answer. `update` takes the nodes that are about to be moved. */
export function guarding(id, report) {
  const root = h("div", { class: "guarding", id, role: "status" });
  let open = [];

  async function accept() {
    for (const node of open) {
      if (!report(`Node ${node}`, await ask({ do: "accept_unguarded", node })).ok) return;
    }
  }

  const line = ({ node, goes_on, without_us }) =>
    without_us && h("p", { class: goes_on ? "bad" : "quiet" }, `Node ${node}: if ${host_name} dies, ${without_us}.${goes_on ? " Keep an emergency stop within reach." : ""}`);

  function update(nodes, mine) {
    open = nodes.filter((node) => node.goes_on && !node.accepted).map(({ node }) => node);
    const key = JSON.stringify([open, mine, nodes.map(({ node, goes_on, without_us }) => [node, goes_on, without_us])]);
    renew(root, key, () => [
      ...nodes.map(line).filter(Boolean),
      ...(open.length && mine ? [h("p", {}, h("button", { type: "button", class: "danger", onclick: accept }, `Move ${open.length === 1 ? "it" : "them"} anyway`), " Until then this page does not move it.")] : []),
    ]);
  }

  /** True if they may be moved; else asks for confirmation. */
  function isAccepted() {
    if (!open.length) return true;
    const button = root.querySelector("button");
    button?.scrollIntoView({ block: "nearest" });
    button?.focus();
    return false;
  }

  return { root, update, isAccepted };
}
