// How the page reaches its host: over a WebSocket and requests to the studio that serves it, or, where the page names one, through a
// worker of its own that holds virtual drives. Messages and requests are the same.

import { kept } from "./settings.js";

/** The worker of a page without a server. */
const worker_at = globalThis.document?.documentElement.dataset.worker;
/** The serial adapter that this tab has in place of virtual drives, in such a page. */
const serial = worker_at ? JSON.parse(sessionStorage.getItem("serial")) : null;
/** What moves the drives, in the words of the page. */
export const host_name = worker_at ? "the host in this page" : "the studio";

/** A host behind a socket: `heard` and `closed` are called with each message (and when it was sent, by the wall clock, where that is known), and when the connection is lost. */
function overSocket(heard, closed) {
  const socket = new WebSocket(`ws://${location.host}/ws`);
  socket.addEventListener("message", (event) => heard(event.data));
  socket.addEventListener("close", closed);
  return {
    isOpen: () => socket.readyState === WebSocket.OPEN,
    send: (text) => socket.send(text),
    close: () => socket.close(),
  };
}

let worker = null;
/** Ends a worker that has left so many requests in turn without an answer. */
let giveUp = (_why) => {};
let silent = 0;
const MOST_SILENT = 3;
let asked = 0;
const answers = new Map();
/** The views make requests before the page connects. */
let begun;
const beginning = new Promise((resolve) => (begun = resolve));

/** The machine lives as long as its worker: a connection that is opened again is a new session with it. */
function inWorker(heard, closed) {
  worker ??= new Worker(serial ? "serial_worker.js" : worker_at, { type: "module" });
  const mine = worker;
  const lose = (why) => {
    if (worker !== mine) return;
    worker = null;
    dispatchEvent(new CustomEvent("machine-ended", { detail: why }));
    mine.terminate();
    for (const { reject } of answers.values()) reject(new Error(why));
    answers.clear();
    closed();
  };
  giveUp = (why) => lose(serial ? `The host in this page was ended: ${why}` : why);
  mine.onmessage = ({ data }) => {
    silent = 0;
    if (data.text !== undefined) heard(data.text, data.sent_ms);
    else if (data.ended !== undefined) {
      // Not again and again: the next one is the first one.
      if (data.refused) goBack();
      if (serial) lose(`The host in this page has ended: ${data.ended}`);
      else lose(data.refused ? `The machine was refused. ${data.ended}` : `The virtual machine has ended, and begins anew: ${data.ended}`);
    } else if (data.event !== undefined) {
      dispatchEvent(new CustomEvent(data.event, { detail: data.detail }));
      // The session is over; the host goes on.
      if (data.closes) closed();
    } else {
      answers.get(data.answer)?.resolve(new Response(data.body, { status: data.status, headers: { "content-type": data.kind } }));
      answers.delete(data.answer);
    }
  };
  mine.onerror = (event) => lose(event.message ?? "it cannot be loaded");
  mine.postMessage({ open: true, ...opened() });
  begun();
  return { isOpen: () => worker === mine, send: (text) => mine.postMessage({ say: text }), close: () => {} };
}

/** Hands a message to the worker, behind those before. */
export const tellWorker = (message) => worker?.postMessage(message);

/** The machine file that this tab keeps, and data sheets that it names; a base with two wheels, and two axes, at first. */
export function present() {
  const own = sessionStorage.getItem("machine");
  return own ? JSON.parse(own) : { machine: document.getElementById("machine").textContent, files: {} };
}

/** What a worker is to open: the adapter, or the machine with what its drives have stored. */
function opened() {
  if (serial) return { serial };
  const { machine, files } = present();
  return { machine, files: filesOf(files), stored: storedOf(machine) };
}

/** Goes back from a machine that was refused to the one before it, or to the page's own. */
function goBack() {
  const before = sessionStorage.getItem("machine-before");
  sessionStorage.removeItem("machine-before");
  if (before === null) sessionStorage.removeItem("machine");
  else sessionStorage.setItem("machine", before);
}

/** Files as the machine takes them: text, or bytes that are kept as characters. */
export const filesOf = (files) => Object.fromEntries(Object.entries(files).map(([name, one]) => [name, typeof one === "string" ? one : Uint8Array.from(one.bytes, (byte) => byte.charCodeAt(0))]));

/** Where the browser keeps what the drives of a machine have stored. */
export const storeOf = (machine) => `stored ${machine}`;
export const storedOf = (machine) => kept(storeOf(machine), []);

/**
 * A request to the host: `fetch` with a path.
 * @param {string} path
 * @param {RequestInit} [options]
 * @returns {Promise<Response>}
 */
async function requestWorker(path, { body = null, signal = null } = {}) {
  await beginning;
  if (!worker) throw new Error("the worker has ended");
  // Here and not in the worker: a file that cannot be read fails this request alone, and nothing waits behind it.
  const content = body instanceof Blob ? await body.arrayBuffer() : body;
  asked += 1;
  const answer = asked;
  worker.postMessage({ request: answer, path, body: content });
  return new Promise((resolve, reject) => {
    answers.set(answer, { resolve, reject });
    signal?.addEventListener("abort", () => {
      if (!answers.delete(answer)) return;
      reject(signal.reason);
      silent += 1;
      if (silent === MOST_SILENT) giveUp("it does not answer");
    });
  });
}

/** Opens a connection: `{ isOpen, send, close }`. */
export const open = worker_at ? inWorker : overSocket;

/** As `fetch`, of a path of the host. */
export const request = worker_at ? requestWorker : (path, options) => fetch(path, options);

// Links to files that the host makes.
if (worker_at) {
  addEventListener("click", async (event) => {
    const link = /** @type {HTMLAnchorElement} */ (/** @type {Element} */ (event.target).closest?.("a[href^='/api/']"));
    if (!link) return;
    event.preventDefault();
    const answer = await request(link.getAttribute("href"));
    if (!answer.ok) return alert((await answer.json()).error.message);
    const url = URL.createObjectURL(await answer.blob());
    const save = document.createElement("a");
    [save.href, save.download] = [url, link.download];
    save.click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  });
}
