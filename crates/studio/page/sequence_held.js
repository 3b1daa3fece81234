// Held motions of several drives in a sequence: they go on until `group_end`, and while they are played the page holds them. A program says
// how long instead. Independent of the page.

/** `60 r/min` and the like as they are written: at most six significant digits, no exponent. */
export const figure = (value) => String(Number(Number(value).toPrecision(6)));
export const ms = (value) => `${figure(value)}ms`;
/** Where a form has no word for a command, it has a line for people. */
export const LEFT_OUT = (what) => `# left out: ${what}`;

/** A speed that is reached and left by a ramp of its own, in each form; nothing without one. */
export const BY_RAMP = {
  line: (ramp) => (ramp ? ` acceleration ${figure(ramp)}rpm/s deceleration ${figure(ramp)}rpm/s` : ""),
  cli: (ramp) => (ramp ? ` --acceleration ${figure(ramp)}rpm/s --deceleration ${figure(ramp)}rpm/s` : ""),
  python: (ramp) => (ramp ? `, acceleration_rpm_s=${figure(ramp)}, deceleration_rpm_s=${figure(ramp)}` : ""),
};

/** Whether the page has to hold it. */
export const isHeld = ({ do: word }) => word === "group_jog" || word === "base_jog";

/** The nodes of a held motion, and of its end none; null of any other command. */
export const heldNodes = ({ do: word, axes, wheels }) => ({ group_jog: () => axes.map(({ node }) => node), base_jog: () => wheels, group_end: () => [] })[word]?.() ?? null;

/** Steps with `held_s` in each held motion in place of its end, or of a command for which `ends(held, command)` is true. */
export function withTimes(steps, ends) {
  const said = [];
  let held = null;
  for (const { after_s, command } of steps) {
    if (held) held.held_s += after_s;
    if (command.do === "group_end") {
      held = null;
      continue;
    }
    if (held && ends(held, command)) {
      // Its pause was that of the held motion.
      held = null;
      said.push({ after_s: 0, command });
      continue;
    }
    const own = isHeld(command) ? { ...command, held_s: 0 } : command;
    // What was sent meanwhile comes behind it.
    said.push({ after_s: held ? 0 : after_s, command: own });
    if (isHeld(command)) held = own;
  }
  return said;
}

/** A base as the inside of a table of TOML, its limits those of its wheels. */
export const baseOf = ({ wheels, turns, wheel_base_m, wheel_radius_m, most_m_s, m_per_s2 }) => baseFields({ wheels, turns, wheel_base_m, wheel_radius_m, most_m_s, m_per_s2 }).join(", ");
const baseFields = ({ wheels, turns, wheel_base_m, wheel_radius_m, most_m_s, m_per_s2 }) => [
  `wheels = [${wheels.join(", ")}]`,
  `turns = [${turns.map(figure).join(", ")}]`,
  `wheel_base_m = ${figure(wheel_base_m)}`,
  `wheel_radius_m = ${figure(wheel_radius_m)}`,
  `linear_m_s = ${figure(most_m_s)}`,
  `angular_rad_s = ${figure((2 * most_m_s) / wheel_base_m)}`,
  `wheel_m_s = ${figure(most_m_s)}`,
  `wheel_m_s2 = ${figure(m_per_s2)}`,
];

const time = ({ held_s }) => (held_s === undefined ? "" : ` for ${figure(held_s)} s`);
const nodes = (command) => `nodes ${heldNodes(command).join(", ")}`;
const unsaid = (command) => LEFT_OUT(`${nodes(command)}: ${HELD_ROWS[command.do].shown(command)}`);
/** A base needs the models of its wheels. */
const unknown = (command, models) => command.wheels.some((node) => !models.has(node)) && `${unsaid(command)}: the models of its wheels are not known`;

/** The forms of held motions: see `ROWS` of the sequence. */
export const HELD_ROWS = {
  group_jog: {
    shown: (command) => `Turn together at ${command.axes.map(({ rpm }) => figure(rpm)).join(", ")} r/min${time(command)}`,
    line: ({ axes, rpm_per_s: ramp, held_s }) => [
      ...axes.map(({ node }) => `${node} guard`),
      ...axes.map(({ node, rpm }) => `${node} velocity ${figure(rpm)}rpm${BY_RAMP.line(ramp)} no-wait`),
      `wait ${ms(held_s * 1e3)}`,
      ...axes.map(({ node }) => `${node} stop`),
      ...axes.map(({ node }) => `${node} disable`),
    ],
    cli: ({ axes, rpm_per_s: ramp, held_s }) => [
      // Each is a program that the drive watches, for as long as it turns.
      ...axes.map(({ node, rpm }) => `ferrodrive velocity ${node} ${figure(rpm)}rpm${BY_RAMP.cli(ramp)} --for ${ms(held_s * 1e3)} & node_${node}=$!`),
      ...axes.map(({ node }) => `wait "$node_${node}"`),
      ...axes.map(({ node }) => `ferrodrive disable ${node}`),
    ],
    python: ({ axes, rpm_per_s: ramp, held_s }) => [
      ...axes.map(({ node }) => `node_${node}.guard()`),
      ...axes.map(({ node, rpm }) => `node_${node}.velocity(${figure(rpm)}${BY_RAMP.python(ramp)}, wait=False)`),
      `network.sleep(${figure(held_s)})`,
      ...axes.map(({ node }) => `node_${node}.stop()`),
      ...axes.map(({ node }) => `node_${node}.disable()`),
    ],
  },
  base_jog: {
    shown: (command) => `Drive the base at ${figure(command.linear_m_s)} m/s and ${figure(command.angular_rad_s)} rad/s${time(command)}`,
    line: ({ linear_m_s, angular_rad_s, held_s }) => `drive-base linear ${figure(linear_m_s)} angular ${figure(angular_rad_s)} for ${ms(held_s * 1e3)}`,
    cli: (command, models) => {
      const without = unknown(command, models);
      if (without) return [without];
      const drives = command.wheels.flatMap((node) => ["[[drive]]", `model = "${models.get(node)}"`, `node = ${node}`]);
      return ["cat > base.toml <<'END'", ...drives, "[base]", ...baseFields(command), "END", `ferrodrive drive-base base.toml --linear ${figure(command.linear_m_s)} --angular ${figure(command.angular_rad_s)} --for ${ms(command.held_s * 1e3)}`];
    },
    python: (command, models) => {
      const without = unknown(command, models);
      if (without) return [without];
      const { wheels, turns, wheel_base_m, wheel_radius_m, most_m_s, m_per_s2, linear_m_s, angular_rad_s, held_s } = command;
      const own = wheels.map((node) => `(${node}, ${models.get(node)})`).join(", ");
      return [
        `with network.base(${own}, turns=(${turns.map(figure).join(", ")}), wheel_base_m=${figure(wheel_base_m)}, wheel_radius_m=${figure(wheel_radius_m)}, linear_m_s=${figure(most_m_s)}, angular_rad_s=${figure((2 * most_m_s) / wheel_base_m)}, wheel_m_s=${figure(most_m_s)}, wheel_m_s2=${figure(m_per_s2)}) as base:`,
        `    base.drive(${figure(linear_m_s)}, ${figure(angular_rad_s)}, seconds=${figure(held_s)})`,
      ];
    },
  },
  group_end: { shown: () => "End of the held motion", line: () => [], cli: () => [], python: () => [] },
};

const isFigure = (value) => Number.isFinite(value);
const isTwo = (values, is) => Array.isArray(values) && values.length === 2 && values.every(is);
const BASE = ["wheel_base_m", "wheel_radius_m", "most_m_s", "m_per_s2", "linear_m_s", "angular_rad_s"];

/** What they have to have so that their forms can be made. */
export const HELD_WHOLE = {
  group_jog: ({ axes }) => Array.isArray(axes) && axes.length > 1 && axes.every((axis) => Number.isInteger(axis?.node) && isFigure(axis.rpm)),
  base_jog: (command) => isTwo(command.wheels, Number.isInteger) && isTwo(command.turns, isFigure) && BASE.every((name) => isFigure(command[name])),
};
