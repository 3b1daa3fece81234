// The worker of a page without a server: a machine of virtual drives, moved with the clock, and its host.
//
// What stops a motion that is not held is in here, so a page that is hidden, hangs or is gone stops what it moved.

import { World } from "./ferrodrive.js";
import { whileLoading } from "./loading.js";
import { WakingClock } from "./waking_clock.js";

/** How often the world is moved on. */
const TICK_MS = 5;
/** Most time that passes at once: between two of these a message of the page, such as a stop, is taken. */
const MOST_MS = 20;
/** A world that is further behind does not catch up: the machine slept, or is too slow. */
const MOST_BEHIND_MS = 250;

/** How often time that is left out is said. */
const SAY_MS = 1000;

let world = null;
/** The time in which the computer slept counts. */
const clock = new WakingClock();
/** What the clock showed at the world's zero. */
let zero_ms = 0;

function end(error) {
  // A machine that was never there was refused.
  postMessage({ ended: error.message, refused: world === null });
  close();
}

/** Time that was left out and not said yet, and when some was said. */
let skipped_ms = 0;
let said_at = -Infinity;

function skip(ms) {
  zero_ms += ms;
  skipped_ms += ms;
}

function saySkipped() {
  if (skipped_ms === 0 || performance.now() - said_at < SAY_MS) return;
  postMessage({ event: "skipped", detail: skipped_ms });
  [skipped_ms, said_at] = [0, performance.now()];
}

function tick() {
  const behind = clock.read() - zero_ms - world.now * 1000;
  if (behind > MOST_BEHIND_MS) skip(behind - MOST_MS);
  saySkipped();
  try {
    if (behind > 0) world.run(Math.min(behind, MOST_MS) / 1000);
  } catch (error) {
    end(error);
  }
}

/** What waits for the page to have kept it. */
const keeping = new Map();

const keep = (image) =>
  new Promise((resolve) => {
    const kept = keeping.size + performance.now();
    keeping.set(kept, resolve);
    postMessage({ event: "stored", detail: { image, kept } });
  });

async function open({ machine, files, stored }) {
  if (world) return world.join();
  const onunusable = (why) => postMessage({ event: "unusable", detail: why });
  world = await whileLoading(World.open(machine, { files, stored, unix_ms: Date.now(), onmessage: (text) => postMessage({ text }), onstored: keep, onunusable }));
  zero_ms = clock.read() - world.now * 1000;
  setInterval(tick, TICK_MS);
}

async function answer({ request, path, body }) {
  const { status, kind, body: content } = world.request(path, body instanceof Blob ? await body.arrayBuffer() : (body ?? ""));
  postMessage({ answer: request, status, kind, body: content });
}

// One after the other: a message that comes while the module loads waits for it.
let queue = Promise.resolve();
addEventListener("message", ({ data }) => {
  if (data.kept !== undefined) return keeping.get(data.kept)?.();
  const take = data.open ? open : data.say !== undefined ? ({ say }) => world.say(say) : answer;
  queue = queue.then(() => take(data)).catch(end);
});
