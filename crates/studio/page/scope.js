// The Scope view: what the drives said in the last 60 s, over time.
//
// Every drive is kept, also while another view is shown. A sample is one reading of a drive, with the time at which it was
// read; between two readings a line is drawn and nothing is made up.

import { on } from "./link.js";
import { h, number, say } from "./dom.js";
import { chooser } from "./drive.js";

const KEPT_S = 60;

/** Field, label, unit, decimals; one pane each. */
const SIGNALS = [
  ["velocity_rpm", "Speed", "r/min", 1],
  ["angle_degrees", "Position", "°", 1],
  ["current_a", "Current", "A", 2],
  ["supply_v", "Supply", "V", 1],
];

/** Readings of each node, oldest first. */
const kept = new Map();

on("state", (state) => {
  for (const { node, drive } of state.nodes) {
    if (!drive) continue;
    const samples = kept.get(node) ?? [];
    kept.set(node, samples);
    // The time of the bus begins anew with a studio that was started anew.
    if (samples.length && drive.at_s < samples.at(-1).at_s) samples.length = 0;
    if (samples.length && drive.at_s === samples.at(-1).at_s) continue;
    samples.push(drive);
    while (samples[0].at_s < drive.at_s - KEPT_S) samples.shift();
  }
});

/** The reading at or before a time. */
const before = (samples, at_s) => samples.findLast((sample) => sample.at_s <= at_s) ?? null;

/** Bounds that leave some room, and are never equal. */
function bounds(values) {
  const low = Math.min(...values);
  const high = Math.max(...values);
  const room = Math.max((high - low) * 0.1, Math.abs(high) * 0.01, 0.5);
  return [low - room, high + room];
}

/** A step of 1, 2 or 5 times a power of ten that makes at most `count` steps. */
function step(span, count) {
  const rough = span / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((times) => times * power).find((size) => size >= rough);
}

export function scopeView(shared) {
  const choose = chooser(shared);
  const canvas = h("canvas", { tabindex: "0", "aria-label": "Values over time. Click sets cursor A, Shift and click cursor B." });
  const readout = h("p", { class: "readout", role: "status" });
  const seconds = h("select", { id: "scope-window", "aria-label": "Time shown" }, ...[5, 10, 30, 60].map((span) => h("option", { value: String(span), selected: span === 10 }, `${span} s`)));
  const pause = h("button", { type: "button", id: "scope-pause", "aria-pressed": "false", onclick: toggle }, "Pause");
  const clear = h("button", { type: "button", onclick: () => setCursors(null, null) }, "Clear cursors");
  const save = h("button", { type: "button", id: "scope-save", onclick: saveCsv }, "Save CSV");
  const root = h(
    "section",
    { class: "scope" },
    h("div", { class: "bar" }, choose.root, seconds, pause, clear, save),
    canvas,
    readout,
    h("p", { class: "quiet" }, "Each point is one reading by SDO, about ten a second and fewer with many drives. Click: cursor A; Shift and click: cursor B; key p: pause."),
  );
  let frozen = null;
  let cursors = [null, null];
  let shown = false;
  let extent = null;

  /** The readings that are drawn, and when the picture ends. */
  function source() {
    if (frozen) return frozen;
    const samples = kept.get(shared.node) ?? [];
    return { node: shared.node, samples, end_s: samples.at(-1)?.at_s ?? 0 };
  }

  function toggle() {
    const now = source();
    frozen = frozen ? null : { ...now, samples: [...now.samples] };
    pause.setAttribute("aria-pressed", String(frozen !== null));
    say(pause, frozen ? "Go on" : "Pause");
  }

  function setCursors(a, b) {
    cursors = [a, b];
  }

  canvas.addEventListener("click", (event) => {
    if (!extent) return;
    const { left, right, from_s, span_s } = extent;
    const at_s = from_s + ((event.offsetX - left) / (right - left)) * span_s;
    if (at_s >= from_s && at_s <= from_s + span_s) setCursors(event.shiftKey ? cursors[0] : at_s, event.shiftKey ? at_s : cursors[1]);
  });

  function draw() {
    if (!shown) return;
    requestAnimationFrame(draw);
    const { samples, end_s } = source();
    const scale = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
    }
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(name).trim();
    const pen = canvas.getContext("2d");
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "12px system-ui, sans-serif";
    const span_s = Number(seconds.value);
    const from_s = end_s - span_s;
    const [left, right] = [72, width - 12];
    extent = { left, right, from_s, span_s };
    const x = (at_s) => left + ((at_s - from_s) / span_s) * (right - left);
    // One reading before the picture's edge, so that the line reaches it.
    const first = Math.max(samples.findIndex((sample) => sample.at_s >= from_s) - 1, 0);
    const visible = samples.slice(first);
    const panes = SIGNALS.filter(([field]) => visible.some((sample) => sample[field] !== null));
    const pane = (height - 24) / Math.max(panes.length, 1);
    panes.forEach(([field, label, unit, decimals], at) => {
      const [top, bottom] = [at * pane + 6, (at + 1) * pane - 8];
      const values = visible.map((sample) => sample[field]).filter((value) => value !== null);
      const [low, high] = bounds(values);
      const y = (value) => bottom - ((value - low) / (high - low)) * (bottom - top);
      pen.strokeStyle = colour("--line");
      pen.fillStyle = colour("--quiet");
      pen.lineWidth = 1;
      pen.strokeRect(left, top, right - left, bottom - top);
      pen.textAlign = "right";
      pen.textBaseline = "middle";
      const size = step(high - low, Math.max(4, Math.floor((bottom - top) / 30)));
      for (let line = Math.ceil(low / size) * size; line <= high; line += size) {
        pen.beginPath();
        pen.moveTo(left, y(line));
        pen.lineTo(right, y(line));
        pen.stroke();
        pen.fillText(number(line, size < 1 ? Math.min(3, Math.ceil(-Math.log10(size))) : 0), left - 6, y(line));
      }
      pen.textAlign = "left";
      pen.fillStyle = colour("--text");
      pen.fillText(`${label} ${number(values.at(-1), decimals)} ${unit}`, left + 8, top + 12);
      pen.save();
      pen.beginPath();
      pen.rect(left, top, right - left, bottom - top);
      pen.clip();
      pen.strokeStyle = colour("--accent");
      pen.lineWidth = 1.6;
      pen.beginPath();
      let drawn = false;
      for (const sample of visible) {
        if (sample[field] === null) drawn = false;
        else if (drawn) pen.lineTo(x(sample.at_s), y(sample[field]));
        else {
          pen.moveTo(x(sample.at_s), y(sample[field]));
          drawn = true;
        }
      }
      pen.stroke();
      pen.restore();
    });
    pen.fillStyle = colour("--quiet");
    pen.textAlign = "center";
    const tick = step(span_s, 10);
    for (let at_s = Math.ceil(from_s / tick) * tick; at_s <= end_s; at_s += tick) pen.fillText(`${number(at_s, tick < 1 ? 1 : 0)} s`, x(at_s), height - 9);
    cursors.forEach((at_s, which) => {
      if (at_s === null || at_s < from_s || at_s > end_s) return;
      pen.strokeStyle = colour("--warn");
      pen.beginPath();
      pen.moveTo(x(at_s), 6);
      pen.lineTo(x(at_s), height - 24);
      pen.stroke();
      pen.fillStyle = colour("--warn");
      pen.fillText("AB"[which], x(at_s) + 8, 12);
    });
    say(readout, measured(samples, panes));
  }

  /** What stands at the cursors, and what lies between. */
  function measured(samples, panes) {
    const [a, b] = cursors.map((at_s) => (at_s === null ? null : before(samples, at_s)));
    const of = (sample) => panes.map(([field, label, unit, decimals]) => `${label} ${number(sample[field], decimals)} ${unit}`).join(", ");
    const lines = [];
    [a, b].forEach((sample, which) => {
      if (sample) lines.push(`${"AB"[which]} at ${number(sample.at_s, 2)} s: ${of(sample)}`);
      else if (cursors[which] !== null) lines.push(`${"AB"[which]} at ${number(cursors[which], 2)} s: no reading so early`);
    });
    if (a && b) {
      const difference = Object.fromEntries(panes.map(([field]) => [field, a[field] === null || b[field] === null ? null : b[field] - a[field]]));
      lines.push(`B − A: ${number(b.at_s - a.at_s, 2)} s, ${of(difference)}`);
    }
    return lines.join("\n");
  }

  function saveCsv() {
    const { node, samples } = source();
    const fields = ["at_s", ...SIGNALS.map(([field]) => field), "position_counts", "statusword"];
    const rows = samples.map((sample) => fields.map((field) => sample[field] ?? "").join(","));
    const file = new Blob([[fields.join(","), ...rows, ""].join("\n")], { type: "text/csv" });
    const address = URL.createObjectURL(file);
    h("a", { href: address, download: `node${node}.csv` }).click();
    URL.revokeObjectURL(address);
  }

  function update(state) {
    choose.update(state);
    if (!shown) {
      shown = true;
      requestAnimationFrame(draw);
    }
  }

  function key(event) {
    if (event.key === "p") toggle();
  }

  return { root, update, key, hide: () => (shown = false) };
}
