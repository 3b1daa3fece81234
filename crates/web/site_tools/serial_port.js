// An emulated `navigator.serial`: a port of the page and its worker that ends, over a WebSocket of the page's own server, at an slcan adapter
// over TCP. A test may have that adapter misbehave.

import { createHash } from "node:crypto";
import { connect } from "node:net";

/** What stands in for Web Serial in the page and its worker. */
const MOCK = `
{
  if (location.search === "?lacking") delete Navigator.prototype.serial;
  // What the test has happen: the machine sleeps, and its steady clock stands still meanwhile. The page's own clock dates what comes.
  if (!globalThis.document) {
    let slept_ms = 0;
    const wall = Date.now;
    Date.now = () => wall() + slept_ms;
    new BroadcastChannel("emulated").onmessage = ({ data }) => (slept_ms += data.slept_ms);
  }
  const lost = (why) => new DOMException(why, "NetworkError");
  class Port {
    getInfo() {
      return { usbVendorId: 0x1d50, usbProductId: 0x606f };
    }
    async open() {
      this.socket = new WebSocket("ws://" + location.host + "/port");
      this.socket.binaryType = "arraybuffer";
      await new Promise((resolve, reject) => {
        this.socket.onopen = resolve;
        this.socket.onerror = () => reject(lost("Failed to open serial port."));
      });
      this.readable = new ReadableStream({
        start: (controller) => {
          this.socket.onmessage = ({ data }) => controller.enqueue(new Uint8Array(data));
          this.socket.onclose = () => { try { controller.error(lost("The device has been lost.")); } catch {} };
        },
      });
      this.writable = new WritableStream({ write: (chunk) => this.socket.send(chunk) });
    }
    async close() {
      this.socket.close();
    }
    async forget() {
      await fetch("/port/forget");
    }
  }
  const port = new Port();
  // That of another tab.
  const others = location.search === "?two" ? [new Port()] : [];
  const serial = new EventTarget();
  serial.requestPort = async () => (await fetch("/port/choose"), port);
  serial.getPorts = async () => ((await (await fetch("/port/is")).json()) ? [port, ...others] : []);
  if (location.search !== "?lacking") Object.defineProperty(navigator, "serial", { value: serial, configurable: true });
}
`;

/** The adapter at a TCP port, as a page sees it. */
export class Adapter {
  constructor(port) {
    this.port = port;
    this.chosen = false;
    this.plugged = true;
    this.forgotten = false;
    /** Answers BEL to every frame. */
    this.refuses = false;
    /** What it was sent since this was emptied. */
    this.heard = "";
    this.ends = new Set();
  }

  /** For `begin` of the browser. */
  get serving() {
    return {
      answered: (path, answer) => {
        if (!path.startsWith("/port/")) return false;
        if (path === "/port/choose") this.chosen = true;
        if (path === "/port/forget") this.forgotten = true;
        answer.writeHead(200, { "content-type": "application/json" }).end(String(this.chosen && this.plugged));
        return true;
      },
      changed: (name, content) => (["page/bundle.js", "serial_worker.js"].includes(name) ? MOCK + content : content),
    };
  }

  pull() {
    this.plugged = false;
    for (const socket of this.ends) socket.destroy();
  }

  /** An upgrade to a WebSocket (RFC 6455). */
  accept(request, socket) {
    const key = createHash("sha1").update(`${request.headers["sec-websocket-key"]}258EAFA5-E914-47DA-95CA-C5AB0DC85B11`).digest("base64");
    socket.write(`HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: ${key}\r\n\r\n`);
    const adapter = connect(this.port, "127.0.0.1");
    this.ends.add(socket);
    // Half lines: what an adapter says comes in pieces of three bytes.
    const say = (bytes) => {
      for (let at = 0; at < bytes.length; at += 3) {
        const piece = bytes.subarray(at, at + 3);
        socket.write(Buffer.concat([Buffer.from([0x82, piece.length]), piece]));
      }
    };
    adapter.on("data", say);
    let input = Buffer.alloc(0);
    socket.on("data", (data) => {
      input = Buffer.concat([input, data]);
      for (let frame; (frame = unframed(input)); input = input.subarray(frame.end)) {
        if (frame.kind === 8) return socket.end();
        this.heard += frame.payload;
        if (!this.refuses) adapter.write(frame.payload);
        else for (const line of String(frame.payload).split(/(?<=\r)/)) line[0] === "t" ? say(Buffer.from([7])) : adapter.write(line);
      }
    });
    const end = () => (socket.destroy(), adapter.destroy(), this.ends.delete(socket));
    for (const one of [socket, adapter]) one.on("close", end).on("error", end);
  }
}

/** The first masked frame of a client, if it is whole. */
function unframed(input) {
  if (input.length < 6) return null;
  const kind = input[0] & 15;
  let [length, at] = [input[1] & 127, 2];
  if (length === 126) [length, at] = [input.readUInt16BE(2), 4];
  if (input.length < at + 4 + length) return null;
  const mask = input.subarray(at, at + 4);
  const payload = Buffer.from(input.subarray(at + 4, at + 4 + length).map((byte, place) => byte ^ mask[place % 4]));
  return { kind, payload, end: at + 4 + length };
}
