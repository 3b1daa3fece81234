// Virtual CANopen drives in a page, a worker or node: a world in virtual time, its host, and scenarios.
//
// Nothing is fetched but the module beside this file, and no clock is read: time passes by `run`.

/** What was refused: `kind` is a word that programs may rely on. */
export class FerrodriveError extends Error {
  constructor({ kind, message }) {
    super(message);
    this.name = "FerrodriveError";
    this.kind = kind;
  }
}

let compiled = null;

/** The module beside this file, compiled once. */
function compile() {
  compiled ??= compileFrom(new URL("./ferrodrive.wasm", import.meta.url)).catch((error) => {
    // The next one tries again.
    compiled = null;
    throw error;
  });
  return compiled;
}

async function compileFrom(url) {
  if (url.protocol === "file:" && globalThis.process?.versions?.node) {
    const { readFile } = await import("node:fs/promises");
    return WebAssembly.compile(await readFile(url));
  }
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url}: status ${answer.status}`);
  // While it comes, where the server says what it is.
  if (answer.headers.get("content-type") === "application/wasm") return WebAssembly.compileStreaming(answer);
  return WebAssembly.compile(await answer.arrayBuffer());
}

/** The unit of the module's memory, in bytes, and so many as one step of a world takes at most. */
const PAGE = 65_536;
const ROOM_PAGES = 1024;

const bytes = (body) => (typeof body === "string" ? new TextEncoder().encode(body) : new Uint8Array(body));
const text = (body) => new TextDecoder().decode(body);

/** For the workers of the page. One instance of the module: calls are a line of JSON and a body, and so are their answers. */
export class Library {
  static async make() {
    const library = new Library();
    library.exports = (await WebAssembly.instantiate(await compile(), {})).exports;
    return library;
  }

  #answer(length) {
    // A copy: the memory may move with the next call.
    return new Uint8Array(this.exports.memory.buffer, this.exports.answer(), length).slice();
  }

  /** What has ended the module without a word. There is hardly room for more where a piece of memory was refused. */
  #diagnosis(trap, length) {
    const { memory } = this.exports;
    const held = memory.buffer.byteLength;
    try {
      memory.grow(ROOM_PAGES + Math.ceil((2 * length) / PAGE));
    } catch {
      return `out of memory: the module has taken ${Math.round(held / 2 ** 20)} MiB of at most 1024`;
    }
    return `a defect of Ferrodrive; please report it with what was done: ${trap.message}`;
  }

  call(head, body = "") {
    const line = bytes(`${JSON.stringify(head)}\n`);
    const behind = bytes(body);
    let answer;
    try {
      const at = this.exports.reserve(line.length + behind.length);
      const input = new Uint8Array(this.exports.memory.buffer, at, line.length + behind.length);
      input.set(line);
      input.set(behind, line.length);
      answer = this.#answer(this.exports.call());
    } catch (trap) {
      const said = this.#answer(this.exports.answer_length());
      throw new Error(said.length ? JSON.parse(text(said)).error.message : this.#diagnosis(trap, line.length + behind.length), { cause: trap });
    }
    const end = answer.indexOf(10);
    const read = JSON.parse(text(answer.subarray(0, end)));
    if (!read.ok) throw new FerrodriveError(read.error);
    return { ...read, body: answer.subarray(end + 1) };
  }
}

/** A machine of virtual drives with its host, in virtual time. */
export class World {
  #library;
  #now_ns;
  #seq = 0;
  #word = null;
  #answers = new Map();
  #listener = null;
  #keep = null;

  /**
   * The machine of a machine file (TOML). `files` are data sheets that it names: name to content. `onstored` is called with what a drive stores,
   * `{ number, model, image }`, and the drive acknowledges it when it returns, or when its promise is kept; `stored` are those of before.
   */
  static async open(machine, { files = {}, unix_ms = 0, stored = [], onmessage = null, onstored = null, onunusable = null } = {}) {
    const world = new World();
    world.#library = await Library.make();
    [world.#listener, world.#keep] = [onmessage, onstored];
    for (const [name, content] of Object.entries(files)) world.#library.call({ call: "give", name }, content);
    const { now_ns, unusable } = world.#library.call({ call: "open", unix_ms, stored, keeps: onstored !== null }, machine);
    world.#now_ns = now_ns;
    for (const why of unusable) onunusable?.(why);
    world.run(0);
    return world;
  }

  /** The time of the world, in seconds since its power came on. */
  get now() {
    return this.#now_ns / 1e9;
  }

  /** Has so many seconds pass. */
  run(seconds) {
    if (!(seconds >= 0 && seconds <= 1e6)) throw new RangeError(`expected seconds from 0 to 1e6, got ${seconds}`);
    const end_ns = this.#now_ns + Math.round(seconds * 1e9);
    // In pieces: all states of a piece are held until its end.
    do this.#runTo(Math.min(end_ns, this.#now_ns + 1e9));
    while (this.#now_ns < end_ns);
  }

  #runTo(to_ns) {
    const { now_ns, stored, body } = this.#library.call({ call: "run", to_ns });
    this.#now_ns = now_ns;
    for (const { generation, ...image } of stored) {
      const confirm = () => this.#library.call({ call: "kept", number: image.number, generation });
      const kept = this.#keep(image);
      if (kept?.then) kept.then(confirm);
      else confirm();
    }
    if (body.length === 0) return;
    for (const line of text(body).split("\n")) this.#take(line);
  }

  #take(line) {
    this.#listener?.(line);
    // A state comes 20 times a second, and only a listener wants it.
    if (line.startsWith('{"type":"state"')) return;
    const message = JSON.parse(line);
    if (message.type === "welcome") [this.#word, this.#seq] = [message.word, 0];
    else if (message.type === "answer" && this.#answers.has(message.seq)) this.#answers.set(message.seq, message);
  }

  /** Hands on a message of a page as it stands, with its own `seq` and `session`. */
  say(line) {
    this.#library.call({ call: "say" }, line);
  }

  /** A new session for a page: what it moved is stopped. */
  join() {
    this.#library.call({ call: "join" });
    this.#runTo(this.#now_ns);
  }

  /** Has a command of a session carried out, and time pass until it is answered, at most `within` seconds; its result. */
  ask(command, { within = 60 } = {}) {
    this.#seq += 1;
    const seq = this.#seq;
    this.#answers.set(seq, null);
    this.say(JSON.stringify({ seq, session: this.#word, ...command }));
    const until_ns = this.#now_ns + within * 1e9;
    // A person who holds a motion shows that they are there.
    let alive_ns = this.#now_ns;
    while (this.#answers.get(seq) === null && this.#now_ns < until_ns) {
      this.#runTo(this.#now_ns + 1e6);
      if (this.#now_ns - alive_ns < 1e9) continue;
      alive_ns = this.#now_ns;
      this.hold();
    }
    const answer = this.#answers.get(seq);
    this.#answers.delete(seq);
    if (answer === null) throw new FerrodriveError({ kind: "timeout", message: `no answer within ${within} s` });
    if (!answer.ok) throw new FerrodriveError(answer.error);
    return answer.result ?? { notes: answer.notes ?? [] };
  }

  /** Shows that the session is there: without it whatever it has moved is quick-stopped after 3 s. */
  hold() {
    this.#seq += 1;
    this.say(JSON.stringify({ seq: this.#seq, session: this.#word, do: "alive" }));
  }

  /** Does what a line says to the surroundings of the drives, and answers: `4 supply 30`, `4 get`. */
  command(line) {
    return JSON.parse(text(this.#library.call({ call: "world" }, line).body));
  }

  /** A request of the studio's page, such as `/api/state`: `{ status, kind, body }`. */
  request(path, body = "") {
    return this.#library.call({ call: "request", path }, body);
  }

  /** The newest state of all drives, as `/api/state` of the studio has it. */
  get state() {
    return JSON.parse(text(this.request("/api/state").body));
  }

  /** A hash of all that has happened: equal for equal runs, in every engine and natively. */
  get digest() {
    return this.#library.call({ call: "digest" }).digest;
  }
}

/** Runs a scenario file from its start to its end: the outcome, as `ferrodrive run --json` prints it. */
export async function runScenario(scenario, { seed = null, files = {} } = {}) {
  const library = await Library.make();
  for (const [name, content] of Object.entries(files)) library.call({ call: "give", name }, content);
  return library.call({ call: "scenario", seed }, scenario).outcome;
}
