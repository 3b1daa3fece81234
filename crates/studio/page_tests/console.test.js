// The lines that were typed before, as Up and Down go through them.

import assert from "node:assert/strict";
import { test } from "node:test";

import { history, stops } from "../page/console_lines.js";

test("a line that stops is known, whatever stands around it", () => {
  for (const line of ["estop", "  estop ", "estop all", "ferrodrive estop", "quick-stop all", "ferrodrive  quick-stop   all"]) assert.equal(stops(line), "all", line);
  assert.equal(stops("quick-stop 4"), "one");
  for (const line of ["", "stop 4", "help estop", "velocity 4 60rpm", "estopper", "state 4"]) assert.equal(stops(line), null, line);
});

test("up and down go through the lines and back to what was being typed", () => {
  const past = history(["state 4", "enable 4"]);
  assert.equal(past.newer("mo"), "mo", "nothing is newer than what is typed");
  assert.equal(past.older("mo"), "enable 4");
  assert.equal(past.older("enable 4"), "state 4");
  assert.equal(past.older("state 4"), "state 4", "the oldest stays");
  assert.equal(past.newer("state 4"), "enable 4");
  assert.equal(past.newer("enable 4"), "mo");
});

test("a line that is given twice is kept once, and a hundred are kept", () => {
  const past = history([]);
  past.add("state 4");
  past.add("state 4");
  assert.deepEqual(past.lines, ["state 4"]);
  for (let number = 0; number < 120; number += 1) past.add(`state ${number}`);
  assert.equal(past.lines.length, 100);
  assert.equal(past.older(""), "state 119");
});
