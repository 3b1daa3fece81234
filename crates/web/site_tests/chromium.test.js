// The page in headless Chromium, from a folder below a static host's root: the same runs, a motion, and a page without a network.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { address, asked, begin, command, end, go, picture, run, server, until } from "../site_tools/browser.js";

const { FERRODRIVE, SCENARIOS } = process.env;

before(() => begin());
after(end);

test("the page finds its drives and turns one of them, and stops it", async () => {
  await go(address);
  await until("four drives", "return document.querySelectorAll('#view table tbody tr').length >= 4");
  await picture("bus");
  const { first_motion_ms } = await until(
    "the wheel turns",
    `const { ask, link } = await import(new URL("page/link.js", location.href));
     if (!link.fresh) return null;
     window.turning ??= (async () => {
       const taken = await ask({ do: "take_control" });
       const turned = await ask({ do: "velocity", node: 4, rpm: 60 });
       return { taken, turned };
     })();
     const { taken, turned } = await window.turning;
     if (!taken.ok || !turned.ok) { window.turning = null; return { failed: JSON.stringify({ taken, turned }) }; }
     const drive = link.state.nodes.find(({ node }) => node === 4).drive;
     return Math.abs(drive.velocity_rpm - 60) < 5 ? { first_motion_ms: performance.now() } : null;`,
  );
  console.log(`# turning ${Math.round(first_motion_ms)} ms after the page was asked for`);
  await run("location.hash = 'scope'; return true");
  await new Promise((resolve) => setTimeout(resolve, 1500));
  await picture("scope");
  await run("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown')); return true");
  await until(
    "the wheel stands",
    `const { link } = await import(new URL("page/link.js", location.href));
     const { drive, doing } = link.state.nodes.find(({ node }) => node === 4);
     return Math.abs(drive.velocity_rpm) < 1 && !doing && drive.state !== "Operation enabled"`,
  );
});

test("the views get what they request", async () => {
  await run("location.hash = 'trace'; return true");
  // What this page's own host reads is hidden at first.
  await until("its switch", "const quiet = document.getElementById('trace-quiet'); quiet?.click(); return quiet !== null");
  await until("lines of the trace", "return [...document.querySelectorAll('.trace-list .trace-row')].some((row) => /6041h/.test(row.innerText))");
  await picture("trace");
  await run("location.hash = 'drive'; return true");
  await until("the state machine", "return document.querySelectorAll('#view svg.machine .state').length === 8");
  await run("location.hash = 'world'; return true");
  await until("the world", "return /48\\.0 V/.test(document.querySelector('#view .world')?.innerText ?? '')");
  await picture("world");
});

test("the console takes lines by the keyboard alone, and shows what a device is called as text", async () => {
  const key = (value) => ({ type: "key", actions: [...value].flatMap((one) => [{ type: "keyDown", value: one }, { type: "keyUp", value: one }]) });
  const type = (keys) => command("POST", "/actions", { actions: [{ ...key(keys), id: "keys" }] });
  const [ENTER, UP] = ["\ue007", "\ue013"];
  await run("location.hash = 'console'; return true");
  await until("its line", "const line = document.getElementById('console-line'); line?.focus(); return document.activeElement === line && line !== null");
  const said = (text) => until(text, "return document.getElementById('console-log').innerText.includes(arguments[0])", text);
  await type(`state 4${ENTER}`);
  await said("statusword");
  await type(`<b>fly</b> 4${ENTER}`);
  await said("unrecognized subcommand '<b>fly</b>'");
  await run("const { ask } = await import(new URL('page/link.js', location.href)); return await ask({ do: 'take_control' })");
  await type(`move 1 10deg --relative${ENTER}`);
  await said("reached after");
  await type(`${UP}${UP}${UP}`);
  await until("the oldest line", "return document.getElementById('console-line').value === 'state 4'");
  await until("no markup", "return document.querySelector('#console-log b') === null && document.getElementById('console-log').getAttribute('role') === 'log'");
  await picture("console");
  await command("POST", "/window/rect", { width: 400, height: 800 });
  await until("nothing wider than the window", "return document.documentElement.scrollWidth <= innerWidth");
  await picture("console_narrow");
  await command("POST", "/window/rect", { width: 1280, height: 900 });
});

test("a scenario in the browser is the same run as the native one", async () => {
  const path = join(SCENARIOS, "brown_out.toml");
  const native = JSON.parse(execFileSync(FERRODRIVE, ["run", "--json", path], { encoding: "utf8" }));
  // The page itself may not compile: its policy leaves that to workers.
  const here = await run(
    `return new Promise((resolve) => {
       const worker = new Worker("scenario.js", { type: "module" });
       worker.onmessage = ({ data }) => resolve(data);
       worker.onerror = (event) => resolve({ error: event.message });
       worker.postMessage({ scenario: ${JSON.stringify(readFileSync(path, "utf8"))} });
     })`,
  );
  assert.equal(here.error, undefined);
  assert.equal(here.outcome.digest, native.digest);
});

test("a scenario of the list is played, and its rows are shown", async () => {
  await run("document.querySelector('#machine-choice button').click(); return true");
  await until("the list", "const at = [...document.querySelectorAll('#machine-choice li')].find((one) => /Brown-out/.test(one.innerText)); at?.click(); return at !== undefined");
  const text = await until("the outcome", "return document.getElementById('scenario')?.innerText");
  await picture("scenario");
  assert.match(text, /As expected: .* digest [0-9a-f]{16}/);
  assert.match(text, /603F/);
  await run("document.querySelector('#scenario button').click(); return true");
});

test("a data sheet that is dropped on the page joins the machine at the next free node-ID", async () => {
  const sheet = readFileSync(new URL("../tests/data/io401.eds", import.meta.url), "utf8");
  await run(
    `location.hash = "bus";
     const data = new DataTransfer();
     data.items.add(new File([${JSON.stringify(sheet)}], "mine.eds"));
     window.dispatchEvent(new DragEvent("drop", { dataTransfer: data, cancelable: true }));
     return true`,
  );
  await until("node 3 among four drives", "return [...document.querySelectorAll('#view table tbody tr')].map((row) => parseInt(row.innerText)).join() === '1,2,3,4,5'");
  await picture("eds");
});

test("a machine that is refused says why, and the first one stands in for it", async () => {
  await go(`${address}?refused#machine=${encodeURIComponent("[[drive]]\nmodel = 'zlac9'\nnode = 4\n")}`);
  await until("why", "return /refused.*line 2.*zlac9/s.test(document.getElementById('machine-status').innerText)");
  await until("four drives", "return document.querySelectorAll('#view table tbody tr').length >= 4");
  await picture("refused");
});

test("a link holds a machine, which its server never sees", async () => {
  const machine = '[[drive]]\nmodel = "zlim42c"\nnode = 77\n';
  await go(`${address}?again#machine=${encodeURIComponent(machine)}`);
  await until("node 77 alone", "return document.querySelectorAll('#view table tbody tr').length === 1 && /77/.test(document.querySelector('#view table tbody').innerText)");
  assert.equal(asked.some((path) => path.includes("zlim")), false);
  await run("sessionStorage.clear(); return true");
});

test("once loaded the page works without a network, and has asked for nothing but its own files", async () => {
  await until("the service worker", "return (await navigator.serviceWorker.ready) && navigator.serviceWorker.controller !== null");
  assert.deepEqual(asked.filter((path) => !path.startsWith("/try/") && path !== "/favicon.ico"), []);
  server.close();
  server.closeAllConnections();
  await go(address);
  await until("four drives, offline", "return document.querySelectorAll('#view table tbody tr').length >= 4");
});
