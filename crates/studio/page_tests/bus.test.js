// The list of nodes, and the buttons of remedies.

import assert from "node:assert/strict";
import { test } from "node:test";

import { chosenNodes, concerns, summary } from "../page/bus_rows.js";
import { buttonsOf } from "../page/remedy.js";

const drive = (node, state, fault, more = {}) => ({ node, title: "ZLAC8030L", model: "zlac8030l", nmt: "operational", trouble: null, drive: { state, fault_code: fault ? 1 : 0, faults: fault ? [{ name: fault }] : [], angle_degrees: 0, velocity_rpm: 0 }, ...more });
const nodes = [
  ...Array.from({ length: 17 }, (_, at) => drive(at + 1, "Operation enabled")),
  drive(18, "Fault", "over-voltage"),
  drive(19, "Operation enabled", null, { trouble: "node 19 does not answer" }),
  { node: 20, title: null, model: null, nmt: "pre-operational", trouble: null, drive: null },
];
const of = (asked) => chosenNodes(nodes, asked).map(({ node }) => node);

test("of twenty nodes those with a fault are found by a word, by the switch, or first in the list", () => {
  assert.deepEqual(of({ words: "Over-Voltage" }), [18]);
  assert.deepEqual(of({ words: "zlac 19" }), [19]);
  assert.deepEqual(of({ only: true }), [18, 19]);
  assert.deepEqual(of({ by: "Fault" }).slice(0, 4), [18, 19, 1, 2]);
  assert.deepEqual(of({ by: "Node", down: true }).slice(0, 2), [20, 19]);
  assert.deepEqual(of({ words: "nothing" }), []);
});

test("the fastest come first, in either direction, and unknown speeds last", () => {
  const three = [drive(1, "Operation enabled"), drive(2, "Operation enabled"), { ...nodes[19], node: 3 }];
  three[1].drive.velocity_rpm = -60;
  assert.deepEqual(chosenNodes(three, { by: "Speed" }).map(({ node }) => node), [2, 1, 3]);
});

test("what is worth a look is counted", () => {
  assert.equal(summary(nodes), "20 nodes · 19 drives · 18 enabled · 1 drive with a fault, 1 without an answer");
  assert.equal(concerns(nodes.slice(0, 3)), "");
  assert.equal(summary(nodes.slice(0, 1)), "1 node · 1 drive · 1 enabled · no faults");
});

test("a remedy that names commands of the command line has their buttons", () => {
  assert.deepEqual(buttonsOf("Lower the supply. Then: ferrodrive reset 4"), [{ name: "Reset fault of node 4", command: { do: "reset_fault", node: 4 } }]);
  assert.deepEqual(buttonsOf("Start it: ferrodrive nmt 2 start, then ferrodrive enable 2").map(({ command }) => command), [{ do: "nmt", node: 2, command: "start" }, { do: "enable", node: 2 }]);
  // What moves a drive is not a button of a remedy.
  assert.deepEqual(buttonsOf("or: ferrodrive move 4, ferrodrive home 4 --method 17; ferrodrive dump"), []);
});
