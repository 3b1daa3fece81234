// A canvas context that writes SVG: the part of its interface that the scope uses.

const escaped = (text) => text.replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);
const ANCHORS = { left: "start", right: "end", center: "middle" };
const place = (value) => Math.round(value * 100) / 100;

export class SvgPen {
  constructor(width, height, background) {
    this.size = [width, height];
    this.strokeStyle = this.fillStyle = "";
    this.lineWidth = 1;
    this.textAlign = "left";
    this.parts = [`<rect width="${width}" height="${height}" fill="${background}"/>`];
    this.path = "";
    this.clips = 0;
    this.depth = [];
    this.pattern = [];
    // The measures of the picture on the page.
    this.ruler = document.createElement("canvas").getContext("2d");
    this.font = "12px system-ui, sans-serif";
  }

  beginPath() {
    this.path = "";
  }

  moveTo(x, y) {
    this.path += `M${place(x)} ${place(y)}`;
  }

  lineTo(x, y) {
    this.path += `L${place(x)} ${place(y)}`;
  }

  rect(x, y, width, height) {
    this.path += `M${place(x)} ${place(y)}h${place(width)}v${place(height)}h${place(-width)}z`;
  }

  stroke() {
    const pattern = this.pattern.length ? ` stroke-dasharray="${this.pattern.join(" ")}"` : "";
    this.parts.push(`<path d="${this.path}" fill="none" stroke="${escaped(this.strokeStyle)}" stroke-width="${this.lineWidth}"${pattern}/>`);
  }

  strokeRect(x, y, width, height) {
    const before = this.path;
    this.path = "";
    this.rect(x, y, width, height);
    this.stroke();
    this.path = before;
  }

  fillText(text, x, y) {
    const anchor = ANCHORS[this.textAlign];
    this.parts.push(`<text x="${place(x)}" y="${place(y)}" fill="${escaped(this.fillStyle)}" text-anchor="${anchor}" dominant-baseline="middle">${escaped(text)}</text>`);
  }

  measureText(text) {
    this.ruler.font = this.font;
    return this.ruler.measureText(text);
  }

  setLineDash(pattern) {
    this.pattern = pattern;
  }

  save() {
    this.depth.push(0);
  }

  clip() {
    this.clips += 1;
    this.parts.push(`<clipPath id="clip${this.clips}"><path d="${this.path}"/></clipPath><g clip-path="url(#clip${this.clips})">`);
    this.depth[this.depth.length - 1] += 1;
  }

  restore() {
    this.parts.push("</g>".repeat(this.depth.pop()));
  }

  text() {
    const [width, height] = this.size;
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" font-family="system-ui, sans-serif" font-size="12">${this.parts.join("\n")}</svg>\n`;
  }
}
