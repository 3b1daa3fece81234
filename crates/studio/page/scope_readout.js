// What the scope measures, in words: the values at the cursors, their differences, and the step response. Independent of the page.

import { stepResponse, within } from "./analysis.js";
import { number } from "./dom.js";

/** @param {any} step */
function shownStep({ from, to, rise_s, overshoot, overshoot_grid, settling_s, grid_s }, unit, decimals) {
  const above = overshoot === null ? "overshoot too short for these readings" : overshoot === 0 ? "no overshoot" : `overshoot ${within(100 * overshoot, 100 * overshoot_grid)} %`;
  const settling = settling_s === null ? "not settled to 2 %" : `settled to 2 % in ${within(settling_s, grid_s)} s`;
  return `${number(from, decimals)} to ${number(to, decimals)} ${unit}, rise time (10 to 90 %) ${within(rise_s, grid_s)} s, ${above}, ${settling}`;
}

const tooFew = (few) => `too few readings: ${few} in the rise, expected at least 10. Map the object into a TPDO with an event timer of 1 ms (PDO view), start the node, and add the object here.`;

/** Every line of the panes, with a label of its own. */
const linesOf = (panes) => panes.flatMap(({ lines, ...quantity }) => lines.map((one) => ({ ...quantity, ...one, label: lines.length > 1 || one.isCapture ? `${quantity.label} of ${one.name}` : quantity.label })));

/** Amplitudes are small beside the values that they are of: so many decimals more. */
const FINER = 2;

/** The lines of the readout of spectra: at each cursor the amplitude of the spectral line nearest to it, or why a value has none there. */
export function measuredSpectra({ panes, cursors }) {
  const nearest = (hertz, at) => hertz.reduce((best, one, place) => (Math.abs(one - at) < Math.abs(hertz[best] - at) ? place : best), 0);
  const all = linesOf(panes);
  const read = ({ label, unit, decimals, spectrum }, at) => {
    if (!spectrum) return `${label} too few readings`;
    const { hertz, amplitude } = spectrum;
    const place = nearest(hertz, at);
    if (at - hertz[place] > hertz[1] - hertz[0]) return `${label} not sampled so often`;
    return `${label} ${number(amplitude[place], decimals + FINER)} ${unit} (line at ${number(hertz[place], 2)} Hz)`;
  };
  const lines = cursors.flatMap((at, which) => {
    if (at === null) return [];
    return [`${"AB"[which]} at ${number(at, 2)} Hz: ${all.map((one) => read(one, at)).join(", ") || "no values shown"}`];
  });
  const [a, b] = cursors;
  if (a !== null && b !== null) lines.push(`B − A: ${number(b - a, 2)} Hz`);
  return lines.join("\n");
}

/** The lines of the readout of a picture; `steps`: with the step response of each line. */
export function measured({ panes, from_s, to_s, cursors }, steps) {
  const all = linesOf(panes);
  const lines = [];
  const [a, b] = cursors.map((at_s) => (at_s === null ? null : all.map((one) => (at_s > one.series.last_s() ? null : one.series.value(at_s)))));
  const listed = (values) => all.map(({ label, unit, decimals }, at) => `${label} ${number(values[at], decimals)} ${unit}`).join(", ");
  [a, b].forEach((values, which) => {
    if (values?.some((value) => value !== null)) lines.push(`${"AB"[which]} at ${number(cursors[which], 3)} s: ${listed(values)}`);
    else if (values) lines.push(`${"AB"[which]} at ${number(cursors[which], 3)} s: no reading there`);
  });
  if (a && b) {
    const differences = all.map((_, at) => (a[at] === null || b[at] === null ? null : b[at] - a[at]));
    lines.push(`B − A: ${number(cursors[1] - cursors[0], 3)} s, ${listed(differences)}`);
  }
  if (!steps) return lines.join("\n");
  const [from, to] = a && b ? [Math.min(...cursors), Math.max(...cursors)] : [from_s, to_s];
  for (const { label, unit, decimals, steps: takesSteps, series } of all) {
    const step = takesSteps === false ? null : stepResponse(series, from, to);
    if (step) lines.push(`Step of ${label}: ${step.few === undefined ? shownStep(step, unit, decimals) : tooFew(step.few)}`);
  }
  if (!lines.some((line) => line.startsWith("Step"))) lines.push("No step found: a value other than a current has to be steady, change, and be steady again.");
  return lines.join("\n");
}
