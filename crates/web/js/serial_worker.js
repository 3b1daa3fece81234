// The worker of a page with a serial CAN adapter: its port, and the host on the bus behind it.
//
// The port is opened in here, so that a page that hangs, is hidden or is gone is stopped by what still runs. Streams that a page hands to a
// worker are pumped by the page.

import { FerrodriveError, Library } from "./ferrodrive.js";
import { whileLoading } from "./loading.js";
import { WakingClock } from "./waking_clock.js";

/** How often time passes. */
const TICK_MS = 5;
/** Between two attempts to open the port: a USB adapter needs about a second to be there again. */
const PAUSE_MS = 1000;
/** How long bytes may wait for an adapter that takes none. */
const STUCK_MS = 1000;

let library = null;
let setting = null;
/** The open port: `{ port, writer, reader, outbox, writing_since, flushing }`. */
let cable = null;
/** The channel has been open once: there is a host. */
let hosts = false;
let shown = "";
/** No other tab has an adapter. */
let holds = false;
/** The page has taken leave, and nothing more can be done for its drives. */
let gone = false;

/** Why the port cannot be opened, by the last attempt. */
let not_opened = null;
const clock = new WakingClock();

/** In ns. */
const now_ns = () => Math.round(clock.read() * 1e6);

function end(error) {
  postMessage({ ended: error.message, refused: library === null });
  close();
}

/** Everything comes to now, with what the port has brought. */
function run(event = null, input = "") {
  try {
    const answer = library.call({ call: "serial", now_ns: now_ns(), event }, input);
    take(answer);
  } catch (error) {
    end(error);
  }
}

function take({ wire, line, lost, let_go, moved, left, body }) {
  if (wire > 0 && cable) {
    cable.outbox.push(body.slice(0, wire));
    if (cable.writing_since === null) cable.flushing = flush(cable);
  }
  if (body.length > wire) for (const text of new TextDecoder().decode(body.subarray(wire)).split("\n")) postMessage({ text, sent_ms: Date.now() });
  if (let_go) postMessage({ event: "serial-let-go", detail: let_go, closes: true });
  hosts ||= line === "open";
  show(line, not_opened ?? lost, moved);
  // The adapter has refused to open its channel.
  if (line === "closed" && cable) give_up();
  if (left && !gone) leave(left);
}

function show(line, why, moved) {
  const state = JSON.stringify({ line, why, moved });
  if (state !== shown) postMessage({ event: "serial-line", detail: { line, why, moved, hosts } });
  shown = state;
}

/** One write at a time, so that it is seen when the adapter takes nothing any more. */
async function flush(mine) {
  try {
    while (mine.outbox.length) {
      mine.writing_since = performance.now();
      await mine.writer.write(mine.outbox.shift());
    }
    mine.writing_since = null;
  } catch (error) {
    lose(mine, error.message);
  }
}

async function read(mine) {
  try {
    for (;;) {
      const { value, done } = await mine.reader.read();
      if (mine !== cable) return;
      if (done) return lose(mine, "the port was closed");
      run(null, value);
    }
  } catch (error) {
    lose(mine, error.message);
  }
}

/** The one port that the page may use. */
async function granted() {
  const ports = await navigator.serial.getPorts();
  if (ports.length > 1) throw new Error("this page may use several adapters: choose one again");
  if (ports.length === 0) throw new Error("the adapter is not there: is it plugged in, and was it chosen?");
  return ports[0];
}

/** Has the one adapter of this page to itself for as long as this worker lives: another tab opens none, and lets no port be forgotten. */
const hold = () =>
  new Promise((resolve, reject) => {
    const until_end = (lock) => {
      holds = lock !== null;
      resolve();
      return lock && new Promise(() => {});
    };
    navigator.locks.request("serial", { ifAvailable: true }, until_end).catch(reject);
  });

/** Opens the port, again and again. */
async function plug() {
  try {
    if (!holds) await hold();
    if (!holds) throw new Error("another tab of this page has an adapter: choose Disconnect there first");
    const port = await granted();
    await port.open({ baudRate: setting.baud, bufferSize: 4096 });
    cable = { port, writer: port.writable.getWriter(), reader: port.readable.getReader(), outbox: [], writing_since: null, flushing: null };
  } catch (error) {
    not_opened = error.message;
    setTimeout(plug, PAUSE_MS);
    return;
  }
  not_opened = null;
  run("plugged");
  if (cable) read(cable);
}

/** The port is gone, or of no use. */
function lose(mine, why) {
  if (mine !== cable) return;
  cable = null;
  release(mine);
  run({ unplugged: why });
  setTimeout(plug, PAUSE_MS);
}

function give_up() {
  const mine = cable;
  cable = null;
  release(mine);
  setTimeout(plug, PAUSE_MS);
}

/** Everything that can be given back of a port that may be gone. */
async function release({ port, reader, writer }) {
  await Promise.allSettled([reader.cancel(), writer.abort()]);
  reader.releaseLock();
  writer.releaseLock();
  await port.close().catch(() => {});
}

/** The channel is closed as the last thing on the line. `moving` are the drives that were not seen to stand. */
async function leave(moving) {
  gone = true;
  const mine = cable;
  if (mine) {
    run("close");
    cable = null;
    // Also from an adapter that takes nothing any more.
    await Promise.race([mine.flushing, new Promise((resolve) => setTimeout(resolve, PAUSE_MS))]);
    await release(mine);
  }
  postMessage({ event: "serial-left", detail: { moving } });
  close();
}

function tick() {
  run();
  const mine = cable;
  if (mine && mine.writing_since !== null && performance.now() - mine.writing_since > STUCK_MS) lose(mine, "the adapter takes nothing any more");
}

async function open({ serial }) {
  if (!library) {
    await hold();
    const made = await whileLoading(Library.make());
    setting = serial;
    made.call({ call: "open_serial", name: serial.name, bitrate: serial.bitrate, unix_ms: Math.round(performance.timeOrigin), now_ns: now_ns() });
    library = made;
    navigator.serial.addEventListener("disconnect", () => cable && granted().catch(({ message }) => lose(cable, message)));
    setInterval(tick, TICK_MS);
    plug();
  }
  library.call({ call: "join" });
  run();
}

/** What is refused, as every request before there is a bus, is answered at once: a page takes a worker that does not answer for dead. */
function answered(path, body) {
  try {
    return library.call({ call: "request", path }, body ?? "");
  } catch (error) {
    if (!(error instanceof FerrodriveError)) throw error;
    const refusal = { ok: false, error: { kind: error.kind, message: error.message } };
    return { status: 503, kind: "application/json", body: new TextEncoder().encode(JSON.stringify(refusal)) };
  }
}

function answer({ request, path, body }) {
  const { status, kind, body: content } = answered(path, body);
  postMessage({ answer: request, status, kind, body: content });
}

function say({ say }) {
  // A message that waited while the machine slept comes behind the stop of what moved before.
  run();
  library.call({ call: "say" }, say);
  run();
}

/** Whether this browser has Web Serial for workers: the host has to be where a page that hangs does not reach. */
const probe = () => postMessage({ has_serial: "serial" in navigator });

const take_leave = () => run("leave");

// One after the other: a message that comes while the module loads waits for it. What stops does not wait.
let queue = Promise.resolve();
addEventListener("message", ({ data }) => {
  if (data.let_go !== undefined) return library && run({ let_go: data.let_go });
  const does = data.probe ? probe : data.open ? open : data.leave ? take_leave : data.say !== undefined ? say : answer;
  queue = queue.then(() => does(data)).catch(end);
});
