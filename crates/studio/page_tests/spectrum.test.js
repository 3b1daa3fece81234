// What the scope computes besides steps: spectra, crossings, what it keeps of a minute, and its right edge.

import assert from "node:assert/strict";
import { test } from "node:test";

import { crossing, spectrum } from "../page/analysis.js";
import { edge } from "../page/scope_edge.js";
import { measuredSpectra } from "../page/scope_readout.js";
import { Series } from "../page/series.js";

const of = (value, count) => {
  const series = new Series(60);
  for (let at = 0; at < count; at += 1) series.push(at * 1e-3, value(at * 1e-3));
  return series;
};

test("the spectrum of two sines on a slope is two lines", () => {
  const sines = of((t) => 3 + 0.1 * t + 0.7 * Math.sin(2 * Math.PI * 31.25 * t) + 0.2 * Math.cos(2 * Math.PI * 125 * t), 4096);
  const { hertz, amplitude } = spectrum(sines, 0, 5);
  assert.ok(Math.abs(amplitude[hertz.indexOf(31.25)] - 0.7) < 1e-3);
  assert.ok(Math.abs(amplitude[hertz.indexOf(125)] - 0.2) < 1e-3);
  // What the line of the slope takes of the sines.
  const others = amplitude.filter((_, at) => Math.abs(hertz[at] - 31.25) > 1 && Math.abs(hertz[at] - 125) > 1);
  assert.ok(Math.max(...others) < 5e-3);
  assert.equal(spectrum(of((t) => t, 15), 0, 1), null, "too few");
});

test("a cursor in a spectrum reads the amplitude of the line nearest to it, of each value", () => {
  const sine = (amplitude, hertz) => spectrum(of((t) => amplitude * Math.sin(2 * Math.PI * hertz * t), 4096), 0, 5);
  const pane = (label, unit, ...spectra) => ({ label, unit, decimals: 1, lines: spectra.map((one, at) => ({ name: `node ${at}`, spectrum: one })) });
  const panes = [pane("Speed", "r/min", sine(0.7, 31.25)), pane("Current", "A", sine(0.2, 125), sine(0.4, 31.25)), pane("Supply", "V", null)];
  const lines = measuredSpectra({ panes, cursors: [31.3, 125.1] }).split("\n");
  assert.equal(lines[0], "A at 31.30 Hz: Speed 0.700 r/min (line at 31.25 Hz), Current of node 0 0.000 A (line at 31.25 Hz), Current of node 1 0.400 A (line at 31.25 Hz), Supply too few readings");
  assert.match(lines[1], /^B at 125\.10 Hz: .*Current of node 0 0\.200 A \(line at 125\.00 Hz\)/);
  assert.equal(lines[2], "B \u2212 A: 93.80 Hz");
  assert.equal(measuredSpectra({ panes, cursors: [null, null] }), "");
  // 1000 samples a second have lines up to 500 Hz.
  assert.match(measuredSpectra({ panes, cursors: [600, null] }), /^A at 600\.00 Hz: Speed not sampled so often, Current of node 0 not sampled/);
});

test("a lag of first order crosses a level at its logarithm, and never the other way", () => {
  const lag = of((t) => (t < 0.5 ? 0 : -8 * (1 - Math.exp((0.5 - t) / 0.05))), 5000);
  assert.ok(Math.abs(crossing(lag, -4, "falling") - (0.5 + 0.05 * Math.log(2))) < 1e-5);
  assert.equal(crossing(lag, -4, "rising"), null);
});

test("of a long series the last minute is kept", () => {
  const long = of((t) => t, 200_000);
  assert.ok(Math.abs(long.length - 60_001) <= 1);
  assert.ok(Math.abs(long.last_s() - 199.999) < 1e-9 && Math.abs(long.value(150.0005) - 150) < 1e-9);
  assert.equal(long.value(1), null, "before it nothing is known");
});

/** Ten readings a second that come with 0 and 40 ms of delay in turn, and a picture 60 times a second. */
test("the edge of the picture moves evenly, and stands where the bus does", () => {
  const at = edge();
  const [steps, behind] = [[], []];
  let last;
  for (let picture = 0; picture < 1200; picture += 1) {
    const now_s = picture / 60;
    let reading = Math.floor(now_s * 10 + 1e-9);
    if (reading % 2 === 1 && now_s < reading / 10 + 0.04) reading -= 1;
    // The bus has a clock of its own.
    const end_s = at(1000 + reading / 10, now_s);
    if (picture > 600) {
      steps.push(end_s - last);
      behind.push(end_s - 1000 - now_s);
    }
    last = end_s;
  }
  // A step differs from 1/60 s by at most a tenth of the difference of the delays; the pictures themselves have times in 1/60 s.
  const jitter_s = 0.1 * (0.04 + 1 / 60);
  assert.ok(Math.min(...steps) > 1 / 60 - jitter_s && Math.max(...steps) < 1 / 60 + jitter_s);
  // Between the earliest and the latest reading.
  assert.ok(Math.min(...behind) > -0.04 - 1 / 60 && Math.max(...behind) < 1e-3);
  assert.ok(Math.abs(at(1019.9, 60) - 1020.4) < 1e-9, "half a second after the last reading");
  assert.ok(Math.abs(at(0.1, 61) - 0.1) < 1e-9, "a bus that began anew");
});
