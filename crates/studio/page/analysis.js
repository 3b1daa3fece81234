// What a piece of a series says: its response to a step, what it is made of, where it crosses a level. No knowledge of the page.

/** The value of a straight line between the samples of `series` at a time within it. */
function between(series, time_s) {
  const right = Math.min(Math.max(series.at(time_s), series.start + 1), series.end - 1);
  const [t0, t1] = [series.times[right - 1], series.times[right]];
  const [v0, v1] = [series.values[right - 1], series.values[right]];
  return v0 + ((v1 - v0) * (time_s - t0)) / (t1 - t0);
}

function mean(series, from_s, to_s) {
  const [from, to] = [series.at(from_s), series.at(to_s)];
  const values = series.values.subarray(from, Math.max(to, from + 1));
  return values.reduce((sum, value) => sum + value, 0) / values.length;
}

/** When the line first passes from one side of `level` to the other after `from_s`: "rising", "falling" or "either"; null if never. */
export function crossing(series, level, edge, from_s = -Infinity) {
  for (let at = Math.max(series.at(from_s), series.start + 1); at < series.end; at += 1) {
    const [v0, v1] = [series.values[at - 1], series.values[at]];
    const rises = v0 < level && v1 >= level;
    const falls = v0 > level && v1 <= level;
    if ((edge !== "falling" && rises) || (edge !== "rising" && falls)) {
      const [t0, t1] = [series.times[at - 1], series.times[at]];
      return t0 + ((t1 - t0) * (level - v0)) / (v1 - v0);
    }
  }
  return null;
}

/**
 * The response to a step between two times: it begins at the mean of the first 5 % of the time and ends at that of the last 10 %.
 *
 * `rise_s` is the time from 10 % to 90 % of the way, `overshoot` the greatest excess over the end as a part of the way, `settling_s` the
 * time from 10 % of the way until it stays within 2 % of the way around its end, null if it does not. Null where there is no step: at its
 * end the values scatter by more than a twentieth of the way.
 */
export function stepResponse(series, from_s, to_s) {
  const [begin_s, end_s] = [Math.max(from_s, series.first_s()), Math.min(to_s, series.last_s())];
  const span_s = end_s - begin_s;
  if (series.length < 5 || !(span_s > 0)) return null;
  const from = mean(series, begin_s, begin_s + 0.05 * span_s);
  const to = mean(series, end_s - 0.1 * span_s, end_s + 1e-9);
  const way = to - from;
  let scatter = 0;
  for (let at = series.at(end_s - 0.1 * span_s); at < series.at(end_s + 1e-9); at += 1) scatter = Math.max(scatter, Math.abs(series.values[at] - to));
  if (Math.abs(way) <= 20 * scatter || way === 0) return null;
  const edge = way > 0 ? "rising" : "falling";
  const at10_s = crossing(series, from + 0.1 * way, edge, begin_s);
  const at90_s = crossing(series, from + 0.9 * way, edge, at10_s ?? begin_s);
  if (at10_s === null || at90_s === null) return null;
  let [overshoot, outside_s] = [0, at10_s];
  for (let at = series.at(at10_s); at < series.at(end_s + 1e-9); at += 1) {
    const beyond = (series.values[at] - to) / way;
    overshoot = Math.max(overshoot, beyond);
    if (Math.abs(beyond) > 0.02) outside_s = at + 1 < series.end ? series.times[at + 1] : Infinity;
  }
  const settling_s = outside_s <= end_s - 0.1 * span_s ? outside_s - at10_s : null;
  return { from, to, rise_s: at90_s - at10_s, overshoot, settling_s };
}

/** In place: the discrete Fourier transform of a power of two of complex values. */
function transform(real, imaginary) {
  const count = real.length;
  for (let at = 1, mirrored = 0; at < count; at += 1) {
    let bit = count >> 1;
    for (; mirrored & bit; bit >>= 1) mirrored ^= bit;
    mirrored |= bit;
    if (at < mirrored) {
      [real[at], real[mirrored]] = [real[mirrored], real[at]];
      [imaginary[at], imaginary[mirrored]] = [imaginary[mirrored], imaginary[at]];
    }
  }
  for (let size = 2; size <= count; size *= 2) {
    for (let turn = 0; turn < size / 2; turn += 1) {
      const [cos, sin] = [Math.cos((2 * Math.PI * turn) / size), -Math.sin((2 * Math.PI * turn) / size)];
      for (let at = turn; at < count; at += size) {
        const other = at + size / 2;
        const re = real[other] * cos - imaginary[other] * sin;
        const im = real[other] * sin + imaginary[other] * cos;
        [real[other], imaginary[other]] = [real[at] - re, imaginary[at] - im];
        real[at] += re;
        imaginary[at] += im;
      }
    }
  }
}

const MOST_LINES = 1 << 14;

/**
 * What a series between two times is made of: a series of amplitudes over Hz, without its mean and its straight line, in a Hann window.
 * Its samples are taken as they lie on average, on straight lines between those that there are; so only what is slower than half
 * their rate says something. Null with fewer than 16 samples.
 */
export function spectrum(series, from_s, to_s) {
  const [begin_s, end_s] = [Math.max(from_s, series.first_s()), Math.min(to_s, series.last_s())];
  const samples = series.at(end_s) - series.at(begin_s) + 1;
  if (samples < 16 || !(end_s > begin_s)) return null;
  const count = Math.min(2 ** Math.floor(Math.log2(samples)), MOST_LINES);
  const step_s = (end_s - begin_s) / (samples - 1);
  const first_s = end_s - (count - 1) * step_s;
  const real = Float64Array.from({ length: count }, (_, at) => between(series, first_s + at * step_s));
  // The straight line through it by least squares: it is no vibration.
  const middle = (count - 1) / 2;
  const average = real.reduce((sum, value) => sum + value, 0) / count;
  const slope = real.reduce((sum, value, at) => sum + (at - middle) * value, 0) / real.reduce((sum, _, at) => sum + (at - middle) ** 2, 0);
  real.forEach((value, at) => {
    real[at] = (value - average - slope * (at - middle)) * (1 - Math.cos((2 * Math.PI * at) / count));
  });
  const imaginary = new Float64Array(count);
  transform(real, imaginary);
  const half = count / 2;
  // A line at 0 Hz is what the window leaves of the mean.
  return {
    hertz: Float64Array.from({ length: half - 1 }, (_, at) => (at + 1) / (count * step_s)),
    amplitude: Float64Array.from({ length: half - 1 }, (_, at) => (2 * Math.hypot(real[at + 1], imaginary[at + 1])) / count),
  };
}
