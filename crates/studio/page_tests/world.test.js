// The sliders of the world.

import assert from "node:assert/strict";
import { test } from "node:test";

import { partOf, torqueAt } from "../page/world_sliders.js";

test("a torque is set as finely where it is small, and its slider stands where it is", () => {
  // By the third power of where the slider stands, of 20 N·m.
  assert.deepEqual([0, 0.5, -0.5, 1].map(torqueAt), [0, 2.5, -2.5, 20]);
  for (const part of [-1, -0.3, 0, 0.2, 0.9]) assert.ok(Math.abs(partOf(torqueAt(part)) - part) < 0.01, String(part));
  assert.equal(torqueAt(0.01), 0.00002);
  assert.deepEqual([partOf(100), partOf(-100)], [1, -1]);
});
