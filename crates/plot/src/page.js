// Values under the pointer, and their differences from where the page was clicked.
//
// Each panel is a group with its scale in data attributes; its lines are paths with a data-label. A path has at most two
// points for each pixel, so what is read here is as exact as the picture.
"use strict";
const SVG = "http://www.w3.org/2000/svg";
const picture = document.querySelector("svg");
const readout = document.getElementById("readout");

function panelOf(group) {
  const number = (name) => Number(group.dataset[name]);
  const panel = {
    figure: group.dataset.figure,
    name: group.dataset.name,
    unit: group.dataset.unit,
    // What a logarithmic axis shows: "frequency, Hz". Empty for a time.
    axis: group.dataset.logarithmic,
    left: number("left"), right: number("right"),
    top: number("top"), height: number("height"),
    begin: number("begin"), end: number("end"),
    low: number("low"), high: number("high"),
    lines: [],
  };
  for (const path of group.querySelectorAll("path[data-label]")) {
    const points = [...path.getAttribute("d").matchAll(/[ML](-?[\d.]+) (-?[\d.]+)/g)]
      .map((match) => [Number(match[1]), Number(match[2])]);
    // A line with gaps is several paths of one label.
    const known = panel.lines.find((line) => line.label === path.dataset.label);
    if (known) known.points.push(...points);
    else panel.lines.push({ label: path.dataset.label, colour: path.getAttribute("stroke"), points });
  }
  return panel;
}

const panels = [...picture.querySelectorAll("g[data-figure]")].map(panelOf);
function timeAt(panel, x) {
  const at = panel.begin + (x - panel.left) / (panel.right - panel.left) * (panel.end - panel.begin);
  return panel.axis ? 10 ** at : at;
}

// The value of a line at x: on the line between its neighbours.
function valueAt(panel, line, x) {
  let low = 0, high = line.points.length - 1;
  if (high < 0 || x < line.points[0][0] - 1 || x > line.points[high][0] + 1) return null;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (line.points[middle][0] < x) low = middle + 1; else high = middle;
  }
  const [x1, y1] = line.points[low];
  const [x0, y0] = line.points[Math.max(low - 1, 0)];
  const y = x1 > x0 ? y0 + (Math.min(x, x1) - x0) / (x1 - x0) * (y1 - y0) : y1;
  return panel.high - (y - panel.top) / panel.height * (panel.high - panel.low);
}

const short = (value) => Number(value.toPrecision(5)).toString();

function cursor(colour) {
  const line = document.createElementNS(SVG, "line");
  line.setAttribute("stroke", colour);
  line.setAttribute("pointer-events", "none");
  picture.append(line);
  return (panel, x) => {
    const of_it = panels.filter((other) => other.figure === panel.figure);
    line.setAttribute("x1", x);
    line.setAttribute("x2", x);
    line.setAttribute("y1", Math.min(...of_it.map((other) => other.top)));
    line.setAttribute("y2", Math.max(...of_it.map((other) => other.top + other.height)));
  };
}

const here = cursor("#475467");
const there = cursor("#b42318");
let fixed = null;

function under(event) {
  const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(picture.getScreenCTM().inverse());
  const panel = panels.find((panel) =>
    point.x >= panel.left && point.x <= panel.right && point.y >= panel.top - 20 && point.y <= panel.top + panel.height + 8);
  return panel && { panel, x: point.x };
}

function show(panel, x) {
  here(panel, x);
  const from = fixed && fixed.panel.figure === panel.figure ? fixed : null;
  const time = timeAt(panel, x);
  const [name, unit] = panel.axis ? panel.axis.split(", ") : ["time", "s"];
  const rows = [[name, unit, time, from ? time - timeAt(panel, from.x) : null, "#1f2933"]];
  for (const other of panels.filter((other) => other.figure === panel.figure)) {
    for (const line of other.lines) {
      const value = valueAt(other, line, x);
      if (value === null) continue;
      const before = from && valueAt(other, line, from.x);
      rows.push([`${other.name}, ${line.label}`, other.unit, value, before === null ? null : value - before, line.colour]);
    }
  }
  readout.replaceChildren(...rows.map(([name, unit, value, difference, colour]) => {
    const row = document.createElement("tr");
    const texts = [name, short(value), difference === null || !from ? "" : `\u0394 ${short(difference)}`, unit];
    for (const text of texts) row.append(Object.assign(document.createElement("td"), { textContent: text }));
    row.firstChild.style.color = colour;
    return row;
  }));
}

picture.addEventListener("pointermove", (event) => {
  const found = under(event);
  if (found) show(found.panel, found.x);
});
picture.addEventListener("click", (event) => {
  fixed = under(event) || null;
  if (fixed) {
    there(fixed.panel, fixed.x);
    show(fixed.panel, fixed.x);
  }
});
