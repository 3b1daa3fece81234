/** What was refused. */
export class FerrodriveError extends Error {
  /** A word that programs may rely on, such as `not_in_control`. */
  readonly kind: string;
}

/** Data sheets (EDS, DCF) that a machine file names: name to content. */
export type Files = Record<string, string | ArrayBuffer | Uint8Array>;

/** A command of a session: `{ do: "velocity", node: 4, rpm: 60 }`. The commands are those of the studio's page. */
export type Command = { do: string } & Record<string, unknown>;

/** The answer to a world command. */
export type WorldAnswer = { ok: boolean; t: number } & Record<string, unknown>;

/** What a drive has stored: its number, its model, and the content of its memory as hexadecimal digits. */
export interface Stored {
  number: number;
  model: string;
  image: string;
}

/** A machine of virtual drives with its host, in virtual time. */
export class World {
  /** The machine of a machine file (TOML); refused with all that is wrong with it. */
  static open(
    machine: string,
    options?: {
      files?: Files;
      unix_ms?: number;
      /** What its drives have stored before; what cannot be used is said by `onunusable`, and that drive begins as from the factory. */
      stored?: Stored[];
      onunusable?: ((why: string) => void) | null;
      /** What a drive stores: it acknowledges that when this has returned, or when its promise is kept. */
      onstored?: ((stored: Stored) => void | Promise<void>) | null;
      onmessage?: ((line: string) => void) | null;
    },
  ): Promise<World>;
  private constructor();
  /** The time of the world, in seconds since its power came on. */
  readonly now: number;
  /** The newest state of all drives. */
  readonly state: any;
  /** A hash of all that has happened: equal for equal runs, in every engine and natively. */
  readonly digest: string;
  /** Has so many seconds pass. */
  run(seconds: number): void;
  /** Has a command carried out, and time pass until it is answered, at most `within` seconds (60); its result. */
  ask(command: Command, options?: { within?: number }): any;
  /** Shows that the session is there: without it whatever it has moved is quick-stopped after 3 s. */
  hold(): void;
  /** Does what a line says to the surroundings of the drives: `4 supply 30`, `4 get`. */
  command(line: string): WorldAnswer;
  /** A request of the studio's page, such as `/api/trace?count=10`. */
  request(path: string, body?: string | ArrayBuffer | Uint8Array): { status: number; kind: string; body: Uint8Array };
  /** Hands on a message of a page as it stands. */
  say(line: string): void;
  /** A new session for a page: what it moved is stopped. */
  join(): void;
}

/** One thing that a scenario asked, and what was seen. */
export interface Row {
  kind: "step" | "host" | "expect";
  name: string;
  asked: string;
  t: number | null;
  seen: string;
  verdict: "passed" | "failed" | "skipped";
  line: number;
}

/** The outcome of a scenario, as `ferrodrive run --json` prints it. */
export interface Outcome {
  ok: boolean;
  title: string;
  seed: number;
  parameters: Record<string, string>;
  end_s: number;
  rows: Row[];
  figures: Record<string, number>;
  digest: string;
  last_frames: string[];
}

/** Runs a scenario file (TOML) from its start to its end. */
export function runScenario(scenario: string, options?: { seed?: number | null; files?: Files }): Promise<Outcome>;
