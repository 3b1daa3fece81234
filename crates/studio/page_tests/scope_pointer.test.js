// Fingers, keys and scales of the scope.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Scales, around } from "../page/scale.js";
import { gestures, keyMeaning } from "../page/scope_pointer.js";

/** What gestures were made of; the figures are left of 72 pixels. */
function recorded() {
  const made = [];
  const on = Object.fromEntries(["tap", "pan", "slide", "free", "zoom", "scale"].map((name) => [name, (...of) => made.push([name, ...of])]));
  return [made, gestures(on, (x) => x < 72)];
}

test("a tap sets a cursor, a drag moves, and a shaking finger taps", () => {
  const [made, pointer] = recorded();
  pointer.down({ id: 1, x: 300, y: 50 });
  pointer.move({ id: 1, x: 303, y: 52 });
  pointer.up({ id: 1, x: 303, y: 52, at_ms: 0 });
  pointer.down({ id: 1, x: 300, y: 50 });
  pointer.move({ id: 1, x: 320, y: 50 });
  pointer.move({ id: 1, x: 290, y: 50 });
  pointer.up({ id: 1, x: 290, y: 50, at_ms: 900 });
  assert.deepEqual(made, [["tap", 303, 52, false], ["pan", 20], ["pan", -30]]);
});

test("two fingers zoom by the ratio of their distances, each direction for itself", () => {
  const [made, pointer] = recorded();
  pointer.down({ id: 1, x: 200, y: 100 });
  pointer.down({ id: 2, x: 300, y: 110 });
  pointer.move({ id: 2, x: 400, y: 110 });
  // Their distance has doubled: half of the time is shown, around their middle.
  assert.deepEqual(made, [["zoom", 300, 0.5]]);
  pointer.up({ id: 2, x: 400, y: 110, at_ms: 0 });
  pointer.up({ id: 1, x: 200, y: 100, at_ms: 1 });
  assert.equal(made.length, 1, "neither was a tap");
  pointer.down({ id: 1, x: 200, y: 100 });
  pointer.down({ id: 2, x: 210, y: 200 });
  pointer.move({ id: 2, x: 210, y: 150 });
  assert.deepEqual(made[1], ["scale", 125, 2]);
});

test("on the figures a drag moves the scale, and a double tap sets it free", () => {
  const [made, pointer] = recorded();
  pointer.down({ id: 1, x: 30, y: 80 });
  pointer.move({ id: 1, x: 30, y: 100 });
  pointer.up({ id: 1, x: 30, y: 100, at_ms: 0 });
  for (const at_ms of [1000, 1200]) {
    pointer.down({ id: 1, x: 30, y: 80 });
    pointer.up({ id: 1, x: 30, y: 80, at_ms });
  }
  assert.deepEqual(made, [["slide", 80, 20], ["free", 80]]);
  // What the browser takes away does not tap.
  pointer.down({ id: 1, x: 300, y: 80 });
  pointer.lose({ id: 1 });
  pointer.up({ id: 1, x: 300, y: 80, at_ms: 5000 });
  assert.equal(made.length, 2);
});

test("keys move the cursor, and those of the browser stay its own", () => {
  assert.deepEqual(keyMeaning({ key: "ArrowRight", shiftKey: true }), { does: "cursor", by: 10 });
  assert.deepEqual(keyMeaning({ key: "ArrowUp" }), { does: "scale", by: -1 });
  assert.deepEqual(keyMeaning({ key: "-" }), { does: "zoom", by: 1 });
  for (const event of [{ key: "ArrowRight", altKey: true }, { key: "+", ctrlKey: true }, { key: "Tab" }, { key: "Escape" }, { key: " " }]) assert.equal(keyMeaning(event), null, JSON.stringify(event));
});

test("a scale is that of its values until it is set", () => {
  const scales = new Scales();
  assert.deepEqual(scales.of("speed", 0, 100), [-10, 110]);
  // A value that does not change stands in the middle of a span of its own size.
  assert.deepEqual([around(0, 0), around(48, 48)], [[-1, 1], [43.2, 52.8]]);
  assert.deepEqual(around(Infinity, -Infinity), [-1, 1], "nothing is drawn");
  assert.equal(scales.zoom("speed", [0, 100], 0.5, 0.25), true);
  // A quarter from below, 25, stays where it is.
  assert.deepEqual(scales.of("speed", -999, 999), [12.5, 62.5]);
  scales.move("speed", [12.5, 62.5], 0.5);
  assert.deepEqual(scales.of("speed", 0, 0), [37.5, 87.5]);
  assert.equal(scales.fix("speed", 5, 5), false);
  assert.equal(scales.fix("speed", NaN, 5), false);
  assert.deepEqual(scales.kept(), { speed: [37.5, 87.5] });
  assert.deepEqual(new Scales({ a: [0, 1], b: [1, 0], c: "x", d: [0, null] }).kept(), { a: [0, 1] });
  scales.free("speed");
  assert.equal(scales.isSet("speed"), false);
});
