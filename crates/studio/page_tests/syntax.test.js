// Every file of the page is a module that can be read: what a browser would only say on its console.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readdirSync } from "node:fs";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

const folder = fileURLToPath(new URL("../page/", import.meta.url));

/** Reads each as a module without carrying it out: one process for all, since each takes a second on a busy machine. */
const READ = `const { readFileSync } = require("node:fs"); const { SourceTextModule } = require("node:vm");
  for (const name of process.argv.slice(1)) {
    try { new SourceTextModule(readFileSync(name, "utf8"), { identifier: name }); }
    catch (error) { console.log(name + ": " + error.message); }
  }`;

test("every file of the page is a module without an error of syntax", () => {
  const files = readdirSync(folder).filter((name) => name.endsWith(".js"));
  assert.ok(files.length > 10);
  const { status, stdout, stderr } = spawnSync(process.execPath, ["--experimental-vm-modules", "--no-warnings", "-e", READ, ...files], { cwd: folder, encoding: "utf8" });
  assert.deepEqual([status, stdout], [0, ""], stderr);
});
