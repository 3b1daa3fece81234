// The Bus view: the nodes of the bus.

import { ask, link } from "./link.js";
import { SORTED, chosenNodes, summary } from "./bus_rows.js";
import { h, hex, number, setText, toggle } from "./dom.js";
import { pointed } from "./help.js";

const COLUMNS = ["Node", "Model", "NMT state", "Heartbeat", "Power state", "Position", "Speed", "Fault", "Identity (1018h)"];

export function busView(shared, open) {
  const scan = h("button", { type: "button", id: "scan", onclick: () => ask({ do: "scan" }) }, "Scan");
  const rows = h("tbody");
  const empty = h("p", { class: "quiet" });
  const wire = h("p", { id: "wire", role: "status" });
  const words = h("input", { type: "search", id: "bus-filter", size: "24", placeholder: "words, such as 4 or fault", "aria-label": "Words that a node must have", oninput: () => link.state && update(link.state) });
  const only = toggle("bus-faults", "faults only", false, () => link.state && update(link.state));
  const all = h("span", { class: "quiet", role: "status", id: "bus-summary" });
  const order = { by: "Node", down: false };
  const heads = COLUMNS.map((title) => h("th", { scope: "col", "data-label": title }, SORTED.includes(title) ? h("button", { type: "button", class: "plain", title: `Sort by ${title.toLowerCase()}`, onclick: () => sortBy(title) }, title) : title));
  const root = h(
    "section",
    { class: "bus" },
    h("div", { class: "bar" }, h("h2", {}, "Bus"), scan, words, only, all),
    wire,
    h("table", {}, h("thead", {}, h("tr", {}, ...heads)), rows),
    empty,
  );

  function sortBy(title) {
    order.down = order.by === title && !order.down;
    order.by = title;
    if (link.state) update(link.state);
  }

  function row(node) {
    const look = () => {
      shared.node = node;
      open();
    };
    const name = h("button", { type: "button", class: "plain", onclick: look });
    const cells = COLUMNS.map((_, at) => h("td", { "data-label": COLUMNS[at] }));
    cells[0].append(name);
    return h("tr", { "data-node": String(node), onclick: look }, ...cells);
  }

  /** Bus load, and the errors that the controller and the connection report. */
  function tellWire({ frames_per_s, load_percent, bitrate, health }) {
    const rate = bitrate === null ? "bit rate unknown" : `${bitrate / 1000} kbit/s`;
    const load = load_percent === null ? "" : `, load ${number(load_percent, 1)} %`;
    const count = (value, what) => (value === null ? [] : [`${what} ${value}`]);
    const counters = [...count(health.transmit_errors, "transmit error counter"), ...count(health.receive_errors, "receive error counter")];
    const lost = health.frames_lost ? [`${health.frames_lost} frames lost`] : [];
    const errors = health.state === null && !counters.length && !health.error_frames ? ["no errors reported"] : [health.state ?? "controller", ...counters, `${health.error_frames} error frames`];
    setText(wire, `${rate}, ${frames_per_s} frames/s${load} · ${[...errors, ...lost].join(", ")}`);
    wire.className = ["bus-off", "error-passive", "connection lost"].includes(health.state) || lost.length ? "bad" : "quiet";
  }

  function update(state) {
    tellWire(state.bus);
    scan.disabled = state.scanning;
    setText(scan, state.scanning ? "Scanning …" : "Scan");
    const nodes = chosenNodes(state.nodes, { words: words.value, only: only.checked, ...order });
    setText(all, summary(state.nodes));
    heads.forEach((head) => head.setAttribute("aria-sort", head.dataset.label !== order.by ? "none" : order.down ? "descending" : "ascending"));
    // Rows that only change places keep the focus.
    if ([...rows.children].map((tr) => tr.dataset.node).join() !== nodes.map(({ node }) => node).join()) {
      const known = new Map([...rows.children].map((tr) => [Number(tr.dataset.node), tr]));
      rows.replaceChildren(...nodes.map(({ node }) => known.get(node) ?? row(node)));
    }
    nodes.forEach((node, at) => {
      const cells = rows.children[at].children;
      const drive = node.drive;
      setText(cells[0].firstChild, String(node.node));
      setText(cells[1], node.title ?? "unknown");
      cells[1].title = node.remark ?? "";
      setText(cells[2], node.nmt ?? "–");
      setText(cells[3], node.heartbeat_age_ms === null ? "none heard" : `${number(node.heartbeat_age_ms / 1000, 1)} s ago`);
      setText(cells[4], node.trouble ? "no answer" : (drive?.state ?? "–"));
      cells[4].className = drive?.state === "Operation enabled" ? "good" : "";
      pointed(cells[2], "nmt", node.nmt ?? "–", node.node);
      pointed(cells[4], "state", drive?.state ?? "–", node.node);
      pointed(cells[7], "fault", drive?.faults[0]?.name ?? "none", node.node);
      setText(cells[5], drive?.angle_degrees === null || !drive ? "–" : `${number(drive.angle_degrees, 1)}°`);
      setText(cells[6], drive?.velocity_rpm === null || !drive ? "–" : `${number(drive.velocity_rpm, 1)} r/min`);
      const fault = drive?.fault_code ? `${hex(drive.fault_code, 4)} ${drive.faults.map((row) => row.name).join(", ")}` : drive?.fault_code === 0 ? "none" : "not known";
      setText(cells[7], node.trouble ? node.trouble : drive ? fault : "–");
      cells[7].className = node.trouble || drive?.fault_code ? "bad" : "";
      setText(cells[8], [node.vendor_id, node.product_code, node.revision_number].map((part) => hex(part, 1)).join(" : "));
    });
    setText(empty, nodes.length ? "" : state.nodes.length ? "No node has these words." : state.scanning ? "Asking all 127 node-IDs …" : "No node answers. Check supply, cable, termination (60 Ω between CAN_H and CAN_L) and bit rate, then scan again.");
  }

  return { root, update };
}
