// Sliders for what is changed most around a drive: its load, its supply, the temperature of its motor. What they send is a line of the
// simulator, as the forms do; where they stand is what is true of the drive.

import { h, number, setText } from "./dom.js";

/** Steps of a slider to either side of its middle. */
const STEPS = 100;
/** The largest torque, in N·m: more than any model here withstands. */
const MOST_NM = 20;
const [COLDEST_C, HOTTEST_C] = [-20, 150];

/** A torque from where its slider stands, -1 to 1: by the third power, so that small loads are set as finely as large ones. */
export const torqueAt = (part) => Number((MOST_NM * part ** 3).toPrecision(2));
export const partOf = (torque_nm) => Math.cbrt(Math.max(-1, Math.min(1, torque_nm / MOST_NM)));

/**
 * `seen` is what is true of a drive, nothing where it does not have it; `bounds` of the slider by the first value that was seen; `place` is where it
 * stands for a value, and `value` the other way.
 */
const ROWS = [
  { name: "load", label: "Load torque", unit: "N·m", decimals: 2, seen: (node) => node.load_torque_nm, bounds: () => [-STEPS, STEPS], place: (value) => Math.round(partOf(value) * STEPS), value: (place) => torqueAt(place / STEPS), line: (node, value) => `${node} load torque ${value}` },
  // To twice of what it was when this page saw the drive first.
  { name: "supply", label: "Supply", unit: "V", decimals: 0, seen: (node) => node.supply_v, bounds: (first) => [0, Math.ceil(2 * first)], place: Math.round, value: (place) => place, line: (node, value) => `${node} supply ${value}` },
  { name: "temperature", label: "Temperature of the motor", unit: "°C", decimals: 0, seen: (node) => node.motor_c, bounds: () => [COLDEST_C, HOTTEST_C], place: Math.round, value: (place) => place, line: (node, value) => `${node} temperature motor ${value}` },
];

/** `perform(line)` does it; `update(node)` takes what is true of the chosen drive. */
export function worldSliders(perform) {
  /** What each drive had when it was seen first, by place and name. */
  const firsts = new Map();

  const sliders = ROWS.map((row) => {
    const shown = h("b");
    const input = h("input", { type: "range", id: `world-slider-${row.name}`, step: "1" });
    const root = h("label", { class: "world-slider" }, h("span", {}, `${row.label} `, shown), input);
    let held = false;
    let place = null;
    const say = (value) => setText(shown, `${number(value, row.decimals)} ${row.unit}`);
    input.addEventListener("input", () => {
      held = true;
      say(row.value(Number(input.value)));
    });
    // Sent where it is let go: each line is one of the list of what was done.
    input.addEventListener("change", async () => {
      await perform(row.line(place, row.value(Number(input.value))));
      held = false;
    });
    function update(node) {
      // Held for another drive: it is let go.
      if (node.place !== place) held = false;
      place = node.place;
      const value = row.seen(node);
      root.hidden = value === null || value === undefined;
      if (root.hidden || held) return;
      const key = `${node.place} ${row.name}`;
      if (!firsts.has(key)) firsts.set(key, value);
      [input.min, input.max] = row.bounds(firsts.get(key)).map(String);
      input.value = String(row.place(value));
      say(value);
    }
    return { root, update };
  });

  const root = h("div", { class: "form world-sliders", role: "group", "aria-label": "Load, supply and temperature of the chosen drive" }, ...sliders.map((one) => one.root));
  return {
    root,
    update(node) {
      for (const one of sliders) one.update(node);
    },
  };
}
