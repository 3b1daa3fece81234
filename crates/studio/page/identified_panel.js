// What a kept capture shows of a drive: its frequency response with coherence, its masses, its speed loop. Nothing moves.

import { h, setText, table } from "./dom.js";
import { identified } from "./recordings.js";
import { bodePanes, identifiedRows, resonanceMarks } from "./tune.js";
import { picture } from "./tune_picture.js";

/** `shared.node` is the drive that is meant where a capture has several. */
export function identifiedPanel(shared) {
  const status = h("p", { role: "status", id: "identified-status" });
  const had = h("div", { id: "identified" });
  const root = h("div", { hidden: true }, h("div", { class: "bar" }, status, h("button", { type: "button", "aria-label": "Close what was identified", onclick: () => (root.hidden = true) }, "Close")), had);
  /** The capture that was asked about last. */
  let asked = null;

  const say = (text, bad = false) => {
    setText(status, text);
    status.className = bad ? "bad" : "";
  };

  async function show(capture) {
    asked = capture;
    root.hidden = false;
    had.replaceChildren();
    say(`${capture.name}: it is looked at …`);
    try {
      const report = await identified(capture, shared.node);
      if (asked === capture) draw(capture, report);
    } catch (error) {
      if (asked === capture) say(`${capture.name}: ${error.message}`, true);
    }
  }

  function draw({ name }, report) {
    say(`${name}, node ${report.node}: ${report.rows} rows ${Number((report.period_s * 1e3).toPrecision(4))} ms apart, by ${report.quantities.join(", ")}. Nothing has moved, and no gains are proposed.`);
    // In a narrow window the letters keep their size.
    const width = Math.max(300, Math.min(640, innerWidth - 70));
    const bode = picture(bodePanes(report.response), { logarithmic: true, unit: "Hz", marks: resonanceMarks(report), width, says: "Frequency response as captured and of the model, with its coherence" });
    had.replaceChildren(h("div", { class: "columns" }, h("div", {}, bode), h("div", {}, table(["Found", "Figure"], identifiedRows(report)))), ...report.notes.map((note) => h("p", { class: "quiet" }, note)));
    // Behind a list of captures it would not be seen.
    root.scrollIntoView({ block: "center" });
  }

  return { root, show };
}
