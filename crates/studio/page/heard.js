// Any object that passes on the bus, as a series: mapped into a PDO each frame is a sample, read or written by SDO each transfer,
// whoever asked. Times are those of the frames.

import { choice } from "./choice.js";
import { h, say } from "./dom.js";
import { Series } from "./series.js";

const ASK_MS = 100;
const KEPT_S = 60;
/** As many as the studio gives at once. */
const MOST = 32;

/** By object, `4:606C:00`: `{ field, node, label, unit, decimals, series }`. */
const chosen = new Map();
let after = null;
let timer = null;

/** Torque is current by another name. */
const isCurrent = ({ name, unit }) => /current|torque/i.test(name ?? "") || /\bm?A\b/.test(unit ?? "");

/** What was chosen, as quantities of the scope. */
export const heard = () => [...chosen.values()];

async function fetchSeries(parameters) {
  const answer = await fetch(`/api/series?${new URLSearchParams(parameters)}`);
  const told = await answer.json();
  if (!answer.ok) throw new Error(told.error.message);
  return told;
}

function take(told) {
  for (const { object, points } of told.series) {
    const series = chosen.get(object)?.series;
    // The first answer of an object and the next one of all may tell the same frames.
    for (const [time_s, value] of points) if (series && time_s > series.last_s()) series.push(time_s, value);
  }
}

/** Buttons to choose objects by, and to let them go. */
export function heardChooser() {
  const first = { value: "", text: "Add an object …" };
  const list = choice("scope-object", "Add an object that passes on the bus", [first], { onopen: load, onchange: () => add(list.value) });
  const shown = h("span", { class: "chooser", role: "group", "aria-label": "Objects shown" });
  const status = h("span", { class: "quiet", role: "status" });
  let known = [];
  let loading = false;
  let missed = 0;

  async function load() {
    if (loading) return;
    loading = true;
    try {
      known = (await fetchSeries({})).series.filter(({ object }) => !chosen.has(object));
      const title = ({ object, name, unit, count }) => `${object} ${name ?? ""}${unit ? ` [${unit}]` : ""}, ${count} lately`;
      list.offer([first, ...known.map((one) => ({ value: one.object, text: title(one) }))]);
      say(status, "");
    } catch (error) {
      say(status, error.message);
    }
    loading = false;
  }

  async function add(object) {
    const one = known.find((known) => known.object === object);
    list.value = "";
    if (!one || chosen.has(object)) return;
    if (chosen.size >= MOST) return say(status, `At most ${MOST} objects`);
    chosen.set(object, { field: object, node: one.node, label: `${object} ${one.name ?? ""}`, unit: one.unit ? `[${one.unit}]` : "", decimals: 0, steps: !isCurrent(one), series: new Series(KEPT_S) });
    const remove = h("button", { type: "button", "data-object": object, title: "Take it away" }, `× ${object}`);
    remove.addEventListener("click", () => {
      chosen.delete(object);
      remove.remove();
    });
    shown.append(remove);
    try {
      // What has passed already is a part of it.
      take(await fetchSeries({ objects: object }));
    } catch (error) {
      say(status, error.message);
    }
    if (timer === null) ask();
  }

  async function ask() {
    timer = null;
    if (chosen.size === 0) {
      after = null;
      return;
    }
    if (!document.hidden) {
      try {
        const told = await fetchSeries({ objects: [...chosen.keys()].join(), ...(after === null ? {} : { after }) });
        take(told);
        after = told.to;
        missed += told.skipped;
        say(status, missed ? `${missed} frames were too many for this page and are not drawn` : "");
      } catch (error) {
        say(status, error.message);
      }
    }
    timer = setTimeout(ask, ASK_MS);
  }

  return { root: h("span", { class: "bar" }, list, shown, status) };
}
