// The module in node: the same runs as those of the native program, and the JavaScript interface.
//
// SITE is the folder of `cargo xtask web`, FERRODRIVE the native program, SCENARIOS the folder of the scenarios (`site_tools/scenarios.js`).

import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

import { natively, scenarios } from "../site_tools/scenarios.js";

const { SITE, FERRODRIVE } = process.env;
const { FerrodriveError, World, runScenario } = await import(pathToFileURL(join(SITE, "ferrodrive.js")));

const WHEEL = '[[drive]]\nmodel = "zlac8030l"\nnode = 4\n';

for (const scenario of scenarios) {
  test(`${scenario.name} is the same run as the native one, to the last frame`, async () => {
    const native = natively(scenario);
    const here = await runScenario(scenario.text, { files: scenario.files });
    assert.equal(here.digest, native.digest);
    // Printed with six decimals.
    const printed = (row) => ({ ...row, t: row.t === null ? null : Number(row.t.toFixed(6)) });
    assert.deepEqual(here.rows.map(printed), native.rows);
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

test("bad files are refused with the words of the native program", async () => {
  const MACHINES = ["[[drive]]\nmodel = 'zlac9'\nnode = 4\n", "[[drive]]\nmodel = 'zlac8030l'\nnode = 128\n", "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nlod = 1\n", "[[drive]\n", ""];
  const DRIVE = "[machine]\n[[machine.drive]]\nmodel = 'zlac8030l'\nnode = 4\n";
  const SCENARIO_FILES = ["", `title = 'x'\n${DRIVE}[[step]]\nname = 'a'\nwhen = '4 fly > 1'\n`, `title = 'x'\nlimit = '5 parsecs'\n${DRIVE}`];
  const folder = mkdtempSync(join(tmpdir(), "ferrodrive-bad-"));
  const path = join(folder, "bad.toml");
  // The program names the file, which has none in a page, and says what it cannot use.
  const unnamed = (text) => text.replaceAll(`${folder}/`, "").replace(/^cannot use (the scenario )?bad\.toml: /, "").replaceAll(/bad\.toml:(\d+):(\d+): /g, "");
  const there = (command, text) => {
    writeFileSync(path, text);
    const { stdout } = spawnSync(FERRODRIVE, ["--json", command, path], { encoding: "utf8" });
    return unnamed(JSON.parse(stdout).error.message);
  };
  const here = async (refused) => {
    const message = await refused.then(() => "accepted", (error) => error.message);
    return message.replaceAll(/line (\d+)(, column \d+)?: /g, "");
  };
  try {
    for (const text of MACHINES) assert.equal(await here(World.open(text)), there("check", text), text);
    for (const text of SCENARIO_FILES) assert.equal(await here(runScenario(text)), there("run", text), text);
  } finally {
    rmSync(folder, { recursive: true });
  }
});

test("what a drive stores is handed out before the drive acknowledges it, and is there when it is given back", async () => {
  const kept = [];
  let release = () => {};
  const held = await World.open(WHEEL, { onstored: (stored) => (kept.push(stored), new Promise((resolve) => (release = resolve))) });
  held.ask({ do: "take_control" });
  // This drive stores the object with the write (its handbook page): the answer to the write waits.
  assert.throws(() => held.ask({ do: "write_parameters", node: 4, values: [{ object: "2013:01", value: "850" }] }, { within: 0.1 }), { kind: "timeout" });
  assert.deepEqual(kept.map(({ number, model }) => [number, model]), [[4, "zlac8030l"]]);
  release();
  // Calls of promises come between two calls of ours.
  await null;
  held.run(0.1);
  const read = (world) => world.ask({ do: "read_objects", node: 4, objects: ["2013:01"] }).values;
  const again = await World.open(WHEEL, { stored: kept });
  assert.match(read(again)[0].text, /85/);
  const factory = await World.open(WHEEL);
  assert.doesNotMatch(read(factory)[0].text, /85/);
  // That of another model, and what is not an image, is reported, and the drive begins as from the factory.
  for (const stored of [{ ...kept[0], model: "zlim42c" }, { ...kept[0], image: "0" }, { ...kept[0], image: "zz".repeat(64) }]) {
    const said = [];
    const world = await World.open(WHEEL, { stored: [stored], onunusable: (why) => said.push(why) });
    assert.match(said.join(), /what drive 4 has stored cannot be used/);
    assert.equal(read(world)[0].text, read(factory)[0].text);
  }
});

test("a module that runs out of memory is reported as such, and a defect is called one", async () => {
  const { Library } = await import(pathToFileURL(join(SITE, "ferrodrive.js")));
  const full = await Library.make();
  const piece = new Uint8Array(100 * 2 ** 20);
  assert.throws(() => {
    for (let count = 0; count < 12; count += 1) full.call({ call: "give", name: `${count}.eds` }, piece);
  }, /out of memory: the module has taken [\d]+ MiB of at most 1024/);
  const broken = await Library.make();
  broken.exports = { ...broken.exports, call: () => { throw new WebAssembly.RuntimeError("unreachable"); } };
  assert.throws(() => broken.call({ call: "digest" }), /a defect of Ferrodrive.*unreachable/);
});

/** The blocks of JavaScript in a file of ours. */
const snippets = (path) => [...readFileSync(new URL(path, import.meta.url), "utf8").matchAll(/^```js\n([^]*?)^```$/gm)].map(([, code]) => code);

test("the package is installed by npm, and what is written about it runs as it stands", (t) => {
  const archive = readdirSync(SITE).find((name) => name.endsWith(".tgz"));
  if (!archive) return t.skip("npm is not installed");
  const listed = execFileSync("tar", ["-tzf", join(SITE, archive)], { encoding: "utf8" }).trim().split("\n").sort();
  assert.deepEqual(listed, ["LICENSE-APACHE", "LICENSE-MIT", "README.md", "ferrodrive.d.ts", "ferrodrive.js", "ferrodrive.wasm", "package.json"].map((name) => `package/${name}`));
  const folder = mkdtempSync(join(tmpdir(), "ferrodrive-npm-"));
  try {
    execFileSync("npm", ["install", "--offline", "--no-audit", "--no-fund", "--prefix", folder, join(SITE, archive)], { stdio: "pipe" });
    const written = [...snippets("../README.md"), ...snippets("../../../docs/handbook/in-the-browser.md")];
    assert.equal(written.length, 2);
    for (const code of written) {
      writeFileSync(join(folder, "written.mjs"), code);
      const said = execFileSync("node", ["written.mjs"], { cwd: folder, encoding: "utf8" });
      const [, speed] = /^(-?[\d.]+) [0-9a-f]{16}$/m.exec(said) ?? assert.fail(said);
      assert.ok(Math.abs(speed - 60) < 3, said);
    }
  } finally {
    rmSync(folder, { recursive: true });
  }
});
