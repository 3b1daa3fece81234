// The frame of the page: views, keys, stop, control, news.

import { ask, connect, inControl, link, on, stopAll } from "./link.js";
import { h, number, renew, say } from "./dom.js";
import { busView } from "./bus.js";
import { driveView } from "./drive.js";
import { motionView } from "./motion.js";
import { helpPanel } from "./help.js";
import { scopeView } from "./scope.js";
import { parametersView } from "./parameters.js";
import { pdoView } from "./pdo.js";
import { faultsView } from "./faults.js";
import { tourBar } from "./tour.js";
import { traceView } from "./trace.js";
import { worldView } from "./world.js";

const byId = (id) => document.getElementById(id);
const NEWS_KEPT = 200;

/** What the views share: which node is looked at. */
const shared = { node: null };

const help = helpPanel(shared);
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
  for (const tab of byId("tabs").children) tab.setAttribute("aria-current", tab.dataset.name === next.name ? "page" : "false");
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
 * A space is a space in a text field, as long as nothing is moved and the studio can be asked whether that is so; and in the
 * commands to a virtual world, where no real motor turns.
 */
const isText = (target) =>
  target.matches("textarea, input:not([type]), input[type=text], input[type=search]") &&
  link.welcome !== null &&
  link.state !== null &&
  (target.closest(".world") !== null || !link.state.nodes.some((node) => node.moving || node.doing));

addEventListener(
  "keydown",
  (event) => {
    if (event.key === "Escape" || (event.key === " " && !isText(event.target))) {
      // Wherever the focus is: no button is pressed with a space.
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) stopAll();
      if (event.key === "Escape") help.hide();
      return;
    }
    const typing = event.target.matches("input, select, textarea");
    if (typing || event.ctrlKey || event.altKey || event.metaKey) return;
    const view = views[Number(event.key) - 1];
    if (event.key === "?") help.key();
    else if (view) show(view.name);
    else shown?.view.key?.(event);
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
    for (const note of answer.notes ?? []) addNews(null, `${title}: ${note}`, "note");
  } else {
    addNews(null, `${title}: ${answer.error.message}`, "bad");
  }
  return answer;
}

function addNews(time_s, text, kind) {
  const list = byId("news");
  const time = time_s ?? link.state?.time_s ?? null;
  list.prepend(h("li", { class: kind }, h("time", {}, time === null ? "" : `${number(time, 1)} s`), ` ${text}`));
  while (list.children.length > NEWS_KEPT) list.lastElementChild.remove();
}

function updateControl(state) {
  const mine = inControl();
  const asking = mine && state.asking !== null ? state.asking : null;
  const key = `${link.welcome?.session} ${state.controller} ${state.sessions} ${state.asking}`;
  renew(byId("control"), key, () => {
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
  const load = state.bus.load_percent === null ? "" : ` · load ${number(state.bus.load_percent, 1)} %`;
  const bus = `${state.bus.frames_per_s} frames/s${load} · ${state.bus.name}`;
  say(byId("bus-line"), bus);
  byId("bus-line").title = bus;
  updateControl(state);
  if (shared.node === null || !state.nodes.some((node) => node.node === shared.node)) {
    shared.node = state.nodes.find((node) => node.drive)?.node ?? state.nodes[0]?.node ?? null;
  }
  shown?.view.update(state);
  tour.update(state);
});

/** A text about no node, or that begins with it. */
const isNamed = ({ node, text }) => node === null || node === undefined || text.toLowerCase().startsWith(`node ${node}`);

on("news", (news) => addNews(news.time_s, isNamed(news) ? news.text : `node ${news.node}: ${news.text}`, ""));

on("change", (connected) => {
  const banner = byId("banner");
  banner.hidden = connected;
  say(banner, connected ? "" : "No connection to the studio. What this page moved is stopped there. Trying again …");
  if (!connected) shown?.view.hide?.();
});

show(location.hash.slice(1) || "bus");
connect();
