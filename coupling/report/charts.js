// Charts in SVG: over an axis, and around a ring. Both take rows of values and are redrawn by `set`; `marks` point at
// places: [{angle, text, colour}], colour and text may be missing.
const WIDTH = 360;  // of every chart, in its own units; the page scales them
const COLOURS = ["#0b5394", "#b04a00", "#2f6f1e", "#6a3d9a", "#a31621", "#00656e", "#7a5c00", "#4a4f57"];
const DASHES = ["none", "8 3", "2 3", "8 3 2 3"];

function element(name, attributes = {}, parent = null, text = null) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== null) made.textContent = text;
  if (parent) parent.append(made);
  return made;
}

function ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 2.5, 5, 10].map((s) => s * power).find((s) => s >= raw * 0.999);
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, k) => (first + k) * step);
}

function tickText(value) {
  if (Math.abs(value) >= 1e5) return String(Number(value.toPrecision(4)).toExponential()).replace("e+", "e").replace("-", "−");
  return String(Number(value.toPrecision(6))).replace("-", "−");
}

function roundRange([low, high], fromZero) {
  let [a, b] = fromZero ? [Math.min(low, 0), Math.max(high, 0)] : [low, high];
  if (!(b > a)) { const pad = Math.abs(a) * 0.1 || 1; a -= fromZero && a >= 0 ? 0 : pad; b += pad; }
  const pad = 0.05 * (b - a);
  return [a === 0 ? 0 : a - pad, b === 0 ? 0 : b + pad];
}

function linePath(xs, ys) {
  let text = "", pen = "M";
  for (let k = 0; k < xs.length; k++) {
    if (!Number.isFinite(ys[k]) || !Number.isFinite(xs[k])) { pen = "M"; continue; }
    text += `${pen}${xs[k].toFixed(2)} ${ys[k].toFixed(2)}`;
    pen = "L";
  }
  return text;
}

class LineChart {
  constructor(svg, { x, xLabel, yRange, xTicks = null, classes, styles = [], marks = [], height = 240, onPick = null }) {
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${WIDTH} ${height}`);
    Object.assign(this, { svg, x, box: { left: 50, right: WIDTH - 12, top: 18, bottom: height - 40 } });
    const { left, right, top, bottom } = this.box;
    this.xRange = xTicks ? [xTicks[0], xTicks[xTicks.length - 1]] : [x[0], x[x.length - 1]];
    if (this.xRange[1] <= this.xRange[0]) this.xRange[1] = this.xRange[0] + 1;
    this.yRange = yRange;
    this.dots = [];
    for (const value of ticks(...yRange, 5)) {
      const y = this.atY(value);
      element("line", { x1: left, x2: right, y1: y, y2: y, class: value === 0 ? "zero" : "rule" }, svg);
      element("text", { x: left - 6, y: y + 4, "text-anchor": "end", class: "tick y-tick" }, svg, tickText(value));
    }
    for (const value of xTicks || ticks(...this.xRange, 5)) {
      const at = this.atX(value);
      element("line", { x1: at, x2: at, y1: bottom, y2: bottom + 4, class: "zero" }, svg);
      element("text", { x: at, y: bottom + 16, "text-anchor": "middle", class: "tick x-tick" }, svg, tickText(value));
    }
    element("text", { x: (left + right) / 2, y: height - 6, "text-anchor": "middle", class: "tick" }, svg, xLabel);
    this.lines = classes.map((name, k) => {
      const path = element("path", { class: name }, svg);
      Object.assign(path.style, styles[k] || {});
      return path;
    });
    for (const { angle, text, colour } of marks) {
      const at = this.atX(angle);
      element("path", { d: `M${at - 5} ${top - 10}h10l-5 9z`, class: "gate" }, svg).style.fill = colour || "";
      if (text) element("text", { x: at + 8, y: top - 2, class: "tick gate" }, svg, text);
    }
    if (onPick) this.pickWith(onPick);
  }
  atX(value) { return this.box.left + (value - this.xRange[0]) / (this.xRange[1] - this.xRange[0]) * (this.box.right - this.box.left); }
  atY(value) { return this.box.bottom - (value - this.yRange[0]) / (this.yRange[1] - this.yRange[0]) * (this.box.bottom - this.box.top); }
  set(k, values, factor, x = this.x) {
    this.lines[k].setAttribute("d", linePath(Array.from(x, (v) => this.atX(v)), Array.from(values, (v) => this.atY(v * factor))));
  }
  // a dot on a line; none where a coordinate is unknown
  dot(k, x, y, factor) {
    const circle = this.dots[k] = this.dots[k] || element("circle", { r: 3.5, class: "dot" }, this.svg);
    const known = Number.isFinite(x) && Number.isFinite(y);
    circle.style.fill = this.lines[k].style.stroke;
    circle.style.display = known ? "" : "none";
    if (!known) return;
    circle.setAttribute("cx", this.atX(x).toFixed(2));
    circle.setAttribute("cy", this.atY(y * factor).toFixed(2));
  }
  cursor(value) {
    this.line = this.line || element("line", { class: "cursor", y1: this.box.top, y2: this.box.bottom }, this.svg);
    const at = this.atX(value).toFixed(2);
    this.line.setAttribute("x1", at);
    this.line.setAttribute("x2", at);
  }
  pickWith(onPick) {
    this.svg.style.cursor = "pointer";
    this.svg.addEventListener("click", (event) => {
      const frame = this.svg.getBoundingClientRect(), at = (event.clientX - frame.left) / frame.width * WIDTH;
      onPick(this.xRange[0] + (at - this.box.left) / (this.box.right - this.box.left) * (this.xRange[1] - this.xRange[0]));
    });
  }
}

class PolarChart {
  constructor(svg, { x, yRange, classes, styles = [], marks = [] }) {
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${WIDTH} 330`);
    const [low, high] = yRange, outer = 132;
    Object.assign(this, { x, low, high, outer, inner: low < 0 ? outer / 3 : 0, cx: WIDTH / 2, cy: 165 });
    for (let degree = 0; degree < 360; degree += 45) {
      const [a, b] = [this.place(degree, low), this.place(degree, high)], label = this.turn(degree, outer + 18);
      element("line", { x1: a[0], y1: a[1], x2: b[0], y2: b[1], class: "rule" }, svg);
      const apart = marks.map((m) => Math.abs((degree - m.angle + 540) % 360 - 180));
      if (Math.min(180, ...apart) > 15) element("text", { x: label[0], y: label[1] + 4, "text-anchor": "middle", class: "tick" }, svg, `${degree}°`);
    }
    const labelled = (marks.length === 1 ? marks[0].angle + 202.5 : 172) % 360, rings = ticks(low, high, 4);
    for (const value of rings) {
      element("circle", { cx: this.cx, cy: this.cy, r: this.radius(value), class: value === 0 ? "zero" : "rule" }, svg);
    }
    this.lines = classes.map((name, k) => {
      const path = element("path", { class: name }, svg);
      Object.assign(path.style, styles[k] || {});
      return path;
    });
    for (const value of rings) {
      if (value === low && this.inner === 0) continue;
      const [a, b] = this.place(labelled, value);
      element("text", { x: a, y: b + 4, "text-anchor": "middle", class: "tick halo y-tick" }, svg, tickText(value));
    }
    for (const { angle, text, colour } of marks) {
      const [a, b] = this.turn(angle, outer + 3), [x, y] = this.turn(angle, outer + 27);
      element("path", { d: "M-6 -11h12l-6 11z", class: "gate", transform: `translate(${a.toFixed(1)} ${b.toFixed(1)}) rotate(${angle})` }, svg)
        .style.fill = colour || "";
      if (text) element("text", { x, y: y + 4, "text-anchor": "middle", class: "tick gate" }, svg, text);
    }
  }
  radius(value) { return this.inner + (value - this.low) / (this.high - this.low) * (this.outer - this.inner); }
  turn(degree, r) { const a = degree * Math.PI / 180; return [this.cx + r * Math.sin(a), this.cy - r * Math.cos(a)]; }
  place(degree, value) { return this.turn(degree, this.radius(value)); }
  set(k, values, factor) {
    const xs = [], ys = [];
    for (let j = 0; j <= this.x.length; j++) {
      const i = j % this.x.length, [a, b] = this.place(this.x[i], values[i] * factor);
      xs.push(a);
      ys.push(b);
    }
    this.lines[k].setAttribute("d", linePath(xs, ys));
  }
}

// A legend of [name, class, style] entries as HTML nodes.
function legend(entries) {
  return entries.map(([name, lineClass, style]) => {
    const item = document.createElement("span");
    item.className = "legend";
    const svg = element("svg", { viewBox: "0 0 28 10", "aria-hidden": "true" });
    Object.assign(element("path", { d: "M0 5H28", class: lineClass }, svg).style, style || {});
    item.append(svg, name);
    return item;
  });
}

function caption(key, ...content) {
  const place = document.getElementById(`${key}-text`);
  place.replaceChildren(...content);
}

function sentence(text) {
  const line = document.createElement("div");
  line.textContent = text;
  return line;
}
