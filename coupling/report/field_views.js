// Pictures of the ground: points coloured by a field and the mesh, on canvas; the section through the ground, in SVG.
function liningPath(pen, at, size) {
  data.section.tunnels.forEach((t, k) => {
    const open = gate && gate.tunnel === k ? gate : null;
    // the walls of the gate are parallel: its angle differs on the two faces
    const faces = [t.outer, t.inner].map((r) => {
      const half = open ? Math.asin(open.width / 2 / r) : 0, middle = open ? open.angle * Math.PI / 180 : 0;
      return Array.from({ length: 361 }, (_, j) => {
        const a = middle + half + (2 * Math.PI - 2 * half) * j / 360;
        return at(t.x + r * Math.sin(a), t.y + r * Math.cos(a));
      });
    });
    pen.beginPath();
    if (open) {
      [...faces[0], ...faces[1].reverse()].forEach(([x, y], j) => (j ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      pen.closePath();
    } else {
      for (const face of faces) face.forEach(([x, y], j) => (j ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    }
    pen.fillStyle = "#d9dde2";
    pen.strokeStyle = "#3a434e";
    pen.lineWidth = size;
    pen.fill("evenodd");
    pen.stroke();
  });
}

class CanvasView {
  // a square picture of the ground with its coordinates along two sides
  constructor(id) {
    this.canvas = document.getElementById(id);
    this.pen = this.canvas.getContext("2d");
    this.edge = { left: 84, top: 14, size: 900 - 84 - 14 };
  }
  frame({ x, y, half }) {
    const { left, top, size } = this.edge, pen = this.pen;
    this.at = (px, py) => [left + (px - x + half) / (2 * half) * size, top + (y + half - py) / (2 * half) * size];
    this.pixels = size / (2 * half);
    pen.clearRect(0, 0, 900, 900);
    pen.fillStyle = "#ffffff";
    pen.fillRect(0, 0, 900, 900);
    pen.save();
    pen.beginPath();
    pen.rect(left, top, size, size);
    pen.clip();
  }
  finish({ x, y, half }) {
    const { left, top, size } = this.edge, pen = this.pen;
    pen.restore();
    pen.strokeStyle = "#55606e";
    pen.lineWidth = 1.5;
    pen.strokeRect(left, top, size, size);
    pen.fillStyle = "#1b2430";
    pen.font = "25px system-ui, sans-serif";
    pen.textAlign = "center";
    for (const value of ticks(x - half, x + half, 5)) {
      const [at] = this.at(value, y);
      if (at < left + size - 60) pen.fillText(tickText(value), Math.max(at, left + 14), top + size + 32);
    }
    pen.fillText("x [m]", left + size - 26, top + size + 32);
    pen.textAlign = "right";
    for (const value of ticks(y - half, y + half, 5)) {
      const [, at] = this.at(x, value);
      if (at > top + 50) pen.fillText(tickText(value), left - 8, at + 8);
    }
    pen.fillText("y [m]", left - 8, top + 22);
  }
}

function gateView(span) {
  const a = gate.angle * Math.PI / 180, r = (home.outer + home.inner) / 2;
  return { x: home.x + r * Math.sin(a), y: home.y + r * Math.cos(a), half: span };
}

class FieldView extends CanvasView {
  constructor() {
    super("fields");
    this.source = data.fields;
    this.snapshots = this.source.snapshots.map((s) => ({ time: s.time, spread: s.spread, count: s.drawn,
      ...Object.fromEntries(["x", "y", "side", ...Object.keys(this.source.fields)].map((k) => [k, unpack(s[k]).values])) }));
    this.moments = this.snapshots.map((s) => s.time);
    this.field = document.getElementById("field");
    this.view = document.getElementById("field-view");
    if (!gate) this.view.closest("label").remove();
    for (const select of [this.field, this.view]) select.addEventListener("change", () => { this.last = null; this.draw(this.current); });
  }
  draw(frame) {
    this.current = frame;
    const k = nearest(this.moments, times[frame]);
    const state = `${k} ${this.field.value} ${this.view.value}`;
    if (state !== this.last) this.paint(k);
    this.last = state;
    const scale = this.source.fields[this.field.value], unit = scale.unit === "-" ? "" : ` ${scale.unit}`;
    const bar = document.createElement("div"), ends = document.createElement("div");
    bar.className = "colours";
    bar.style.background = `linear-gradient(to right, ${scale.colours.map((c) => `rgb(${c})`).join(", ")})`;
    ends.className = "ends";
    const middle = scale.log ? Math.sqrt(scale.low * scale.high) : (scale.low + scale.high) / 2;
    [scale.low, middle, scale.high].forEach((value, j) => {
      const end = document.createElement("span");
      end.textContent = `${["", "", "≥ "][j]}${shown(value)}${unit}`;
      ends.append(end);
    });
    const text = `${scale.label}, stored at ${shown(this.moments[k])} s (nearest to the slider)`;
    caption("fields", bar, ends, sentence(text));
    this.canvas.setAttribute("aria-label", `${text}; from ${shown(scale.low)} to ${shown(scale.high)}${unit}`);
  }
  paint(k) {
    const snap = this.snapshots[k], name = this.field.value, whole = this.source.view, pen = this.pen;
    const view = this.view.value === "gate" && gate ? gateView(Math.max(5 * gate.width, 0.8)) : whole;
    const stops = this.source.fields[name].colours, last = stops.length - 1;
    const palette = Array.from({ length: 256 }, (_, v) => {
      const at = v / 255 * last, low = Math.min(Math.floor(at), last - 1), share = at - low;
      return `rgb(${stops[low].map((c, j) => Math.round(c + share * (stops[low + 1][j] - c))).join(",")})`;
    });
    this.frame(view);
    const left = whole.x - whole.half, bottom = whole.y - whole.half, width = 2 * whole.half;
    const x = snap.x, y = snap.y, side = snap.side, values = snap[name];
    const grow = 1.7 * snap.spread * this.source.largest_side / 255 * this.pixels;
    for (let j = 0; j < snap.count; j++) {
      const [px, py] = this.at(left + x[j] / 65535 * width, bottom + y[j] / 65535 * width);
      if (px < 0 || py < 0 || px > 900 || py > 900) continue;
      const s = Math.max(side[j] * grow, 2);
      pen.fillStyle = palette[values[j]];
      pen.fillRect(px - s / 2, py - s / 2, s, s);
    }
    liningPath(pen, this.at, 2);
    this.finish(view);
  }
}

class MeshView extends CanvasView {
  constructor() {
    super("mesh");
    this.mesh = { x: unpack(data.mesh.x).values, y: unpack(data.mesh.y).values, corners: unpack(data.mesh.corners).values,
      region: unpack(data.mesh.region).values };
    this.choice = document.getElementById("mesh-view");
    if (!gate) this.choice.querySelector("[value=gate]").remove();
    if (!home) this.choice.querySelector("[value=tunnel]").remove();
    this.choice.addEventListener("change", () => this.paint());
    this.paint();
  }
  viewOf(name) {
    if (name === "gate") return gateView(5 * gate.width);
    if (name === "tunnel") return { x: home.x, y: home.y, half: 1.6 * home.outer };
    const [a, b] = rangeOf([this.mesh.x], 1), [c, d] = rangeOf([this.mesh.y], 1);
    return { x: (a + b) / 2, y: (c + d) / 2, half: 0.52 * Math.max(b - a, d - c) };
  }
  paint() {
    const { x, y, corners, region } = this.mesh, view = this.viewOf(this.choice.value), pen = this.pen;
    const colours = ["#efe6d2", "#f2b8a8", "#d6e6f2", "#ffffff"];
    this.frame(view);
    liningPath(pen, this.at, 2);
    pen.strokeStyle = "#59636f";
    pen.lineWidth = this.choice.value === "box" ? 0.5 : 1;
    for (let e = 0; e < region.length; e++) {
      const p = [0, 1, 2].map((c) => this.at(x[corners[3 * e + c]], y[corners[3 * e + c]]));
      if (p.every(([a]) => a < 0) || p.every(([a]) => a > 900) || p.every(([, b]) => b < 0) || p.every(([, b]) => b > 900)) continue;
      pen.fillStyle = colours[region[e]] || "#ffffff";
      pen.beginPath();
      p.forEach(([a, b], j) => (j ? pen.lineTo(a, b) : pen.moveTo(a, b)));
      pen.closePath();
      pen.fill();
      pen.stroke();
    }
    this.finish(view);
    const told = `Ground${gate ? ", gate (red), inside of the tunnel (blue)" : ""}; view: ${this.choice.selectedOptions[0].textContent}.`;
    caption("mesh", sentence(data.mesh.whole ? told : `${told} Only the triangles nearest to the tunnel are in this page.`));
    this.canvas.setAttribute("aria-label", told);
  }
}

function drawSection() {
  const svg = document.getElementById("section"), { box, water_table: table, soils } = data.section;
  if (!box) { svg.closest("figure").remove(); return; }
  const scale = 400 / box.width, top = 22, bottom = top + box.depth * scale;
  svg.setAttribute("viewBox", `0 0 420 ${bottom + 30}`);
  const px = (x) => 10 + (x + box.width / 2) * scale, py = (y) => top - y * scale;
  element("rect", { x: px(-box.width / 2), y: py(0), width: box.width * scale, height: box.depth * scale, class: "ground" }, svg);
  soils.forEach((soil) => {
    if (soil.top > 0) element("path", { d: `M10 ${py(-soil.top)}h400`, class: "zero" }, svg);
    element("text", { x: 16, y: py(-soil.top) + 15 }, svg, `${soil.name}`);
  });
  if (table !== null) {
    element("path", { d: `M10 ${py(-table)}h400`, class: "water" }, svg);
    element("path", { d: `M386 ${py(-table) - 1}l-6 -9h12z`, fill: "#1f6fb2" }, svg);
    element("text", { x: 376, y: py(-table) - 4, "text-anchor": "end", class: "tick" }, svg, "water table");
  }
  data.section.tunnels.forEach((t, k) => {
    element("circle", { cx: px(t.x), cy: py(t.y), r: t.outer * scale, class: "concrete" }, svg);
    element("circle", { cx: px(t.x), cy: py(t.y), r: t.inner * scale, fill: "#ffffff", stroke: "#55606e" }, svg);
    if (gate && gate.tunnel === k) {
      const a = gate.angle * Math.PI / 180, x = px(t.x + t.outer * Math.sin(a)), y = py(t.y + t.outer * Math.cos(a));
      element("path", { d: "M-5 -10h10l-5 10z", class: "gate", transform: `translate(${x} ${y}) rotate(${gate.angle})` }, svg);
    }
    element("path", { d: `M${px(t.x)} ${py(0)}V${py(t.y + t.outer)}`, class: "zero", "stroke-dasharray": "3 3" }, svg);
    element("text", { x: px(t.x) + 5, y: (py(0) + py(t.y + t.outer)) / 2 }, svg, `${shown(-t.y - t.outer)} m`);
  });
  element("text", { x: 210, y: bottom + 18, "text-anchor": "middle", class: "tick" }, svg,
    `${shown(box.width)} m wide, ${shown(box.depth)} m deep`);
  const told = `${soils.map((s) => s.name).join(", ")}; ${data.section.tunnels.length} tunnel(s)${gate ? `, gate at ${gate.angle}° (red)` : ""}`;
  caption("section", sentence(told));
  svg.setAttribute("aria-label", `section through the ground: ${told}`);
}
