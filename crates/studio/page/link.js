// The connection to the studio: what is known, and what is asked for.
//
// Messages have rising numbers and the word of this session, so that none counts twice. A connection that is lost is made
// again; what was moved has been stopped by then, and control has to be taken anew.

const RETRY_MS = 1000;
const ALIVE_MS = 500;

export const link = {
  /** The newest picture of everything; null before the first. */
  state: null,
  /** The welcome message of this connection; null without one. */
  welcome: null,
};

const listeners = { state: [], news: [], change: [] };
let socket = null;
let seq = 0;
const waiting = new Map();

/** Calls `listener` with each picture ("state"), piece of news ("news"), or when the connection comes or goes ("change"). */
export function on(what, listener) {
  listeners[what].push(listener);
}

const tell = (what, value) => listeners[what].forEach((listener) => listener(value));

/** True if this page may move drives. */
export const inControl = () => link.welcome !== null && link.state?.controller === link.welcome.session;

/** Sends a deed; resolves with the answer, and never rejects. */
export function ask(deed) {
  if (!link.welcome || socket.readyState !== WebSocket.OPEN) {
    return Promise.resolve({ ok: false, error: { kind: "no_connection", message: "There is no connection to the studio." } });
  }
  seq += 1;
  const message = { seq, session: link.welcome.word, ...deed };
  socket.send(JSON.stringify(message));
  return new Promise((resolve) => waiting.set(message.seq, resolve));
}

/** Quick-stops every drive: over the socket, and by a request of its own in case that the socket is in trouble. */
export function stopAll() {
  ask({ do: "stop_all" });
  fetch("/api/stop", { method: "POST", keepalive: true }).catch(() => {
    tell("news", { type: "news", time_s: null, node: null, text: "The studio cannot be reached: use the emergency stop." });
  });
}

function take(message) {
  switch (message.type) {
    case "welcome":
      link.welcome = message;
      seq = 0;
      tell("change", true);
      break;
    case "state":
      link.state = message;
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
  socket = new WebSocket(`ws://${location.host}/ws`);
  socket.addEventListener("message", (event) => take(JSON.parse(event.data)));
  socket.addEventListener("close", () => {
    link.welcome = null;
    for (const resolve of waiting.values()) {
      resolve({ ok: false, error: { kind: "no_connection", message: "The connection to the studio was lost." } });
    }
    waiting.clear();
    tell("change", false);
    setTimeout(connect, RETRY_MS);
  });
}

// Whoever has control shows that the page is there.
setInterval(() => {
  if (inControl()) ask({ do: "alive" });
}, ALIVE_MS);
