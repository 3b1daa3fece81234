// How much of a core three turning drives and their host take in node, and how many times as fast as the clock they could pass:
//
//     cargo xtask web -o site
//     SITE=$PWD/site node crates/web/site_tools/speed.js

import { join } from "node:path";
import { pathToFileURL } from "node:url";

const { World } = await import(pathToFileURL(join(process.env.SITE, "ferrodrive.js")));
const NODES = [4, 5, 6];
const SPAN_S = 20;

const world = await World.open(NODES.map((node) => `[[drive]]\nmodel = "zlac8030l"\nnode = ${node}\n`).join(""));
world.ask({ do: "take_control" });
for (const node of NODES) world.ask({ do: "velocity", node, rpm: 60 });
// Compiled by then.
world.run(1);
world.hold();
const { user: before } = process.cpuUsage();
for (let second = 0; second < SPAN_S; second += 1) {
  world.run(1);
  world.hold();
}
const taken_s = (process.cpuUsage().user - before) / 1e6;
for (const node of NODES) {
  const speed = world.command(`${node} get`).velocity_rpm;
  if (!(Math.abs(speed - 60) < 3)) throw new Error(`node ${node} turns at ${speed} r/min`);
}
console.log(`${((taken_s / SPAN_S) * 1000).toFixed(1)} ms of processor time for a second of three drives: ${(SPAN_S / taken_s).toFixed(0)} times as fast as the clock`);
