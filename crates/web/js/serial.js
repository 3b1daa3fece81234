// Real drives by a cable: a serial CAN adapter (slcan), which a person chooses, and what is said before anything moves by it.

import { choice } from "./page/choice.js";
import { h, renew, setText, toggle } from "./page/dom.js";
import { link } from "./page/link.js";
import { tellWorker } from "./page/transport.js";

const BITRATES = { "10k": 10_000, "20k": 20_000, "50k": 50_000, "100k": 100_000, "125k": 125_000, "250k": 250_000, "500k": 500_000, "800k": 800_000, "1M": 1_000_000 };
const kept = JSON.parse(sessionStorage.getItem("serial"));

const rate = Object.keys(BITRATES).find((text) => BITRATES[text] === kept?.bitrate) ?? "500k";
const bitrate = choice("serial-bitrate", "Bit rate of the bus", Object.keys(BITRATES).map((text) => ({ value: text, text })), { value: rate });
const baud = h("input", { id: "serial-baud", type: "number", min: "9600", max: "4000000", value: String(kept?.baud ?? 115_200), inputmode: "numeric" });
const ready = toggle("serial-ready", "An emergency stop that takes the power away is within reach", false, () => (choose.disabled = !ready.checked));
const choose = h("button", { type: "button", id: "serial-choose", class: "primary", disabled: true, onclick: begin }, "Choose the adapter …");
const refused = h("p", { class: "bad", role: "alert", id: "serial-refused" });

/** The page asks for the port on a click, as browsers require, and its worker opens it. One adapter at a time. */
async function begin() {
  setText(refused, "");
  try {
    // A port that is forgotten is closed in every tab, whatever moves there.
    const { held } = await navigator.locks.query();
    if (held.some(({ name }) => name === "serial")) return setText(refused, "This page has an adapter already, in this tab or in another: choose Disconnect there first.");
    const port = await navigator.serial.requestPort();
    for (const other of await navigator.serial.getPorts()) if (other !== port) await other.forget();
    const { usbVendorId, usbProductId } = port.getInfo();
    const id = (number) => number.toString(16).padStart(4, "0");
    const name = usbVendorId === undefined ? "serial adapter" : `USB ${id(usbVendorId)}:${id(usbProductId)}`;
    sessionStorage.setItem("serial", JSON.stringify({ name, bitrate: BITRATES[bitrate.value], baud: Number(baud.value) }));
    location.reload();
  } catch (error) {
    setText(refused, error.name === "NotFoundError" ? "No adapter was chosen." : `The adapter cannot be used: ${error.message}`);
  }
}

const lacking = !isSecureContext
  ? "Browsers open serial ports for pages from https or from this machine alone: this one is neither."
  : "This browser has no Web Serial. Chrome, Edge, Opera and Chromium on a computer have it, and Firefox from version 151 on; Safari does not. Without it the program ferrodrive reaches the same adapters.";
const lacking_in_workers =
  "This browser has Web Serial for pages and not for workers: a page that hangs could stop nothing there. Chrome, Edge, Opera and Chromium on a computer have both. Without it the program ferrodrive reaches the same adapters.";

const item = (text) => h("li", {}, text);
const dialog = h(
  "dialog",
  { id: "serial", "aria-label": "Real drives by a cable" },
  h("button", { type: "button", class: "close", onclick: () => dialog.close() }, "Close"),
  h("h2", {}, "Real drives by a cable"),
  h("p", {}, "A USB or serial CAN adapter that speaks slcan (CANable with slcan firmware, LAWICEL and alike). Real motors will turn."),
  h("h3", {}, "This page stops what it moved when"),
  h("ul", {}, item("you press STOP, Esc or Space"), item("the tab is hidden, closed or loaded again"), item("the page hangs for 3 s (a jog: 0.2 s)"), item("the machine wakes, or the browser was held up for 1 s"), item("the adapter refuses frames, or sends what is not slcan")),
  h("h3", {}, "It cannot stop anything when"),
  h("ul", {}, item("the machine sleeps, or the browser crashes or freezes"), item("the adapter or its cable is pulled out"), item("the tab is closed and the browser lets nothing more be sent")),
  h("p", {}, "Then only a drive's own watch over this page stops it. The page sets that watch before a drive moves, and shows for each drive what it does. A drive that has none moves only after you have accepted that."),
  ...("serial" in navigator
    ? [
        h("div", { class: "row" }, h("span", {}, "Bit rate of the bus ", bitrate), h("label", {}, "Speed of a serial line ", baud, " baud")),
        h("p", { class: "row" }, ready, choose),
        refused,
      ]
    : [h("p", { class: "bad", id: "serial-lacking" }, lacking)]),
);
document.body.append(dialog);

/** The host is in a worker: whether it can open the port is asked of one, before an adapter is chosen. */
function askWorker() {
  if (!("serial" in navigator)) return;
  const worker = new Worker("serial_worker.js", { type: "module" });
  worker.postMessage({ probe: true });
  worker.onmessage = ({ data }) => {
    worker.terminate();
    if (data.has_serial) return;
    ready.closest(".row").remove();
    dialog.append(h("p", { class: "bad", id: "serial-lacking" }, lacking_in_workers));
  };
}

const top = document.getElementById("top");
const status = h("span", { id: "serial-status", role: "status" });
top.append(h("button", { type: "button", id: "serial-open", title: "Real drives, by a serial CAN adapter", onclick: () => (dialog.show(), askWorker()) }, "Cable …"), status);

const alert = h("div", { id: "serial-alert", role: "alert", hidden: true });
document.getElementById("alerts").prepend(alert);

/** What was said of drives that may be moving, as `[why, moving]`: over a reload too, until a person has seen it. */
const UNSEEN = "serial-unseen";
const unseen = JSON.parse(sessionStorage.getItem(UNSEEN));
if (unseen) say(...unseen);

if (kept) attach();

/** This tab has an adapter in place of virtual drives. */
function attach() {
  document.documentElement.classList.add("cable");
  const detach = h("button", { type: "button", id: "serial-leave", title: "Stop what this page moved, close the adapter, and go back to virtual drives" }, "Disconnect");
  top.append(detach);
  let leaving = false;
  /** The nodes that this page has set in motion, and that were not seen to stand since. */
  let moved = [];
  detach.addEventListener("click", () => {
    if (leaving) return left(moved.map((node) => may_move(node, "whether its quick stop was sent, and that it stands, was not awaited")));
    leaving = true;
    setText(detach, "Stopping … (again: at once)");
    tellWorker({ leave: true });
  });
  function left(moving) {
    sessionStorage.removeItem("serial");
    // Shown beside the virtual drives.
    if (moving.length) say("This page has taken leave of the adapter. Use the emergency stop:", moving);
    location.reload();
  }
  addEventListener("serial-left", ({ detail }) => left(detail.moving));

  /** With what it does by itself. */
  function may_move(node, why) {
    const without_us = link.state?.nodes.find((one) => one.node === node)?.without_us;
    return `node ${node} may still be moving: ${why}${without_us ? `; without this page ${without_us}` : ""}`;
  }
  // Before the worker that has reached them is replaced by one that has moved nothing.
  addEventListener("machine-ended", ({ detail }) => {
    leaving = false;
    setText(detach, "Disconnect");
    status.className = "bad";
    setText(status, `${kept.name} at ${rate}: the host in this page has ended`);
    say(detail, moved.map((node) => may_move(node, "this page cannot stop it any more")));
  });

  addEventListener("serial-line", ({ detail: { line, why, hosts, moved: nodes } }) => {
    moved = nodes;
    const texts = { open: "connected", opening: "opening …", closed: why ?? "opening …" };
    status.className = line === "open" ? "good" : line === "opening" ? "quiet" : "bad";
    // An attempt each second: the reason of the last one stays until the channel opens.
    if (line === "opening" && status.dataset.line === "closed") return;
    status.dataset.line = line;
    setText(status, `${kept.name} at ${rate}: ${texts[line]}`);
    if (line === "closed" && !hosts && why) say(`No bus yet: ${why}`, []);
    else if (line === "open" && alert.dataset.early) alert.hidden = true;
  });
  addEventListener("serial-let-go", ({ detail: { why, moved, moving } }) => {
    // The adapter, and errors of the browser, end with a full stop or without.
    const what = why.replace(/\.$/, "");
    const had_control = link.welcome !== null && link.state?.controller === link.welcome.session;
    const nodes = `node${moved.length > 1 ? "s" : ""} ${moved.join(", ")}`;
    if (moving.length) say(`${what}.`, moving);
    else if (moved.length) say(`${what}: a quick stop was ordered for ${nodes}. Whether it stands is shown at the drive; control has to be taken again.`, []);
    else if (had_control) say(`${what}: control has to be taken again.`, []);
  });

  // A page that is not seen moves nothing.
  const let_go = (why) => tellWorker({ let_go: why });
  document.addEventListener("visibilitychange", () => document.hidden && let_go("The tab was hidden"));
  addEventListener("pagehide", () => let_go("The page was closed"));
  // Files would replace the machine.
  addEventListener("drop", (event) => (event.preventDefault(), event.stopImmediatePropagation()), { capture: true });
}

function say(why, moving) {
  // Which drives may be moving stays until it was seen.
  if (!alert.hidden && alert.dataset.urgent && !moving.length) return;
  alert.hidden = false;
  if (moving.length) {
    alert.dataset.urgent = "1";
    sessionStorage.setItem(UNSEEN, JSON.stringify([why, moving]));
  } else delete alert.dataset.urgent;
  if (why.startsWith("No bus yet")) alert.dataset.early = "1";
  else delete alert.dataset.early;
  renew(alert, JSON.stringify([why, moving]), () => [
    h("p", {}, why, " ", h("button", { type: "button", onclick: seen }, "Seen")),
    ...moving.map((text) => h("p", { class: "urgent" }, text)),
  ]);
}

function seen() {
  alert.hidden = true;
  sessionStorage.removeItem(UNSEEN);
}
