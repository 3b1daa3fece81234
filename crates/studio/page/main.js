// The frame of the page: views, keys, stop, control, news.

import { ask, connect, inControl, link, on, stopAll } from "./link.js";
import { closeChoice } from "./choice.js";
import { h, number, renew, say, toggle } from "./dom.js";
import { busView } from "./bus.js";
import { driveView } from "./drive.js";
import { motionView } from "./motion.js";
import { helpPanel } from "./help.js";
import { meaningOf } from "./keys.js";
import { scopeView } from "./scope.js";
import { lostSight, unseenStops } from "./sight.js";
import { parametersView } from "./parameters.js";
import { pdoView } from "./pdo.js";
import { faultsView } from "./faults.js";
import { tourBar } from "./tour.js";
import { traceView } from "./trace.js";
import { worldView } from "./world.js";

const byId = (id) => document.getElementById(id);
const NEWS_KEPT = 200;
/** What is told twice within this time is told once. */
const SAME_NEWS_MS = 2000;
/** How long it is shown that a stop was confirmed late. */
const LATE_MS = 6000;
/** A page that has just been opened has no picture yet. */
const OPENING_MS = 1500;

/** What the views share: which node is looked at. */
const shared = { node: null };

// Keys of one character, until somebody switches them off.
const keepKeys = () => localStorage.setItem("character-keys", characters.checked ? "on" : "off");
const characters = toggle("character-keys", "Keys of one character (1 to 9, ?, d, r, s, p)", localStorage.getItem("character-keys") !== "off", keepKeys);
const help = helpPanel(shared, characters);
document.body.append(help.root);
byId("what").addEventListener("click", help.overview);

const views = [
  { name: "bus", title: "Bus", view: busView(shared, () => show("drive")) },
  { name: "drive", title: "Drive", view: driveView(shared) },
  { name: "motion", title: "Motion", view: motionView(shared, report) },
  { name: "scope", title: "Scope", view: scopeView(shared) },
  { name: "parameters", title: "Parameters", view: parametersView(shared, report) },
  { name: "pdo", title: "PDO", view: pdoView(shared, report) },
  { name: "trace", title: "Trace", view: traceView() },
  { name: "faults", title: "Faults", view: faultsView() },
  { name: "world", title: "World", view: worldView(shared, report) },
];
let shown = null;
const tour = tourBar(() => shown?.name ?? null, show);
byId("view").before(tour.root);
help.offer("The tour", tour.isOffered, tour.resume);

function show(name) {
  const next = views.find((view) => view.name === name) ?? views[0];
  if (next === shown) return;
  shown?.view.hide?.();
  shown = next;
  byId("view").replaceChildren(next.view.root);
  scrollTo(0, 0);
  for (const tab of byId("tabs").children) {
    const isShown = tab.dataset.name === next.name;
    tab.setAttribute("aria-current", isShown ? "page" : "false");
    // In a narrow window the views are a line that moves sideways.
    if (isShown) tab.scrollIntoView({ block: "nearest", inline: "center" });
  }
  if (location.hash !== `#${next.name}`) location.hash = next.name;
  if (link.state) next.view.update(link.state);
}

byId("tabs").append(
  ...views.map(({ name, title }, at) =>
    h("button", { type: "button", "data-name": name, title: `${title} (key ${at + 1})`, onclick: () => show(name) }, title)),
);
addEventListener("hashchange", () => show(location.hash.slice(1)));

// Stop: pressed, not released, so that it acts at once.
byId("stop").addEventListener("pointerdown", stopAll);
byId("stop").addEventListener("click", (event) => {
  // By the keyboard there is no pointer.
  if (event.detail === 0) stopAll();
});

/**
 * A space is a space in a text field, as long as the studio moves nothing and that is seen; and in the commands to a virtual world,
 * where no real motor turns.
 */
const isText = (target) =>
  target.matches("textarea, input:not([type]), input[type=text], input[type=search]") &&
  link.fresh &&
  (target.closest(".world") !== null || !link.state.nodes.some((node) => node.moving || node.doing));

addEventListener(
  "keydown",
  (event) => {
    const types = event.target.matches("input, textarea, [aria-expanded=true]");
    const meaning = meaningOf(event, { in_text: isText(event.target), types, characters: characters.checked });
    if (meaning === "stop") {
      // Wherever the focus is: no button is pressed with a space.
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) stopAll();
      closeChoice();
      if (event.key === "Escape") help.hide();
      return;
    }
    if (meaning === "help") help.key();
    else if (meaning === "view") show(views[Number(event.key) - 1].name);
    else if (meaning === "own") shown?.view.key?.(event);
  },
  true,
);

// Light and dark: as the system has it, until somebody chooses.
const chosen = localStorage.getItem("theme");
if (chosen) document.documentElement.dataset.theme = chosen;
byId("theme").addEventListener("click", () => {
  const now = document.documentElement.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  const next = now === "dark" ? "light" : "dark";
  document.documentElement.dataset.theme = next;
  localStorage.setItem("theme", next);
});

/** Shows what became of a deed: notes, or why it was not done. */
export function report(title, answer) {
  if (answer.ok) {
    for (const note of answer.notes ?? []) addNews(null, `${title}: `, note, "note");
  } else {
    addNews(null, `${title}: `, answer.error.message, "bad");
  }
  return answer;
}

/** The newest line below: who it is about, and what has happened. The answer to whoever asked and the news to all may be the same. */
let newest = { text: "", at: -Infinity };
function addNews(time_s, about, text, kind) {
  const list = byId("news");
  const time = time_s ?? link.state?.time_s ?? null;
  const now = performance.now();
  const isSame = newest.text === text && now - newest.at < SAME_NEWS_MS;
  newest = { text, at: now };
  if (isSame && kind === "") return;
  if (isSame) list.firstElementChild.remove();
  list.prepend(h("li", { class: kind }, h("time", {}, time === null ? "" : `${number(time, 1)} s`), ` ${about}${text}`));
  while (list.children.length > NEWS_KEPT) list.lastElementChild.remove();
  document.querySelector("footer").hidden = false;
}
byId("news-all").addEventListener("click", ({ currentTarget }) => {
  const all = document.querySelector("footer").classList.toggle("all");
  currentTarget.setAttribute("aria-expanded", String(all));
  say(currentTarget, all ? "The newest" : "All news");
  byId("news").scrollTop = 0;
});

function updateControl(state) {
  const mine = inControl();
  const asking = mine && state.asking !== null ? state.asking : null;
  const key = `${link.fresh} ${link.welcome?.session} ${state.controller} ${state.sessions} ${state.asking}`;
  renew(byId("control"), key, () => {
    if (!link.fresh) return [h("span", { class: "bad" }, "The studio shows nothing new")];
    const others = state.sessions > 1 ? ` · ${state.sessions} pages open` : "";
    if (mine) {
      return [
        h("span", { class: "good" }, `You have control${others} `),
        asking === null
          ? h("button", { type: "button", id: "release", onclick: () => control("release_control") }, "Give up")
          : h("button", { type: "button", id: "hand-over", onclick: () => control("hand_over", asking) }, `Hand over to session ${asking}`),
      ];
    }
    if (state.controller === null) {
      return [h("button", { type: "button", id: "take", class: "primary", onclick: () => control("take_control") }, "Take control")];
    }
    const asked = state.asking === link.welcome?.session;
    return [
      h("span", { class: "quiet" }, `Session ${state.controller} has control${others} `),
      h("button", { type: "button", id: "ask", disabled: asked, onclick: () => control("ask_control") }, asked ? "Asked for it" : "Ask for control"),
    ];
  });
}

async function control(deed, to) {
  report("Control", await ask(to === undefined ? { do: deed } : { do: deed, to }));
}

on("state", (state) => {
  const load = state.bus.load_percent === null ? "" : `load ${number(state.bus.load_percent, 1)} % · `;
  const bus = `${load}${state.bus.frames_per_s} frames/s · ${state.bus.name}`;
  say(byId("bus-line"), bus);
  byId("bus-line").title = bus;
  updateControl(state);
  const unseen = unseenStops(state);
  byId("moving-notice").hidden = unseen.length === 0;
  renew(byId("moving-notice"), unseen.join(), () => unseen.map((text) => h("p", {}, text)));
  if (shared.node === null || !state.nodes.some((node) => node.node === shared.node)) {
    shared.node = state.nodes.find((node) => node.drive)?.node ?? state.nodes[0]?.node ?? null;
  }
  shown?.view.update(state);
  tour.update(state);
});

/** A text about no node, or that begins with it. */
const isNamed = ({ node, text }) => node === null || node === undefined || text.toLowerCase().startsWith(`node ${node}`);

on("news", (news) => addNews(news.time_s, isNamed(news) ? "" : `node ${news.node}: `, news.text, ""));

on("change", (connected) => {
  if (!connected) shown?.view.hide?.();
});

// What is not seen any more is grey, and what is known of it stands over the whole width.
on("sight", ({ fresh, connected, age_ms, refused }) => {
  const wasFresh = !document.body.classList.contains("unseen");
  document.body.classList.toggle("unseen", !fresh);
  const banner = byId("banner");
  banner.hidden = fresh || (!link.state && !refused && age_ms < OPENING_MS);
  if (fresh) return;
  const lines = lostSight({ state: link.state, connected, age_ms, refused });
  renew(banner, JSON.stringify(lines), () => lines.map(({ text, urgent }) => h("p", { class: urgent ? "urgent" : "" }, text)));
  if (wasFresh && link.state) {
    for (const { view } of views) view.lose?.();
    updateControl(link.state);
  }
});

// A stop that nobody has confirmed stays told until one is.
let late = null;
on("stop", ({ confirmed, after_ms }) => {
  const notice = byId("stop-notice");
  clearTimeout(late);
  if (!confirmed) {
    notice.className = "unconfirmed";
    say(notice, "STOP WAS NOT CONFIRMED: use the emergency stop");
    notice.hidden = false;
  } else if (!notice.hidden) {
    notice.className = "";
    say(notice, `The stop was confirmed after ${number(after_ms / 1000, 1)} s.`);
    late = setTimeout(() => (notice.hidden = true), LATE_MS);
  }
});

show(location.hash.slice(1) || "bus");
connect();
