// The Scope view: the values of the last 60 s, over time or over frequency.
//
// A sample is one reading of a drive, with its time; two readings are joined by a straight line, and nothing else is interpolated.

import { choice } from "./choice.js";
import { h, number, setText } from "./dom.js";
import { chooser } from "./drive.js";
import { heard, heardChooser } from "./heard.js";
import { QUANTITIES, everything, markers, newest_s, series } from "./kept.js";
import { frame, overFrequency, overTime } from "./scope_picture.js";
import { crossing, spectrum, stepResponse, within } from "./analysis.js";
import { edge } from "./scope_edge.js";
import { SvgPen } from "./svg_pen.js";
import { trigger } from "./scope_trigger.js";
import { request } from "./transport.js";

const SPANS_S = [1, 2, 5, 10, 30, 60];
const LONGEST_MARK = 40;
/** Least height of a legible pane; the picture grows with its panes. */
const LOWEST_PANE = 76;

const cut = (text) => (text.length > LONGEST_MARK ? `${text.slice(0, LONGEST_MARK - 1)}…` : text);

export function scopeView(shared) {
  const choose = chooser(shared);
  const canvas = h("canvas", { tabindex: "0", "aria-label": "Values over time. Click sets cursor A, Shift+click cursor B; the wheel zooms while paused." });
  const readout = h("p", { class: "readout", role: "status" });
  const seconds = choice("scope-window", "Time shown", SPANS_S.map((span) => ({ value: String(span), text: `${span} s` })), { value: "10" });
  const button = (id, text, onclick, title = "") => h("button", { type: "button", id, title, onclick }, text);
  const toggled = (id, text, onclick, title) => h("button", { type: "button", id, title, "aria-pressed": "false", onclick }, text);
  const pause = toggled("scope-pause", "Pause", pauseOrGoOn, "Key p");
  const steps = toggled("scope-step", "Step response", () => press(steps), "Rise time, overshoot and settling time of the values shown, or between the cursors");
  const frequencies = toggled("scope-fft", "Spectrum", () => press(frequencies), "Spectrum of the values shown");
  const panes = h("span", { class: "chooser", role: "group", "aria-label": "Values shown" });
  const others = h("span", { class: "chooser", role: "group", "aria-label": "Drives shown besides the chosen one" });
  const trip = trigger(thaw);
  const saved = h("p", { class: "bad", role: "status" });
  const root = h(
    "section",
    { class: "scope" },
    h("div", { class: "bar" }, choose.root, others),
    h("div", { class: "bar" }, seconds, pause, panes, steps, frequencies, button("scope-clear", "Clear cursors", () => (cursors = [null, null])), button("scope-save", "Save CSV", saveCsv), button("scope-mcap", "Save MCAP", saveMcap, "For Foxglove, PlotJuggler, Rerun and ferrodrive plot"), button("scope-svg", "Save SVG", saveSvg)),
    h("div", { class: "bar" }, trip.root, heardChooser().root),
    saved,
    canvas,
    readout,
    h("p", { class: "quiet" }, "Each point is one reading by SDO, about ten a second, fewer with many drives; for an added object, each frame that carries it. Click: cursor A; Shift+click: cursor B; key p: pause. While paused, the wheel zooms and a drag moves."),
  );
  /** While paused: the series, and their end. */
  let frozen = null;
  let cursors = [null, null];
  let shown = false;
  let extent = null;
  /** The inputs of the picture on the canvas. */
  let picture = null;
  const liveEdge = edge();
  const hidden = new Set(["supply_v"]);
  const beside = new Set();

  for (const { field, label } of QUANTITIES) {
    const pressed = h("button", { type: "button", "data-field": field, "aria-pressed": String(!hidden.has(field)) }, label);
    pressed.addEventListener("click", () => {
      if (!hidden.delete(field)) hidden.add(field);
      pressed.setAttribute("aria-pressed", String(!hidden.has(field)));
    });
    panes.append(pressed);
  }

  const press = (one) => one.setAttribute("aria-pressed", String(one.getAttribute("aria-pressed") !== "true"));
  const isPressed = (one) => one.getAttribute("aria-pressed") === "true";

  /** The drawn drives, the chosen one first. */
  const nodes = () => [shared.node, ...[...beside].filter((node) => node !== shared.node)].filter((node) => node !== null);

  /** Holds the picture as it is, or as it was at an end time; `byTrigger`: until the trigger fires again. */
  function freeze(end_s = end(), byTrigger = false) {
    const copies = new Map(all().map(([node, field, one]) => [`${node} ${field}`, one.cut(one.first_s(), end_s + Number(seconds.value))]));
    frozen = { copies, end_s, span_s: Number(seconds.value), marks: [...markers], byTrigger };
    pause.setAttribute("aria-pressed", "true");
    setText(pause, "Resume");
  }

  function thaw() {
    frozen = null;
    pause.setAttribute("aria-pressed", "false");
    setText(pause, "Pause");
  }

  function pauseOrGoOn() {
    if (!frozen) return freeze();
    thaw();
    trip.rearm(newest_s(shared.node));
  }

  const ofSource = (node, field) => frozen?.copies.get(`${node} ${field}`) ?? heard().find((one) => one.field === field)?.series ?? series(node, field);

  /** The source of the trigger: a value of the chosen drive, or an added object. */
  const live = (field) => heard().find((one) => one.field === field)?.series ?? series(shared.node, field);

  /** When the newest drawable value was read, and the end of the running picture. */
  const newest = () => Math.max(newest_s(shared.node), ...heard().map((one) => one.series.last_s()));
  const end = () => liveEdge(newest(), performance.now() / 1e3);

  /** Every series of the drawn drives, and of the added objects: `[node, field, series]`. */
  const all = () => [...everything(nodes()), ...heard().map((one) => [one.node, one.field, one.series])];

  /** The panes that are drawn now. */
  function content() {
    const end_s = frozen ? frozen.end_s : end();
    const from_s = end_s - (frozen ? frozen.span_s : Number(seconds.value));
    const drawn = QUANTITIES.filter(({ field }) => !hidden.has(field))
      .map((quantity) => ({
        ...quantity,
        level: trip.isOn() && trip.field() === quantity.field ? trip.level() : undefined,
        lines: nodes()
          .map((node) => ({ name: `node ${node}`, series: ofSource(node, quantity.field) }))
          .filter((line) => line.series.length > 0),
      }))
      .filter(({ lines }) => lines.length > 0);
    for (const one of heard()) {
      const lines = [{ name: `node ${one.node}`, series: ofSource(one.node, one.field) }].filter((line) => line.series.length > 0);
      if (lines.length > 0) drawn.push({ ...one, level: trip.isOn() && trip.field() === one.field ? trip.level() : undefined, lines });
    }
    const marks = (frozen ? frozen.marks : markers)
      .filter(({ node }) => node === null || nodes().includes(node))
      .map(({ time_s, text }) => ({ time_s, text: cut(text) }));
    return { panes: drawn, from_s, to_s: end_s, cursors, markers: marks };
  }

  function colours() {
    const style = getComputedStyle(document.documentElement);
    const of = (name) => style.getPropertyValue(name).trim();
    return { card: of("--card"), line: of("--line"), quiet: of("--quiet"), text: of("--text"), warn: of("--warn"), lines: ["--accent", "--bad", "--good", "--warn"].map(of) };
  }

  function paint(pen, width, height, now) {
    pen.font = "12px system-ui, sans-serif";
    if (isPressed(frequencies)) {
      const panes = now.panes.map((one) => ({ ...one, lines: one.lines.map(({ name, series: of }) => ({ name, spectrum: spectrum(of, now.from_s, now.to_s) })) }));
      overFrequency(pen, width, height, colours(), panes);
    } else {
      overTime(pen, width, height, colours(), now);
    }
  }

  /** The inputs of the picture: the same picture is not drawn twice. */
  function keyOf({ panes: all, from_s, to_s, markers: marks }, width, height, scale) {
    const lines = all.flatMap(({ field, level, lines: of }) => [field, level, ...of.map(({ name, series: one }) => `${name} ${one.first_s()} ${one.last_s()}`)]);
    const newest = marks.at(-1);
    return JSON.stringify([width, height, scale, colours(), isPressed(frequencies), isPressed(steps), from_s, to_s, cursors, marks.length, newest?.time_s, lines]);
  }

  function draw() {
    if (!shown) return;
    requestAnimationFrame(draw);
    trip.offer([...QUANTITIES, ...heard()]);
    watchTrigger();
    const scale = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const now = content();
    const key = keyOf(now, width, height, scale);
    if (key === picture) return;
    picture = key;
    if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, width, height);
    paint(pen, width, height, now);
    const least = `${now.panes.length * LOWEST_PANE}px`;
    if (canvas.style.minHeight !== least) canvas.style.minHeight = least;
    extent = { ...frame(width), from_s: now.from_s, span_s: now.to_s - now.from_s };
    setText(readout, measured(now));
  }

  /** Holds the picture once the trigger has fired, with the wanted part before it. */
  function watchTrigger() {
    if (frozen && !(frozen.byTrigger && trip.comesAgain())) return;
    const end_s = trip.look(live(trip.field()), Number(seconds.value), crossing);
    if (end_s !== null) freeze(end_s, true);
  }

  /** The values at the cursors, their differences, and the step response of each line. */
  function measured({ panes: drawn, from_s, to_s }) {
    const all = drawn.flatMap(({ lines, ...quantity }) => lines.map((one) => ({ ...quantity, ...one, label: lines.length > 1 ? `${quantity.label} of ${one.name}` : quantity.label })));
    const lines = [];
    const [a, b] = cursors.map((at_s) => (at_s === null ? null : all.map((one) => one.series.value(at_s))));
    const listed = (values) => all.map(({ label, unit, decimals }, at) => `${label} ${number(values[at], decimals)} ${unit}`).join(", ");
    [a, b].forEach((values, which) => {
      if (values?.some((value) => value !== null)) lines.push(`${"AB"[which]} at ${number(cursors[which], 3)} s: ${listed(values)}`);
      else if (values) lines.push(`${"AB"[which]} at ${number(cursors[which], 3)} s: no reading that early`);
    });
    if (a && b) {
      const differences = all.map((_, at) => (a[at] === null || b[at] === null ? null : b[at] - a[at]));
      lines.push(`B − A: ${number(cursors[1] - cursors[0], 3)} s, ${listed(differences)}`);
    }
    if (isPressed(steps)) {
      const [from, to] = a && b ? [Math.min(...cursors), Math.max(...cursors)] : [from_s, to_s];
      for (const { label, unit, decimals, steps: takesSteps, series: of } of all) {
        const step = takesSteps === false ? null : stepResponse(of, from, to);
        if (step) lines.push(`Step of ${label}: ${step.few === undefined ? shownStep(step, unit, decimals) : tooFew(step.few)}`);
      }
      if (!lines.some((line) => line.startsWith("Step"))) lines.push("No step found: a value other than a current has to be steady, change, and be steady again.");
    }
    return lines.join("\n");
  }

  function shownStep({ from, to, rise_s, overshoot, overshoot_grid, settling_s, grid_s }, unit, decimals) {
    const above = overshoot === null ? "overshoot too short for these readings" : overshoot === 0 ? "no overshoot" : `overshoot ${within(100 * overshoot, 100 * overshoot_grid)} %`;
    const settling = settling_s === null ? "not settled to 2 %" : `settled to 2 % in ${within(settling_s, grid_s)} s`;
    return `${number(from, decimals)} to ${number(to, decimals)} ${unit}, rise time (10 to 90 %) ${within(rise_s, grid_s)} s, ${above}, ${settling}`;
  }

  const tooFew = (few) => `too few readings: ${few} in the rise, expected at least 10. Map the object into a TPDO with an event timer of 1 ms (PDO view), start the node, and add the object here.`;

  const timeAt = (x) => extent.from_s + ((x - extent.left) / (extent.right - extent.left)) * extent.span_s;
  let dragged = null;

  canvas.addEventListener("pointerdown", (event) => (dragged = frozen && { x: event.offsetX, end_s: frozen.end_s, far: false }));
  canvas.addEventListener("pointermove", (event) => {
    if (!dragged || !frozen) return;
    dragged.far ||= Math.abs(event.offsetX - dragged.x) > 4;
    if (dragged.far) frozen.end_s = dragged.end_s - ((event.offsetX - dragged.x) / (extent.right - extent.left)) * frozen.span_s;
  });
  canvas.addEventListener("click", (event) => {
    const moved = dragged?.far;
    dragged = null;
    if (!extent || moved || isPressed(frequencies)) return;
    const at_s = timeAt(event.offsetX);
    if (at_s < extent.from_s || at_s > extent.from_s + extent.span_s) return;
    cursors = event.shiftKey ? [cursors[0], at_s] : [at_s, cursors[1]];
  });
  canvas.addEventListener("pointerleave", () => (dragged = null));
  canvas.addEventListener("wheel", (event) => {
    if (!frozen || isPressed(frequencies)) return;
    event.preventDefault();
    // Zoom around the pointer: the point under it stays there.
    const around_s = timeAt(event.offsetX);
    const span_s = Math.min(60, Math.max(0.01, frozen.span_s * (event.deltaY > 0 ? 1.25 : 0.8)));
    frozen.end_s = around_s + ((frozen.end_s - around_s) * span_s) / frozen.span_s;
    frozen.span_s = span_s;
  });
  seconds.addEventListener("change", () => {
    if (frozen) frozen.span_s = Number(seconds.value);
  });

  function saveCsv() {
    // The name of an object includes its node.
    const title = (node, field) => (nodes().length > 1 && !field.includes(":") ? `node${node}_${field}` : field);
    const [columns, rows] = table(title);
    const lines = rows.map(([time_s, row]) => [time_s, ...row].join(","));
    save([["at_s", ...columns].join(","), ...lines, ""].join("\n"), "text/csv", "csv");
  }

  /** As a record with the events: the studio converts a table in the form of a CSV record. */
  async function saveMcap() {
    const title = (node, field) => `${node}.${field.includes(":") ? field.split(":").slice(1).join("_") : field}`;
    const [columns, rows] = table(title);
    const marks = (frozen ? frozen.marks : markers).filter(({ node }) => node === null || nodes().includes(node));
    const first_s = rows[0]?.[0] ?? Infinity;
    const events = marks.filter(({ time_s }) => time_s >= first_s).map(({ time_s, text }) => [time_s, Array(columns.length).fill(""), `"${text.replaceAll('"', '""').replaceAll("\n", " ")}"`]);
    const lines = [...rows, ...events].sort(([a], [b]) => a - b).map(([time_s, row, mark = ""]) => [time_s, ...row, mark].join(","));
    const body = [["t_s", ...columns, "mark"].join(","), ...lines, ""].join("\n");
    const answer = await request("/api/recording.mcap", { method: "POST", body }).catch(() => null);
    if (answer?.ok) return save(await answer.blob(), "application/octet-stream", "mcap");
    const why = answer ? (await answer.json().catch(() => null))?.error?.message ?? `status ${answer.status}` : "the studio does not answer";
    setText(saved, `MCAP not saved: ${why}`);
  }

  /** Column titles, and a row for each time of a reading; values that were not read then are empty. */
  function table(title) {
    const columns = all()
      .map(([node, field]) => [title(node, field), ofSource(node, field)])
      .filter(([, one]) => one.length > 0);
    const rows = new Map();
    columns.forEach(([, { times, values, start, end }], column) => {
      for (let at = start; at < end; at += 1) {
        if (!rows.has(times[at])) rows.set(times[at], Array(columns.length).fill(""));
        rows.get(times[at])[column] = values[at];
      }
    });
    return [columns.map(([name]) => name), [...rows].sort(([a], [b]) => a - b)];
  }

  function saveSvg() {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const pen = new SvgPen(width, height, colours().card);
    paint(pen, width, height, content());
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
    const drives = state.nodes.filter((node) => node.drive && node.node !== shared.node).map((node) => node.node);
    const key = drives.join(" ");
    if (others.dataset.key !== key) {
      others.dataset.key = key;
      others.replaceChildren(...drives.map((node) => {
        const pressed = h("button", { type: "button", "data-beside": String(node), "aria-pressed": String(beside.has(node)), title: `Draw node ${node} too` }, `+ ${node}`);
        pressed.addEventListener("click", () => {
          if (!beside.delete(node)) beside.add(node);
          pressed.setAttribute("aria-pressed", String(beside.has(node)));
        });
        return pressed;
      }));
    }
    if (!shown) {
      shown = true;
      requestAnimationFrame(draw);
    }
  }

  function key(event) {
    if (event.key === "p") pauseOrGoOn();
  }

  return { root, update, key, hide: () => (shown = false) };
}
