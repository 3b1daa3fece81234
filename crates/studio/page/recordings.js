// Records and logs as captures, and captures as records. The studio reads the files; the forms are those of the command line.

import { QUANTITIES, fieldOf, recordedName } from "./quantities.js";
import { request } from "./transport.js";

/** `4.velocity_rpm`, `4.606C_00`: what a column is called in a record. */
export function titleOf({ node, field }) {
  // A column of a file that names no node keeps its name.
  if (node === null) return field;
  return `${node}.${field.includes(":") ? field.split(":").slice(1).join("_") : recordedName(field)}`;
}

/** The field and the node of a column of a record. */
export function placeOf(title) {
  const [, node, axis, name] = /^(?:(\d+)(?:\.(\d+))?\.)?(.*)$/.exec(title);
  const object = /^([0-9A-F]{4})_([0-9A-F]{2})$/i.exec(name);
  if (node === undefined || axis !== undefined) return { node: null, field: title };
  return { node: Number(node), field: object ? `${node}:${object[1].toUpperCase()}:${object[2].toUpperCase()}` : fieldOf(name) };
}

/** How the mark of a record begins that says what the capture is: the form of `ferrodrive capture` (crate recording). */
const ABOUT = "capture {";

/** That mark, of a capture of the scope. */
function aboutOf({ name, notes = "", model = "", parameters = {}, zero_s, columns }) {
  const first_s = Math.min(...columns.map(({ times }) => times[0]));
  return `capture ${JSON.stringify({ name, notes, model, trigger_s: zero_s === first_s ? null : zero_s, parameters })}`;
}

/** What such a mark says; an empty object of another mark, or one that cannot be read. */
function readAbout(text) {
  try {
    return text.startsWith(ABOUT) ? JSON.parse(text.slice(ABOUT.length - 1)) : {};
  } catch {
    return {};
  }
}

/** A capture as the text of a record: a column for each value, a line for each time, and what happened; `about` is the kept capture that it is of. */
export function recordOf({ columns, marks, about = null }) {
  const rows = new Map();
  columns.forEach(({ times, values }, column) => {
    times.forEach((time_s, at) => {
      if (!rows.has(time_s)) rows.set(time_s, Array(columns.length).fill(""));
      rows.get(time_s)[column] = values[at];
    });
  });
  const empty = Array(columns.length).fill("");
  const quoted = (text) => `"${text.replaceAll('"', '""').replaceAll("\n", " ")}"`;
  const lines = [...[...rows].map(([time_s, row]) => [time_s, row, ""]), ...marks.map(({ time_s, text }) => [time_s, empty, quoted(text)])];
  lines.sort(([one], [other]) => one - other);
  if (about && lines.length) lines.unshift([lines[0][0], empty, quoted(aboutOf(about))]);
  return [["t_s", ...columns.map(titleOf), "mark"].join(","), ...lines.map(([time_s, row, mark]) => [time_s, ...row, mark].join(",")), ""].join("\n");
}

/** A capture of what the studio has read of a file: `{ columns: [{ name, title, unit, points }], marks, remark }`. */
export function captureOf(name, { columns, marks }, now = new Date()) {
  const read = columns.map(({ name: title, title: shown, unit, points }) => {
    const { node, field } = placeOf(title);
    const known = QUANTITIES.find((one) => one.field === field);
    const [times, values] = [0, 1].map((of) => Float64Array.from(points, (point) => point[of]));
    return { field, node, label: known?.label ?? shown ?? title, unit: known?.unit ?? unit, decimals: known?.decimals ?? 3, steps: known?.steps, times, values };
  });
  const first_s = Math.min(...read.map(({ times }) => times[0]));
  const about = marks.map(({ text }) => readAbout(text)).find(({ name: of }) => of !== undefined) ?? {};
  const happened = marks.filter(({ text }) => !text.startsWith(ABOUT));
  const more = { notes: about.notes ?? "", model: about.model ?? "", parameters: about.parameters ?? {} };
  return { id: crypto.randomUUID(), name: about.name || name, ...more, taken: now.toISOString(), zero_s: about.trigger_s ?? first_s, shift_s: 0, columns: read, marks: happened };
}

async function posted(path, body) {
  const answer = await request(path, { method: "POST", body }).catch(() => null);
  if (answer?.ok) return answer;
  throw new Error(answer ? ((await answer.json().catch(() => null))?.error?.message ?? `status ${answer.status}`) : "the studio does not answer");
}

/** The files of logs that were read, by their captures: these have what frames carry, a log has when it was sampled. Until the page is loaded anew. */
const logs = new WeakMap();

/** What a capture shows of a drive: frequency response, masses, speed loop. `node` is taken where it has several. Throws what it lacks. */
export async function identified(capture, node) {
  const nodes = new Set(capture.columns.map((column) => column.node));
  const log = logs.get(capture);
  if (!log && capture.columns.every(({ field }) => field.includes(":"))) throw new Error("it has the objects of a log without the times of its SYNC: load the log again, and identify from that");
  const name = log?.name ?? "capture.csv";
  const query = new URLSearchParams({ name, ...(nodes.has(node) ? { node } : {}) });
  return (await posted(`/api/recording/identified?${query}`, log ?? recordOf({ columns: capture.columns, marks: [], about: capture }))).json();
}

/** Reads a record or a log: `{ capture, remark }`. Throws what is wrong with it. */
export async function readRecording(file) {
  const body = await (await posted(`/api/recording?${new URLSearchParams({ name: file.name })}`, file)).json();
  if (!body.columns.length) throw new Error(`${file.name} has no values${body.remark ? `: ${body.remark}` : ""}`);
  const capture = captureOf(file.name, body);
  if (!/\.(csv|mcap)$/i.test(file.name)) logs.set(capture, file);
  return { capture, remark: body.remark };
}

/** The text of a record as MCAP, which Foxglove, PlotJuggler and Rerun open. */
export const mcapOf = async (text) => (await posted("/api/recording.mcap", text)).blob();
