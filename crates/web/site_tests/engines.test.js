// The module in node: the same runs as those of the native program, and the JavaScript interface.
//
// SITE is the folder of `cargo xtask web`, FERRODRIVE the native program, SCENARIOS the folder of the scenarios.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const { SITE, FERRODRIVE, SCENARIOS } = process.env;
const { FerrodriveError, World, runScenario } = await import(pathToFileURL(join(SITE, "ferrodrive.js")));

const WHEEL = '[[drive]]\nmodel = "zlac8030l"\nnode = 4\n';

for (const name of readdirSync(SCENARIOS).filter((name) => name.endsWith(".toml"))) {
  // A page has no machine file beside a scenario.
  if (/^machine =/m.test(readFileSync(join(SCENARIOS, name), "utf8"))) continue;
  test(`${name} is the same run as the native one, to the last frame`, async () => {
    const path = join(SCENARIOS, name);
    const native = JSON.parse(execFileSync(FERRODRIVE, ["run", "--json", path], { encoding: "utf8" }));
    const here = await runScenario(readFileSync(path, "utf8"));
    assert.equal(here.digest, native.digest);
    assert.deepEqual(here.rows, native.rows);
    // Printed with six decimals.
    for (const [name, figure] of Object.entries(native.figures)) assert.ok(Math.abs(here.figures[name] - figure) <= 5e-7, name);
  });
}

test("a world moves as it is asked, and stops what is not held", async () => {
  const world = await World.open(WHEEL);
  const began = world.now;
  world.run(0.25);
  assert.equal(world.now, began + 0.25);
  assert.throws(() => world.ask({ do: "velocity", node: 4, rpm: 60 }), (error) => error instanceof FerrodriveError && error.kind === "not_in_control");
  world.ask({ do: "take_control" });
  world.ask({ do: "velocity", node: 4, rpm: 60 });
  const speed = () => world.command("4 get").velocity_rpm;
  assert.ok(Math.abs(speed() - 60) < 3, `${speed()} r/min`);
  assert.equal(world.state.nodes[0].drive.state, "Operation enabled");
  // The presence span is 3 s.
  world.run(4);
  assert.ok(Math.abs(speed()) < 2, `${speed()} r/min after 4 s without a sign of life`);
});

test("two worlds do not know each other, and equal ones are equal", async () => {
  const [one, two] = [await World.open(WHEEL), await World.open(WHEEL)];
  one.run(1);
  two.run(0.4);
  two.run(0.6);
  assert.equal(one.digest, two.digest);
  one.command("4 supply 30");
  one.run(0.1);
  two.run(0.1);
  assert.equal(Math.round(one.command("4 get").supply_v), 30);
  assert.equal(Math.round(two.command("4 get").supply_v), 48);
});

test("what is wrong with a machine is said with its line, and a world goes on after a refusal", async () => {
  await assert.rejects(World.open("[[drive]]\nmodel = 'zlac9'\nnode = 4\n"), (error) => error.kind === "bad_file" && /line 2/.test(error.message));
  const world = await World.open(WHEEL);
  assert.throws(() => world.command("4 fly"), (error) => error.kind === "usage");
  assert.throws(() => world.run(-1), RangeError);
  world.run(0.1);
});

test("the package for npm has all that its entry needs", (t) => {
  const archive = readdirSync(SITE).find((name) => name.endsWith(".tgz"));
  if (!archive) return t.skip("npm is not installed");
  const listed = execFileSync("tar", ["-tzf", join(SITE, archive)], { encoding: "utf8" }).trim().split("\n").sort();
  assert.deepEqual(listed, ["LICENSE-APACHE", "LICENSE-MIT", "README.md", "ferrodrive.d.ts", "ferrodrive.js", "ferrodrive.wasm", "package.json"].map((name) => `package/${name}`));
});
