// The worker of a page, in node, with a clock that the test has.

import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const WHEEL = '[[drive]]\nmodel = "zlac8030l"\nnode = 4\n';

test("time that a worker was away for is left out, and said at most once a second", async () => {
  let [now, wall, hand, tick, sign] = [1000, 5000, null, null, null];
  const posted = [];
  const [clock, date, timer] = [performance.now, Date.now, setInterval];
  const stop = clearInterval;
  Object.assign(globalThis, { postMessage: (message) => posted.push(message), addEventListener: (_, handle) => (hand = handle), close: () => {} });
  try {
    performance.now = () => now;
    Date.now = () => wall;
    // Signs of life while the module loads come seldom; the world is moved on more often.
    globalThis.setInterval = (handle, ms) => (ms < 100 ? (tick = handle) : (sign = handle));
    globalThis.clearInterval = (which) => (sign = which === sign ? null : sign);
    await import(pathToFileURL(join(process.env.SITE, "worker.js")));
    hand({ data: { open: true, machine: WHEEL, files: {}, stored: [] } });
    while (sign === null) await new Promise((resolve) => setImmediate(resolve));
    sign();
    assert.deepEqual(posted.splice(0), [{ event: "loading" }], "a page does not take it for dead");
    while (tick === null) await new Promise((resolve) => setImmediate(resolve));
    assert.equal(sign, null, "it has loaded");
    const said = () => posted.filter(({ event }) => event === "skipped").map(({ detail }) => detail);
    const time = () => JSON.parse(posted.findLast(({ text }) => text?.includes('"type":"state"')).text).time_s;
    const pass = (ms) => {
      now += ms;
      wall += ms;
      tick();
    };
    for (let count = 0; count < 100; count += 1) pass(5);
    assert.deepEqual(said(), [], "it keeps up");
    const before = time();
    // 20 s of sleep, of which 20 ms are caught up with.
    pass(20_000);
    assert.deepEqual(said(), [19_980]);
    pass(300);
    for (let count = 0; count < 100; count += 1) pass(5);
    assert.deepEqual(said(), [19_980], "not again within a second");
    for (let count = 0; count < 200; count += 1) pass(5);
    assert.equal(said().length, 2);
    assert.ok(said()[1] > 250 && said()[1] < 300, said().join());
    // A sleep in which the steady clock stood still.
    for (let count = 0; count < 200; count += 1) pass(5);
    wall += 60_000;
    pass(5);
    assert.deepEqual(said().slice(2), [59_985], "all but 20 ms of it and of the tick");
    assert.ok(time() - before < 4, `${time() - before} s of the drives have passed`);
  } finally {
    [performance.now, Date.now, globalThis.setInterval, globalThis.clearInterval] = [clock, date, timer, stop];
  }
});
