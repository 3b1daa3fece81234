import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const { WakingClock } = await import(pathToFileURL(join(process.env.SITE, "waking_clock.js")));

/** What the clock shows, by pairs of a steady and a wall clock. */
function read(pairs) {
  const [first, ...rest] = pairs.map(([steady, wall]) => ({ steady, wall }));
  const clock = new WakingClock(first);
  return rest.map((now) => clock.read(now));
}

test("a sleep counts, whether the steady clock goes on in it or not", () => {
  const asleep = 20_000;
  assert.deepEqual(read([[100, 5000], [105, 5005], [110, 5010 + asleep], [115, 5015 + asleep]]), [105, 110 + asleep, 115 + asleep]);
  assert.deepEqual(read([[100, 5000], [105 + asleep, 5005 + asleep]]), [105 + asleep]);
});

test("a wall clock that drifts, or is set back, changes nothing", () => {
  assert.deepEqual(read([[100, 5000], [200, 5101], [300, 5202], [400, -90_000], [500, -89_900]]), [200, 300, 400, 500]);
});
