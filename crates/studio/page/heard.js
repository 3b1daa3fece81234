// Any object that passes on the bus, as a series: mapped into a PDO each frame is a sample, read or written by SDO each transfer,
// of any client. Times are those of the frames.

import { choice } from "./choice.js";
import { h, setText } from "./dom.js";
import { Series } from "./series.js";
import { request } from "./transport.js";

const ASK_MS = 100;
const KEPT_S = 60;
/** The most that the studio gives at once. */
const MOST = 32;

/** By object, `4:606C:00`: `{ field, node, label, unit, decimals, series }`. */
const chosen = new Map();
let after = null;
/** Whether the studio is asked again and again: once at a time, however many objects are added while an answer is awaited. */
let asks = false;

/** Torque is current by another name. */
const isCurrent = ({ name, unit }) => /current|torque/i.test(name ?? "") || /\bm?A\b/.test(unit ?? "");

/** The chosen objects, as quantities of the scope. */
export const heard = () => [...chosen.values()];

async function fetchSeries(parameters) {
  const answer = await request(`/api/series?${new URLSearchParams(parameters)}`);
  const body = await answer.json();
  if (!answer.ok) throw new Error(body.error.message);
  return body;
}

function take(body) {
  for (const { object, points } of body.series) {
    const series = chosen.get(object)?.series;
    // The first answer for an object and the next one for all may have the same frames.
    for (const [time_s, value] of points) if (series && time_s > series.last_s()) series.push(time_s, value);
  }
}

/** Buttons that choose objects, and remove them. */
export function heardChooser() {
  const first = { value: "", text: "Add an object …" };
  const list = choice("scope-object", "Add an object from the bus", [first], { onopen: () => (loading ??= read()), onchange: () => add(list.value) });
  const shown = h("span", { class: "chooser", role: "group", "aria-label": "Objects shown" });
  const status = h("span", { class: "quiet", role: "status" });
  let known = [];
  /** The answer that is awaited. */
  let loading = null;
  let missed = 0;

  async function read() {
    try {
      known = (await fetchSeries({})).series.filter(({ object }) => !chosen.has(object));
      const title = ({ object, name, unit, count }) => `${object} ${name ?? ""}${unit ? ` [${unit}]` : ""}, ${count} recently`;
      list.offer([first, ...known.map((one) => ({ value: one.object, text: title(one) }))]);
      setText(status, "");
    } catch (error) {
      setText(status, error.message);
    }
    loading = null;
  }

  async function add(object) {
    const one = known.find((known) => known.object === object);
    list.value = "";
    if (!one || chosen.has(object)) return;
    if (chosen.size >= MOST) return setText(status, `At most ${MOST} objects`);
    chosen.set(object, { field: object, node: one.node, label: `${object} ${one.name ?? ""}`, unit: one.unit ? `[${one.unit}]` : "", decimals: 0, steps: !isCurrent(one), series: new Series(KEPT_S) });
    const remove = h("button", { type: "button", "data-object": object, title: "Remove" }, `× ${object}`);
    remove.addEventListener("click", () => {
      chosen.delete(object);
      remove.remove();
    });
    shown.append(remove);
    try {
      // With the frames that have passed already.
      take(await fetchSeries({ objects: object }));
    } catch (error) {
      setText(status, error.message);
    }
    if (!asks) ask();
  }

  async function ask() {
    asks = chosen.size > 0;
    if (!asks) {
      after = null;
      return;
    }
    if (!document.hidden) {
      try {
        const body = await fetchSeries({ objects: [...chosen.keys()].join(), ...(after === null ? {} : { after }) });
        take(body);
        after = body.to;
        missed += body.skipped;
        setText(status, missed ? `${missed} frames are not drawn: too many for this page` : "");
      } catch (error) {
        setText(status, error.message);
      }
    }
    setTimeout(ask, ASK_MS);
  }

  return { root: h("span", { class: "bar" }, list, shown, status) };
}
