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

const motion = { shape: "sine", by_deg: 20, speed_rpm: 60, frequency_hz: 1, to_frequency_hz: 5, periods: 3, time_s: 0.5, count: 2, velocity_rpm: 60, acceleration_rpm_s: null, travel_turns: 2, following_error_deg: 72, period_ms: 10, path: [] };
const measured = [
  { after_s: 0, command: { do: "nmt", node: 4, command: "start" } },
  { after_s: 0, command: { do: "write_parameters", node: 4, values: [{ object: "2008h:00", value: "60rpm" }, { object: "6083h:00", value: '"5"' }] } },
  { after_s: 0, command: { do: "store", node: 4 } },
  { after_s: 1, command: { do: "capture", node: 4, quantities: ["velocity", "6041h:00"], period_ms: 1, duration_ms: 2000, trigger: "velocity>10", pre_ms: 50, sdo: false } },
  { after_s: 0, command: { do: "test_motion", node: 4, motion, quantities: ["velocity"], capture_ms: 2, sdo: false } },
];

test("parameters, captures and test motions have the words of the command line", () => {
  assert.equal(
    commandLine(measured, "can0"),
    `#!/bin/sh
set -e
export FERRODRIVE_BUS='can0'
ferrodrive nmt 4 start
cat > node4.toml <<'END'
[values]
"2008:00" = "60rpm"
"6083:00" = "\\"5\\""
END
ferrodrive params apply 4 node4.toml
ferrodrive save 4
sleep 1
ferrodrive capture 4 velocity 6041h:00 --for 2000ms --rate 1ms --trigger 'velocity>10' --pre 50ms -o node4.mcap &
ferrodrive test-motion 4 sine --by 20deg --frequency 1 --periods 3 --count 2 --velocity 60rpm --travel 2 --following-error 72deg --period 10ms --capture velocity --rate 2ms
wait
`,
  );
  const path = { after_s: 0, command: { ...measured[4].command, motion: { ...motion, shape: "path", path: [[0, 0], [1, 90]] } } };
  assert.match(commandLine([path], "can0"), /^cat > path4.csv <<'END'\nt_s,4.position_deg,mark\n0,0,\n1,90,\nEND\nferrodrive test-motion 4 path --path path4.csv --count 2 --velocity 60rpm /m);
  assert.match(python([path], "can0"), /test_motion\("path", "velocity", path=\[\(0, 0\), \(1, 90\)\], count=2, velocity_rpm=60,/);
});

test("and those of Python and of a scenario", () => {
  const text = python(measured, "can0");
  for (const line of [
    '    network.nmt("start", 4)',
    '    with open("node4.toml", "w") as file:',
    '        file.write("[values]\\n\\"2008:00\\" = \\"60rpm\\"\\n\\"6083:00\\" = \\"\\\\\\"5\\\\\\"\\"\\n")',
    '    network.params(4).apply("node4.toml")',
    "    node_4.save()",
    "    # left out: node 4: Capture velocity, 6041h:00 every 1ms for 2 s from velocity>10: it would wait for what comes behind it",
    '    node_4.test_motion("sine", "velocity", by=20, frequency=1, periods=3, count=2, velocity_rpm=60, travel_turns=2, following_error=72, period=0.01, capture_period=0.002)',
  ]) assert.ok(text.includes(`${line}\n`), line);
  const lines = scenario(measured, [{ node: 4, model: "zlac8030l" }]);
  for (const line of ['    "4 nmt start",', '    "4 write 2008:00 60rpm",', '    "4 save",', '    "4 test-motion sine by 20deg frequency 1 periods 3 count 2 velocity 60rpm travel 2 following-error 72deg period 10ms capture velocity rate 2ms",']) assert.ok(lines.includes(`${line}\n`), line);
});

test("a capture takes its time from the pause behind it, and what only the studio knows is left out", () => {
  const capture = { do: "capture", node: 4, quantities: ["velocity", "true_winding"], period_ms: 1, duration_ms: 2000, trigger: null, pre_ms: 0, take: ["tpdo1"], sdo: true };
  const steps = [{ after_s: 0, command: capture }, { after_s: 3, command: { do: "velocity", node: 4, rpm: 30, rpm_per_s: null } }, { after_s: 2.5, command: { do: "stop", node: 4 } }];
  // A program that has ended is not there to keep its drive turning.
  assert.match(commandLine(steps, "can0"), /capture 4 velocity --for 2000ms --rate 1ms --take tpdo1 --sdo -o node4.mcap {2}# waits for its end\nsleep 1\nferrodrive velocity 4 30rpm --for 2500ms\nferrodrive stop 4\n$/);
  assert.match(python(steps, "can0"), /node_4.capture\("velocity", duration=2, period=0.001, take=\["tpdo1"\], sdo=True\) {2}# waits for its end\n {4}network.sleep\(1\)\n/);
  const text = scenario(steps, [{ node: 4, model: "zlac8030l" }]);
  assert.match(text, /"4 capture velocity rate 1ms take tpdo1 sdo for 2000ms",\n {4}"wait 1s",\n {4}"4 guard",\n {4}"4 velocity 30rpm no-wait",\n {4}"wait 2.5s",/);
  const limit = Number(/^limit = "(\d+)s"$/m.exec(text)[1]);
  assert.ok(limit >= 60 + 2 + 1 + 2.5, text);
  const truth = scenario([{ after_s: 0, command: { ...capture, quantities: ["true_winding"] } }], []);
  assert.match(truth, /# left out: node 4: Capture true_winding .*: what is true of a virtual drive is known to the studio alone$/m);
});

const together = [
  { after_s: 0, command: { do: "group_move", axes: [{ node: 1, degrees: 90 }, { node: 2, degrees: -4.5 }], relative: true, rpm: 40, rpm_per_s: 120, within_s: 2.5 } },
  { after_s: 1, command: { do: "group_move", axes: [{ node: 1, degrees: 0 }, { node: 2, degrees: 0 }], relative: false, rpm: null, rpm_per_s: null, within_s: null } },
];

test("drives that move together do so in each form, in Python with the models that a group has to know", () => {
  assert.deepEqual(keptSteps(together), together);
  assert.equal(shownStep(together[0], 0), "nodes 1, 2: Move together by 90°, -4.5° within 2.5 s");
  const lines = commandLine(together, "can0");
  for (const line of ["ferrodrive group move 1=90deg 2=-4.5deg --relative --velocity 40rpm --acceleration 120rpm/s --within 2500ms", "ferrodrive group move 1=0deg 2=0deg"]) assert.ok(lines.includes(`${line}\n`), line);
  const models = [{ node: 1, model: "m4230e17b50" }, { node: 2, model: "m4230e17b50" }];
  const run = scenario(together, models);
  for (const line of ['    "group move by 1=90deg 2=-4.5deg at 40rpm acceleration 120rpm/s within 2500ms",', '    "group move 1=0deg 2=0deg",']) assert.ok(run.includes(`${line}\n`), line);
  const text = python(together, "can0", models);
  for (const line of [
    '    with network.group([ferrodrive.Axis(1, "m4230e17b50", velocity_rpm=40, acceleration_rpm_s=120), ferrodrive.Axis(2, "m4230e17b50", velocity_rpm=40, acceleration_rpm_s=120)]) as group:',
    '        at = [axis["set_point_deg"] for axis in group.state()["axes"]]',
    "        group.move([at[0] + 90, at[1] + -4.5], within=2.5)",
    "        group.move([0, 0])",
  ]) assert.ok(text.includes(`${line}\n`), line);
  assert.match(python(together, "can0"), /^    # left out: Move together by .*: the model of node 1 is not known$/m);
  const { take } = recorder();
  take(together[0].command);
  assert.deepEqual(take({ do: "stop_all" }), [{ do: "quick_stop", node: 1 }, { do: "quick_stop", node: 2 }]);
  assert.deepEqual(keptSteps([{ after_s: 1, command: { ...together[0].command, axes: [{ node: 1, degrees: 90 }] } }, { after_s: 1, command: { ...together[0].command, axes: [{ node: 1, degrees: 90 }, { node: "2; rm", degrees: 1 }] } }]), []);
});

test("PDOs have the words of the command line, and of a scenario what it has words for", () => {
  const pdos = [{ pdo: "TPDO1", valid: true, objects: [{ object: "6041h:00", bits: 16 }, { object: "6064h:00", bits: 32 }], transmission: 1 }, { pdo: "TPDO2", valid: false }, { pdo: "RPDO3", valid: true, objects: [{ object: "60FFh:00", bits: 32 }], id: 0x404 }, { pdo: "TPDO3", valid: true, event_ms: 10 }];
  const step = { after_s: 0, command: { do: "write_pdos", node: 4, pdos } };
  assert.deepEqual(keptSteps([step]), [step]);
  assert.equal(shownStep(step, 0), "node 4: Configure TPDO1 6041:00,6064:00, transmission 1; TPDO2 off; RPDO3 60FF:00, id 1028; TPDO3 event_ms 10");
  assert.deepEqual(commandLine([step], "can0").split("\n").slice(3, -1), ["ferrodrive pdo apply 4 tpdo1=6041:00,6064:00 --type 1", "ferrodrive pdo apply 4 tpdo2=off", "ferrodrive pdo apply 4 rpdo3=60FF:00 --id 0x404", "# left out: node 4: TPDO3 event_ms 10"]);
  const run = scenario([step], []);
  for (const line of ['    "4 pdo map tpdo 1 6041:00 6064:00 type 1",', "    # left out: node 4: TPDO2 off", "    # left out: node 4: RPDO3 60FF:00, id 1028"]) assert.ok(run.includes(`${line}\n`), line);
  for (const bad of [{ pdo: "TPDO1; rm", valid: true }, { pdo: "TPDO1", valid: true, objects: [{ object: "$(rm)" }] }, { pdo: "TPDO1", valid: true, event_ms: "$(rm)" }]) assert.deepEqual(keptSteps([{ after_s: 0, command: { ...step.command, pdos: [bad] } }]), []);
});

test("of a kept sequence only what its forms can be made of is taken", () => {
  assert.deepEqual(keptSteps(measured), measured);
  const [nmt, write, , capture, test_motion] = measured.map(({ command }) => command);
  const wrong = [
    { ...nmt, command: "start; rm" }, { ...write, values: [] }, { ...write, values: [{ object: "2008h:00", value: "1\nEND" }] }, { ...write, values: [{ object: "$(rm)", value: "1" }] },
    { ...capture, quantities: ["$(rm)"] }, { ...test_motion, motion: { ...motion, shape: "spiral" } }, { do: "write_parameters", node: 4, file: "[values]" },
  ];
  assert.deepEqual(keptSteps(wrong.map((command) => ({ after_s: 1, command }))), []);
});

test("a model that is known is named where an identity may fit several", () => {
  const models = [{ node: 4, model: "zlac8030l" }, { node: 2, model: "zlim42c" }];
  const lines = commandLine(measured, "can0", models).split("\n");
  assert.equal(lines[3], 'ferrodrive() { command ferrodrive --model 4=zlac8030l "$@"; }');
  const text = python(measured, "can0", models);
  for (const line of ['    node_4 = network.drive(4, "zlac8030l")', '    network.params(4, "zlac8030l").apply("node4.toml")']) assert.ok(text.includes(`${line}\n`), line);
});

const tune = { do: "tune", node: 4, bandwidth_hz: null, phase_margin_deg: 45, position: false, speed_rpm: 60, current_a: 8, travel_turns: 20, period_ms: 5, torque_constant_nm_a: null };
const tuned = [
  { after_s: 0, command: tune },
  { after_s: 40, command: { do: "try_gains", node: 4 } },
  { after_s: 20, command: { do: "store", node: 4 } },
  { after_s: 1, command: { ...tune, bandwidth_hz: 20, position: true, speed_rpm: null, torque_constant_nm_a: 0.9 } },
];

test("a tuning has its limits in each form, and its trial as its option", () => {
  assert.deepEqual(keptSteps(tuned), tuned);
  const { take } = recorder();
  assert.deepEqual(tuned.flatMap(({ command }) => take(command)), tuned.map(({ command }) => command));
  assert.equal(shownStep(tuned[0], 0), "node 4: Find gains for a phase margin of 45°; at most 60 r/min, 8 A, 20 turns");
  assert.match(
    commandLine(tuned, "can0"),
    /^ferrodrive tune 4 --phase-margin 45 --speed 60rpm --current 8A --travel 20turn --period 5ms --apply {2}# waits for its end\nsleep 20\nferrodrive save 4\nsleep 1\nferrodrive tune 4 --bandwidth 20 --loop position --current 8A --travel 20turn --period 5ms --torque-constant 0.9 {2}# waits for its end$/m,
  );
  const text = python(tuned, "can0");
  for (const line of ["    node_4.tune(phase_margin=45, speed_rpm=60, current_a=8, travel_turns=20, period=0.005, apply=True)  # waits for its end", "    node_4.tune(bandwidth=20, position=True, current_a=8, travel_turns=20, period=0.005, torque_constant=0.9)  # waits for its end"]) assert.ok(text.includes(`${line}\n`), line);
  assert.match(scenario(tuned, [{ node: 4, model: "zlac8030l" }]), /^ {4}"4 tune phase-margin 45 speed 60rpm current 8A travel 20turn period 5ms apply",\n {4}"wait 20s",\n {4}"4 save",$/m);
});

test("gains that are put back at once were only found, and what stands between is not passed over", () => {
  const [found, tried, stored] = tuned;
  const back = { after_s: 1, command: { do: "roll_back", node: 4 } };
  assert.deepEqual(keptSteps([found, tried, back]), [found, tried, back]);
  assert.match(commandLine([found, tried, back], "can0"), /^ferrodrive tune 4 .* --period 5ms {2}# waits for its end\n$/m);
  assert.match(commandLine([found, tried, back], "can0"), /^(?!.*left out)/s);
  const between = commandLine([found, stored, tried], "can0");
  assert.ok(!between.includes("--apply") && /save 4\nsleep 40\n# left out: node 4: gains/.test(between), between);
  assert.match(python([back], "can0"), /^ {4}# left out: node 4: Back to the former values$/m);
});

test("a trial without its tuning is named, and a tuning without limits is not kept", () => {
  assert.match(commandLine(tuned.slice(1, 2), "can0"), /^# left out: node 4: gains that were found before/m);
  for (const name of ["current_a", "travel_turns", "period_ms"]) assert.deepEqual(keptSteps([{ after_s: 0, command: { ...tune, [name]: null } }]), [], name);
});

const base = { do: "base_jog", wheels: [4, 5], turns: [1, -1], wheel_base_m: 0.4, wheel_radius_m: 0.084, most_m_s: 0.3, m_per_s2: 0.5, linear_m_s: 0.1, angular_rad_s: 0.25 };
const turning = { do: "group_jog", axes: [{ node: 1, rpm: 30 }, { node: 2, rpm: -15 }], rpm_per_s: null };
const held = [
  { after_s: 0, command: base },
  { after_s: 1.5, command: { do: "group_end" } },
  { after_s: 2, command: turning },
  { after_s: 0.7, command: { do: "group_end" } },
];

test("a held motion of several drives is recorded from its begin to its end, however it ends", () => {
  const { take, end } = recorder();
  assert.deepEqual(take({ do: "group_end" }), [], "nothing was held");
  assert.deepEqual([base, { do: "base_twist" }, { do: "group_hold" }, { do: "group_end" }].flatMap(take), [base, { do: "group_end" }]);
  take(turning);
  assert.deepEqual(take({ do: "enable", node: 4 }), [{ do: "enable", node: 4 }], "another drive");
  assert.deepEqual(take({ do: "move", node: 2, degrees: 5, relative: true, rpm: null })[0], { do: "group_end" }, "one of its drives gets another command");
  take(turning);
  assert.deepEqual(take({ do: "stop_all" }).map(({ do: word }) => word), ["group_end", "quick_stop", "quick_stop", "quick_stop", "quick_stop"]);
  assert.deepEqual(end(), []);
  take(turning);
  assert.deepEqual(end(), [{ do: "group_end" }], "the recording ends");
});

test("a held base has its time in each form, with the machine that it takes", () => {
  assert.deepEqual(keptSteps([...held, { after_s: 0, command: { ...base, wheels: [4] } }]), held);
  assert.equal(shownStep(held[0], 0), "nodes 4, 5: Drive the base at 0.1 m/s and 0.25 rad/s");
  assert.equal(shownStep(held[1], 1), "+1.50 s End of the held motion");
  const models = [4, 5].map((node) => ({ node, model: "zlac8030l" }));
  const shell = commandLine(held, "can0", models);
  for (const line of ["wheels = [4, 5]", "turns = [1, -1]", "wheel_m_s = 0.3", "angular_rad_s = 1.5", "ferrodrive drive-base base.toml --linear 0.1 --angular 0.25 --for 1500ms", "sleep 2", "ferrodrive velocity 1 30rpm --for 700ms & node_1=$!\nferrodrive velocity 2 -15rpm --for 700ms & node_2=$!\nwait \"$node_1\"\nwait \"$node_2\"\nferrodrive disable 1\nferrodrive disable 2"]) assert.ok(shell.includes(`${line}\n`), line);
  assert.match(commandLine(held, "can0"), /^# left out: nodes 4, 5: .*the models of its wheels are not known$/m);
  const program = python(held, "can0", models);
  for (const line of ['    with network.base((4, "zlac8030l"), (5, "zlac8030l"), turns=(1, -1), wheel_base_m=0.4, wheel_radius_m=0.084, linear_m_s=0.3, angular_rad_s=1.5, wheel_m_s=0.3, wheel_m_s2=0.5) as base:', "        base.drive(0.1, 0.25, seconds=1.5)", "    node_1.velocity(30, wait=False)\n    node_2.velocity(-15, wait=False)\n    network.sleep(0.7)\n    node_1.stop()\n    node_2.stop()\n    node_1.disable()\n    node_2.disable()"]) assert.ok(program.includes(`${line}\n`), line);
  const run = scenario([...held, { after_s: 1, command: { ...base, wheels: [5, 4] } }], models);
  for (const line of ['    "drive-base linear 0.1 angular 0.25 for 1500ms",', '    "1 velocity 30rpm no-wait",\n    "2 velocity -15rpm no-wait",\n    "wait 700ms",\n    "1 stop",\n    "2 stop",\n    "1 disable",\n    "2 disable",', "base = { wheels = [4, 5], turns = [1, -1], wheel_base_m = 0.4, wheel_radius_m = 0.084, linear_m_s = 0.3, angular_rad_s = 1.5, wheel_m_s = 0.3, wheel_m_s2 = 0.5 }"]) assert.ok(run.includes(`${line}\n`), line);
  assert.match(run, /^ {4}# left out: nodes 5, 4: .*: another base$/m);
  // Something else to one of its drives ends it; what another drive gets meanwhile does not.
  const next = (command) => commandLine([held[0], { after_s: 1, command: { do: "reset_fault", node: 4 } }, { after_s: 1, command }, { after_s: 3, command: { do: "enable", node: 4 } }], "can0", models);
  assert.match(next({ do: "quick_stop", node: 4 }), /--for 2000ms\nferrodrive reset 4\nferrodrive quick-stop 4\nsleep 3\n/);
  assert.match(next({ do: "quick_stop", node: 2 }), /--for 5000ms\n/);
  assert.match(scenario(held, models.slice(1)), /^ {4}# left out: nodes 4, 5: .*the models of its wheels are not known$/m);
  assert.match(commandLine(held, "sim:machine.toml", models), /^export FERRODRIVE_BUS=socketcand\S+ {2}# ferrodrive sim --machine 'machine\.toml' --serve socketcand/m);
});
