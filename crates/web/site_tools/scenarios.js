// The scenarios of SCENARIOS as a page is given them: their text, and the files that they name.

import { execFileSync } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";

const { FERRODRIVE, SCENARIOS } = process.env;

export const scenarios = readdirSync(SCENARIOS)
  .filter((name) => name.endsWith(".toml"))
  .sort()
  .map((name) => {
    const path = join(SCENARIOS, name);
    const text = readFileSync(path, "utf8");
    const beside = /^machine = "(.*)"$/m.exec(text)?.[1];
    return { name, path, text, files: beside ? { [beside]: readFileSync(join(SCENARIOS, beside), "utf8") } : {} };
  });

const outcomes = new Map();

/** What the native program prints of one. */
export function natively({ path }) {
  if (!outcomes.has(path)) outcomes.set(path, JSON.parse(execFileSync(FERRODRIVE, ["run", "--json", path], { encoding: "utf8" })));
  return outcomes.get(path);
}
