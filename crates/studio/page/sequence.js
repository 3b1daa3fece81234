// A sequence of commands, recorded from what a person did: as it is shown, and as the command line, Python and a scenario say it.
// Independent of the page.
//
// A step is `{ after_s, command }`: the time since the step before, and what was sent, which is about one node, or about those of its axes.

import { BY_RAMP, HELD_ROWS, HELD_WHOLE, LEFT_OUT, baseOf, figure, heldNodes, isHeld, ms, withTimes } from "./sequence_held.js";
import { SHAPES } from "./test_motion.js";

/** `2008:00`, as files and command lines write `2008h:00`. */
const objectOf = (object) => object.replace("h:", ":");
/** A file of parameters (docs: `ferrodrive params`) with these values as they were typed. */
const valuesFile = (values) => ["[values]", ...values.map(({ object, value }) => `"${objectOf(object)}" = ${JSON.stringify(value)}`)];
/** The nodes that a command is about. */
export const nodesOf = (command) => (command.do === "group_move" ? command.axes.map(({ node }) => node) : heldNodes(command) ?? [command.node]);
const isOfGroup = (command) => command.do === "group_move" || heldNodes(command) !== null;
/** `1=90deg 2=-45deg` */
const targets = (axes) => axes.map(({ node, degrees }) => `${node}=${figure(degrees)}deg`).join(" ");
const quoted = (text) => `'${text.replaceAll("'", "'\\''")}'`;

/** Quantities that a drive has: what is true of a virtual one is known to the program alone that has its world. */
const measured = (quantities) => quantities.filter((name) => !name.startsWith("true_"));

/** The form of a capture, or why there is none: one that is armed would wait for what only comes behind it. */
function captureUnless(command, form) {
  const why = command.trigger ? "it would wait for what comes behind it" : measured(command.quantities).length ? null : "what is true of a virtual drive is known to the studio alone";
  return why === null ? form(command) : [LEFT_OUT(`node ${command.node}: ${ROWS.capture.shown(command)}: ${why}`)];
}

/** The options of a test motion: of its fields those that its shape has, and its limits where they are given. */
function testMotionOptions({ motion, quantities, capture_ms }) {
  const has = SHAPES.find(({ value }) => value === motion.shape).fields;
  const of = (name, option, form) => (has.includes(name) || !(name in FIELD_OF_SHAPE) ? (motion[name] === null ? [] : [[option, form(motion[name])]]) : []);
  return [
    ...of("by_deg", "by", (value) => `${figure(value)}deg`),
    ...of("speed_rpm", "speed", (value) => `${figure(value)}rpm`),
    ...of("frequency_hz", "frequency", figure),
    ...of("to_frequency_hz", "to-frequency", figure),
    ...of("periods", "periods", figure),
    ...of("time_s", "time", (value) => ms(value * 1e3)),
    ["count", figure(motion.count)],
    ...of("velocity_rpm", "velocity", (value) => `${figure(value)}rpm`),
    ...of("acceleration_rpm_s", "acceleration", (value) => `${figure(value)}rpm/s`),
    ...of("travel_turns", "travel", figure),
    ...of("following_error_deg", "following-error", (value) => `${figure(value)}deg`),
    ...of("period_ms", "period", ms),
    ...(measured(quantities).length ? [["capture", measured(quantities).join()]] : []),
    ...(capture_ms === null ? [] : [["rate", ms(capture_ms)]]),
  ];
}
/** Fields that only some shapes have. */
const FIELD_OF_SHAPE = { by_deg: 0, speed_rpm: 0, frequency_hz: 0, to_frequency_hz: 0, periods: 0, time_s: 0 };

/** The same as arguments in Python, whose units are in the names. */
function testMotionArguments({ motion, quantities, capture_ms }) {
  const has = SHAPES.find(({ value }) => value === motion.shape).fields;
  const of = (name, argument, form = figure) => (has.includes(name) || !(name in FIELD_OF_SHAPE) ? (motion[name] === null ? [] : [`${argument}=${form(motion[name])}`]) : []);
  return [
    JSON.stringify(motion.shape),
    ...measured(quantities).map((name) => JSON.stringify(name)),
    ...of("by_deg", "by"),
    ...of("speed_rpm", "speed_rpm"),
    ...of("frequency_hz", "frequency"),
    ...of("to_frequency_hz", "to_frequency"),
    ...of("periods", "periods"),
    ...of("time_s", "time"),
    ...(motion.path.length ? [`path=[${motion.path.map(([at, deg]) => `(${figure(at)}, ${figure(deg)})`).join(", ")}]`] : []),
    `count=${figure(motion.count)}`,
    ...of("velocity_rpm", "velocity_rpm"),
    ...of("acceleration_rpm_s", "acceleration_rpm_s"),
    ...of("travel_turns", "travel_turns"),
    ...of("following_error_deg", "following_error"),
    ...of("period_ms", "period", (value) => figure(value / 1e3)),
    ...(capture_ms === null ? [] : [`capture_period=${figure(capture_ms / 1e3)}`]),
  ].join(", ");
}

/** What a tuning is asked for: each as it is written for the command line and for Python, where it is given. */
function tuneOptions({ bandwidth_hz, phase_margin_deg, position, speed_rpm, current_a, travel_turns, period_ms, torque_constant_nm_a, applied }) {
  return [
    bandwidth_hz === null ? { option: `phase-margin ${figure(phase_margin_deg)}`, argument: `phase_margin=${figure(phase_margin_deg)}` } : { option: `bandwidth ${figure(bandwidth_hz)}`, argument: `bandwidth=${figure(bandwidth_hz)}` },
    position ? { option: "loop position", argument: "position=True" } : null,
    speed_rpm === null ? null : { option: `speed ${figure(speed_rpm)}rpm`, argument: `speed_rpm=${figure(speed_rpm)}` },
    { option: `current ${figure(current_a)}A`, argument: `current_a=${figure(current_a)}` },
    { option: `travel ${figure(travel_turns)}turn`, argument: `travel_turns=${figure(travel_turns)}` },
    { option: `period ${ms(period_ms)}`, argument: `period=${figure(period_ms / 1e3)}` },
    torque_constant_nm_a === null ? null : { option: `torque-constant ${figure(torque_constant_nm_a)}`, argument: `torque_constant=${figure(torque_constant_nm_a)}` },
    applied ? { option: "apply", argument: "apply=True" } : null,
  ].filter((one) => one !== null);
}

/** Of what a PDO is to have, which the page sends as far as it changes: `TPDO1 = 6041:00,6064:00, event_ms 10`. */
const shownPdo = ({ pdo, valid, objects, ...rest }) => `${pdo} ${[...(valid ? [] : ["off"]), ...(objects ? [objects.map(({ object }) => objectOf(object)).join()] : []), ...Object.entries(rest).map(([name, value]) => `${name} ${value}`)].join(", ") || "on"}`;

/** The command line names the objects of a PDO with all else. */
function pdoCommand(node, one) {
  const { pdo, valid, objects, id } = one;
  if (!valid) return `ferrodrive pdo apply ${node} ${pdo.toLowerCase()}=off`;
  if (!objects) return LEFT_OUT(`node ${node}: ${shownPdo(one)}`);
  const option = (name, value, form) => (value === undefined ? "" : ` --${name} ${form(value)}`);
  return `ferrodrive pdo apply ${node} ${pdo.toLowerCase()}=${objects.map(({ object }) => objectOf(object)).join()}${option("type", one.transmission, figure)}${option("inhibit", one.inhibit_ms, ms)}${option("event", one.event_ms, ms)}${option("id", id, (value) => `0x${value.toString(16)}`)}`;
}

/** A scenario has a mapping and a transmission type for it. */
function pdoLine(node, one) {
  const { pdo, valid, objects, transmission, ...rest } = one;
  if (!valid || !objects || Object.keys(rest).length > 0) return LEFT_OUT(`node ${node}: ${shownPdo(one)}`);
  return `pdo map ${pdo.slice(0, 4).toLowerCase()} ${pdo.slice(4)} ${objects.map(({ object }) => objectOf(object)).join(" ")}${transmission === undefined ? "" : ` type ${figure(transmission)}`}`;
}

/**
 * The forms of each command that is recorded; `shown` for people. `line` is of a scenario, without the node; `cli` of the command line;
 * `python` of a drive, or in lines of its own, with the models of nodes as it writes them. One that begins with `#` is a line for people,
 * and one of several lines is a list.
 */
const ROWS = {
  enable: { shown: () => "Enable", line: () => "enable", cli: ({ node }) => `enable ${node}`, python: () => "enable()" },
  disable: { shown: () => "Disable", line: () => "disable", cli: ({ node }) => `disable ${node}`, python: () => "disable()" },
  reset_fault: { shown: () => "Reset fault", line: () => "reset", cli: ({ node }) => `reset ${node}`, python: () => "reset_fault()" },
  stop: { shown: () => "Stop (ramp)", line: () => "stop", cli: ({ node }) => `stop ${node}`, python: () => "stop()" },
  quick_stop: { shown: () => "Quick stop", line: () => "quick-stop", cli: ({ node }) => `quick-stop ${node}`, python: () => "quick_stop()" },
  velocity: {
    shown: ({ rpm }) => `Turn at ${figure(rpm)} r/min`,
    // As the studio does: a drive that watches its host is kept content while it turns, and stops when the program is gone.
    line: ({ rpm, rpm_per_s: ramp }) => ["guard", `velocity ${figure(rpm)}rpm${BY_RAMP.line(ramp)} no-wait`],
    cli: ({ node, rpm, rpm_per_s: ramp, for_s }) => `velocity ${node} ${figure(rpm)}rpm${BY_RAMP.cli(ramp)} ${for_s ? `--for ${ms(for_s * 1e3)}` : "--no-wait"}`,
    python: ({ node, rpm, rpm_per_s: ramp }) => [`node_${node}.guard()`, `node_${node}.velocity(${figure(rpm)}${BY_RAMP.python(ramp)}, wait=False)`],
  },
  move: {
    shown: ({ degrees, relative }) => `Move ${relative ? "by" : "to"} ${figure(degrees)}°`,
    line: ({ degrees, relative, rpm }) => `move ${relative ? "by " : ""}${figure(degrees)}deg${rpm ? ` at ${figure(rpm)}rpm` : ""} no-wait`,
    cli: ({ node, degrees, relative, rpm }) => `move ${node} ${figure(degrees)}deg${relative ? " --relative" : ""}${rpm ? ` --profile-velocity ${figure(rpm)}rpm` : ""} --no-wait`,
    python: ({ degrees, relative, rpm }) => `move(${figure(degrees)}${relative ? ", relative=True" : ""}${rpm ? `, speed_rpm=${figure(rpm)}` : ""}, wait=False)`,
  },
  torque: { shown: ({ amperes }) => `Push with ${figure(amperes)} A`, line: ({ amperes }) => `torque ${figure(amperes)}A`, cli: ({ node, amperes }) => `torque ${node} ${figure(amperes)}A`, python: ({ amperes }) => `torque(${figure(amperes)})` },
  home: {
    shown: ({ method }) => `Home by method ${method}`,
    line: ({ method, rpm }) => `home ${figure(method)}${rpm ? ` at ${figure(rpm)}rpm` : ""}`,
    cli: ({ node, method, rpm }) => `home ${node} --method ${figure(method)}${rpm ? ` --profile-velocity ${figure(rpm)}rpm` : ""}`,
    python: ({ method, rpm }) => `home(${figure(method)}${rpm ? `, speed_rpm=${figure(rpm)}` : ""})`,
  },
  group_move: {
    shown: ({ axes, relative, within_s }) => `Move together ${relative ? "by" : "to"} ${axes.map(({ degrees }) => `${figure(degrees)}°`).join(", ")}${within_s ? ` within ${figure(within_s)} s` : ""}`,
    line: ({ axes, relative, rpm, rpm_per_s: ramp, within_s }) => `group move ${relative ? "by " : ""}${targets(axes)}${rpm ? ` at ${figure(rpm)}rpm` : ""}${ramp ? ` acceleration ${figure(ramp)}rpm/s` : ""}${within_s ? ` within ${ms(within_s * 1e3)}` : ""}`,
    cli: ({ axes, relative, rpm, rpm_per_s: ramp, within_s }) => `group move ${targets(axes)}${relative ? " --relative" : ""}${rpm ? ` --velocity ${figure(rpm)}rpm` : ""}${ramp ? ` --acceleration ${figure(ramp)}rpm/s` : ""}${within_s ? ` --within ${ms(within_s * 1e3)}` : ""}`,
    python: groupInPython,
  },
  ...HELD_ROWS,
  write_pdos: {
    shown: ({ pdos }) => `Configure ${pdos.map(shownPdo).join("; ")}`,
    line: ({ node, pdos }) => pdos.map((one) => pdoLine(node, one)),
    cli: ({ node, pdos }) => pdos.map((one) => pdoCommand(node, one)),
    python: (command) => [LEFT_OUT(`node ${command.node}: ${ROWS.write_pdos.shown(command)}`)],
  },
  nmt: { shown: ({ command }) => `NMT ${command}`, line: ({ command }) => `nmt ${command}`, cli: ({ node, command }) => `nmt ${node} ${command}`, python: ({ node, command }) => [`network.nmt(${JSON.stringify(command)}, ${node})`] },
  store: { shown: () => "Store the parameters", line: () => "save", cli: ({ node }) => `save ${node}`, python: () => "save()" },
  write_parameters: {
    shown: ({ values }) => `Write ${values.map(({ object, value }) => `${object} = ${value}`).join(", ")}`,
    line: ({ values }) => values.map(({ object, value }) => `write ${objectOf(object)} ${value}`),
    cli: ({ node, values }) => [`cat > node${node}.toml <<'END'`, ...valuesFile(values), "END", `ferrodrive params apply ${node} node${node}.toml`],
    python: ({ node, values }, models) => [`with open("node${node}.toml", "w") as file:`, `    file.write(${JSON.stringify(`${valuesFile(values).join("\n")}\n`)})`, `network.params(${node}${namedModel(node, models)}).apply("node${node}.toml")`],
  },
  capture: {
    shown: ({ quantities, period_ms, duration_ms, trigger }) => `Capture ${quantities.join(", ")} every ${ms(period_ms)} for ${figure(duration_ms / 1e3)} s${trigger ? ` from ${trigger}` : ""}`,
    line: (command) => captureUnless(command, ({ quantities, period_ms, duration_ms, take = [], sdo }) => `capture ${measured(quantities).join(" ")} rate ${ms(period_ms)}${take.map((pdo) => ` take ${pdo}`).join("")}${sdo ? " sdo" : ""} for ${ms(duration_ms)}`),
    // One that is armed waits beside what comes behind it.
    cli: (command) =>
      captureUnless({ ...command, trigger: null }, () => {
        const { node, quantities, period_ms, duration_ms, trigger, pre_ms, take = [], sdo } = command;
        return `capture ${node} ${measured(quantities).join(" ")} --for ${ms(duration_ms)} --rate ${ms(period_ms)}${trigger ? ` --trigger ${quoted(trigger)}${pre_ms ? ` --pre ${ms(pre_ms)}` : ""}` : ""}${take.map((pdo) => ` --take ${pdo}`).join("")}${sdo ? " --sdo" : ""} -o node${node}.mcap${trigger ? " &" : "  # waits for its end"}`;
      }),
    python: (command) => captureUnless(command, ({ quantities, period_ms, duration_ms, take = [], sdo }) => `capture(${measured(quantities).map((name) => JSON.stringify(name)).join(", ")}, duration=${figure(duration_ms / 1e3)}, period=${figure(period_ms / 1e3)}${take.length ? `, take=${JSON.stringify(take)}` : ""}${sdo ? ", sdo=True" : ""})  # waits for its end`),
  },
  test_motion: {
    shown: ({ motion }) => `Test motion ${motion.shape}, ${motion.count} ${motion.count === 1 ? "run" : "runs"}`,
    line: ({ node, ...order }) => (order.motion.shape === "path" ? LEFT_OUT(`node ${node}: a test motion along a path of ${order.motion.path.length} points`) : `test-motion ${order.motion.shape} ${testMotionOptions(/** @type {any} */ (order)).flat().join(" ")}`),
    cli: ({ node, ...order }) => {
      const options = testMotionOptions(/** @type {any} */ (order)).map(([name, value]) => ` --${name} ${value}`).join("");
      if (order.motion.shape !== "path") return `test-motion ${node} ${order.motion.shape}${options}`;
      const points = order.motion.path.map(([at_s, deg]) => `${figure(at_s)},${figure(deg)},`);
      return [`cat > path${node}.csv <<'END'`, `t_s,${node}.position_deg,mark`, ...points, "END", `ferrodrive test-motion ${node} path --path path${node}.csv${options}`];
    },
    python: (order) => `test_motion(${testMotionArguments(order)})`,
  },
  tune: {
    shown: ({ bandwidth_hz, phase_margin_deg, position, speed_rpm, current_a, travel_turns }) => `Find gains for ${bandwidth_hz === null ? `a phase margin of ${figure(phase_margin_deg)}°` : `a bandwidth of ${figure(bandwidth_hz)} Hz`}${position ? ", position too" : ""}; at most ${speed_rpm === null ? "its usual speed" : `${figure(speed_rpm)} r/min`}, ${figure(current_a)} A, ${figure(travel_turns)} turns`,
    line: (command) => `tune ${tuneOptions(command).map(({ option }) => option).join(" ")}`,
    cli: (command) => `tune ${command.node} ${tuneOptions(command).map(({ option }) => `--${option}`).join(" ")}  # waits for its end`,
    python: (command) => `tune(${tuneOptions(command).map(({ argument }) => argument).join(", ")})  # waits for its end`,
  },
  try_gains: {
    shown: () => "Try the gains that were found last",
    line: (command) => LEFT_OUT(`node ${command.node}: ${ROWS.try_gains.shown()}`),
    cli: ({ node }) => [LEFT_OUT(`node ${node}: gains that were found before this sequence are tried`)],
    python: ({ node }) => [LEFT_OUT(`node ${node}: gains that were found before this sequence are tried`)],
  },
  roll_back: {
    shown: () => "Back to the former values",
    line: (command) => LEFT_OUT(`node ${command.node}: ${ROWS.roll_back.shown()}`),
    cli: ({ node }) => [LEFT_OUT(`node ${node}: ${ROWS.roll_back.shown()}`)],
    python: ({ node }) => [LEFT_OUT(`node ${node}: ${ROWS.roll_back.shown()}`)],
  },
};

/** The model of a node as a further argument, if it is known. */
const namedModel = (node, models) => (models.has(node) ? `, ${models.get(node)}` : "");

/** A move of several drives in Python, whose group has to know their models. */
function groupInPython(command, models) {
  const { axes, relative, rpm, rpm_per_s: ramp, within_s } = command;
  const unknown = axes.find(({ node }) => !models.has(node));
  if (unknown) return [LEFT_OUT(`${ROWS.group_move.shown(command)}: the model of node ${unknown.node} is not known`)];
  const own = axes.map(({ node }) => `ferrodrive.Axis(${node}, ${models.get(node)}${rpm ? `, velocity_rpm=${figure(rpm)}` : ""}${ramp ? `, acceleration_rpm_s=${figure(ramp)}` : ""})`);
  const to = axes.map(({ degrees }, at) => (relative ? `at[${at}] + ${figure(degrees)}` : figure(degrees)));
  return [
    `with network.group([${own.join(", ")}]) as group:`,
    ...(relative ? ['    at = [axis["set_point_deg"] for axis in group.state()["axes"]]'] : []),
    `    group.move([${to.join(", ")}]${within_s ? `, within=${figure(within_s)}` : ""})`,
  ];
}

/** What a command has to have so that its forms can be made of it; parameters of a file are not recorded. */
const WHOLE = {
  nmt: ({ command }) => typeof command === "string" && /^[a-z-]+$/.test(command),
  write_parameters: ({ values }) => Array.isArray(values) && values.length > 0 && values.every((one) => isObject(one?.object) && typeof one.value === "string" && !/[\n\r]/.test(one.value)),
  group_move: ({ axes }) => Array.isArray(axes) && axes.length > 1 && axes.every((axis) => Number.isInteger(axis?.node) && typeof axis.degrees === "number"),
  ...HELD_WHOLE,
  write_pdos: ({ pdos }) => Array.isArray(pdos) && pdos.length > 0 && pdos.every(isPdo),
  capture: ({ quantities, trigger, take = [] }) => isNames(quantities) && isNames(take) && (trigger === null || typeof trigger === "string"),
  tune: (command) => typeof command.position === "boolean" && TUNE_FIGURES.every((name) => isFigure(command[name])) && TUNE_CHOICES.every((name) => command[name] === null || isFigure(command[name])),
  test_motion: ({ motion, quantities }) => isNames(quantities) && SHAPES.some(({ value }) => value === motion?.shape) && Array.isArray(motion.path),
};
const TUNE_FIGURES = ["phase_margin_deg", "current_a", "travel_turns", "period_ms"];
const TUNE_CHOICES = ["bandwidth_hz", "speed_rpm", "torque_constant_nm_a"];
const isFigure = (value) => Number.isFinite(value);
const isObject = (object) => typeof object === "string" && /^[0-9A-F]{4}h:[0-9A-F]{2}$/.test(object);
const isPdo = (one) => typeof one === "object" && one !== null && isWholePdo(one);
const isWholePdo = ({ pdo, valid, objects, ...rest }) => /^[RT]PDO[0-9]+$/.test(pdo) && typeof valid === "boolean" && (objects === undefined || (Array.isArray(objects) && objects.every((entry) => isObject(entry?.object)))) && Object.entries(rest).every(([name, value]) => /^[a-z_]+$/.test(name) && typeof value === "number");
const isNames = (names) => Array.isArray(names) && names.every((name) => typeof name === "string" && /^[\w.:]+$/.test(name));

/** Whether a command is one that a sequence has. */
export const isRecorded = (command) => Object.hasOwn(ROWS, command.do) && (!Object.hasOwn(WHOLE, command.do) || WHOLE[command.do](command));

/** Commands that leave the motion of a drive as it is, a jog too. */
const LEAVE_MOTION = ["enable", "reset_fault", "capture", "store", "nmt", "write_pdos"];

/**
 * What is kept of commands that are sent: `take(command)` and `end()` give lists of commands. A jog is a turn that ends with a stop,
 * at the latest when the recording ends, as a held motion of several drives has its own end. Stop is a quick stop of each recorded node.
 */
export function recorder() {
  const [nodes, jogs] = [new Set(), new Set()];
  /** The nodes of a held motion of several drives that has not ended. */
  let held = null;
  const endHeld = () => {
    const was = held;
    held = null;
    return was === null ? [] : [{ do: "group_end" }];
  };
  const end = () => {
    const open = [...jogs];
    jogs.clear();
    return [...open.map((node) => ({ do: "stop", node })), ...endHeld()];
  };
  function take(command) {
    const { do: word, node } = command;
    if (word === "stop_all") {
      jogs.clear();
      return [...endHeld(), ...[...nodes].map((node) => ({ do: "quick_stop", node }))];
    }
    if (word === "jog_end") return jogs.delete(node) ? [{ do: "stop", node }] : [];
    if (word === "group_end") return endHeld();
    if (word !== "jog" && !isRecorded(command)) return [];
    const about = nodesOf(command);
    for (const one of about) nodes.add(one);
    // It has ended by itself, or this ends it.
    const before = !LEAVE_MOTION.includes(word) && held?.some((one) => about.includes(one)) ? endHeld() : [];
    if (word === "jog") {
      jogs.add(node);
      return [...before, { do: "velocity", node, rpm: command.rpm, rpm_per_s: null }];
    }
    if (!LEAVE_MOTION.includes(word)) for (const one of about) jogs.delete(one);
    if (isHeld(command)) held = about;
    return [...before, { ...command }];
  }
  return { take, end };
}

/** Shorter pauses are the time that a press takes. */
const SHORTEST_S = 0.05;
const rounded = (after_s) => Math.round(after_s * 100) / 100;
const pauseOf = ({ after_s }, at) => (at > 0 && after_s >= SHORTEST_S ? rounded(after_s) : null);

/** Steps that the browser has kept; what another version or a person wrote there, and is not a step, is left out. */
export const keptSteps = (steps) =>
  (Array.isArray(steps) ? steps : []).filter((step) => step && typeof step.after_s === "number" && step.command && isRecorded(step.command) && nodesOf(step.command).every(Number.isInteger));

/** A line for people: `+1.50 s  node 4: Turn at 60 r/min`. */
export const shownStep = ({ after_s, command }, at) => `${at > 0 ? `+${after_s.toFixed(2)} s ` : ""}${nodesOf(command).length ? `${isOfGroup(command) ? "nodes" : "node"} ${nodesOf(command).join(", ")}: ` : ""}${ROWS[command.do].shown(command)}`;

/** The models of the nodes that steps are about, as far as they have a name: an identity may fit several. */
function modelsOf(steps, models) {
  const nodes = new Set(steps.flatMap(({ command }) => nodesOf(command)));
  return models.filter(({ node, model }) => nodes.has(node) && /^[a-z0-9-]+$/.test(model));
}

/** Commands whose answer the next one may need: a play goes on behind it. */
export const isAwaited = ({ do: word }) => word === "tune" || word === "try_gains";

/** Where a program has one command for gains that are found and tried: the trial is an option of the tuning. */
function withTrials(steps) {
  const tuningOf = new Map();
  const said = [];
  for (const step of steps) {
    const { do: word, node } = step.command;
    const tuning = tuningOf.get(node);
    const { applied = false } = said[tuning]?.command ?? {};
    // Gains that are put back at once were only found.
    if (tuning !== undefined && word === (applied ? "roll_back" : "try_gains")) {
      said[tuning] = { ...said[tuning], command: { ...said[tuning].command, applied: !applied } };
      continue;
    }
    for (const one of nodesOf(step.command)) tuningOf.delete(one);
    if (word === "tune") tuningOf.set(node, said.length);
    said.push(step);
  }
  return said;
}

/** A capture that a program waits for takes its time from the pause behind it. */
const withoutWaits = (steps) =>
  steps.map((step, at) => {
    const { do: word, duration_ms } = steps[at - 1]?.command ?? {};
    return word === "capture" && !steps[at - 1].command.trigger ? { ...step, after_s: Math.max(0, step.after_s - duration_ms / 1e3) } : step;
  });

/** As programs say it: where one command is several of a page. */
const asSaid = (steps) => withTimes(withoutWaits(withTrials(steps)), isReplaced);

/** In a shell each command is a program of its own, and a drive that watches it stops when it is gone: it turns until the stop that follows. */
function withTurns(steps) {
  const said = steps.map((step) => ({ ...step }));
  said.forEach((step, at) => {
    const next = said[at + 1];
    const ends = next && ["stop", "quick_stop"].includes(next.command.do) && next.command.node === step.command.node;
    if (step.command.do !== "velocity" || !ends || next.after_s < SHORTEST_S) return;
    step.command = { ...step.command, for_s: rounded(next.after_s) };
    next.after_s = 0;
  });
  return said;
}

/** What a scenario may take at most: the pauses, and far more than each command. */
const AT_MOST_S = { tune: 200, test_motion: 200, capture: 10, home: 60 };
const limitOf = (steps) => Math.ceil(60 + steps.reduce((sum, { after_s, command: { do: word, motion, duration_ms = 0, held_s = 0 } }) => sum + after_s + held_s + duration_ms / 1e3 + (AT_MOST_S[word] ?? 10) * (motion?.count ?? 1), 0));
/** Another command to one of its drives ends a held motion. */
const isReplaced = (held, command) => !LEAVE_MOTION.includes(command.do) && !isHeld(command) && nodesOf(command).some((node) => nodesOf(held).includes(node));

/** A virtual bus begins and ends with each command: a program needs one that stays. */
const isVirtual = (bus) => /^sim(:|$)/.test(bus);

/** As commands of a shell; `bus` as the studio has it, `models` is the model of each node. */
export function commandLine(steps, bus, models = []) {
  const named = new Map(modelsOf(steps, models).map(({ node, model }) => [node, model]));
  const lines = withTurns(asSaid(steps)).flatMap((step, at) => {
    const pause = pauseOf(step, at);
    const said = ROWS[step.command.do].cli(step.command, named);
    return [...(pause === null ? [] : [`sleep ${pause}`]), ...(Array.isArray(said) ? said : [`ferrodrive ${said}`])];
  });
  // One that is served by ferrodrive sim.
  const export_ = isVirtual(bus) ? `export FERRODRIVE_BUS=socketcand://127.0.0.1:29536/can0  # ferrodrive sim${bus === "sim" ? "" : ` --machine ${quoted(bus.slice("sim:".length))}`} --serve socketcand://127.0.0.1:29536` : `export FERRODRIVE_BUS='${bus}'`;
  const known = [...named].map(([node, model]) => ` --model ${node}=${model}`);
  const own = known.length ? [`ferrodrive() { command ferrodrive${known.join("")} "$@"; }`] : [];
  const waits = lines.some((line) => line.endsWith(" &")) ? ["wait"] : [];
  return ["#!/bin/sh", "set -e", export_, ...own, ...lines, ...waits, ""].join("\n");
}

/** As a program in Python. */
export function python(steps, bus, models = []) {
  const known = new Map(modelsOf(steps, models).map(({ node, model }) => [node, JSON.stringify(model)]));
  const nodes = [...new Set(steps.flatMap(({ command }) => nodesOf(command)))];
  const lines = asSaid(steps).flatMap((step, at) => {
    const pause = pauseOf(step, at);
    const said = ROWS[step.command.do].python(step.command, known);
    const own = Array.isArray(said) ? said : [`node_${step.command.node}.${said}`];
    return [...(pause === null ? [] : [`network.sleep(${pause})`]), ...own].map((text) => `    ${text}`);
  });
  const on = isVirtual(bus) ? "socketcand://127.0.0.1:29536/can0" : bus;
  return ["import ferrodrive", "", `with ferrodrive.Network("${on}") as network:`, ...nodes.map((node) => `    network.wait_for(${node})\n    node_${node} = network.drive(${node}${namedModel(node, known)})`), ...lines, ""].join("\n");
}

/** As a scenario for `ferrodrive run`; `models` is the model of each node, of which all that are known are in its machine. */
export function scenario(steps, models) {
  const drives = models.map(({ node, model }) => `    { model = "${model}", node = ${node} },`);
  const known = new Set(models.map(({ node }) => node));
  const isKnown = (command) => nodesOf(command).every((node) => known.has(node));
  const bases = [...new Set(steps.filter(({ command }) => command.do === "base_jog" && isKnown(command)).map(({ command }) => baseOf(command)))];
  const lines = asSaid(steps).flatMap((step, at) => {
    const pause = pauseOf(step, at);
    // Its machine has one base.
    const { command } = step;
    const isOther = command.do === "base_jog" && baseOf(command) !== bases[0];
    const said = isOther ? [LEFT_OUT(`nodes ${nodesOf(command).join(", ")}: ${ROWS.base_jog.shown(command)}: ${isKnown(command) ? "another base" : "the models of its wheels are not known"}`)] : [ROWS[command.do].line(command)].flat();
    const own = said.map((text) => (text.startsWith("#") ? `    ${text}` : `    ${JSON.stringify(isOfGroup(step.command) ? text : `${step.command.node} ${text}`)},`));
    return [...(pause === null ? [] : [`    "wait ${pause}s",`]), ...own];
  });
  return ['title = "Recorded in the studio"', `limit = "${limitOf(asSaid(steps))}s"`, "", "[machine]", "drive = [", ...drives, "]", ...bases.slice(0, 1).map((base) => `base = { ${base} }`), "", "[[host]]", "do = [", ...lines, "]", ""].join("\n");
}
