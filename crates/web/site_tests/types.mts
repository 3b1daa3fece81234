// Uses each member of the package as its declarations have it: the TypeScript compiler reads this, and nothing runs it.

import { FerrodriveError, World, runScenario } from "../js/ferrodrive.js";
import type { Command, Files, Outcome, Row, Stored, WorldAnswer } from "../js/ferrodrive.js";

const files: Files = { "a.eds": "text", "b.eds": new ArrayBuffer(8), "c.eds": new Uint8Array(8) };
const kept: Stored[] = [];
const world: World = await World.open("[[drive]]", {
  files,
  unix_ms: 0,
  stored: kept,
  onunusable: (why: string) => console.log(why),
  onstored: (stored) => void kept.push(stored),
  onmessage: (line: string) => console.log(line),
});
const plain: World = await World.open("[[drive]]");
const command: Command = { do: "velocity", node: 4, rpm: 60 };
world.run(0.25);
world.ask(command, { within: 1 });
world.hold();
const answer: WorldAnswer = world.command("4 get");
const now: number = world.now + answer.t;
const digest: string = plain.digest;
const { status, kind, body }: { status: number; kind: string; body: Uint8Array } = world.request("/api/state", "");
world.say("{}");
world.join();
const outcome: Outcome = await runScenario("title = \"x\"", { seed: 1, files });
const rows: Row[] = outcome.rows.filter((row) => row.verdict === "failed" && row.t !== null);
console.log(world.state.nodes, now, digest, status, kind, body, rows);
try {
  world.run(-1);
} catch (error) {
  if (error instanceof FerrodriveError) console.log(error.kind.length, error.message);
}

// @ts-expect-error a world is opened, not constructed
new World();
// @ts-expect-error a command has a word
world.ask({ node: 4 });
// @ts-expect-error the time passes by run alone
world.now = 1;
// @ts-expect-error
runScenario(1);
