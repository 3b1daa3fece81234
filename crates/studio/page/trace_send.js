// The send window of the Trace view: frames as they are, once or in cycles. A cycle is the page's own: it ends with the page, with
// control, and with a stop of everything.

import { ask, inControl, on } from "./link.js";
import { h, setText, toggle } from "./dom.js";
import { keep, kept } from "./settings.js";
import { SHORTEST_MS, cycleOf, frameOf } from "./trace_sum.js";

const KEY = "trace-send";
const MOST = 16;
const NEW = { id: "604", data: "40 41 60 00 00 00 00 00", cycle: "100" };

export function sendWindow() {
  const status = h("p", { class: "quiet", role: "status", id: "send-status" });
  const list = h("ul", { class: "captures", "aria-label": "Frames to send" });
  const add = h("button", { type: "button", id: "send-add", onclick: () => append({ ...NEW }) }, "Add a frame");
  const hint = `Frames are sent as they are, in control only. One that may set a drive in motion needs a studio that was started with --allow-motion. A cycle of ${SHORTEST_MS} ms or more is kept by the page: Stop ends it, and so does the loss of control. An SDO request beside those of the studio may mix with them.`;
  const root = h("details", { class: "plain-details", id: "send" }, h("summary", {}, "Send frames"), list, add, status, h("p", { class: "quiet" }, hint));
  const rows = [];

  const say = (text, bad) => {
    setText(status, text);
    status.className = bad ? "bad" : "quiet";
  };
  const store = () => keep(KEY, rows.map(({ read }) => read()));

  function append(frame) {
    if (rows.length >= MOST) return say(`at most ${MOST} frames`, true);
    const field = (label, value, size) => h("input", { value: String(value ?? ""), size: String(size), "aria-label": label, spellcheck: "false", onchange: store });
    const [id, data, cycle] = [field("COB-ID, hexadecimal", frame.id, 9), field("Data, hexadecimal", frame.data, 26), field("Period in ms", frame.cycle, 6)];
    const cyclic = toggle(null, "Cyclic", false, () => (cyclic.checked ? begin() : end()));
    let timer = null;
    let count = 0;

    /** Sends it once; a refusal ends a cycle. */
    async function send() {
      try {
        const text = frameOf(id.value, data.value);
        const answer = await ask({ do: "send_frame", frame: text });
        if (!answer.ok) throw new Error(answer.error.message);
        count += 1;
        say(`${text} sent${count > 1 ? `, ${count} times` : ""}${answer.notes?.length ? `; ${answer.notes.join("; ")}` : ""}`, false);
        return true;
      } catch (error) {
        end();
        say(error.message, true);
        return false;
      }
    }

    async function begin() {
      try {
        const ms = cycleOf(cycle.value);
        if (ms === null) throw new Error("expected a period in ms");
        count = 0;
        if (!(await send()) || !cyclic.checked) return;
        // Off and on again meanwhile: the other one has begun too.
        clearInterval(timer);
        timer = setInterval(send, ms);
      } catch (error) {
        end();
        say(error.message, true);
      }
    }

    function end() {
      clearInterval(timer);
      timer = null;
      cyclic.checked = false;
    }

    const row = { read: () => ({ id: id.value, data: data.value, cycle: cycle.value }), end };
    const remove = () => {
      end();
      rows.splice(rows.indexOf(row), 1);
      element.remove();
      store();
    };
    const element = h("li", { class: "bar" }, id, h("span", { class: "quiet" }, "#"), data, h("button", { type: "button", class: "send", onclick: () => ((count = 0), send()) }, "Send"), cyclic, h("label", {}, "every ", cycle, " ms"), h("button", { type: "button", onclick: remove }, "Remove"));
    rows.push(row);
    list.append(element);
    store();
  }

  const endAll = () => rows.forEach((row) => row.end());
  on("halt", endAll);
  on("state", () => inControl() || endAll());
  const before = kept(KEY, [NEW]);
  for (const frame of Array.isArray(before) ? before.slice(0, MOST) : [NEW]) append(frame);
  return root;
}
