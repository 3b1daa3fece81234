// A quantity computed from others: `d(speed)`. Independent of the page.
//
// A formula is parsed once and computed for whole series at a time. It has numbers, + - * / ^, brackets, the constants pi and e, the
// time t in s, the values of a drive by name, objects as [4:606C:00], and the functions below.

/** By the name in a formula: what `field` it is. */
export const NAMES = { speed: "velocity_rpm", position: "angle_degrees", current: "current_a", supply: "supply_v" };

const pointwise = (of) => (columns) => Float64Array.from(columns[0], (_, at) => of(...columns.map((column) => column[at])));

/** The derivative in 1/s: of a straight line between the samples before and after each. */
function derivative([values], times) {
  const last = values.length - 1;
  return values.map((_, at) => {
    const [from, to] = [Math.max(0, at - 1), Math.min(last, at + 1)];
    return to > from ? (values[to] - values[from]) / (times[to] - times[from]) : NaN;
  });
}

/** The integral over time in s from the first sample at or after `begin_s`, of straight lines between samples; without those to one that is not finite. */
function integral([values], times, begin_s) {
  let sum = 0;
  return values.map((value, at) => {
    if (times[at] < begin_s) return NaN;
    const area = ((value + values[at - 1]) / 2) * (times[at] - times[at - 1]);
    if (times[at - 1] >= begin_s && Number.isFinite(area)) sum += area;
    return sum;
  });
}

/** The mean of the finite samples within the last seconds, as many as the second column has everywhere. */
function mean([values, spans], times) {
  let [first, sum, count] = [0, 0, 0];
  const take = (value, sign) => {
    if (!Number.isFinite(value)) return;
    sum += sign * value;
    count += sign;
  };
  return values.map((value, at) => {
    take(value, 1);
    while (first < at && times[first] < times[at] - spans[at]) {
      take(values[first], -1);
      first += 1;
    }
    return count > 0 ? sum / count : NaN;
  });
}

/**
 * By name: how many arguments, and what is computed of their columns and of the times.
 * @type {Record<string, [number, (columns: Float64Array[], times: Float64Array, begin_s: number) => Float64Array]>}
 */
const FUNCTIONS = {
  abs: [1, pointwise(Math.abs)],
  sqrt: [1, pointwise(Math.sqrt)],
  exp: [1, pointwise(Math.exp)],
  log: [1, pointwise(Math.log)],
  sign: [1, pointwise(Math.sign)],
  sin: [1, pointwise(Math.sin)],
  cos: [1, pointwise(Math.cos)],
  atan2: [2, pointwise(Math.atan2)],
  hypot: [2, pointwise(Math.hypot)],
  min: [2, pointwise(Math.min)],
  max: [2, pointwise(Math.max)],
  d: [1, derivative],
  int: [1, integral],
  mean: [2, mean],
};
const OPERATORS = {
  "+": pointwise((a, b) => a + b),
  "-": pointwise((a, b) => a - b),
  "*": pointwise((a, b) => a * b),
  "/": pointwise((a, b) => a / b),
  "^": pointwise((a, b) => a ** b),
};
const CONSTANTS = { pi: Math.PI, e: Math.E };

/** For people: what a formula may have. */
export const LANGUAGE = `${Object.keys(NAMES).join(", ")}, an object as [4:606C:00], t, pi, e, + - * / ^ ( ), ${Object.entries(FUNCTIONS).map(([name, [count]]) => `${name}(${"x, y".slice(0, 3 * count - 2)})`).join(", ")}`;

const TOKEN = /\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)|([A-Za-z_]\w*)|\[([^\]]*)\]|(.))/gy;

function tokens(text) {
  const found = [];
  for (const [, digits, word, object, sign] of text.trimEnd().matchAll(TOKEN)) {
    if (digits !== undefined) found.push({ kind: "number", text: digits, value: Number(digits) });
    else if (word !== undefined) found.push({ kind: "word", text: word });
    else if (object !== undefined) found.push({ kind: "object", text: object.trim().toUpperCase() });
    else found.push({ kind: "sign", text: sign });
  }
  return found;
}

/** Brackets and signs within each other; a formula of a person has a few. */
const DEEPEST = 60;

/**
 * A formula: `fields` are the values that it takes, and `compute(times, column, begin_s)` its value at each time, where `column(field)` gives
 * those of a field and integrals begin at `begin_s`. Throws an error that says what is wrong.
 */
export function formula(text) {
  const all = tokens(text);
  const fields = new Set();
  let at = 0;
  let depth = 0;
  const wrong = (expected) => new Error(`${at < all.length ? `'${all[at].text}'` : "the end"} where ${expected} was expected`);
  const isSign = (...signs) => all[at]?.kind === "sign" && signs.includes(all[at].text);
  const need = (sign) => {
    if (!isSign(sign)) throw wrong(`'${sign}'`);
    at += 1;
  };
  const isVariable = ({ kind, text: word }) => kind === "object" || (kind === "word" && (word === "t" || Object.hasOwn(NAMES, word)));
  const constant = (value) => (times) => new Float64Array(times.length).fill(value);
  const value = (field) => {
    fields.add(field);
    return (times, column) => column(field);
  };

  function word(name) {
    at += 1;
    if (isSign("(")) return call(name);
    if (name === "t") return (times) => Float64Array.from(times);
    if (Object.hasOwn(CONSTANTS, name)) return constant(CONSTANTS[name]);
    if (Object.hasOwn(NAMES, name)) return value(NAMES[name]);
    throw new Error(`'${name}' is not known; expected ${LANGUAGE}`);
  }

  function call(name) {
    if (!Object.hasOwn(FUNCTIONS, name)) throw new Error(`'${name}' is not a function; expected ${Object.keys(FUNCTIONS).join(", ")}`);
    const [count, of] = FUNCTIONS[name];
    need("(");
    const begins = [at];
    const given = [sum()];
    while (isSign(",")) {
      at += 1;
      begins.push(at);
      given.push(sum());
    }
    need(")");
    if (given.length !== count) throw new Error(`${name} takes ${count} ${count === 1 ? "value" : "values"}, not ${given.length}`);
    if (of === mean && all.slice(begins.at(-1), at).some(isVariable)) throw new Error("mean takes a number of seconds that does not change");
    return (times, column, begin_s) => of(given.map((one) => one(times, column, begin_s)), times, begin_s);
  }

  function atom() {
    const token = all[at];
    if (token?.kind === "number") {
      at += 1;
      return constant(token.value);
    }
    if (token?.kind === "word") return word(token.text);
    if (token?.kind === "object") {
      if (!/^\d+:[0-9A-F]{4}:[0-9A-F]{2}$/.test(token.text)) throw new Error(`[${token.text}] is not an object of a node; expected one such as [4:606C:00]`);
      at += 1;
      return value(token.text);
    }
    need("(");
    const inner = sum();
    need(")");
    return inner;
  }

  /** A sign binds less than a power: -x^2 is -(x^2). */
  function signed() {
    depth += 1;
    if (depth > DEEPEST) throw new Error(`more than ${DEEPEST} brackets and signs within each other`);
    let found;
    if (isSign("-")) {
      at += 1;
      const [zero, of] = [constant(0), signed()];
      found = (times, column, begin_s) => OPERATORS["-"]([zero(times), of(times, column, begin_s)]);
    } else {
      const base = atom();
      found = base;
      if (isSign("^")) {
        at += 1;
        const power = signed();
        found = (times, column, begin_s) => OPERATORS["^"]([base(times, column, begin_s), power(times, column, begin_s)]);
      }
    }
    depth -= 1;
    return found;
  }

  function chain(next, ...signs) {
    let left = next();
    while (isSign(...signs)) {
      const operator = OPERATORS[all[at].text];
      at += 1;
      const [before, right] = [left, next()];
      left = (times, column, begin_s) => operator([before(times, column, begin_s), right(times, column, begin_s)]);
    }
    return left;
  }
  const product = () => chain(signed, "*", "/");
  const sum = () => chain(product, "+", "-");

  const compute = sum();
  if (at < all.length) throw wrong("an operator");
  return { fields: [...fields], compute };
}
