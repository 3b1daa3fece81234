// A sequence of commands, recorded from what a person did: as it is shown, and as the command line, Python and a scenario say it.
// Independent of the page.
//
// A step is `{ after_s, command }`: the time since the step before, and what was sent.

/** `60 r/min` and the like as they are written: at most six significant digits, no exponent. */
const figure = (value) => String(Number(Number(value).toPrecision(6)));

/** The forms of each command that is recorded; `shown` for people. */
const ROWS = {
  enable: { shown: () => "Enable", line: () => "enable", cli: ({ node }) => `enable ${node}`, python: () => "enable()" },
  disable: { shown: () => "Disable", line: () => "disable", cli: ({ node }) => `disable ${node}`, python: () => "disable()" },
  reset_fault: { shown: () => "Reset fault", line: () => "reset", cli: ({ node }) => `reset ${node}`, python: () => "reset_fault()" },
  stop: { shown: () => "Stop (ramp)", line: () => "stop", cli: ({ node }) => `stop ${node}`, python: () => "stop()" },
  quick_stop: { shown: () => "Quick stop", line: () => "quick-stop", cli: ({ node }) => `quick-stop ${node}`, python: () => "quick_stop()" },
  velocity: {
    shown: ({ rpm }) => `Turn at ${figure(rpm)} r/min`,
    line: ({ rpm, rpm_per_s: ramp }) => `velocity ${figure(rpm)}rpm${ramp ? ` acceleration ${figure(ramp)}rpm/s deceleration ${figure(ramp)}rpm/s` : ""} no-wait`,
    cli: ({ node, rpm, rpm_per_s: ramp }) => `velocity ${node} ${figure(rpm)}rpm${ramp ? ` --acceleration ${figure(ramp)}rpm/s --deceleration ${figure(ramp)}rpm/s` : ""} --no-wait`,
    python: ({ rpm, rpm_per_s: ramp }) => `velocity(${figure(rpm)}${ramp ? `, acceleration_rpm_s=${figure(ramp)}, deceleration_rpm_s=${figure(ramp)}` : ""}, wait=False)`,
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
};

/** Whether a command is one that a sequence has. */
export const isRecorded = ({ do: word }) => Object.hasOwn(ROWS, word);

/** Commands that leave the motion of a drive as it is, a jog too. */
const LEAVE_MOTION = ["enable", "reset_fault"];

/**
 * What is kept of commands that are sent: `take(command)` and `end()` give lists of commands. A jog is a turn that ends with a stop,
 * at the latest when the recording ends. Stop is a quick stop of each recorded node.
 */
export function recorder() {
  const [nodes, jogs] = [new Set(), new Set()];
  const end = () => {
    const open = [...jogs];
    jogs.clear();
    return open.map((node) => ({ do: "stop", node }));
  };
  function take(command) {
    const { do: word, node } = command;
    if (word === "stop_all") {
      jogs.clear();
      return [...nodes].map((node) => ({ do: "quick_stop", node }));
    }
    if (word === "jog_end") return jogs.delete(node) ? [{ do: "stop", node }] : [];
    if (word !== "jog" && !isRecorded(command)) return [];
    nodes.add(node);
    if (word === "jog") {
      jogs.add(node);
      return [{ do: "velocity", node, rpm: command.rpm, rpm_per_s: null }];
    }
    if (!LEAVE_MOTION.includes(word)) jogs.delete(node);
    return [{ ...command }];
  }
  return { take, end };
}

/** Shorter pauses are the time that a press takes. */
const SHORTEST_S = 0.05;
const rounded = (after_s) => Math.round(after_s * 100) / 100;
const pauseOf = ({ after_s }, at) => (at > 0 && after_s >= SHORTEST_S ? rounded(after_s) : null);

/** Steps that the browser has kept; what another version or a person wrote there, and is not a step, is left out. */
export const keptSteps = (steps) =>
  (Array.isArray(steps) ? steps : []).filter((step) => step && typeof step.after_s === "number" && step.command && isRecorded(step.command) && Number.isInteger(step.command.node));

/** A line for people: `+1.50 s  node 4: Turn at 60 r/min`. */
export const shownStep = ({ after_s, command }, at) => `${at > 0 ? `+${after_s.toFixed(2)} s ` : ""}node ${command.node}: ${ROWS[command.do].shown(command)}`;

/** As commands of a shell; `bus` as the studio has it. */
export function commandLine(steps, bus) {
  const lines = steps.flatMap((step, at) => {
    const pause = pauseOf(step, at);
    return [...(pause === null ? [] : [`sleep ${pause}`]), `ferrodrive ${ROWS[step.command.do].cli(step.command)}`];
  });
  // A virtual bus begins and ends with each command: there it has to be one that stays, served by ferrodrive sim.
  const export_ = bus === "sim" ? "export FERRODRIVE_BUS=socketcand://127.0.0.1:29536/can0  # ferrodrive sim --serve socketcand://127.0.0.1:29536" : `export FERRODRIVE_BUS='${bus}'`;
  return ["#!/bin/sh", "set -e", export_, ...lines, ""].join("\n");
}

/** As a program in Python. */
export function python(steps, bus) {
  const nodes = [...new Set(steps.map(({ command }) => command.node))];
  const lines = steps.flatMap((step, at) => {
    const pause = pauseOf(step, at);
    return [...(pause === null ? [] : [`    network.sleep(${pause})`]), `    node_${step.command.node}.${ROWS[step.command.do].python(step.command)}`];
  });
  const on = bus === "sim" ? "socketcand://127.0.0.1:29536/can0" : bus;
  return ["import ferrodrive", "", `with ferrodrive.Network("${on}") as network:`, ...nodes.map((node) => `    network.wait_for(${node})\n    node_${node} = network.drive(${node})`), ...lines, ""].join("\n");
}

/** As a scenario for `ferrodrive run`; `models` is the model of each node, of which all that are known are in its machine. */
export function scenario(steps, models) {
  const drives = models.map(({ node, model }) => `    { model = "${model}", node = ${node} },`);
  const lines = steps.flatMap((step, at) => {
    const pause = pauseOf(step, at);
    return [...(pause === null ? [] : [`    "wait ${pause}s",`]), `    "${step.command.node} ${ROWS[step.command.do].line(step.command)}",`];
  });
  return ['title = "Recorded in the studio"', "", "[machine]", "drive = [", ...drives, "]", "", "[[host]]", "do = [", ...lines, "]", ""].join("\n");
}
