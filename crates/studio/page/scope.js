// The Scope view: the values of the last 60 s, over time, over frequency or over each other, and captures laid over them.
//
// A sample is one reading of a drive, with its time; two readings are joined by a straight line, and nothing else is interpolated.

import { against, firstOf, lastOf, samplesOf, seriesOf } from "./capture.js";
import { choice } from "./choice.js";
import { chooseUnit, chosenUnits } from "./chosen_units.js";
import { h, number, setText, toggle } from "./dom.js";
import { chooser } from "./drive.js";
import { captureOfAnswer } from "./fast_capture.js";
import { fastCapturePanel } from "./fast_capture_panel.js";
import { heard, heardChooser } from "./heard.js";
import { everything, markers, newest_s, series } from "./kept.js";
import { linkTo, linked } from "./linked.js";
import { QUANTITIES } from "./quantities.js";
import { mcapOf, recordOf } from "./recordings.js";
import { Scales, ZOOM } from "./scale.js";
import { frame, highestOf, overEach, overFrequency, overTime } from "./scope_picture.js";
import { capturePanel } from "./scope_captures.js";
import { computedPanel } from "./scope_computed.js";
import { crossing, spectrum } from "./analysis.js";
import { edge } from "./scope_edge.js";
import { gestures, keyMeaning } from "./scope_pointer.js";
import { measured, measuredSpectra } from "./scope_readout.js";
import { scalePanel } from "./scope_scales.js";
import { overlaid, panesOf, partnerOf } from "./scope_source.js";
import { kept, keep } from "./settings.js";
import { SvgPen } from "./svg_pen.js";
import { MOST_KEPT, capturesOf } from "./test_motion.js";
import { testMotionPanel } from "./test_motion_panel.js";
import { tunePanel } from "./tune_panel.js";
import { trigger } from "./scope_trigger.js";
import { unitsOf } from "./unit_table.js";
import { inUnit } from "./units.js";

const SPANS_S = [1, 2, 5, 10, 30, 60];
const SHORTEST_S = 1e-3;
const LONGEST_S = 86_400;
const LONGEST_MARK = 40;
/** Least height of a legible pane; the picture grows with its panes. */
const LOWEST_PANE = 76;
const SETTINGS = "scope";
const HIDDEN = ["supply_v", "position_counts", "statusword"];

/** What the key of a pane with spectra begins with. */
const SPECTRAL = "Hz ";

const cut = (text) => (text.length > LONGEST_MARK ? `${text.slice(0, LONGEST_MARK - 1)}…` : text);

export function scopeView(shared, report) {
  const before = kept(SETTINGS, {});
  const choose = chooser(shared);
  const canvas = h("canvas", {
    tabindex: "0",
    role: "img",
    "aria-label": "Values over time. Arrows left and right move the cursor, Enter changes to the other one; arrows up and down zoom the scale, plus and minus the time, Page up and down move the picture.",
  });
  const readout = h("p", { class: "readout", role: "status" });
  const seconds = choice("scope-window", "Time shown", SPANS_S.map((span) => ({ value: String(span), text: `${span} s` })), { value: SPANS_S.includes(before.span_s) ? String(before.span_s) : "10" });
  const button = (id, text, onclick, title = "") => h("button", { type: "button", id, title, onclick }, text);
  const pause = toggle("scope-pause", "Pause", false, () => (frozen ? goOn() : freeze()), { title: "Key p" });
  const steps = toggle("scope-step", "Step response", false, () => {}, { title: "Rise time, overshoot and settling time of the values shown, or between the cursors" });
  const frequencies = toggle("scope-fft", "Spectrum", false, () => only(across), { title: "Spectrum of the values shown" });
  const across = toggle("scope-xy", "XY", false, () => only(frequencies), { title: "Each value over another one" });
  const only = (not) => {
    not.checked = false;
    below.hidden = !across.checked;
  };
  const below = choice("scope-across", "Value below the picture", []);
  below.hidden = true;
  const together = toggle("scope-together", "One pane", before.together === true, store, { title: "All values in one pane, each with its own scale" });
  const other = toggle("scope-cursor", "Set cursor B", false, () => {}, { title: "A tap or a key sets cursor B, not A (Enter on the picture)" });
  const panes = h("span", { class: "chooser", role: "group", "aria-label": "Values shown" });
  const others = h("span", { class: "chooser", role: "group", "aria-label": "Drives shown besides the chosen one" });
  const trip = trigger(goOn);
  const keeps = toggle("trigger-keep", "Keep each", false, () => {}, { title: "Keep a capture whenever the trigger fires" });
  const saved = h("p", { class: "bad", role: "status" });
  const computed = computedPanel();
  const captures = capturePanel(shared, { take: shownCapture, open: openCapture });
  const fast = fastCapturePanel(shared, { taken(capture) {
    captures.keep(capture);
    openCapture(capture);
  } });
  const bench = testMotionPanel(shared, report, { open: openCapture, async taken(made) {
    for (const capture of made.slice(0, MOST_KEPT)) await captures.keep(capture);
    if (made.length) openCapture(made[0]);
  } });
  const gains = tunePanel(shared, report);
  // What a sequence has captured is kept too.
  addEventListener("played", async (/** @type {any} */ { detail: { command, result } }) => {
    const made = command.do === "capture" ? [captureOfAnswer(result)] : command.do === "test_motion" ? capturesOf(result) : [];
    for (const capture of made.slice(0, MOST_KEPT)) await captures.keep(capture);
  });
  const scales = new Scales(before.scales);
  /** The units that were chosen, by field; the panes as they are without; what a turn of each node moves. */
  const units = chosenUnits();
  let offered = [];
  /** The field of the pane whose scale is chosen. */
  let paneField = null;
  const feeds = new Map();
  const unit = choice("scope-unit", "Unit", [], { onchange: () => {
    const field = unit.dataset.field;
    if (field === undefined) return;
    chooseUnit(field, unit.value);
  } });
  const scale = scalePanel(scales, () => areas, store);
  const root = h(
    "section",
    { class: "scope" },
    h("div", { class: "bar" }, choose.root, others),
    h("div", { class: "bar" }, seconds, pause, panes, together, heardChooser().root),
    h("div", { class: "bar" }, trip.root, keeps),
    canvas,
    h("div", { class: "bar under" }, scale.root, unit),
    h("div", { class: "bar" }, other, button("scope-clear", "Clear cursors", () => ([cursors, hertz] = [[null, null], [null, null]])), button("scope-zoom-in", "Time +", () => zoom(null, 1 / ZOOM), "Shorter time (plus on the picture)"), button("scope-zoom-out", "Time −", () => zoom(null, ZOOM), "Longer time (minus on the picture)"), steps, frequencies, across, below),
    readout,
    captures.root,
    fast.root,
    bench.root,
    gains.root,
    computed.root,
    h("div", { class: "bar" }, h("span", { class: "quiet" }, "Save as"), button("scope-save", "CSV", saveCsv, "A record, for ferrodrive plot and spreadsheets"), button("scope-mcap", "MCAP", saveMcap, "For Foxglove, PlotJuggler, Rerun and ferrodrive plot"), button("scope-svg", "SVG", saveSvg)),
    saved,
    h("p", { class: "quiet" }, "Each point is one reading by SDO, about ten a second, fewer with many drives; for an added object, each frame that carries it. A tap sets cursor A, with Shift cursor B, in a spectrum too; key p: pause. While paused a drag moves, the wheel or two fingers zoom; on the figures beside a pane they zoom and move its scale, and a double tap sets it free."),
  );
  /** While paused: `{ columns, end_s, span_s, zero_s, marks, byTrigger, id, about }`; `id` is that of a capture that is shown by itself, `about`. */
  let frozen = null;
  let cursors = [null, null];
  /** The cursors of the spectrum. */
  let hertz = [null, null];
  let followed = linked.changes;
  let shown = false;
  /** What is on the canvas: its inputs, its extent, its areas, and what it drew. */
  let picture = null;
  let extent = null;
  let areas = [];
  let drives = [];
  const liveEdge = edge();
  const lay = overlaid();
  const hidden = new Set(Array.isArray(before.hidden) ? before.hidden : HIDDEN);
  const beside = new Set();

  for (const { field, label } of QUANTITIES) {
    const pressed = toggle(null, label, !hidden.has(field), () => {
      if (!hidden.delete(field)) hidden.add(field);
      store();
    }, { "data-field": field });
    panes.append(pressed);
  }

  function store() {
    keep(SETTINGS, { hidden: [...hidden], together: together.checked, span_s: Number(seconds.value), scales: scales.kept() });
  }

  /** The drawn drives, the chosen one first. */
  const nodes = () => [shared.node, ...[...beside].filter((node) => node !== shared.node)].filter((node) => node !== null);

  /** Every value that is read or heard now. */
  const live = () => [...everything(drives), ...heard()];

  /** Holds the picture as it is, or as it was at an end time. */
  function freeze({ end_s = end(), zero_s = null, byTrigger = false } = {}) {
    const span_s = Number(seconds.value);
    const columns = live().map((one) => ({ ...one, series: one.series.cut(one.series.first_s(), end_s + span_s) }));
    hold({ columns, end_s, span_s, zero_s, marks: [...markers], byTrigger, id: null });
  }

  function hold(what) {
    frozen = what;
    pause.checked = true;
    setText(pause, "Resume");
  }

  function openCapture(capture) {
    const columns = capture.columns.map((one) => ({ ...one, series: seriesOf(one) }));
    const [first_s, last_s] = [firstOf(capture), lastOf(capture)];
    cursors = [null, null];
    hold({ columns, end_s: last_s, span_s: Math.max(SHORTEST_S, last_s - first_s), zero_s: capture.zero_s, marks: capture.marks, byTrigger: false, id: capture.id, about: capture });
  }

  function goOn() {
    const was = frozen;
    frozen = null;
    pause.checked = false;
    setText(pause, "Pause");
    if (was && !was.byTrigger) trip.rearm(newest_s(shared.node));
  }

  /** When the newest drawable value was read, and the end of the running picture. */
  const newest = () => Math.max(newest_s(shared.node), ...heard().map((one) => one.series.last_s()));
  const end = () => liveEdge(newest(), performance.now() / 1e3);

  /** What the picture is of: the shown values, and the captures over them. */
  function content() {
    const end_s = frozen ? frozen.end_s : end();
    const from_s = end_s - (frozen ? frozen.span_s : Number(seconds.value));
    const all = frozen ? frozen.columns : live();
    const isDrawn = ({ node, field }) => frozen?.id || field.includes(":") || nodes().includes(node);
    const base = { name: "", columns: all.filter((one) => one.series.length > 0 && isDrawn(one)) };
    const over = captures.chosen().filter(({ id }) => id !== frozen?.id);
    const sources = [base, ...over.map((one) => lay(one, captures.alignment(), { from_s, zero_s: frozen?.zero_s ?? null }))];
    const marks = (frozen ? frozen.marks : markers).filter(({ node }) => node === null || frozen?.id || nodes().includes(node));
    return { sources, from_s, to_s: end_s, cursors, marks };
  }

  /** A pane with the spectra of its lines, whose scale is its own. */
  const spectraOf = (one, from_s, to_s) => ({ ...one, key: SPECTRAL + one.key, lines: one.lines.map(({ name, isCapture, series: of }) => ({ name, isCapture, spectrum: spectrum(of, from_s, to_s) })) });

  /** The panes of it; with their spectra where these are looked at. */
  function drawn({ sources, from_s, to_s, marks }) {
    const all = panesOf(sources, { definitions: computed.definitions(), hidden, subtracts: captures.subtracts(), from_s });
    for (const one of all) if (trip.isOn() && trip.field() === one.key) one.level = trip.level();
    offered = all;
    const feed_m = (node) => feeds.get(node) ?? null;
    const panes = all.map((one) => inUnit(one, units[one.field], feed_m));
    const spectra = frequencies.checked ? { cursors: hertz, panes: panes.map((one) => spectraOf(one, from_s, to_s)) } : null;
    return { panes, spectra, from_s, to_s, cursors, markers: marks.map(({ time_s, text }) => ({ time_s, text: cut(text) })) };
  }

  /** What is shown now, as a capture. */
  function shownCapture() {
    const { sources, from_s, to_s, marks } = content();
    return captureOf(sources[0].columns.map((one) => ({ ...one, series: one.series.cut(from_s, to_s) })), marks.filter(({ time_s }) => time_s >= from_s && time_s <= to_s), frozen?.zero_s ?? from_s, from_s);
  }

  function captureOf(columns, marks, zero_s, from_s) {
    const taken = new Date();
    const filled = columns.filter((one) => one.series.length > 0).map(({ series: of, ...column }) => ({ ...column, ...samplesOf(of) }));
    const name = taken.toLocaleTimeString("en-GB");
    return filled.length ? { id: crypto.randomUUID(), name, taken: taken.toISOString(), zero_s, from_s, shift_s: 0, columns: filled, marks } : null;
  }

  function colours() {
    const style = getComputedStyle(document.documentElement);
    const of = (name) => style.getPropertyValue(name).trim();
    return { card: of("--card"), line: of("--line"), quiet: of("--quiet"), text: of("--text"), warn: of("--warn"), lines: ["--accent", "--bad", "--good", "--warn"].map(of) };
  }

  /** Each line over that of the same source and node of the value below; one without is left out. */
  function overBelow({ panes: all, from_s, to_s }) {
    const under = all.find(({ key }) => key === below.value) ?? all[0];
    return all.filter((one) => one !== under).map((one) => ({ ...one, label: `${one.label} over ${under.label}`, lines: one.lines.flatMap((line) => {
      const partner = partnerOf(line, under.lines);
      return partner ? [{ name: line.name, isCapture: line.isCapture, ...against(partner.series, line.series, from_s, to_s) }] : [];
    }) })).filter(({ lines }) => lines.length);
  }

  function paint(pen, width, height, now) {
    pen.font = "12px system-ui, sans-serif";
    const layout = { scales, together: together.checked, first: scale.pane() };
    if (now.spectra) return overFrequency(pen, width, height, colours(), now.spectra, layout);
    if (!across.checked || !now.panes.length) return overTime(pen, width, height, colours(), now, layout);
    const under = now.panes.find(({ key }) => key === below.value) ?? now.panes[0];
    return overEach(pen, width, height, colours(), overBelow(now), under, layout);
  }

  /** The inputs of the picture: the same picture is not drawn twice. */
  function keyOf({ sources, from_s, to_s, marks }, size) {
    const lines = sources.map(({ name, columns }) => [name, columns.map(({ node, field, series: one }) => `${node} ${field} ${one.first_s()} ${one.last_s()} ${one.length}`)]);
    const set = [frequencies, steps, across, together].map((one) => one.checked);
    const trigger = [trip.isOn(), trip.field(), trip.level()];
    return JSON.stringify([size, colours(), set, trigger, below.value, scale.pane(), scales.kept(), captures.subtracts(), [...hidden], units, [...feeds], computed.definitions(), from_s, to_s, cursors, hertz, marks.length, marks.at(-1)?.time_s, lines]);
  }

  function draw() {
    if (!shown) return;
    requestAnimationFrame(draw);
    trip.offer([...QUANTITIES, ...heard()]);
    watchTrigger();
    followCursor();
    const ratio = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const what = content();
    const key = keyOf(what, [width, height, ratio]);
    if (key === picture) return;
    picture = key;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const now = drawn(what);
    areas = paint(pen, width, height, now);
    const least = `${(together.checked ? 1 : now.panes.length) * LOWEST_PANE}px`;
    if (canvas.style.minHeight !== least) canvas.style.minHeight = least;
    canvas.classList.toggle("held", frozen !== null);
    const { spectra } = now;
    extent = { ...frame(width), ...(spectra ? { from: 0, span: highestOf(spectra.panes) } : { from: now.from_s, span: now.to_s - now.from_s }) };
    offerPanes(now.panes);
    setText(readout, spectra ? measuredSpectra(spectra) : measured(now, steps.checked));
  }

  function offerPanes(all) {
    const before = scale.pane();
    scale.offer(areas.map(({ key }) => ({ key, label: all.find((one) => key === one.key || key === SPECTRAL + one.key)?.label ?? key })));
    // In another unit a pane has another key, and stays the chosen one.
    const same = all.find(({ field }) => field === paneField);
    if (scale.pane() !== before && same && areas.some(({ key }) => key === same.key)) scale.choose(same.key);
    paneField = all.find(({ key }) => key === scale.pane())?.field ?? paneField;
    offerUnits(all.find(({ key }) => key === scale.pane()) ?? all[0]);
    const key = all.map((one) => one.key).join("\n");
    if (below.dataset.key === key) return;
    below.dataset.key = key;
    below.offer(all.map((one) => ({ value: one.key, text: `over ${one.label}` })));
  }

  /** The units of the pane whose scale is chosen. */
  function offerUnits(pane) {
    const own = offered.find(({ field }) => field === pane?.field);
    unit.hidden = !own || unitsOf(own.unit).length < 2;
    if (unit.hidden) return;
    const of = unitsOf(own.unit, own.lines.map(({ node }) => feeds.get(node)));
    const key = `${own.field} ${of.join()} ${pane.unit}`;
    if (unit.dataset.key === key) return;
    Object.assign(unit.dataset, { key, field: own.field });
    unit.offer(of.map((text) => ({ value: text, text: `in ${text}` })));
    unit.value = pane.unit;
  }

  /** Holds the picture once the trigger has fired, with the wanted part before it. */
  function watchTrigger() {
    if (frozen && !(frozen.byTrigger && trip.comesAgain())) return;
    const source = heard().find((one) => one.field === trip.field())?.series ?? series(shared.node, trip.field());
    const isAwaited = ({ node, field, series: of }) => of.length > 0 && (field.includes(":") || nodes().includes(node));
    const least_s = trip.isOn() ? Math.min(...live().filter(isAwaited).map((one) => one.series.last_s())) : Infinity;
    const held = trip.look(source, Number(seconds.value), crossing, least_s);
    if (held === null) return;
    freeze({ ...held, byTrigger: true });
    if (keeps.checked) captures.keep();
  }

  /** A line that was chosen in the Trace view is where cursor A stands. */
  function followCursor() {
    if (linked.changes === followed) return;
    followed = linked.changes;
    if (frozen?.id) return;
    cursors = [linked.at_s, cursors[1]];
    if (linked.at_s === null || !frozen) return;
    const from_s = frozen.end_s - frozen.span_s;
    if (linked.at_s < from_s || linked.at_s > frozen.end_s) frozen.end_s = linked.at_s + frozen.span_s / 2;
  }

  /** At a time, or at a frequency in the picture of spectra. */
  function setCursor(which, at) {
    if (frequencies.checked) {
      hertz = which === 1 ? [hertz[0], at] : [at, hertz[1]];
      return;
    }
    cursors = which === 1 ? [cursors[0], at] : [at, cursors[1]];
    // The times of a file are not those of the bus.
    if (which === 0 && !frozen?.id) linkTo(at);
    followed = linked.changes;
  }

  const isOverTime = () => extent !== null && !frequencies.checked && !across.checked;
  /** The time or the frequency at a place of the picture. */
  const placeAt = (x) => extent.from + ((x - extent.left) / (extent.right - extent.left)) * extent.span;
  const areaAt = (y) => areas.find(({ bottom }) => y <= bottom + 4) ?? areas.at(-1);

  /** Zooms in time around a place of the picture, its middle where there is none. The point under it stays there. */
  function zoom(x, times) {
    if (!isOverTime()) return;
    if (!frozen) freeze();
    const around_s = x === null ? frozen.end_s - frozen.span_s / 2 : placeAt(x);
    const span_s = Math.min(LONGEST_S, Math.max(SHORTEST_S, frozen.span_s * times));
    frozen.end_s = around_s + ((frozen.end_s - around_s) * span_s) / frozen.span_s;
    frozen.span_s = span_s;
  }

  /** Changes the scale of a pane. */
  function rescale(area, change) {
    if (!area) return;
    change(area.key, [area.low, area.high]);
    scale.choose(area.key);
    store();
  }
  const heightOf = ({ top, bottom }, y) => (bottom - y) / (bottom - top);

  const pointer = gestures(
    {
      tap(x, y, isOther) {
        const area = areaAt(y);
        if (area) scale.choose(area.key);
        if (extent === null || across.checked) return;
        const at = placeAt(x);
        if (at >= extent.from && at <= extent.from + extent.span) setCursor(isOther !== other.checked ? 1 : 0, at);
      },
      pan(dx) {
        if (frozen && isOverTime()) frozen.end_s -= (dx / (extent.right - extent.left)) * frozen.span_s;
      },
      slide: (y, dy) => rescale(areaAt(y), (key, bounds) => scales.move(key, bounds, dy / (areaAt(y).bottom - areaAt(y).top))),
      free: (y) => rescale(areaAt(y), (key) => scales.free(key)),
      zoom,
      scale: (y, times) => rescale(areaAt(y), (key, bounds) => scales.zoom(key, bounds, times, heightOf(areaAt(y), y))),
    },
    (x) => extent !== null && x < extent.left,
  );
  const placed = (event) => ({ id: event.pointerId, x: event.offsetX, y: event.offsetY, at_ms: event.timeStamp, other: event.shiftKey });

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    // Only then moves outside of the canvas are seen; a pointer that is gone already has none.
    try {
      canvas.setPointerCapture(event.pointerId);
    } catch {
      return;
    }
    pointer.down(placed(event));
  });
  canvas.addEventListener("pointermove", (event) => pointer.move(placed(event)));
  canvas.addEventListener("pointerup", (event) => pointer.up(placed(event)));
  canvas.addEventListener("pointercancel", (event) => pointer.lose(placed(event)));
  canvas.addEventListener("wheel", (event) => {
    const times = event.deltaY > 0 ? ZOOM : 1 / ZOOM;
    if (extent && event.offsetX < extent.left) rescale(areaAt(event.offsetY), (key, bounds) => scales.zoom(key, bounds, times, heightOf(areaAt(event.offsetY), event.offsetY)));
    else if (frozen && isOverTime()) zoom(event.offsetX, times);
    else return;
    event.preventDefault();
  });

  /** Keys on the picture; `by` is a number of steps. */
  const KEYS = {
    cursor(by) {
      if (extent === null || across.checked) return;
      const which = other.checked ? 1 : 0;
      const { from, span } = extent;
      const before = (frequencies.checked ? hertz : cursors)[which] ?? from + span / 2;
      setCursor(which, Math.min(from + span, Math.max(from, before + (by * span) / 500)));
    },
    other: () => (other.checked = !other.checked),
    zoom: (by) => zoom(cursors[0] !== null && extent ? extent.left + ((cursors[0] - extent.from) / extent.span) * (extent.right - extent.left) : null, ZOOM ** by),
    pan: (by) => isOverTime() && frozen && (frozen.end_s += by * frozen.span_s * 0.5),
    scale: (by) => rescale(chosenArea(), (key, bounds) => scales.zoom(key, bounds, ZOOM ** by)),
    slide: (by) => rescale(chosenArea(), (key, bounds) => scales.move(key, bounds, by * 0.1)),
    free: () => rescale(chosenArea(), (key) => scales.free(key)),
    pane: () => areas.length && scale.choose(areas[(areas.indexOf(chosenArea()) + 1) % areas.length].key),
  };
  const chosenArea = () => areas.find(({ key }) => key === scale.pane()) ?? areas[0];
  canvas.addEventListener("keydown", (event) => {
    const meaning = keyMeaning(event);
    if (!meaning) return;
    // A key may come before the picture that it means is drawn.
    const { from_s, to_s } = content();
    if (!frequencies.checked) extent = { ...frame(canvas.clientWidth), from: from_s, span: to_s - from_s };
    KEYS[meaning.does](meaning.by);
    event.preventDefault();
    event.stopPropagation();
  });

  seconds.addEventListener("change", () => {
    if (frozen) frozen.span_s = Number(seconds.value);
    store();
  });

  /** Everything of the shown drives, as the text of a record. */
  function record() {
    const { sources, marks } = content();
    const columns = sources[0].columns.map(({ series: of, ...column }) => ({ ...column, ...samplesOf(of) }));
    const first_s = Math.min(...columns.map(({ times }) => times[0]));
    return recordOf({ columns, marks: marks.filter(({ time_s }) => time_s >= first_s), about: frozen?.about ?? null });
  }

  function saveCsv() {
    save(record(), "text/csv", "csv");
  }

  async function saveMcap() {
    try {
      save(await mcapOf(record()), "application/octet-stream", "mcap");
    } catch (error) {
      setText(saved, `MCAP not saved: ${error.message}`);
    }
  }

  function saveSvg() {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const pen = new SvgPen(width, height, colours().card);
    paint(pen, width, height, drawn(content()));
    save(pen.text(), "image/svg+xml", "svg");
  }

  function save(text, type, ending) {
    setText(saved, "");
    const address = URL.createObjectURL(new Blob([text], { type }));
    h("a", { href: address, download: `node${shared.node}.${ending}` }).click();
    URL.revokeObjectURL(address);
  }

  function update(state) {
    choose.update(state);
    fast.update(state);
    bench.update(state);
    gains.update(state);
    for (const { node, feed_m } of state.nodes) feeds.set(node, feed_m);
    drives = state.nodes.filter((node) => node.drive).map((node) => node.node);
    const more = drives.filter((node) => node !== shared.node);
    const key = more.join(" ");
    if (others.dataset.key !== key) {
      others.dataset.key = key;
      others.replaceChildren(...more.map((node) => {
        const turn = () => beside.delete(node) || beside.add(node);
        return toggle(null, `+ ${node}`, beside.has(node), turn, { "data-beside": String(node), title: `Draw node ${node} too` });
      }));
    }
    if (!shown) {
      shown = true;
      requestAnimationFrame(draw);
    }
  }

  function key(event) {
    if (event.key === "p") pause.click();
  }

  return { root, update, key, hide: () => (shown = false) };
}
