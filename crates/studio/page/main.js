// The frame of the page: views, keys, stop, control, news.

import { ask, connect, inControl, isVirtual, link, on, stopAll } from "./link.js";
import { closeChoice } from "./choice.js";
import { h, number, renew, setText, toggle } from "./dom.js";
import { busView } from "./bus.js";
import { concerns } from "./bus_rows.js";
import { helpPanel } from "./help.js";
import { meaningOf } from "./keys.js";
import { lostSight, unseenStops } from "./sight.js";
import { tourBar } from "./tour.js";
import { host_name } from "./transport.js";

/** @type {(id: string) => any} */
const byId = (id) => document.getElementById(id);
const NEWS_KEPT = 200;
/** The same news within this time is shown once. */
const SAME_NEWS_MS = 2000;
/** How long a late confirmation of a stop is shown. */
const LATE_MS = 6000;
/** A page that has just been opened has no state yet. */
const OPENING_MS = 1500;

/** Shared by the views: the chosen node. */
const shared = { node: null };

// Single-character keys are on until they are switched off.
const keepKeys = () => localStorage.setItem("character-keys", characters.checked ? "on" : "off");
const characters = toggle("character-keys", "Single-character keys (1 to 9, ?, d, r, s, p)", localStorage.getItem("character-keys") !== "off", keepKeys);
const help = helpPanel(shared, characters);
document.body.append(help.root);
byId("what").addEventListener("click", help.overview);

/** Stands for a view that is still being fetched. */
const fetching = () => ({ root: h("p", { class: "quiet", role: "status" }, "Loading …"), update() {} });

const views = [
  { name: "bus", title: "Bus", view: busView(shared, () => show("drive")) },
  { name: "drive", title: "Drive", view: fetching() },
  { name: "motion", title: "Motion", view: fetching() },
  { name: "scope", title: "Scope", view: fetching() },
  { name: "parameters", title: "Parameters", view: fetching() },
  { name: "pdo", title: "PDO", view: fetching() },
  { name: "trace", title: "Trace", view: fetching() },
  { name: "faults", title: "Faults", view: fetching() },
  { name: "world", title: "World", view: fetching() },
  { name: "console", title: "Console", view: fetching() },
];
let shown = null;
let isFetching = false;

/**
 * Fetches the other views, again and again while the line is down. On a slow line they would delay the first state of the drives, so that
 * they come after it, or when one of them is to be shown.
 */
async function fetchViews() {
  isFetching = true;
  try {
    const { laterViews } = await import("./views.js");
    for (const [name, view] of Object.entries(laterViews(shared, report))) views.find((one) => one.name === name).view = view;
  } catch {
    setTimeout(fetchViews, SAME_NEWS_MS);
    return;
  }
  if (!shown || byId("view").firstElementChild === shown.view.root) return;
  byId("view").replaceChildren(shown.view.root);
  if (link.state) shown.view.update(link.state);
}
const tour = tourBar(() => shown?.name ?? null, show);
byId("view").before(tour.root);
help.offer("The tour", tour.isOffered, tour.resume);

function show(name) {
  const next = views.find((view) => view.name === name) ?? views[0];
  if (next === shown) return;
  shown?.view.hide?.();
  shown = next;
  if (next !== views[0] && !isFetching) fetchViews();
  byId("view").replaceChildren(next.view.root);
  scrollTo(0, 0);
  for (const tab of byId("tabs").children) {
    const isShown = tab.dataset.name === next.name;
    tab.setAttribute("aria-current", isShown ? "page" : "false");
    // In a narrow window the views are a line that scrolls sideways.
    if (isShown) tab.scrollIntoView({ block: "nearest", inline: "center" });
  }
  if (location.hash !== `#${next.name}`) location.hash = next.name;
  if (link.state) next.view.update(link.state);
}

byId("tabs").append(
  ...views.map(({ name, title }, at) =>
    h("button", { type: "button", "data-name": name, title: at < 9 ? `${title} (key ${at + 1})` : title, onclick: () => show(name) }, title)),
);
addEventListener("hashchange", () => show(location.hash.slice(1)));

// Stop acts on press, not on release, so that it acts at once.
byId("stop").addEventListener("pointerdown", stopAll);
byId("stop").addEventListener("click", (event) => {
  // A press by the keyboard has no pointer event.
  if (event.detail === 0) stopAll();
});

/**
 * Space is a space in a text field while the studio moves nothing and its state is fresh, in the commands to a virtual world, and in
 * the console of virtual drives, where no real motor turns; everywhere else it is Stop.
 */
const isText = (target) =>
  target.matches("textarea, input:not([type]), input[type=text], input[type=search]") &&
  link.fresh &&
  (target.closest(".world") !== null || (target.closest(".console") !== null && isVirtual()) || !link.state.nodes.some((node) => node.moving || node.doing));

addEventListener(
  "keydown",
  /** @param {any} event */
  (event) => {
    const types = event.target.matches("input, textarea, [aria-expanded=true]");
    const meaning = meaningOf(event, { in_text: isText(event.target), types, characters: characters.checked });
    if (meaning === "stop") {
      // Wherever the focus is: Space never presses a button.
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

byId("concerns").addEventListener("click", () => show("faults"));

// Light or dark: as the system has it, until chosen here.
const chosen = localStorage.getItem("theme");
if (chosen) document.documentElement.dataset.theme = chosen;
byId("theme").addEventListener("click", () => {
  const now = document.documentElement.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  const next = now === "dark" ? "light" : "dark";
  document.documentElement.dataset.theme = next;
  localStorage.setItem("theme", next);
});

/** Shows the answer to a command: notes, or why it was refused. */
export function report(title, answer) {
  if (answer.ok) {
    for (const note of answer.notes ?? []) addNews(null, `${title}: `, note, "note");
  } else {
    addNews(null, `${title}: `, answer.error.message, "bad");
  }
  return answer;
}

/** Adds a line of news: whom it concerns, and what happened. An answer and the news to all sessions may be the same text. */
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
  setText(currentTarget, all ? "Newest only" : "All news");
  byId("news").scrollTop = 0;
});

function updateControl(state) {
  const mine = inControl();
  const asking = mine && state.asking !== null ? state.asking : null;
  const key = `${link.fresh} ${link.welcome?.session} ${state.controller} ${state.sessions} ${state.asking}`;
  renew(byId("control"), key, () => {
    if (!link.fresh) return [h("span", { class: "bad" }, `The state of ${host_name} is stale`)];
    const others = state.sessions > 1 ? ` · ${state.sessions} sessions open` : "";
    if (mine) {
      return [
        h("span", { class: "good" }, `You have control${others} `),
        asking === null
          ? h("button", { type: "button", id: "release", onclick: () => control("release_control") }, "Release control")
          : h("button", { type: "button", id: "hand-over", onclick: () => control("hand_over", asking) }, `Hand over to session ${asking}`),
      ];
    }
    if (state.controller === null) {
      return [h("button", { type: "button", id: "take", class: "primary", onclick: () => control("take_control") }, "Take control")];
    }
    const asked = state.asking === link.welcome?.session;
    return [
      h("span", { class: "quiet" }, `Session ${state.controller} has control${others} `),
      h("button", { type: "button", id: "ask", disabled: asked, onclick: () => control("ask_control") }, asked ? "Asked for control" : "Ask for control"),
    ];
  });
}

async function control(command, to) {
  report("Control", await ask(to === undefined ? { do: command } : { do: command, to }));
}

on("state", (state) => {
  const load = state.bus.load_percent === null ? "" : `load ${number(state.bus.load_percent, 1)} % · `;
  const bus = `${load}${state.bus.frames_per_s} frames/s · ${state.bus.name}`;
  setText(byId("bus-line"), bus);
  byId("bus-line").title = bus;
  const bad = concerns(state.nodes);
  setText(byId("concerns"), bad);
  byId("concerns").hidden = bad === "";
  updateControl(state);
  const unseen = unseenStops(state);
  byId("moving-notice").hidden = unseen.length === 0;
  renew(byId("moving-notice"), unseen.join(), () => unseen.map((text) => h("p", {}, text)));
  if (shared.node === null || !state.nodes.some((node) => node.node === shared.node)) {
    shared.node = state.nodes.find((node) => node.drive)?.node ?? state.nodes[0]?.node ?? null;
  }
  shown?.view.update(state);
  tour.update(state);
  if (isFetching) return;
  isFetching = true;
  // Behind this one in the browser too.
  setTimeout(fetchViews);
});

/** Whether a text concerns no node, or begins with the name of its node. */
const isNamed = ({ node, text }) => node === null || node === undefined || text.toLowerCase().startsWith(`node ${node}`);

on("news", (news) => addNews(news.time_s, isNamed(news) ? "" : `node ${news.node}: `, news.text, ""));

on("change", (connected) => {
  if (!connected) shown?.view.hide?.();
});

// A stale state is grey, and what is known of it is shown over the whole width.
on("sight", ({ fresh, connected, age_ms, refused }) => {
  const wasFresh = !document.body.classList.contains("unseen");
  document.body.classList.toggle("unseen", !fresh);
  const banner = byId("banner");
  banner.hidden = fresh || (!link.state && !refused && age_ms < OPENING_MS);
  if (fresh) return;
  const lines = lostSight({ state: link.state, connected, age_ms, refused, host: host_name });
  renew(banner, JSON.stringify(lines), () => lines.map(({ text, urgent }) => h("p", { class: urgent ? "urgent" : "" }, text)));
  if (wasFresh && link.state) {
    for (const { view } of views) view.lose?.();
    updateControl(link.state);
  }
});

// An unconfirmed stop stays on screen until one is confirmed.
let late = null;
on("stop", ({ confirmed, after_ms }) => {
  const notice = byId("stop-notice");
  clearTimeout(late);
  if (!confirmed) {
    notice.className = "unconfirmed";
    setText(notice, "STOP WAS NOT CONFIRMED: use the emergency stop");
    notice.hidden = false;
  } else if (!notice.hidden) {
    notice.className = "";
    setText(notice, `The stop was confirmed after ${number(after_ms / 1000, 1)} s.`);
    late = setTimeout(() => (notice.hidden = true), LATE_MS);
  }
});

show(location.hash.slice(1) || "bus");
connect();
