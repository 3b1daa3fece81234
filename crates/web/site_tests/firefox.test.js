// Another engine: each scenario in Firefox is the same run as the native one. Skipped where Firefox ESR is not installed.
//
// SITE, FERRODRIVE and SCENARIOS are those of engines.test.js; FIREFOX is the browser, where it has another path.

import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { extname, join, normalize } from "node:path";
import { test } from "node:test";

import { natively, scenarios } from "../site_tools/scenarios.js";

const { SITE, FIREFOX = "firefox-esr" } = process.env;
const KINDS = { ".js": "text/javascript", ".wasm": "application/wasm" };
const PAGE = `<!doctype html><script type="module">
import { runScenario } from "./ferrodrive.js";
const digests = {};
try {
  for (const { name, text, files } of await (await fetch("/scenarios")).json()) digests[name] = (await runScenario(text, { files })).digest;
} catch (error) { digests.error = String(error); }
await fetch("/digests", { method: "POST", body: JSON.stringify(digests) });
</script>`;

const missing = spawnSync(FIREFOX, ["--version"]).status === 0 ? false : `${FIREFOX} does not run here: install firefox-esr`;

test("each scenario in Firefox is the same run as the native one", { skip: missing, timeout: 120_000 }, async ({ signal }) => {
  const profile = mkdtempSync(join(tmpdir(), "firefox-"));
  let receive;
  const received = new Promise((resolve) => { receive = resolve; });
  const server = createServer(async (request, response) => {
    const path = new URL(request.url, "http://localhost").pathname;
    if (path === "/digests") {
      let body = "";
      for await (const part of request) body += part;
      response.end();
      receive(JSON.parse(body));
    } else if (path === "/scenarios") {
      response.end(JSON.stringify(scenarios));
    } else if (path === "/probe.html") {
      response.writeHead(200, { "content-type": "text/html" }).end(PAGE);
    } else if (KINDS[extname(path)]) {
      response.writeHead(200, { "content-type": KINDS[extname(path)] }).end(readFileSync(join(SITE, normalize(path))));
    } else {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const address = `http://127.0.0.1:${server.address().port}/probe.html`;
  const browser = spawn(FIREFOX, ["--headless", "--no-remote", "--profile", profile, address], { stdio: "ignore" });
  const ended = new Promise((resolve) => browser.once("exit", resolve));
  const silent = new Promise((_, reject) => {
    browser.once("exit", (code) => reject(new Error(`Firefox ended with ${code} before it had run the scenarios`)));
    signal.addEventListener("abort", () => reject(signal.reason));
  });
  try {
    const digests = await Promise.race([received, silent]);
    assert.deepEqual(digests, Object.fromEntries(scenarios.map((scenario) => [scenario.name, natively(scenario).digest])));
  } finally {
    silent.catch(() => {});
    browser.kill();
    await ended;
    server.closeAllConnections();
    server.close();
    rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
  }
});
