// The page in headless Chromium, from a folder below a static host's root: the same runs, a motion, and a page without a network.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { after, before, test } from "node:test";

import { MODULES, address, asked, begin, command, end, go, picture, policy, press, run, sent, server, until } from "../site_tools/browser.js";
import { natively, scenarios } from "../site_tools/scenarios.js";

const { FERRODRIVE } = process.env;

// With the page's own policy on every file, as a host may send it: that of a worker is the one of its own answer.
before(() => begin({ headers: { "content-security-policy": `${policy()}; frame-ancestors 'none'` } }));
after(end);

const view = (name) => run(`location.hash = "${name}"; return true`);
const drives = (count) => until(`${count} drives`, `return document.querySelectorAll('#view table tbody tr').length === ${count}`);

/** Drops files on the page: their names and texts. */
const drop = (files) =>
  run(
    `const data = new DataTransfer();
     for (const [name, content] of arguments[0]) data.items.add(new File([typeof content === "string" ? content : Uint8Array.from(content)], name));
     window.dispatchEvent(new DragEvent("drop", { dataTransfer: data, cancelable: true }));
     return true`,
    files,
  );
/** Has a command carried out, where the page takes one: a loaded machine lets its state be stale for a moment. */
const must = (command) =>
  until(JSON.stringify(command), `${MODULES} const answer = await ask(arguments[0]); return answer.ok ? { result: answer.result ?? null } : { failed: JSON.stringify(answer) }`, command);
const nodes = () => run("return [...document.querySelectorAll('#view table tbody tr')].map((row) => parseInt(row.innerText)).join()");

test("the page finds its drives and turns one of them, and stops it", async () => {
  await go(address);
  await until("four drives", "return document.querySelectorAll('#view table tbody tr').length >= 4");
  await picture("bus");
  const { first_motion_ms } = await until(
    "the wheel turns",
    `${MODULES}
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
  await view("scope");
  // Curves and their scales are drawn, each in its colour.
  await until(
    "curves in the scope",
    `const canvas = document.querySelector("#view canvas");
     if (!canvas?.width) return false;
     const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
     return new Set(new Uint32Array(data.buffer)).size > 16`,
  );
  await picture("scope");
  await run("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown')); return true");
  await until(
    "the wheel stands",
    `${MODULES}
     const { drive, doing } = link.state.nodes.find(({ node }) => node === 4);
     return Math.abs(drive.velocity_rpm) < 1 && !doing && drive.state !== "Operation enabled"`,
  );
});

test("a first visit is sent each file once", async () => {
  await until("the service worker", "return (await navigator.serviceWorker.ready).active !== null");
  const files = [...new Set(sent)];
  assert.deepEqual(sent.toSorted(), files.toSorted(), "the service worker has kept what the page had loaded");
  assert.ok(files.includes("/try/ferrodrive.wasm") && files.includes("/try/page/later.js"), files.join(" "));
});

test("nothing is fetched from elsewhere, and no text becomes a script", async () => {
  let visits = 0;
  const other = createServer((_, answer) => ((visits += 1), answer.writeHead(200, { "access-control-allow-origin": "*" }).end()));
  await new Promise((resolve) => other.listen(0, "127.0.0.1", resolve));
  const at = `http://127.0.0.1:${other.address().port}/`;
  // Scripts of a test are let off at first, and not behind a timer.
  const refused = await run(
    `const broken = [];
     addEventListener("securitypolicyviolation", ({ effectiveDirective }) => broken.push(effectiveDirective));
     await new Promise((resolve) => setTimeout(resolve, 10));
     const name = (error) => error.name;
     const made = await (async () => new Function("return 1")())().catch(name);
     const fetched = await fetch(arguments[0]).then(() => "fetched", name);
     const picture = new Image();
     picture.src = arguments[0];
     await new Promise((resolve) => (picture.onerror = picture.onload = resolve));
     await new Promise((resolve) => setTimeout(resolve, 100));
     return { made, fetched, broken }`,
    at,
  );
  other.close();
  assert.deepEqual([refused.made, refused.fetched, visits], ["EvalError", "TypeError", 0]);
  assert.deepEqual(new Set(refused.broken), new Set(["script-src", "connect-src", "img-src"]));
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

test("parameters are written, backed up as a file and stored, and what was stored is there when the page is loaded again", async () => {
  await must({ do: "take_control" });
  await view("bus");
  await until("the wheel is chosen", "const row = [...document.querySelectorAll('#view table tbody tr')].find((one) => parseInt(one.innerText) === 4); row?.click(); return row !== undefined");
  await view("parameters");
  await until("its objects", "return /objects of the ZLAC8030L/i.test(document.getElementById('view').innerText)");
  // STOP has left it in its quick stop.
  await must({ do: "disable", node: 4 });
  const read = async (node) => (await must({ do: "read_objects", node, objects: ["2013:01"] })).result.values[0].text;
  const before = await read(4);
  await must({ do: "write_parameters", node: 4, values: [{ object: "2013:01", value: "850" }] });
  assert.notEqual(before, await read(4));
  // The file goes to the person as a link to a blob.
  await run(
    `window.saved = null;
     const { createObjectURL } = URL;
     URL.createObjectURL = (blob) => (blob.text().then((text) => (window.saved = text)), createObjectURL.call(URL, blob));
     document.getElementById("parameters-backup").click();
     return true`,
  );
  assert.match(await until("the file", "return window.saved"), /^\[[^]*2013[^]*850/m);
  await picture("parameters");
  await run("document.getElementById('parameters-store').click(); return true");
  await until("it is kept", "return document.getElementById('machine-forget').hidden === false");
  await until("the drive acknowledges it", "return /node 4 stored its parameters/.test(document.getElementById('news').innerText)");
  await command("POST", "/refresh", {});
  await until("the drives", `${MODULES} return link.fresh && link.state.nodes.length === 4 && link.state.nodes.every(({ drive }) => drive)`);
  assert.match(await read(4), /85/);
  assert.doesNotMatch(await read(5), /85/);
  // A device that joins leaves the others what they have stored.
  await drop([["mine.eds", readFileSync(new URL("../tests/data/io401.eds", import.meta.url), "utf8")]]);
  await until("a fifth device", `${MODULES} return link.fresh && link.state.nodes.length === 5 && link.state.nodes.every(({ drive, node }) => drive || node === 3)`);
  assert.match(await read(4), /85/);
  await run("document.getElementById('machine-forget').click(); return true");
  await until("the drives as from the factory", `${MODULES} return document.getElementById("machine-forget").hidden && link.fresh && link.state.nodes.length === 5 && link.state.nodes.every(({ drive, node }) => drive || node === 3)`);
  assert.equal(await read(4), before);
  await run("sessionStorage.clear(); localStorage.clear(); location.reload(); return true");
  await view("bus");
  await drives(4);
});

test("PDOs are read, a fault is shown with its remedy, and the tour begins", async () => {
  await view("bus");
  await until("the wheel is chosen", "const row = [...document.querySelectorAll('#view table tbody tr')].find((one) => parseInt(one.innerText) === 4); row?.click(); return row !== undefined");
  await view("pdo");
  await until("its PDOs", "return document.querySelector('button[data-edit=TPDO1]') !== null && /RPDO1[^]*6040h:00 controlword/.test(document.getElementById('view').innerText)");
  await picture("pdo");
  await must({ do: "take_control" });
  await must({ do: "velocity", node: 4, rpm: 60 });
  await must({ do: "change_world", line: "4 supply 12" });
  await view("faults");
  // 12 V are less than a drive that turns needs.
  await until("the fault", "return /under.?voltage/i.test(document.getElementById('view').innerText)");
  await picture("faults");
  await must({ do: "change_world", line: "4 supply 48" });
  await must({ do: "reset_fault", node: 4 });
  await until("the offer of the tour", "const start = document.getElementById('tour-start'); start?.click(); return start !== null");
  await until("its first step", "return /1 of 10: Enable/.test(document.getElementById('tour').innerText)");
  await picture("tour");
  await run("document.getElementById('tour-leave').click(); return true");
});

test("the console takes lines by the keyboard alone, and shows what a device is called as text", async () => {
  const [ENTER, UP] = ["\ue007", "\ue013"];
  await run("location.hash = 'console'; return true");
  await until("its line", "const line = document.getElementById('console-line'); line?.focus(); return document.activeElement === line && line !== null");
  const said = (text) => until(text, "return document.getElementById('console-log').innerText.includes(arguments[0])", text);
  await press(`state 4${ENTER}`);
  await said("statusword");
  await press(`<b>fly</b> 4${ENTER}`);
  await said("unrecognized subcommand '<b>fly</b>'");
  await run("return await (await import(new URL('page/bundle.js', location.href))).modules['link.js'].ask({ do: 'take_control' })");
  await press(`move 1 10deg --relative${ENTER}`);
  await said("reached after");
  await press(`${UP}${UP}${UP}`);
  await until("the oldest line", "return document.getElementById('console-line').value === 'state 4'");
  await until("no markup", "return document.querySelector('#console-log b') === null && document.getElementById('console-log').getAttribute('role') === 'log'");
  await picture("console");
  await command("POST", "/window/rect", { width: 400, height: 800 });
  await until("nothing wider than the window", "return document.documentElement.scrollWidth <= innerWidth");
  await picture("console_narrow");
  await command("POST", "/window/rect", { width: 1280, height: 900 });
});

test("each scenario is given to the page as it is, and is the same run in the browser as natively", async () => {
  const given = await run("return JSON.parse(document.getElementById('given').textContent).scenarios");
  assert.deepEqual(given.map(({ text, files }) => ({ text, files })), scenarios.map(({ text, files }) => ({ text, files })));
  for (const scenario of scenarios) {
    // The page itself may not compile: its policy leaves that to workers.
    const here = await run(
      `return new Promise((resolve) => {
         const worker = new Worker("scenario.js", { type: "module" });
         worker.onmessage = ({ data }) => resolve(data);
         worker.onerror = (event) => resolve({ error: event.message });
         worker.postMessage({ scenario: arguments[0], files: arguments[1] });
       })`,
      scenario.text,
      scenario.files,
    );
    assert.equal(here.error, undefined, scenario.name);
    assert.equal(here.outcome.digest, natively(scenario).digest, scenario.name);
  }
});

test("a scenario of the list is played, and its rows are shown", async () => {
  await run("document.querySelector('#machine-choice button').click(); return true");
  await until("the list", "const at = [...document.querySelectorAll('#machine-choice li')].find((one) => /Brown-out/.test(one.innerText)); at?.click(); return at !== undefined");
  const text = await until("the outcome", "return document.getElementById('scenario')?.innerText");
  await picture("scenario");
  assert.match(text, /As expected: .* digest [0-9a-f]{16}/);
  assert.match(text, /603F/);
  await run("navigator.clipboard.writeText = async (text) => (window.copied = text); document.getElementById('scenario-link').click(); return true");
  const copied = await until("the link", "return window.copied");
  await run("document.querySelector('#scenario .close').click(); return true");
  // Where the page is open, nothing but the fragment changes.
  await go(copied);
  assert.match(await until("the scenario of the link", "return document.getElementById('scenario')?.innerText"), /^[^]*Brown-out[^]*As expected/);
  assert.equal(asked.some((path) => path.includes("scenario=")), false);
  // Once.
  await command("POST", "/refresh", {});
  await view("bus");
  await drives(4);
  assert.equal(await run("return document.getElementById('scenario')"), null);
});

test("a data sheet that is dropped on the page joins the machine at the next free node-ID", async () => {
  const io = readFileSync(new URL("../tests/data/io401.eds", import.meta.url), "utf8");
  await view("bus");
  await drop([["mine.eds", io]]);
  await until("node 3 among four drives", "return [...document.querySelectorAll('#view table tbody tr')].map((row) => parseInt(row.innerText)).join() === '1,2,3,4,5'");
  await picture("eds");
  // One that is not UTF-8: the machine is given its bytes.
  const latin = [...Buffer.from(io.replace("Ferrodrive CiA 401 input and output module", "Gerät"), "latin1")];
  await drop([["latin.eds", latin]]);
  await until("node 6 too", "return [...document.querySelectorAll('#view table tbody tr')].map((row) => parseInt(row.innerText)).join() === '1,2,3,4,5,6'");
  const handed = await run(`${MODULES} const { filesOf, present } = modules["transport.js"]; return [...filesOf(present().files)["latin.eds"]]`);
  assert.deepEqual(handed, latin);
  // One of another encoding is refused, and the machine stays as it was.
  await drop([["wide.eds", [0xff, 0xfe, ...Buffer.from(io, "utf16le")]]]);
  await until("why", "return /refused.*UTF-16/s.test(document.getElementById('machine-status').innerText)");
  await until("the machine before", "return [...document.querySelectorAll('#view table tbody tr')].length === 6");
});

test("that of a servo turns, beside node-IDs that are written as they please, and what a sheet says is text", async () => {
  const servo = execFileSync(FERRODRIVE, ["eds", "zlac8030l"], { encoding: "utf8" });
  const MARKUP = "<img src=x onerror=document.title=1>";
  // Names of the device and of an object, as a stranger may write them.
  const named = servo.replace(/^ProductName=.*$/m, `ProductName=${MARKUP}`).replace(/^(\[2000\]\s+ParameterName)=.*$/m, `$1=${MARKUP}`);
  assert.equal(named.split(MARKUP).length, 3);
  await go(`${address}?hex#machine=${encodeURIComponent('[[drive]]\nmodel = "zlim42c"\nnode = 0x01\n\n[[drive]]\nmodel = "zlac8030l"\nnode = 0b10\n')}`);
  await drives(2);
  await drop([[`a ${MARKUP.replaceAll("/", "")}.eds`, named]]);
  await drives(3);
  assert.equal(await nodes(), "1,2,3");
  await until("it is known", `${MODULES} return link.fresh && link.state.nodes.every(({ drive }) => drive)`);
  await must({ do: "take_control" });
  await must({ do: "accept_unguarded", node: 3 });
  // The sheet has no units: 6083h = 100 of CiA 402's own units is 0.23 (r/min)/s.
  await must({ do: "velocity", node: 3, rpm: 1 });
  await until("it turns", `${MODULES} return Math.abs(link.state.nodes[2].drive.velocity_rpm - 1) < 0.3`);
  await run("[...document.querySelectorAll('#view table tbody tr')][2].click(); return true");
  for (const name of ["bus", "drive", "parameters"]) {
    await view(name);
    if (name === "parameters") await until("its objects", "document.querySelectorAll('#view summary').forEach((one) => one.parentElement.open || one.click()); return document.querySelector('tr[data-object=\"2000h:00\"]') !== null");
    assert.equal(await run("return document.querySelector('img') === null && document.title !== '1'"), true, name);
  }
  assert.match(await run("return document.querySelector('tr[data-object=\"2000h:00\"]').innerText"), /img.src.x.onerror/);
  await picture("servo_eds");
});

test("a machine that is refused says why, and the first one stands in for it", async () => {
  await go(`${address}?refused#machine=${encodeURIComponent("[[drive]]\nmodel = 'zlac9'\nnode = 4\n")}`);
  await until("why", "return /refused.*line 2.*zlac9/s.test(document.getElementById('machine-status').innerText)");
  await until("four drives", "return document.querySelectorAll('#view table tbody tr').length >= 4");
  await picture("refused");
});

test("a link holds a machine, which its server never sees, also in a tab that has the page", async () => {
  const machine = '[[drive]]\nmodel = "zlim42c"\nnode = 77\n';
  const is_alone = "return document.querySelectorAll('#view table tbody tr').length === 1 && /77/.test(document.querySelector('#view table tbody').innerText)";
  await go(`${address}?refused#machine=${encodeURIComponent(machine)}`);
  await until("node 77 alone", is_alone);
  await run("navigator.clipboard.writeText = async (text) => (window.copied = text); document.getElementById('machine-link').click(); return true");
  const copied = await until("the link", "return window.copied");
  assert.equal(new URLSearchParams(new URL(copied).hash.slice(1)).get("machine"), machine);
  await run("sessionStorage.clear(); return true");
  await go(`${address}?again`);
  await drives(4);
  await go(copied.replace("?refused", "?again"));
  await until("node 77 alone", is_alone);
  assert.equal(asked.some((path) => path.includes("zlim")), false);
  await run("sessionStorage.clear(); return true");
});

test("time that is left out is shown among the news", async () => {
  await go(`${address}?asleep`);
  await drives(4);
  // What the worker of a machine that slept says: worker.test.js.
  await run(`dispatchEvent(new CustomEvent("skipped", { detail: 19980 })); return true`);
  await until("what was left out", "return /Time: this page was held up.* 20.0 s of the drives' time are left out/.test(document.getElementById('news').innerText)");
  await picture("asleep");
});

test("once loaded the page works without a network, and has asked for nothing but its own files", async () => {
  await until("the service worker", "return (await navigator.serviceWorker.ready) && navigator.serviceWorker.controller !== null");
  assert.deepEqual(asked.filter((path) => !path.startsWith("/try/") && path !== "/favicon.ico"), []);
  server.close();
  server.closeAllConnections();
  await go(address);
  await until("four drives, offline", "return document.querySelectorAll('#view table tbody tr').length >= 4");
});
