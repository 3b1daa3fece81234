// The machine of a page without a server: chosen from a list, from a file or by a link, and scenarios to play.

import { choice } from "./page/choice.js";
import { h } from "./page/dom.js";
import { link, on } from "./page/link.js";
import { report } from "./page/main.js";
import { filesOf, present, storeOf, storedOf, tellWorker } from "./page/transport.js";

const given = JSON.parse(document.getElementById("given").textContent);
const LARGEST_FILE = 2 ** 20;

/** This tab has this machine from now on. With `keeps` its drives have what those of the machine before have stored. */
function begin(machine, files = {}, keeps = false) {
  try {
    const stored = localStorage.getItem(storeOf(present().machine));
    if (keeps && stored) localStorage.setItem(storeOf(machine), stored);
    // Where the new one is refused, this one is there again.
    sessionStorage.setItem("machine-before", JSON.stringify(present()));
    sessionStorage.setItem("machine", JSON.stringify({ machine, files }));
  } catch (error) {
    return say(`The browser has no room for this machine: ${error.message}`, "bad");
  }
  location.reload();
}

const status = h("span", { role: "status", id: "machine-status" });
const say = (text, kind = "quiet") => {
  status.className = kind;
  status.replaceChildren(text);
};
addEventListener("machine-ended", ({ detail }) => say(detail, "bad"));

const list = choice("machine-choice", "Machine", [], { onchange: () => pick(list.value) });
list.offer([
  { value: "", text: "Machine …" },
  ...given.machines.map(({ title }, at) => ({ value: `machine ${at}`, text: title })),
  ...given.scenarios.map(({ title }, at) => ({ value: `scenario ${at}`, text: `Scenario: ${title}` })),
]);

function pick(value) {
  const [kind, at] = value.split(" ");
  if (kind === "machine") begin(given.machines[at].text);
  else if (kind === "scenario") play(given.scenarios[at]);
}

/** Runs a scenario in a worker of its own, faster than the clock, and shows what it found. */
function play({ title, text, files = {} }) {
  say(`${title} …`);
  const worker = new Worker("scenario.js", { type: "module" });
  worker.onmessage = ({ data }) => {
    worker.terminate();
    say("");
    show(title, Object.keys(files).length ? null : text, data);
  };
  worker.onerror = (event) => say(`${title}: ${event.message ?? "it cannot be run"}`);
  worker.postMessage({ scenario: text, files: filesOf(files) });
}

/** `text` is the scenario, if it is all in one file. */
function show(title, text, { outcome, error }) {
  const rows = (outcome?.rows ?? []).map((row) =>
    h("tr", { class: row.verdict === "passed" ? "" : "bad" }, ...[row.t === null ? "–" : `${row.t.toFixed(3)} s`, row.kind, row.name, row.asked, row.seen, row.verdict].map((cell) => h("td", {}, cell))),
  );
  const heads = h("tr", {}, ...["Time", "What", "Name", "Asked", "Seen", "Verdict"].map((head) => h("th", {}, head)));
  const found = outcome
    ? h("p", {}, `${outcome.ok ? "As expected" : "NOT as expected"}: ${outcome.end_s.toFixed(3)} s of virtual time, seed ${outcome.seed}, digest ${outcome.digest}`)
    : h("p", { class: "bad" }, error);
  const to_scenario = text === null ? [] : [h("button", { type: "button", id: "scenario-link", title: "Copy a link that plays this scenario", onclick: () => copy("scenario", text) }, "Link")];
  const dialog = h("dialog", { id: "scenario" }, h("button", { type: "button", class: "close", onclick: () => dialog.remove() }, "Close"), ...to_scenario, h("h2", {}, title), found, h("table", {}, h("thead", {}, heads), h("tbody", {}, ...rows)));
  document.getElementById("scenario")?.remove();
  document.body.append(dialog);
  dialog.show();
}

/** The address with this machine. Data sheets are not in it. */
function copyLink() {
  const { machine, files } = present();
  if (Object.keys(files).length) return say("A machine with data sheets is too large for a link: hand on its files");
  copy("machine", machine);
}

async function copy(what, text) {
  const url = new URL(location.href);
  url.hash = `${what}=${encodeURIComponent(text)}`;
  try {
    await navigator.clipboard.writeText(url.href);
    say(`The link is copied: it holds the ${what}`);
  } catch {
    // Without the event of a changed address, which shows another view.
    history.replaceState(null, "", url);
    say(`The address holds the ${what} now`);
  }
}

/** A data sheet as it is kept: its text, or its bytes, of which each is a character, where it is not UTF-8. */
async function sheet(file) {
  const bytes = new Uint8Array(await file.arrayBuffer());
  try {
    return new TextDecoder("utf-8", { fatal: true, ignoreBOM: true }).decode(bytes);
  } catch {
    return { bytes: Array.from(bytes, (byte) => String.fromCharCode(byte)).join("") };
  }
}

/** Machine files, scenarios and data sheets that are dropped or chosen. */
async function take(files) {
  const sheets = {};
  let file_of = null;
  for (const file of files) {
    if (file.size > LARGEST_FILE) return say(`${file.name} has ${file.size} bytes; at most ${LARGEST_FILE} are read`, "bad");
    if (/\.(eds|dcf)$/i.test(file.name)) sheets[file.name] = await sheet(file);
    else if (/\.toml$/i.test(file.name)) {
      if (file_of) return say(`${file.name}: expected one machine file or scenario, beside ${file_of.title}`, "bad");
      file_of = { title: file.name, text: await file.text() };
    } else return say(`${file.name}: expected a machine file or scenario (.toml), or a data sheet (.eds, .dcf)`, "bad");
  }
  if (file_of && /^\s*(\[machine\]|machine\s*=|\[\[step\]\])/m.test(file_of.text)) return play({ ...file_of, files: { ...present().files, ...sheets } });
  if (file_of) return begin(file_of.text, { ...present().files, ...sheets });
  // A device joins the machine at the next free node-ID.
  const { machine, files: kept } = present();
  const written = [...machine.matchAll(/\bnode\s*=\s*(0x[\da-f]+|0o[0-7]+|0b[01]+|\d+)/gi)].map(([, node]) => Number(node));
  const taken = [...written, ...(link.state?.nodes ?? []).map(({ node }) => node)];
  let text = machine;
  for (const name of Object.keys(sheets)) {
    const node = Array.from({ length: 127 }, (_, at) => at + 1).find((free) => !taken.includes(free));
    if (node === undefined) return say(`${name}: all 127 node-IDs are taken`, "bad");
    taken.push(node);
    text += `\n[[drive]]\nmodel = ${JSON.stringify(name)}\nnode = ${node}\n`;
  }
  begin(text, { ...kept, ...sheets }, true);
}

const forget = h("button", { type: "button", id: "machine-forget", title: "Begin anew with drives as they left the factory: what those of this machine have stored is lost", hidden: localStorage.getItem(storeOf(present().machine)) === null, onclick: () => {
  localStorage.removeItem(storeOf(present().machine));
  location.reload();
} }, "Factory state");
const input = h("input", { type: "file", id: "machine-file", multiple: true, accept: ".toml,.eds,.dcf", hidden: true, onchange: () => take(input.files) });
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
  event.preventDefault();
  take(event.dataTransfer.files);
});

document.getElementById("top").append(
  list,
  input,
  h("button", { type: "button", id: "machine-open", title: "Open a machine file, a scenario, or a data sheet, which joins the machine; or drop it on the page", onclick: () => input.click() }, "File …"),
  h("button", { type: "button", id: "machine-link", title: "Copy a link to this machine", onclick: copyLink }, "Link"),
  forget,
  status,
);

// What a drive stores is kept by the browser for the machine, and acknowledged by the drive when it is.
addEventListener("stored", ({ detail: { image, kept } }) => {
  const { machine } = present();
  try {
    const others = storedOf(machine).filter(({ number }) => number !== image.number);
    localStorage.setItem(storeOf(machine), JSON.stringify([...others, image]));
    // Else a browser that is short of room may drop it.
    navigator.storage?.persist?.();
    forget.hidden = false;
  } catch (error) {
    report("Storage", { ok: false, error: { message: `what drive ${image.number} has stored lasts as long as this page: the browser does not keep it (${error.message})` } });
  }
  tellWorker({ kept });
});
addEventListener("unusable", ({ detail }) => report("Storage", { ok: false, error: { message: detail } }));

addEventListener("skipped", ({ detail }) => {
  report("Time", { ok: true, notes: [`this page was held up, or its computer slept: ${(detail / 1000).toFixed(1)} s of the drives' time are left out`] });
});

const to_play = sessionStorage.getItem("play");
if (to_play !== null) {
  sessionStorage.removeItem("play");
  play({ title: /^title\s*=\s*"(.*)"\s*$/m.exec(to_play)?.[1] ?? "Scenario of the link", text: to_play });
}

// Offline once loaded, where the page has come over https or from this machine. What is kept for that does not delay the first picture.
let is_kept = false;
on("state", ({ scanning }) => {
  if (is_kept || scanning) return;
  is_kept = true;
  navigator.serviceWorker?.register("offline.js").catch(() => {});
});
