// The connection to the studio: its newest state, how old that is, and requests.
//
// Messages have rising numbers and the word of this session, so that none counts twice. A state that is older than half a second
// is stale: then only a stop is sent, since a command that waits in a connection would be executed much later. A
// connection that is lost, or silent, is opened again; control has to be taken again then.

import { stops } from "./console_lines.js";
import { host_name, open, request } from "./transport.js";

const RETRY_MS = 1000;
const ALIVE_MS = 500;
/** The studio sends its state every 50 ms. */
const OLD_MS = 500;
/** A connection that is silent for so long is given up. */
const DEAD_MS = 3000;
const LOOK_MS = 100;
/** How long a stop may take to be confirmed. */
const CONFIRM_MS = 300;

export const link = {
  /** The newest state; null before the first. */
  state: null,
  /** The welcome message of this connection; null without one. */
  welcome: null,
  /** Whether the newest state is current. */
  fresh: false,
};

/** What the studio says to a page that it does not let in: it was started anew, with another token. */
let turned_away = null;

const listeners = { state: [], news: [], change: [], sight: [], halt: [], stop: [], asked: [] };
let connection = null;
let seq = 0;
const waiting = new Map();
/** When the newest state of this connection came, and when the connection was opened, by `performance.now()`. */
let seen_at = -Infinity;
let opened_at = -Infinity;
/** When the newest state of any connection came; at first when the page was opened. */
let last_at = performance.now();

/**
 * Calls `listener` with each state ("state"), each piece of news ("news"), when the connection opens or closes ("change"), when the
 * shown state becomes current or stale, and repeatedly while it is stale ("sight": `{ fresh, connected, age_ms, refused }`), and with
 * the outcome of a press of stop ("stop": `{ confirmed, after_ms }`), and with each command that is sent ("asked"). "halt" comes when
 * everything is stopped: true before a press of stop on this page is sent, false when the host reports a stop of any cause.
 */
export function on(what, listener) {
  listeners[what].push(listener);
}

const emit = (what, value) => listeners[what].forEach((listener) => listener(value));

/** True if this page may move drives. */
export const inControl = () => link.welcome !== null && performance.now() - seen_at <= OLD_MS && link.state?.controller === link.welcome.session;

/** True if the bus is one of virtual drives in the studio itself: no real motor turns. */
export const isVirtual = () => /^sim(:|$)/.test(link.state?.bus.name ?? "");

const refused = (kind, message) => Promise.resolve({ ok: false, error: { kind, message } });

/** Sends a command; resolves with the answer, and never rejects. */
export function ask(command) {
  // After sleep a timer of another file may run before that of this one.
  look();
  if (!link.welcome || !connection?.isOpen()) return refused("no_connection", `There is no connection to ${host_name}.`);
  const isStop = command.do === "stop_all" || (command.do === "console" && stops(command.line) !== null);
  if (!link.fresh && !isStop) return refused("no_picture", `Nothing was sent: the state of ${host_name} is stale.`);
  seq += 1;
  const message = { seq, session: link.welcome.word, ...command };
  connection.send(JSON.stringify(message));
  emit("asked", command);
  return new Promise((resolve) => waiting.set(message.seq, resolve));
}

/**
 * Quick-stops every drive: over the socket, and by a separate request in case the socket is stuck. Only the answer of
 * the host that moves the drives confirms it; that the web server has taken the request does not.
 */
export function stopAll() {
  emit("halt", true);
  const began = performance.now();
  let confirmed = false;
  let reported = false;
  const missed = () => {
    if (confirmed || reported) return;
    reported = true;
    emit("stop", { confirmed: false, after_ms: performance.now() - began });
  };
  ask({ do: "stop_all" }).then((answer) => {
    if (!answer.ok) return missed();
    confirmed = true;
    emit("stop", { confirmed: true, after_ms: performance.now() - began });
  });
  request("/api/stop", { method: "POST", keepalive: true }).catch(() => {});
  setTimeout(missed, CONFIRM_MS);
}

/** A message waits for a page that is frozen or hangs: a state is as old as that. */
function take(message, age_ms) {
  switch (message.type) {
    case "welcome":
      link.welcome = message;
      turned_away = null;
      seq = 0;
      emit("change", true);
      break;
    case "state": {
      const before = link.state;
      link.state = message;
      seen_at = last_at = performance.now() - age_ms;
      look();
      if (before && before.stops !== message.stops) emit("halt", false);
      emit("state", message);
      break;
    }
    case "answer":
      waiting.get(message.seq)?.(message);
      waiting.delete(message.seq);
      break;
    case "news":
      emit("news", message);
      break;
    case "dropped":
      // A state is replaced by the next one; lost news have to be reported.
      if (message.what === "news") emit("news", { ...message, text: `${message.count} pieces of news were missed` });
      break;
  }
}

/** Connects, and reconnects whenever the connection is lost. */
export function connect() {
  opened_at = performance.now();
  // Messages of a connection that was given up no longer count.
  const mine = open(
    (text, sent_ms = Date.now()) => mine === connection && take(JSON.parse(text), Math.max(0, Date.now() - sent_ms)),
    () => mine === connection && lose(),
  );
  connection = mine;
}

function lose() {
  [connection, link.welcome, seen_at] = [null, null, -Infinity];
  for (const resolve of waiting.values()) {
    resolve({ ok: false, error: { kind: "no_connection", message: `The connection to ${host_name} was lost.` } });
  }
  waiting.clear();
  look();
  emit("change", false);
  // Also where it is refused: another tab may get the browser admitted.
  findRefusal().then(() => setTimeout(connect, RETRY_MS));
}

/** A socket that is refused does not say why; the answer to a request does. */
async function findRefusal() {
  try {
    const answer = await request("/api/state", { signal: AbortSignal.timeout(RETRY_MS) });
    // A host that has no bus yet (503) turns no page away.
    turned_away = [401, 403].includes(answer.status) ? (await answer.json()).error.message : null;
  } catch {
    turned_away = null;
  }
  look();
}

/** Checks the age of the state. */
function look() {
  const now = performance.now();
  const before = link.fresh;
  link.fresh = now - seen_at <= OLD_MS;
  if (!link.fresh || !before) emit("sight", { fresh: link.fresh, connected: link.welcome !== null, age_ms: now - last_at, refused: turned_away });
  if (connection && now - Math.max(seen_at, opened_at) > DEAD_MS) {
    const dead = connection;
    lose();
    dead.close();
  }
}
setInterval(look, LOOK_MS);

// A page that has control shows that it is there.
setInterval(() => {
  if (inControl()) ask({ do: "alive" });
}, ALIVE_MS);
