// A recorded sequence, as the command line, Python and a scenario say it.

import assert from "node:assert/strict";
import { test } from "node:test";

import { commandLine, keptSteps, python, recorder, scenario, shownStep } from "../page/sequence.js";

const steps = [
  { after_s: 3, command: { do: "enable", node: 4 } },
  { after_s: 0.01, command: { do: "velocity", node: 4, rpm: 60, rpm_per_s: 500 } },
  { after_s: 1.504, command: { do: "move", node: 2, degrees: -90, relative: true, rpm: 30 } },
  { after_s: 2, command: { do: "home", node: 2, method: 17, rpm: null } },
  { after_s: 2, command: { do: "torque", node: 4, amperes: 0.5 } },
  { after_s: 2, command: { do: "stop", node: 4 } },
];

test("the command line has each command with its pause", () => {
  assert.equal(
    commandLine(steps, "can0"),
    `#!/bin/sh
set -e
export FERRODRIVE_BUS='can0'
ferrodrive enable 4
ferrodrive velocity 4 60rpm --acceleration 500rpm/s --deceleration 500rpm/s --no-wait
sleep 1.5
ferrodrive move 2 -90deg --relative --profile-velocity 30rpm --no-wait
sleep 2
ferrodrive home 2 --method 17
sleep 2
ferrodrive torque 4 0.5A
sleep 2
ferrodrive stop 4
`,
  );
  assert.match(commandLine(steps, "sim"), /socketcand:\/\/127\.0\.0\.1:29536\/can0/);
});

test("Python has the methods of a drive", () => {
  const text = python(steps, "can0");
  for (const line of ['with ferrodrive.Network("can0") as network:', "    node_4 = network.drive(4)", "    node_4.velocity(60, acceleration_rpm_s=500, deceleration_rpm_s=500, wait=False)", "    network.sleep(1.5)", "    node_2.move(-90, relative=True, speed_rpm=30, wait=False)", "    node_2.home(17)"]) assert.ok(text.includes(`${line}\n`), line);
});

test("a scenario has the machine and a host", () => {
  const text = scenario(steps, [{ node: 2, model: "zlim42c" }, { node: 4, model: "zlac8030l" }]);
  for (const line of ['    { model = "zlim42c", node = 2 },', '    "4 velocity 60rpm acceleration 500rpm/s deceleration 500rpm/s no-wait",', '    "wait 1.5s",', '    "2 move by -90deg at 30rpm no-wait",', '    "2 home 17",']) assert.ok(text.includes(`${line}\n`), line);
});

test("a jog is a turn with a stop, and what only looks is not recorded", () => {
  const { take, end } = recorder();
  assert.deepEqual(take({ do: "jog", node: 4, rpm: -60 }), [{ do: "velocity", node: 4, rpm: -60, rpm_per_s: null }]);
  assert.deepEqual(take({ do: "jog_end", node: 4 }), [{ do: "stop", node: 4 }]);
  for (const word of ["jog_hold", "jog_end", "alive", "read_objects", "help", "constructor"]) assert.deepEqual(take({ do: word, node: 4 }), [], word);
  assert.deepEqual(end(), []);
});

test("Stop is a quick stop of each recorded node, and ends a jog", () => {
  const { take, end } = recorder();
  assert.deepEqual(take({ do: "stop_all" }), [], "nothing was commanded");
  take({ do: "velocity", node: 2, rpm: 60, rpm_per_s: null });
  take({ do: "jog", node: 4, rpm: 60 });
  assert.deepEqual(take({ do: "stop_all" }), [{ do: "quick_stop", node: 2 }, { do: "quick_stop", node: 4 }]);
  assert.deepEqual(take({ do: "jog_end", node: 4 }), [], "it has ended");
  assert.deepEqual(end(), []);
});

test("a jog that is held when recording ends, gets its stop; one that another motion replaced, does not", () => {
  const { take, end } = recorder();
  take({ do: "jog", node: 4, rpm: 60 });
  take({ do: "enable", node: 4 });
  take({ do: "jog", node: 2, rpm: 60 });
  take({ do: "move", node: 2, degrees: 90, relative: true, rpm: null });
  assert.deepEqual(end(), [{ do: "stop", node: 4 }]);
});

test("what is kept and is not a step is left out", () => {
  assert.deepEqual(keptSteps([...steps, { after_s: "1", command: { do: "enable", node: 4 } }, { after_s: 1, command: { do: "fly", node: 4 } }, { after_s: 1, command: { do: "enable", node: "4; rm" } }, null]), steps);
  assert.deepEqual(keptSteps({}), []);
  assert.equal(shownStep(steps[2], 2), "+1.50 s node 2: Move by -90°");
});
