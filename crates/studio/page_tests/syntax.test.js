// Every file of the page is a module that can be read: what a browser would only say on its console.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";
import { test } from "node:test";

const folder = new URL("../page/", import.meta.url);

test("every file of the page is a module without an error of syntax", () => {
  const files = readdirSync(folder).filter((name) => name.endsWith(".js"));
  assert.ok(files.length > 10);
  for (const name of files) {
    const input = readFileSync(new URL(name, folder));
    const { status, stderr } = spawnSync(process.execPath, ["--input-type=module", "--check"], { input });
    assert.equal(status, 0, `${name}: ${stderr}`);
  }
});
