// The page with a serial CAN adapter, in headless Chromium: an emulated port that ends at `ferrodrive sim --serve slcan`. What the drives do is
// read from that program, not from the page. What the host behind the port does is tested in virtual time (`tests/it/serial.rs`).

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createInterface } from "node:readline";
import { after, before, test } from "node:test";

import { MODULES, PATIENCE_MS, address, begin, command, end, go, picture, press, run, server, until } from "../site_tools/browser.js";
import { Adapter } from "../site_tools/serial_port.js";

let sim, adapter, lines;
/** A page that waits for this hangs. */
let release = null;

before(async () => {
  sim = spawn(process.env.FERRODRIVE, ["sim", "--drive", "zlac8030l@4", "--drive", "zlim42c@2", "--serve", "slcan://127.0.0.1:0"], { stdio: ["pipe", "pipe", "inherit"] });
  lines = createInterface({ input: sim.stdout })[Symbol.asyncIterator]();
  const ready = (await lines.next()).value;
  adapter = new Adapter(Number(/slcan:\/\/127\.0\.0\.1:(\d+)/.exec(ready)[1]));
  const { answered, changed } = adapter.serving;
  const hang = (path, answer) => path === "/hang" && ((release = () => answer.end("go on")), true);
  const probe = (path, answer) => path === "/try/probe.js" && (answer.writeHead(200, { "content-type": "text/javascript" }).end("postMessage(typeof navigator.serial?.getPorts)"), true);
  await begin({ answered: (path, answer) => hang(path, answer) || probe(path, answer) || answered(path, answer), changed });
  server.on("upgrade", (request, socket) => adapter.accept(request, socket));
});

after(async () => {
  await end();
  sim?.kill();
});

/** What the drive does, by the program that computes it. */
async function drive(node) {
  sim.stdin.write(`${node} get\n`);
  return JSON.parse((await lines.next()).value);
}

/** Waits for what must come; what hangs is ended. */
async function eventually(what, is_so) {
  const end = performance.now() + PATIENCE_MS;
  while (!(await is_so())) {
    if (performance.now() > end) throw new Error(`not seen: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
}

const stands = (node) => eventually(`node ${node} stands`, async () => Math.abs((await drive(node)).velocity_rpm) < 1);

const LINK = `${MODULES} if (!link.fresh) return null;`;
const text = (id) => run(`return document.getElementById("${id}")?.innerText ?? ""`);

/** Chooses the adapter as a person does, and waits until the channel is open and both drives are found. */
async function attach(bitrate = "500k") {
  await until("the button", "const button = document.getElementById('serial-open'); button?.click(); return button !== null");
  await run(`document.querySelector("#serial-bitrate button").click(); document.querySelector("#serial-bitrate li[data-value='${bitrate}']").click(); return true`);
  assert.equal(await run("return document.getElementById('serial-choose').disabled"), true, "before an emergency stop is at hand");
  const said = await text("serial");
  assert.match(said, /Real motors will turn[^]*This page stops what it moved when[^]*STOP, Esc or Space[^]*the tab is hidden, closed or loaded again[^]*hangs for 3 s/);
  assert.match(said, /It cannot stop anything when[^]*the machine sleeps[^]*the adapter or its cable is pulled out[^]*only a drive's own watch/);
  await run("document.getElementById('serial-ready').click(); return true");
  await picture("serial_dialog");
  await run("document.getElementById('serial-choose').click(); return true");
}

/** Something that happens to the machine, as its worker sees it. */
const happens = (what) => run("const channel = new BroadcastChannel('emulated'); channel.postMessage(arguments[0]); channel.close(); return true", what);

/** A person presses the button beside what may be moving. */
const see = () => run("document.querySelector('#serial-alert button').click(); return true");

const found = () => until("both drives", `${LINK} return link.state.nodes.length === 2 && link.state.nodes.every(({ drive }) => drive)`);

/** Takes control and turns the wheel, also where the machine of the test is so loaded that the worker stops it once. */
async function turn() {
  do {
    await until(
      "the wheel turns",
      `${LINK}
       if (link.state.controller === null) await ask({ do: "take_control" });
       const turned = await ask({ do: "velocity", node: 4, rpm: 60 });
       return turned.ok ? true : { failed: JSON.stringify(turned) };`,
    );
  } while (Math.abs((await drive(4)).velocity_rpm - 60) > 5);
  adapter.heard = "";
}

/** A quick stop of the wheel by SDO: a download to 6040h (CiA 301, 7.2.4.3.3) with bits 7, 2 and 1 as 0, 0, 1 (CiA 402-2, table 28). */
const is_stop = ([, low]) => (parseInt(low, 16) & 0x86) === 2;

const is_stopped = () => [...adapter.heard.matchAll(/t60482B406000(..)/g)].some(is_stop);

/** The page, or its worker, stops the wheel, and it stands. */
async function stops() {
  await eventually("a quick stop by the page", is_stopped);
  await stands(4);
}

test("what stops and what cannot is said before an adapter is chosen; its drives are found, moved and stopped", async () => {
  await go(address);
  await attach();
  await found();
  assert.match(await text("serial-status"), /USB 1d50:606f at 500k: connected/);
  assert.equal(await run("return getComputedStyle(document.getElementById('machine-choice')).display"), "none");
  await picture("serial_bus");
  await turn();
  await run("location.hash = 'motion'; return true");
  await until("what a drive without a watch does", `return /Node 2: if the host in this page dies, nothing stops it/.test(document.getElementById("view").innerText)`);
  await picture("serial_motion");
  await run("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown')); return true");
  await stands(4);
});

test("a drive that nothing would stop moves only after that was accepted", async () => {
  const { kind } = await until("an answer", `${LINK} return { kind: (await ask({ do: "velocity", node: 2, rpm: 30 })).error?.kind ?? "moved" }`);
  assert.equal(kind, "unguarded");
  assert.ok(Math.abs((await drive(2)).velocity_rpm) < 1);
});

test("the keyboard stops what turns, and so does a jog that is let go", async () => {
  await found();
  for (const key of ["\ue00c", " "]) {
    await turn();
    await run("document.activeElement.blur(); return true");
    await press(key);
    await stops();
  }
  await run("location.hash = 'bus'; return true");
  await until("the wheel is chosen", "const row = [...document.querySelectorAll('#view table tbody tr')].find((one) => parseInt(one.innerText) === 4); row?.click(); return row !== undefined");
  await run("location.hash = 'motion'; return true");
  await until("control", `${LINK} if (link.state.controller === null) await ask({ do: "take_control" }); return modules["link.js"].inControl()`);
  const { x, y } = await until("the button of the jog", `const button = document.querySelectorAll("#view button.jog")[1]; if (!button || button.disabled) return null; button.scrollIntoView({ block: "center" }); const { x, y, width, height } = button.getBoundingClientRect(); return { x: Math.round(x + width / 2), y: Math.round(y + height / 2) }`);
  adapter.heard = "";
  const pointer = (actions) => command("POST", "/actions", { actions: [{ type: "pointer", id: "mouse", parameters: { pointerType: "mouse" }, actions }] });
  await pointer([{ type: "pointerMove", duration: 0, x, y }, { type: "pointerDown", button: 0 }]);
  await eventually("the jog turns", async () => Math.abs((await drive(4)).velocity_rpm) > 5);
  await pointer([{ type: "pointerUp", button: 0 }]);
  await stands(4);
});

test("a tab that is hidden stops what it moved, and has to take control anew", async () => {
  await turn();
  const before = await command("GET", "/window");
  const { handle } = await command("POST", "/window/new", { type: "tab" });
  await command("POST", "/window", { handle });
  await stops();
  await command("DELETE", "/window");
  await command("POST", "/window", { handle: before });
  await until("the reason", `return /The tab was hidden: a quick stop was ordered for node 4/.test(document.getElementById("serial-alert").innerText)`);
  await until("a session without control", `${LINK} return link.state.controller === null`);
  await picture("serial_hidden");
});

test("a tab that the browser freezes moves nothing, nor when it goes on", async () => {
  await turn();
  const cycle = (state) => command("POST", "/goog/cdp/execute", { cmd: "Page.setWebLifecycleState", params: { state } });
  await cycle("frozen");
  // The browser may freeze the worker too: then it is the drive's own watch, which the page has set.
  await stands(4);
  await cycle("active");
  await found();
  await stands(4);
});

test("a page that hangs is stopped by its worker, and takes no state that has waited for it for a current one", async () => {
  await turn();
  // A request that blocks the page, until the drive was seen to stand. Of what has come meanwhile it is noted how it is taken.
  const hangs = run(`${MODULES}
    const request = new XMLHttpRequest();
    request.open("GET", "/hang", false);
    const taken = [];
    on("state", ({ time_s }) => taken.push([link.fresh, time_s]));
    request.send();
    while (taken.length === 0) await new Promise((resolve) => setTimeout(resolve, 10));
    await new Promise((resolve) => setTimeout(resolve, 100));
    return { said: request.responseText, fresh: taken.filter(([fresh]) => fresh).map(([, time_s]) => time_s) }`);
  await eventually("a request that hangs", () => release !== null);
  await stops();
  release();
  const { said, fresh } = await hangs;
  assert.equal(said, "go on");
  // The oldest is as old as the page's silence, of 3 s, and the way of the drive to a stop.
  assert.ok(fresh.every((time_s) => fresh.at(-1) - time_s < 2), fresh.join(" "));
  await found();
});

test("a machine that slept stops what moved when it wakes, also where the steady clock stood still", async () => {
  await turn();
  await happens({ slept_ms: 20_000 });
  await stops();
  await until("the reason", `return /slept/.test(document.getElementById("serial-alert").innerText)`);
});

test("an adapter that answers BEL ends what moves", async () => {
  await turn();
  adapter.refuses = true;
  // Not by its own watch.
  await eventually("a quick stop by the page", is_stopped);
  await until("the reason", `return /BEL/.test(document.getElementById("serial-alert").innerText)`);
  adapter.refuses = false;
});

test("a cable that is pulled is said with what may still move, and what moved is seen to stand when it is back", async () => {
  await found();
  await turn();
  adapter.pull();
  await until("the reason", `const text = document.getElementById("serial-alert").innerText; return /The adapter is lost/.test(text) && /node 4 may still be moving/.test(text)`);
  await until("what is missing", `return /is it plugged in/.test(document.getElementById("serial-status").innerText)`);
  await picture("serial_pulled");
  // By its own watch: no adapter is there.
  await stands(4);
  adapter.plugged = true;
  await until("it is connected again", `return /connected/.test(document.getElementById("serial-status").innerText)`);
  await until("it was seen to stand", `${LINK} return link.state.nodes.every(({ stop_unseen }) => !stop_unseen)`);
});

test("a host that ends leaves a word of what may still move", async () => {
  await turn();
  // What it does not understand ends it, as a defect would.
  await run(`${MODULES} modules["transport.js"].tellWorker({ let_go: {} }); return true`);
  await until("what may be moving", `return /The host in this page has ended.*node 4 may still be moving.*without this page/s.test(document.getElementById("serial-alert").innerText)`);
  await picture("serial_ended");
  await stands(4);
  await found();
  assert.match(await text("serial-alert"), /node 4 may still be moving/, "until a person has seen it");
  // Over a reload too.
  await command("POST", "/refresh", {});
  await found();
  assert.match(await text("serial-alert"), /The host in this page has ended.*node 4 may still be moving/s);
  await see();
  await command("POST", "/refresh", {});
  await found();
  assert.doesNotMatch(await text("serial-alert"), /may still be moving/);
});

test("another tab does not take the adapter away", async () => {
  const [mine] = await command("GET", "/window/handles");
  const { handle } = await command("POST", "/window/new", { type: "tab" });
  await command("POST", "/window", { handle });
  adapter.forgotten = false;
  await go(`${address}?two`);
  await attach();
  await until("a refusal", `return /has an adapter already, in this tab or in another/.test(document.getElementById("serial-refused").innerText)`);
  assert.equal(adapter.forgotten, false);
  // One that is duplicated has the same settings.
  await run(`sessionStorage.setItem("serial", JSON.stringify({ name: "USB 1d50:606f", bitrate: 500000, baud: 115200 })); return true`);
  await command("POST", "/refresh", {});
  await until("why it has no bus", `return /another tab of this page has an adapter/.test(document.getElementById("serial-status").innerText)`);
  await command("DELETE", "/window");
  await command("POST", "/window", { handle: mine });
  await found();
});

test("a tab that is closed, and one that takes leave, stop what they moved", async () => {
  await found();
  await turn();
  // What a page that is left says to its worker, while that still runs.
  await run("dispatchEvent(new PageTransitionEvent('pagehide')); return true");
  await stops();
  await turn();
  await run("location.reload(); return true").catch(() => {});
  // By the page; where the browser ends its worker before that has sent the stop, by its own watch.
  await stands(4);
  await found();
  await turn();
  await run("document.getElementById('serial-leave').click(); return true");
  await stops();
  await until("virtual drives", `${LINK} return link.state.bus.name === "sim"`);
  assert.match(adapter.heard, /C\r$/, "the channel is closed as the last thing");
});

test("a page that takes leave names what was not seen to stand, beside its virtual drives", async () => {
  await attach();
  await found();
  await turn();
  adapter.refuses = true;
  await run("document.getElementById('serial-leave').click(); return true");
  await until("what may be moving", `${LINK} return link.state.bus.name === "sim" && /taken leave.*node 4 may still be moving.*without this page/s.test(document.getElementById("serial-alert").innerText)`);
  await picture("serial_left");
  await see();
  adapter.refuses = false;
  // By its own watch.
  await stands(4);
});

test("a wrong bit rate is said", async () => {
  await attach("250k");
  await until("why", `return /the adapter refused 'O': is the bit rate right\\?/.test(document.getElementById("serial-status").innerText)`);
  assert.match(await text("serial-alert"), /No bus yet/);
  // At once: a page takes a worker that does not answer for dead.
  const state = await run(`${MODULES} const answer = await modules["transport.js"].request("/api/state"); return [answer.status, (await answer.json()).error.kind]`);
  assert.deepEqual(state, [503, "no_bus"]);
  assert.ok(!/does not admit/.test(await run("return document.body.innerText")));
  await picture("serial_refused");
});

test("the browser has Web Serial in workers; one that has none says what does", async () => {
  const kind = await run(`return new Promise((resolve) => (new Worker("probe.js").onmessage = ({ data }) => resolve(data)))`);
  assert.equal(kind, "function");
  await run("sessionStorage.clear(); return true");
  await go(`${address}?lacking`);
  await until("the button", "const button = document.getElementById('serial-open'); button?.click(); return button !== null");
  assert.match(await text("serial-lacking"), /has no Web Serial.*Firefox from version 151 on; Safari does not/);
  assert.equal(await run("return document.getElementById('serial-choose')"), null);
  // One that has it for pages alone.
  await go(`${address}?pages`);
  await run(`window.Worker = class { terminate() {} postMessage() { setTimeout(() => this.onmessage({ data: { has_serial: false } })); } }; return true`);
  await until("the button", "const button = document.getElementById('serial-open'); button?.click(); return button !== null");
  await until("why", "return document.getElementById('serial-lacking')?.innerText.includes('for pages and not for workers')");
  assert.equal(await run("return document.getElementById('serial-choose')"), null);
});
