// The worker of a page without a server: a machine of virtual drives, moved with the clock, and its host.
//
// What stops a motion that is not held is in here, so a page that is hidden, hangs or is gone stops what it moved.

import { World } from "./ferrodrive.js";

/** How often the world is moved on. */
const TICK_MS = 5;
/** Most time that passes at once: between two of these a message of the page, such as a stop, is taken. */
const MOST_MS = 20;
/** A world that is further behind does not catch up: the machine slept, or is too slow. */
const MOST_BEHIND_MS = 250;

let world = null;
/** What the clock showed at the world's zero. */
let zero_ms = 0;

function end(error) {
  // A machine that was never there was refused.
  postMessage({ ended: error.message, refused: world === null });
  close();
}

function tick() {
  const behind = performance.now() - zero_ms - world.now * 1000;
  if (behind > MOST_BEHIND_MS) zero_ms += behind - MOST_MS;
  try {
    if (behind > 0) world.run(Math.min(behind, MOST_MS) / 1000);
  } catch (error) {
    end(error);
  }
}

async function open({ machine, files }) {
  if (world) return world.join();
  world = await World.open(machine, { files, unix_ms: Date.now(), onmessage: (text) => postMessage({ text }) });
  zero_ms = performance.now() - world.now * 1000;
  setInterval(tick, TICK_MS);
}

async function answer({ request, path, body }) {
  const { status, kind, body: content } = world.request(path, body instanceof Blob ? await body.arrayBuffer() : (body ?? ""));
  postMessage({ answer: request, status, kind, body: content });
}

// One after the other: a message that comes while the module loads waits for it.
let queue = Promise.resolve();
addEventListener("message", ({ data }) => {
  const take = data.open ? open : data.say !== undefined ? ({ say }) => world.say(say) : answer;
  queue = queue.then(() => take(data)).catch(end);
});
