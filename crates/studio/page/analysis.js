// Analysis of a part of a series: step response, spectrum, level crossings. Independent of the page.

/** The value of a straight line between the samples of `series` at a time within it. */
export function between(series, time_s) {
  const right = Math.min(Math.max(series.at(time_s), series.start + 1), series.end - 1);
  const [t0, t1] = [series.times[right - 1], series.times[right]];
  const [v0, v1] = [series.values[right - 1], series.values[right]];
  return v0 + ((v1 - v0) * (time_s - t0)) / (t1 - t0);
}

/** Least-squares line through the samples from the first index up to, not including, the second: `{ mean, slope, rms }`, the rms of the residuals. */
function straight({ times, values }, from, to) {
  const count = to - from;
  let [middle_s, mean] = [0, 0];
  for (let at = from; at < to; at += 1) {
    middle_s += times[at] / count;
    mean += values[at] / count;
  }
  let [over, below, left] = [0, 0, 0];
  for (let at = from; at < to; at += 1) {
    over += (times[at] - middle_s) * (values[at] - mean);
    below += (times[at] - middle_s) ** 2;
  }
  const slope = below > 0 ? over / below : 0;
  for (let at = from; at < to; at += 1) left += (values[at] - mean - slope * (times[at] - middle_s)) ** 2;
  return { mean, slope, rms: Math.sqrt(left / count) };
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

/** Least readings in the rise of a step, and least readings in which an overshoot has to be seen. */
const FEWEST_IN_RISE = 10;
const FEWEST_IN_PEAK = 5;
/** Readings from which it is judged whether a value is steady. */
const FEWEST_AT_REST = 3;
/** As fractions of the step: drift of a steady value, its deviation from its mean, and the least deviation of a step from every straight line. */
const DRIFT = 0.02;
const SCATTER = 0.05;
const BEND = 0.05;
/** Error of an end value that has not fully settled, as a fraction of the step; everything measured from it has the same error. */
const FINEST = 0.001;
/** Settling band, as a fraction of the step. */
const BAND = 0.02;

/** The largest time between two neighbouring samples of this range. */
function widest({ times }, from, to) {
  let most = 0;
  for (let at = from + 1; at <= to; at += 1) most = Math.max(most, times[at] - times[at - 1]);
  return most;
}

/** Whether the samples of a range are steady, compared to a step of `way`. */
function stands(series, from, to, way) {
  const { mean, slope, rms } = straight(series, from, to);
  const drift = Math.abs(slope * (series.times[to - 1] - series.times[from]));
  let scatter = 0;
  for (let at = from; at < to; at += 1) scatter = Math.max(scatter, Math.abs(series.values[at] - mean));
  return drift <= Math.max(DRIFT * Math.abs(way), 2 * rms) && scatter <= SCATTER * Math.abs(way) ? { mean, scatter } : null;
}

/**
 * Overshoot as a fraction of the step, and by how much a peak between two readings may be higher (twice what a parabola through the
 * three around it has). Null where it is over in too few readings to setText.
 */
function beyond({ times, values }, from, to, end, way, scatter) {
  const part = (at) => (values[at] - end) / way;
  let peak = from;
  for (let at = from; at < to; at += 1) if (part(at) > part(peak)) peak = at;
  // The end may be off by as much as its readings scatter, and so may the peak.
  const noise = Math.max(FINEST, 2 * Math.abs(scatter / way));
  if (part(peak) <= noise) return { overshoot: 0, overshoot_grid: noise };
  let [first, last] = [peak, peak];
  while (first > from && part(first - 1) > 0) first -= 1;
  while (last + 1 < to && part(last + 1) > 0) last += 1;
  if (last - first + 1 < FEWEST_IN_PEAK || peak === from || peak + 1 >= to) return { overshoot: null, overshoot_grid: null };
  const [left_s, right_s] = [times[peak] - times[peak - 1], times[peak + 1] - times[peak]];
  const bend = ((part(peak + 1) - part(peak)) / right_s - (part(peak) - part(peak - 1)) / left_s) / ((left_s + right_s) / 2);
  return { overshoot: part(peak), overshoot_grid: noise + (Math.abs(bend) * Math.max(left_s, right_s) ** 2) / 4 };
}

/**
 * The response to a step between two times. It begins at the mean of the first 5 % of the time and ends at that of the last 10 %, and
 * it has to be steady at both: a ramp gives null, as does everything else that is not a step.
 *
 * `rise_s` is the time from 10 % to 90 % of the step, `overshoot` the greatest excess over the end as a fraction of the step, `settling_s` the
 * time from 10 % of the step until it stays within 2 % of the step around its end, each null if not seen. `grid_s` is the uncertainty of
 * the times, `overshoot_grid` that of the overshoot. With fewer than ten readings in its rise the answer is `{ few }`, their number.
 */
export function stepResponse(series, from_s, to_s) {
  const [first, end] = [series.at(Math.max(from_s, series.first_s())), series.at(Math.min(to_s, series.last_s()) + 1e-9)];
  if (end - first < 2 * FEWEST_AT_REST) return null;
  const [begin_s, end_s] = [series.times[first], series.times[end - 1]];
  const span_s = end_s - begin_s;
  const rests = Math.max(series.at(begin_s + 0.05 * span_s), first + FEWEST_AT_REST);
  const settled = Math.min(series.at(end_s - 0.1 * span_s), end - FEWEST_AT_REST);
  const from = straight(series, first, rests).mean;
  const to = straight(series, settled, end).mean;
  const way = to - from;
  const [before, after] = [stands(series, first, rests, way), stands(series, settled, end, way)];
  if (!before || !after || way === 0 || straight(series, first, end).rms < BEND * Math.abs(way)) return null;
  const edge = way > 0 ? "rising" : "falling";
  const at10_s = crossing(series, from + 0.1 * way, edge, begin_s);
  const at90_s = at10_s === null ? null : crossing(series, from + 0.9 * way, edge, at10_s);
  if (at90_s === null || at90_s > end_s) return null;
  const [at10, at90] = [series.at(at10_s), series.at(at90_s)];
  // The edges themselves lie between readings.
  if (at90 - at10 < FEWEST_IN_RISE) return { few: at90 - at10 };
  const part = (at) => (series.values[at] - to) / way;
  let outside = at10;
  for (let at = at10; at < end; at += 1) if (Math.abs(part(at)) > BAND) outside = at;
  const grid_s = widest(series, at10 - 1, Math.min(outside + 1, end - 1));
  // Where the line between the last reading beyond the band and the next one comes into it.
  const into = () => series.times[outside] + ((series.times[outside + 1] - series.times[outside]) * (Math.sign(part(outside)) * BAND - part(outside))) / (part(outside + 1) - part(outside));
  const settling_s = outside + 1 < settled ? into() - at10_s : null;
  return { from, to, rise_s: at90_s - at10_s, settling_s, grid_s, ...beyond(series, at10, end, to, way, after.scatter) };
}

/** A number with its uncertainty, and no more decimals than that has: `1.2 ± 0.2`. */
export function within(value, grid) {
  const decimals = Math.min(6, Math.max(0, -Math.floor(Math.log10(grid))));
  const unit = 10 ** -decimals;
  return `${value.toFixed(decimals)} ± ${(Math.ceil(grid / unit - 1e-6) * unit).toFixed(decimals)}`;
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
 * Amplitude spectrum (over Hz) of a series between two times, without its mean and linear trend, in a Hann window.
 * The series is resampled at its mean interval by linear interpolation, so only frequencies below half its mean
 * sample rate are meaningful. Null with fewer than 16 samples.
 */
export function spectrum(series, from_s, to_s) {
  const [begin_s, end_s] = [Math.max(from_s, series.first_s()), Math.min(to_s, series.last_s())];
  const samples = series.at(end_s) - series.at(begin_s) + 1;
  if (samples < 16 || !(end_s > begin_s)) return null;
  const count = Math.min(2 ** Math.floor(Math.log2(samples)), MOST_LINES);
  const step_s = (end_s - begin_s) / (samples - 1);
  const first_s = end_s - (count - 1) * step_s;
  const real = Float64Array.from({ length: count }, (_, at) => between(series, first_s + at * step_s));
  // The linear trend is not a vibration: it is removed by least squares.
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
