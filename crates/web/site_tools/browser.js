// Headless Chromium with the page of SITE, from a folder below a static host's root, moved by its WebDriver.

import { spawn } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { extname, join, normalize } from "node:path";
import { gzipSync } from "node:zlib";

const { SITE, PICTURES } = process.env;
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm", ".tgz": "application/gzip" };
/** A loaded machine is slow; what hangs is ended. */
export const PATIENCE_MS = 120_000;

let driver, session, profile;
/** The paths that the browser has asked for, and those of files that were sent, because the browser did not have them. */
export const asked = [];
export const sent = [];
export let server, address;

/** For scripts in the page: its modules by their names, and what most scripts need of them. */
export const MODULES = `const { modules } = await import(new URL("page/bundle.js", location.href));
  const { ask, link, on } = modules["link.js"];`;

/** The policy that the page sets, for a server that sends it as a header. */
export const policy = () => /<meta http-equiv="content-security-policy" content="([^"]*)">/.exec(readFileSync(join(SITE, "index.html"), "utf8"))[1];

/**
 * Sends a file compressed, as static hosts do, on a line of so many Mbit/s that all files share, after a round trip; on a new connection after one
 * more.
 */
function slowly(mbit_s, rtt_ms) {
  const PIECE = 16_384;
  let free_at = 0;
  const known = new WeakSet();
  return async (answer, content) => {
    const trips = known.has(answer.socket) ? 1 : 2;
    known.add(answer.socket);
    await new Promise((resolve) => setTimeout(resolve, trips * rtt_ms));
    const bytes = gzipSync(content, { level: 9 });
    for (let at = 0; at < bytes.length; at += PIECE) {
      const piece = bytes.subarray(at, at + PIECE);
      free_at = Math.max(free_at, performance.now()) + (piece.length * 8) / (mbit_s * 1000);
      await new Promise((resolve) => setTimeout(resolve, free_at - performance.now()));
      answer.write(piece);
    }
    answer.end();
  };
}

/**
 * `answered` may answer a request in place of the folder, by returning true; `changed` may change the text of a file; `headers` come with each of them.
 * A file that the browser has by its tag is not sent again, as by static hosts.
 */
function serve({ answered = () => false, changed = (_, content) => content, headers = {}, mbit_s = null, rtt_ms = 0 }) {
  const send = mbit_s && slowly(mbit_s, rtt_ms);
  server = createServer((request, answer) => {
    const path = new URL(request.url, "http://host").pathname;
    asked.push(path);
    if (answered(path, answer)) return;
    const name = normalize(path.replace(/^\/try\//, "")) || "index.html";
    try {
      const content = changed(name, readFileSync(join(SITE, name === "." ? "index.html" : name)));
      const etag = `"${createHash("sha1").update(content).digest("hex")}"`;
      const type = { ...headers, etag, "content-type": TYPES[extname(name)] ?? "text/html" };
      if (request.headers["if-none-match"] === etag) return void answer.writeHead(304, type).end();
      sent.push(path);
      if (send) send(answer.writeHead(200, { ...type, "content-encoding": "gzip" }), content);
      else answer.writeHead(200, type).end(content);
    } catch {
      answer.writeHead(404).end();
    }
  });
  return new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
}

async function webdriver(method, path, body) {
  const answer = await fetch(`${driver.address}/session${path}`, { method, body: body && JSON.stringify(body) });
  const { value } = await answer.json();
  if (value?.error) throw new Error(`${value.error}: ${value.message}`);
  return value;
}

/** A command of WebDriver to the session. */
export const command = (method, path, body) => webdriver(method, `/${session}${path}`, body);

export const go = (url) => command("POST", "/url", { url });

/** Presses keys, one after the other, where the focus is. */
export const press = (keys) =>
  command("POST", "/actions", { actions: [{ type: "key", id: "keys", actions: [...keys].flatMap((value) => [{ type: "keyDown", value }, { type: "keyUp", value }]) }] });

export const run = (script, ...args) => command("POST", "/execute/async", { script: `const done = arguments[arguments.length - 1]; (async () => { ${script} })().then(done, (error) => done({ failed: String(error) }));`, args });

export async function until(what, script, ...args) {
  const end = performance.now() + PATIENCE_MS;
  for (;;) {
    const value = await run(script, ...args);
    if (value && !value.failed) return value;
    if (performance.now() > end) {
      await picture("failed");
      throw new Error(`${what}: ${JSON.stringify(value)}; the page: ${await run("return document.body.innerText.slice(0, 2000)")}`);
    }
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

export async function picture(name) {
  if (PICTURES) writeFileSync(join(PICTURES, `web_${name}.png`), Buffer.from(await command("GET", "/screenshot"), "base64"));
}

export async function begin(serving = {}) {
  await serve(serving);
  address = `http://127.0.0.1:${server.address().port}/try/`;
  profile = mkdtempSync(join(tmpdir(), "ferrodrive-web-"));
  const child = spawn("chromedriver", ["--port=0"], { stdio: ["ignore", "pipe", "ignore"] });
  const port = await new Promise((resolve, reject) => {
    child.stdout.on("data", (said) => {
      const found = /successfully on port (\d+)/.exec(String(said));
      if (found) resolve(found[1]);
    });
    child.on("error", reject);
  });
  driver = { child, address: `http://127.0.0.1:${port}` };
  const args = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-background-networking", "--no-first-run", "--window-size=1280,900", `--user-data-dir=${profile}`];
  const made = await fetch(`${driver.address}/session`, { method: "POST", body: JSON.stringify({ capabilities: { alwaysMatch: { "goog:chromeOptions": { args }, timeouts: { script: PATIENCE_MS } } } }) });
  session = (await made.json()).value.sessionId;
}

export async function end() {
  if (session) await webdriver("DELETE", `/${session}`).catch(() => {});
  driver?.child.kill();
  server?.close();
  server?.closeAllConnections();
  if (profile) rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
}
