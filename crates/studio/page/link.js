// The connection to the studio: what is known, since when, and what is asked for.
//
// Messages have rising numbers and the word of this session, so that none counts twice. A picture that is older than half a second
// shows nothing of now: then nothing is asked for but a stop, since what waits in a connection would be done much later. A
// connection that is lost, or that brings nothing, is made anew; control has to be taken anew then.

const RETRY_MS = 1000;
const ALIVE_MS = 500;
/** The studio sends a picture every 50 ms. */
const OLD_MS = 500;
/** A connection that has brought nothing for so long is given up. */
const DEAD_MS = 3000;
const LOOK_MS = 100;
/** How long a stop may take to be confirmed. */
const CONFIRM_MS = 300;

export const link = {
  /** The newest picture of everything; null before the first. */
  state: null,
  /** The welcome message of this connection; null without one. */
  welcome: null,
  /** Whether the newest picture shows what is now. */
  fresh: false,
};

/** What the studio says to a page that it does not let in: it was started anew, with another token. */
let turned_away = null;

const listeners = { state: [], news: [], change: [], sight: [], stop: [] };
let socket = null;
let seq = 0;
const waiting = new Map();
/** When the newest picture of this connection came, and when the connection was begun, by `performance.now()`. */
let seen_at = -Infinity;
let opened_at = -Infinity;
/** When the newest picture of any connection came; at first when the page was opened. */
let last_at = performance.now();

/**
 * Calls `listener` with each picture ("state"), piece of news ("news"), when the connection comes or goes ("change"), when what is
 * shown begins or ceases to be what is now, and again and again while it is not ("sight": `{ fresh, connected, age_ms, refused }`), and with
 * what became of a press of stop ("stop": `{ confirmed, after_ms }`).
 */
export function on(what, listener) {
  listeners[what].push(listener);
}

const tell = (what, value) => listeners[what].forEach((listener) => listener(value));

/** True if this page may move drives. */
export const inControl = () => link.welcome !== null && link.fresh && link.state?.controller === link.welcome.session;

const refused = (kind, message) => Promise.resolve({ ok: false, error: { kind, message } });

/** Sends a deed; resolves with the answer, and never rejects. */
export function ask(deed) {
  if (!link.welcome || socket?.readyState !== WebSocket.OPEN) return refused("no_connection", "There is no connection to the studio.");
  if (!link.fresh && deed.do !== "stop_all") return refused("no_picture", "The studio shows nothing new: nothing was sent.");
  seq += 1;
  const message = { seq, session: link.welcome.word, ...deed };
  socket.send(JSON.stringify(message));
  return new Promise((resolve) => waiting.set(message.seq, resolve));
}

/**
 * Quick-stops every drive: over the socket, and by a request of its own in case that the socket is in trouble. Only the answer of
 * whoever moves the drives confirms it; that a web server has taken the request does not.
 */
export function stopAll() {
  const began = performance.now();
  let confirmed = false;
  let told = false;
  const missed = () => {
    if (confirmed || told) return;
    told = true;
    tell("stop", { confirmed: false, after_ms: performance.now() - began });
  };
  ask({ do: "stop_all" }).then((answer) => {
    if (!answer.ok) return missed();
    confirmed = true;
    tell("stop", { confirmed: true, after_ms: performance.now() - began });
  });
  fetch("/api/stop", { method: "POST", keepalive: true }).catch(() => {});
  setTimeout(missed, CONFIRM_MS);
}

function take(message) {
  switch (message.type) {
    case "welcome":
      link.welcome = message;
      turned_away = null;
      seq = 0;
      tell("change", true);
      break;
    case "state":
      link.state = message;
      seen_at = last_at = performance.now();
      look();
      tell("state", message);
      break;
    case "answer":
      waiting.get(message.seq)?.(message);
      waiting.delete(message.seq);
      break;
    case "news":
      tell("news", message);
      break;
    case "dropped":
      // Pictures are replaced by newer ones; of news the loss has to be told.
      if (message.what === "news") tell("news", { ...message, text: `${message.count} pieces of news were missed` });
      break;
  }
}

/** Connects, and goes on connecting. */
export function connect() {
  const mine = new WebSocket(`ws://${location.host}/ws`);
  socket = mine;
  opened_at = performance.now();
  // What one says that was given up counts no longer.
  mine.addEventListener("message", (event) => mine === socket && take(JSON.parse(event.data)));
  mine.addEventListener("close", () => mine === socket && lose());
}

function lose() {
  [socket, link.welcome, seen_at] = [null, null, -Infinity];
  for (const resolve of waiting.values()) {
    resolve({ ok: false, error: { kind: "no_connection", message: "The connection to the studio was lost." } });
  }
  waiting.clear();
  look();
  tell("change", false);
  // Also where it is refused: the browser may be let in by another tab of it.
  findRefusal().then(() => setTimeout(connect, RETRY_MS));
}

/** A socket that is refused does not say why; the answer to a request does. */
async function findRefusal() {
  try {
    const answer = await fetch("/api/state", { signal: AbortSignal.timeout(RETRY_MS) });
    turned_away = answer.ok ? null : (await answer.json()).error.message;
  } catch {
    turned_away = null;
  }
  look();
}

/** Looks how old the picture is. */
function look() {
  const now = performance.now();
  const before = link.fresh;
  link.fresh = now - seen_at <= OLD_MS;
  if (!link.fresh || !before) tell("sight", { fresh: link.fresh, connected: link.welcome !== null, age_ms: now - last_at, refused: turned_away });
  if (socket && now - Math.max(seen_at, opened_at) > DEAD_MS) {
    const dead = socket;
    lose();
    dead.close();
  }
}
setInterval(look, LOOK_MS);

// Whoever has control shows that the page is there.
setInterval(() => {
  if (inControl()) ask({ do: "alive" });
}, ALIVE_MS);
