// Captures: laid over each other, subtracted, one value over another, in files.

import assert from "node:assert/strict";
import { test } from "node:test";

import { against, difference, freeName, noRoomFor, samplesOf, seriesOf, shiftOf } from "../page/capture.js";
import { captureOf, placeOf, recordOf, titleOf } from "../page/recordings.js";
import { overlaid, panesOf, partnerOf } from "../page/scope_source.js";
import { defined, keptDefinitions } from "../page/scope_computed.js";
import { measured } from "../page/scope_readout.js";

const column = (times, of, more = {}) => ({ field: "velocity_rpm", node: 4, label: "Speed", unit: "r/min", decimals: 1, times: Float64Array.from(times), values: Float64Array.from(times, of), ...more });
const grid = (from_s, count, step_s) => Array.from({ length: count }, (_, at) => from_s + at * step_s);
const capture = (columns, more = {}) => ({ id: "a", name: "first", taken: "2026-01-02T03:04:05.000Z", zero_s: 10, shift_s: 0, columns, marks: [], ...more });

test("captures are aligned by trigger, by begin, or by the time of the bus, and moved by hand", () => {
  const one = capture([column(grid(8, 50, 0.1), () => 0)]);
  const picture = { from_s: 100, zero_s: 103 };
  assert.equal(shiftOf(one, "zero", picture), 93);
  assert.equal(shiftOf(one, "start", picture), 92);
  assert.equal(shiftOf(one, "time", picture), 0);
  // Without a trigger the zero of the picture is where it begins.
  assert.equal(shiftOf(one, "zero", { from_s: 100, zero_s: null }), 90);
  assert.equal(shiftOf({ ...one, shift_s: 0.25 }, "start", picture), 92.25);
});

test("a picture that is kept and laid over itself by its begin is not moved", () => {
  const running = seriesOf(column(grid(0, 40, 0.5), Math.sin));
  // From between two samples: the one before is kept too, so that the line reaches the edge.
  const { times, values } = running.cut(5.2, 15.2);
  const own = capture([{ ...column([], () => 0), times, values }], { from_s: 5.2 });
  assert.equal(times[0], 5);
  assert.equal(shiftOf(own, "start", { from_s: 5.2, zero_s: null }), 0);
  const live = { name: "", columns: [{ ...column([], () => 0), series: running }] };
  const [, less] = panesOf([live, overlaid()(own, "start", { from_s: 5.2, zero_s: null })], { subtracts: true });
  assert.ok(less.lines[0].series.length > 10);
  assert.ok(samplesOf(less.lines[0].series).values.every((value) => Math.abs(value) < 1e-12));
});

test("values of two units stand in two panes, and have no difference", () => {
  const source = (name, unit) => ({ name, columns: [column([0, 1, 2], () => 1, { unit })].map((one) => ({ ...one, series: seriesOf(one) })) });
  const panes = panesOf([source("", "r/min"), source("file", "rad/s"), source("log", "")], { subtracts: true });
  assert.deepEqual(panes.map(({ key, unit, lines }) => [key, unit, lines.map(({ name }) => name)]), [
    ["velocity_rpm", "r/min", ["node 4", "node 4, log"]],
    ["velocity_rpm −", "", ["less node 4, log"]],
    ["velocity_rpm rad/s", "rad/s", ["node 4, file"]],
  ]);
});

test("a value is drawn over that of its own source and node, or over none", () => {
  const lines = [{ source: 0, node: 4 }, { source: 1, node: 4, name: "node 4, a" }, { source: 2, node: 4, name: "node 4, a" }, { source: 3, node: null }];
  assert.equal(partnerOf({ source: 2, node: 4 }, lines), lines[2], "two captures of one name");
  assert.equal(partnerOf({ source: 3, node: 4 }, lines), lines[3]);
  assert.equal(partnerOf({ source: 0, node: 2 }, lines), undefined);
});

test("the readout gives no value where a line has none, and names a capture", () => {
  const source = (name, count) => ({ name, columns: [column(grid(0, count, 1), () => 7)].map((one) => ({ ...one, series: seriesOf(one) })) });
  const empty = { name: "", columns: [] };
  const read = (at_s) => measured({ panes: panesOf([empty, source("old", 4)], {}), from_s: 0, to_s: 10, cursors: [at_s, null] }, false);
  assert.equal(read(3), "A at 3.000 s: Speed of node 4, old 7.0 r/min");
  assert.equal(read(3.5), "A at 3.500 s: no reading there");
});

test("the difference of two lines is a line, where both are known", () => {
  const one = seriesOf(column(grid(0, 11, 0.1), (time_s) => 3 * time_s + 1));
  // Read at other times, and from 0.35 s to 0.85 s only.
  const other = seriesOf(column(grid(0.35, 6, 0.1), (time_s) => time_s));
  const less = difference(one, other);
  assert.deepEqual([less.length, less.first_s() > 0.35, less.last_s() <= 0.85], [5, true, true]);
  for (let at = less.start; at < less.end; at += 1) assert.ok(Math.abs(less.values[at] - (2 * less.times[at] + 1)) < 1e-12);
  assert.equal(difference(one, seriesOf(column([0.5], () => 0))).length, 0, "of a single reading");
});

test("a sine over a cosine is a circle", () => {
  const times = grid(0, 629, 0.01);
  const { xs, ys } = against(seriesOf(column(times, Math.cos)), seriesOf(column(times, Math.sin)), 0, 10);
  assert.equal(xs.length, 629);
  xs.forEach((x, at) => assert.ok(Math.abs(Math.hypot(x, ys[at]) - 1) < 1e-12));
  assert.deepEqual(against(seriesOf(column([0, 1], () => 0)), seriesOf(column([2, 3], () => 0)), 0, 5), { xs: [], ys: [] });
});

test("the values of a field stand in one pane, captures too, and their differences below", () => {
  const live = { name: "", columns: [column(grid(100, 11, 0.1), (time_s) => time_s - 100)].map((one) => ({ ...one, series: seriesOf(one) })) };
  const lay = overlaid();
  const other = capture([column(grid(8, 11, 0.1), () => 0.5), column(grid(8, 11, 0.1), () => 2, { field: "current_a", label: "Current", unit: "A" })]);
  const over = lay(other, "start", { from_s: 100, zero_s: null });
  const panes = panesOf([live, over], { subtracts: true });
  assert.deepEqual(panes.map(({ key, lines }) => [key, lines.map(({ name }) => name)]), [
    ["velocity_rpm", ["node 4", "node 4, first"]],
    ["velocity_rpm −", ["less node 4, first"]],
    ["current_a", ["node 4, first"]],
  ]);
  // At 0.7 s after the begin: 0.7 of the one, 0.5 of the other.
  assert.ok(Math.abs(panes[1].lines[0].series.value(100.7 + 1e-9) - 0.2) < 1e-9);
  assert.deepEqual(panesOf([live, over], { hidden: new Set(["velocity_rpm"]), subtracts: true }).map(({ key }) => key), ["current_a"]);
  // What stays where it is is not moved again.
  const again = lay(other, "start", { from_s: 100, zero_s: null });
  assert.equal(again.columns[0].series, over.columns[0].series);
});

test("a computed quantity is one of each source that has what it takes", () => {
  const definitions = [defined({ name: "power", unit: "W", text: "speed * current" })];
  const of = (node) => [column([0, 1], () => 2, { node }), column([0, 1], () => 3, { node, field: "current_a" })].map((one) => ({ ...one, series: seriesOf(one) }));
  const sources = [{ name: "", columns: [...of(1), ...of(4)] }, { name: "first", columns: of(4).slice(1) }];
  const power = panesOf(sources, { definitions }).find(({ key }) => key === "=power");
  assert.deepEqual(power.lines.map(({ name, series }) => [name, series.value(1)]), [["node 1", 6], ["node 4", 6]]);
  assert.throws(() => defined({ name: " ", text: "1" }), /expected a name/);
  assert.deepEqual(keptDefinitions([{ name: "a", text: "speed" }, { name: "b", text: "((" }, null, 3]).map(({ name }) => name), ["a"]);
  assert.deepEqual(keptDefinitions("of another version"), []);
});

test("a browser keeps a bounded number and a bounded size", () => {
  const small = capture([column([0], () => 0)]);
  assert.equal(noRoomFor(small, Array(39).fill(small)), null);
  assert.match(noRoomFor(small, Array(40).fill(small)), /keeps 40 captures; delete one/);
  // 16 bytes a sample: 4 M samples are 64 MB.
  const large = capture([{ times: { byteLength: 32 << 20 }, values: { byteLength: 32 << 20 } }]);
  assert.equal(noRoomFor(large, []), null);
  assert.match(noRoomFor(large, [large]), /would take 128 MB, expected at most 96 MB/);
  assert.equal(freeName("first", [small, { name: "first (2)" }]), "first (3)");
});

test("a record has the names of the command line, both ways", () => {
  for (const [field, title] of [["velocity_rpm", "4.velocity_rpm"], ["angle_degrees", "4.position_deg"], ["4:606C:00", "4.606C_00"]]) {
    assert.equal(titleOf({ node: 4, field }), title);
    assert.deepEqual(placeOf(title), { node: 4, field });
  }
  assert.deepEqual(placeOf("5.2.velocity_rpm"), { node: null, field: "5.2.velocity_rpm" });
  for (const field of ["5.2.velocity_rpm", "base.x_m"]) assert.equal(titleOf(placeOf(field)), field);
  assert.deepEqual(placeOf("base.x_m"), { node: null, field: "base.x_m" });
  const one = capture([column([0.5, 1.5], () => 2), column([1, 1.5], () => 3, { field: "4:606C:00" })], { marks: [{ time_s: 1.2, node: 4, text: 'node 4: "hard", over-voltage' }] });
  // RFC 4180: a quotation mark in a quoted field is written twice.
  assert.equal(recordOf(one), 't_s,4.velocity_rpm,4.606C_00,mark\n0.5,2,,\n1,,3,\n1.2,,,"node 4: ""hard"", over-voltage"\n1.5,2,3,\n');
});

test("what the studio read of a file is a capture", () => {
  const read = { columns: [{ name: "4.velocity_rpm", title: "velocity_rpm of node 4", unit: "r/min", points: [[2, 10], [3, 11]] }, { name: "4.606C_00", title: "4:606C:00 velocity_actual_value", unit: "[0.1 r/min]", points: [[1, 100]] }], marks: [] };
  const found = captureOf("a.log", read, new Date("2026-01-02T03:04:05Z"));
  assert.deepEqual([found.name, found.taken, found.zero_s, found.shift_s], ["a.log", "2026-01-02T03:04:05.000Z", 1, 0]);
  assert.deepEqual(found.columns.map(({ label, unit, node }) => [label, unit, node]), [["Speed", "r/min", 4], ["4:606C:00 velocity_actual_value", "[0.1 r/min]", 4]]);
  assert.deepEqual([...found.columns[0].values], [10, 11]);
});

test("a capture over a running picture moves with it in the array that it has, and what was kept stays", () => {
  const own = capture([column([10, 11, 12], (time_s) => time_s)]);
  const lay = overlaid();
  const drawn = (from_s) => lay(own, "start", { from_s, zero_s: null }).columns[0].series;
  const first = drawn(100);
  assert.deepEqual([...first.times], [100, 101, 102]);
  const arrays = new Set([first.times]);
  for (let frame = 1; frame < 50; frame += 1) arrays.add(drawn(100 + frame / 64).times);
  assert.equal(arrays.size, 1);
  // From the kept times each time: nothing adds up.
  assert.deepEqual([...drawn(7.5).times], [7.5, 8.5, 9.5]);
  assert.equal(drawn(7.5).values, own.columns[0].values, "values are not copied at all");
  assert.deepEqual([...own.columns[0].times], [10, 11, 12]);
});

test("name, notes, trigger and parameters of a capture go into a record and come back", () => {
  const own = capture([column([10, 11, 12], () => 1)], { name: "cold start", notes: "belt \"tight\"\nsecond line", model: "zlac8030l", parameters: { "6083h:00": "E8030000" }, zero_s: 11 });
  const text = recordOf({ columns: own.columns, marks: [{ time_s: 10.5, node: 4, text: "fault" }], about: own });
  const mark = text.split("\n")[1];
  // The form that crate recording reads: one mark, JSON in quotes that are doubled.
  const about = JSON.parse(/"capture (.*)"$/.exec(mark)[1].replaceAll('""', '"'));
  assert.deepEqual(about, { name: "cold start", notes: "belt \"tight\"\nsecond line", model: "zlac8030l", trigger_s: 11, parameters: { "6083h:00": "E8030000" } });
  const read = { columns: [{ name: "4.velocity_rpm", title: "Speed", unit: "r/min", points: [[10, 1], [11, 1]] }], marks: [{ time_s: 10, node: null, text: `capture ${JSON.stringify(about)}` }, { time_s: 10.5, node: 4, text: "fault" }] };
  const back = captureOf("x.csv", read);
  assert.deepEqual([back.name, back.notes, back.zero_s, back.model, back.parameters], [own.name, own.notes, 11, own.model, own.parameters]);
  assert.deepEqual(back.marks.map(({ text: of }) => of), ["fault"]);
  // A mark that is broken is left out, and the file is read all the same.
  const broken = captureOf("x.csv", { ...read, marks: [{ time_s: 0, node: null, text: "capture {" }] });
  assert.deepEqual([broken.name, broken.notes, broken.marks], ["x.csv", "", []]);
});
