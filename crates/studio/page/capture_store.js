// The captures that the browser keeps, over a reload and a restart: IndexedDB, which stores arrays of numbers as they are.

import { freeName, noRoomFor } from "./capture.js";

const DATABASE = "ferrodrive";
const STORE = "captures";

const done = (request) =>
  new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });

let opened = null;
function database() {
  if (opened) return opened;
  const request = indexedDB.open(DATABASE, 1);
  request.onupgradeneeded = () => request.result.createObjectStore(STORE, { keyPath: "id" });
  opened = done(request);
  // A browser that keeps nothing now may do so later.
  opened.catch(() => (opened = null));
  return opened;
}

/** Carries `work` out in a transaction, and waits until it is stored. */
async function change(work) {
  const transaction = (await database()).transaction(STORE, "readwrite");
  const stored = new Promise((resolve, reject) => {
    transaction.oncomplete = () => resolve();
    transaction.onabort = () => reject(transaction.error ?? new Error("the browser did not store it"));
  });
  work(transaction.objectStore(STORE));
  return stored;
}

/** The kept captures, oldest first; a list that changes with them. */
export const captures = [];

/** Reads what the browser has kept. */
export async function loadCaptures() {
  const store = (await database()).transaction(STORE, "readonly").objectStore(STORE);
  const all = await done(store.getAll());
  captures.splice(0, captures.length, ...all.sort((one, other) => one.taken.localeCompare(other.taken)));
}

/** Keeps a capture, under a name that is free. Throws why it is not kept; it is shown until then all the same. */
export async function keepCapture(capture) {
  const why = noRoomFor(capture, captures);
  if (why) throw new Error(why);
  capture.name = freeName(capture.name, captures);
  captures.push(capture);
  await change((store) => store.put(capture));
}

/** Stores a kept capture that was renamed or moved. */
export const storeCapture = (capture) => change((store) => store.put(capture));

export async function deleteCapture(capture) {
  const at = captures.indexOf(capture);
  // A second click.
  if (at < 0) return;
  captures.splice(at, 1);
  await change((store) => store.delete(capture.id));
}
