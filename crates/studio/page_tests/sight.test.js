// What a page reports about motion, and about drives that it no longer sees.

import assert from "node:assert/strict";
import { test } from "node:test";

import { isSeenMoving, lostSight, unseenStops } from "../page/sight.js";

const drive = (state, velocity_rpm = 0, angle_degrees = 0) => ({ state, velocity_rpm, angle_degrees });
const node = (number, of, more = {}) => ({ node: number, drive: of, moving: false, doing: null, goes_on: false, without_us: null, ...more });

test("only a turning drive is reported as moving", () => {
  assert.equal(isSeenMoving(null, null), false);
  assert.equal(isSeenMoving(drive("Quick stop active", 0), 0), false, "whatever was commanded before");
  assert.equal(isSeenMoving(drive("Operation enabled", -60), null), true);
  assert.equal(isSeenMoving(drive("Operation enabled", 0.4, 12), 9), true, "slowly");
  assert.equal(isSeenMoving(drive("Operation enabled", null, null), null), false);
});

test("of drives that may move it is shown what stops them, first those that nothing stops", () => {
  const stops = "it stops by itself 1000 ms after the last frame for it (2000h:00)";
  const nodes = [
    node(1, drive("Switch on disabled"), { goes_on: true }),
    node(4, drive("Operation enabled", 60), { without_us: stops }),
    node(2, drive("Operation enabled", 60), { goes_on: true, without_us: "nothing stops it: .." }),
    node(9, drive("Operation enabled")),
    node(10, null),
  ];
  for (const connected of [true, false]) {
    const lines = lostSight({ state: { nodes }, connected, age_ms: 1234 });
    const text = lines.map((line) => line.text).join("\n");
    assert.deepEqual(lines.slice(0, 2).map((line) => line.urgent), [true, true]);
    assert.match(lines[0].text, /Nothing stops node 2 if the studio is dead: use the emergency stop/);
    assert.match(lines[1].text, /Whether anything stops node 9 if the studio is dead is unknown/);
    assert.match(text, /no longer knows what moves/);
    assert.ok(text.includes(`Node 4: if the studio is dead, ${stops}.`), text);
    assert.ok(!/[Nn]ode 1\b|[Nn]ode 10\b|is stopped/.test(text), "nothing that is unknown");
    assert.match(text, connected ? /Nothing received from the studio for 1\.2 s/ : /No connection to the studio/);
  }
});

test("drives without power give no warning, and before the first state nothing is known", () => {
  const lines = lostSight({ state: { nodes: [node(1, drive("Switch on disabled"), { goes_on: true })] }, connected: true, age_ms: 700 });
  assert.ok(lines.every((line) => !line.urgent) && lines.some((line) => /no drive had power/.test(line.text)));
  assert.equal(lostSight({ state: null, connected: false, age_ms: 700 }).length, 1);
});

test("a drive whose stop was not seen is named until it was seen at rest, whatever was confirmed", () => {
  const nodes = [node(2, drive("Operation enabled", 60), { stop_unseen: true }), node(4, drive("Operation enabled", 60), { stop_unseen: false }), node(9, null, { stop_unseen: true })];
  const texts = unseenStops({ nodes });
  assert.equal(texts.length, 2);
  assert.match(texts[0], /NODE 2 MAY STILL BE MOVING.*emergency stop/);
  assert.match(texts[1], /NODE 9 MAY STILL BE MOVING/);
  assert.deepEqual(unseenStops({ nodes: nodes.map((one) => ({ ...one, stop_unseen: false })) }), []);
});

test("a page that a studio started anew does not let in says what to do, and not that it is trying", () => {
  const refused = "open the address that `ferrodrive studio` printed";
  const nodes = [node(2, drive("Operation enabled", 60), { goes_on: true })];
  const text = lostSight({ state: { nodes }, connected: false, age_ms: 9000, refused }).map((line) => line.text).join("\n");
  assert.match(text, /restarted and does not admit this page: open the address that `ferrodrive studio` printed\./);
  assert.ok(!/Trying again/.test(text), text);
  assert.match(text, /no longer knows what moves; grey values are old/, "what moves is as unknown as before");
});
