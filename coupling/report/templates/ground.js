// The ground: points coloured by a field, the mesh, the linings, painted as one picture behind the axes of a chart.
class Ground extends Chart {
  constructor() {
    super({ name: "ground", title: "ground", unit: "" }, "canvas");
    const { fields, mesh, section } = data, gate = section.gate;
    Object.assign(this, { fields, mesh, section, gate, home: section.tunnels[gate ? gate.tunnel : 0], picture: document.createElement("canvas") });
    for (const [name, there] of [["gate", gate], ["tunnel", this.home || fields], ["box", mesh]]) if (!there) $("view").querySelector(`[value=${name}]`).remove();
    for (const id of ["field", "view", "edges"]) $(id)?.addEventListener("change", () => { if (id === "view") this.build(); this.draw(true); });
    this.place.addEventListener("mousemove", (event) => this.point(event));
  }
  view() {
    const { home, gate, mesh, fields } = this, a = gate ? gate.angle * Math.PI / 180 : 0, r = home ? (home.outer + home.inner) / 2 : 0;
    if ($("view").value === "gate") return [home.x + r * Math.sin(a), home.y + r * Math.cos(a), Math.max(5 * gate.width, 0.8)];
    if ($("view").value === "tunnel") return fields ? [fields.view.x, fields.view.y, fields.view.half] : [home.x, home.y, 1.6 * home.outer];
    const [x, y] = [mesh.x, mesh.y].map((v) => [v.reduce((p, q) => Math.min(p, q)), v.reduce((p, q) => Math.max(p, q))]);
    return [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2, 0.52 * Math.max(x[1] - x[0], y[1] - y[0])];
  }
  build() {
    const [x, y, half] = this.view(), axis = { ...AXIS, splitLine: { show: false }, axisLine: { onZero: false, lineStyle: { color: GREY } }, splitNumber: 4, axisLabel: { ...AXIS.axisLabel, showMinLabel: false, showMaxLabel: false } };
    const zoom = { type: "inside", filterMode: "none" };
    this.set({
      grid: { left: 50, right: 8, top: 8, bottom: 50 }, dataZoom: [{ ...zoom, xAxisIndex: 0 }, { ...zoom, yAxisIndex: 0 }],
      xAxis: { ...axis, min: x - half, max: x + half, name: "x [m]", nameGap: 22 }, yAxis: { ...axis, min: y - half, max: y + half, name: "y [m]", nameGap: 34 },
      series: [{ type: "custom", id: "picture", clip: true, silent: true, data: [[x, y]], renderItem: (_, api) => this.paint(api) }],
    }, true);
  }
  draw(anew = false) {
    const k = this.fields ? nearest(Float64Array.from(this.fields.snapshots, (s) => s.time), entries[0].series.time[recordAt(entries[0])]) : 0;
    if (k !== this.k || anew) { this.k = k; this.palette(); this.set({ series: [{ id: "picture", data: [[this.view()[0], this.view()[1]]] }] }); }
    if (!this.scale) { this.tell([], "Mesh: ground, gate (red), inside of the tunnel (blue)."); return; }
    const { label, low, high, log, colours } = this.scale, unit = this.scale.unit === "-" ? "" : ` ${this.scale.unit}`;
    const text = `${label}, stored at ${shown(this.fields.snapshots[k].time)} s (nearest to the slider)`;
    this.tell([], `${text}; from ${shown(low)} to ${shown(high)}${unit}`);
    const ends = [low, log ? Math.sqrt(low * high) : (low + high) / 2, high].map((v, j) => `<span>${j === 2 ? "≥ " : ""}${shown(v)}${unit}</span>`);
    $("ground-text").innerHTML = `<div class="colours" style="background:linear-gradient(to right,${colours.map((c) => `rgb(${c})`)})"></div><div class="ends">${ends.join("")}</div>${text}<span id="pointed"></span>`;
  }
  palette() {
    this.scale = this.fields?.fields[$("field").value];
    if (!this.scale) return;
    const stops = this.scale.colours, last = stops.length - 1;
    this.colours = Array.from({ length: 256 }, (_, v) => {
      const at = v / 255 * last, low = Math.min(Math.floor(at), last - 1);
      return `rgb(${stops[low].map((c, j) => Math.round(c + (at - low) * (stops[low + 1][j] - c)))})`;
    });
  }
  place_of(snapshot, j) {
    const { x, y, half } = this.fields.view;
    return [x - half + snapshot.x[j] / 65535 * 2 * half, y - half + snapshot.y[j] / 65535 * 2 * half];
  }
  // what is seen of the plane, painted at the resolution of the screen: an element of the chart
  paint(api) {
    const { x, y, width, height } = this.drawn.getModel().getComponent("grid").coordinateSystem.getRect(), ratio = devicePixelRatio || 1, pen = this.picture.getContext("2d");
    Object.assign(this.picture, { width: width * ratio, height: height * ratio });
    this.at = (px, py) => { const [a, b] = api.coord([px, py]); return [(a - x) * ratio, (b - y) * ratio]; };
    const metre = this.at(1, 0)[0] - this.at(0, 0)[0];
    const inside = ([a, b]) => a > -9 && b > -9 && a < width * ratio + 9 && b < height * ratio + 9;
    if (this.scale) {
      const snapshot = this.fields.snapshots[this.k], values = snapshot[$("field").value], grow = 1.7 * snapshot.spread * this.fields.largest_side / 255 * metre;
      for (let j = 0; j < snapshot.drawn; j++) {
        const [a, b] = this.at(...this.place_of(snapshot, j)), s = Math.max(snapshot.side[j] * grow, 2);
        if (!inside([a, b])) continue;
        pen.fillStyle = this.colours[values[j]];
        pen.fillRect(a - s / 2, b - s / 2, s, s);
      }
    }
    this.linings(pen, ratio);
    if (this.mesh && $("edges").checked) this.edges(pen, inside, ratio);
    return { type: "image", style: { image: this.picture, x, y, width, height } };
  }
  linings(pen, ratio) {
    this.section.tunnels.forEach((t, k) => {
      const open = this.gate && this.gate.tunnel === k ? this.gate : null;
      // the walls of the gate are parallel: its angle differs on the two faces
      const faces = [t.outer, t.inner].map((r) => {
        const half = open ? Math.asin(open.width / 2 / r) : 0, middle = open ? open.angle * Math.PI / 180 : 0;
        return Array.from({ length: 361 }, (_, j) => {
          const a = middle + half + (2 * Math.PI - 2 * half) * j / 360;
          return this.at(t.x + r * Math.sin(a), t.y + r * Math.cos(a));
        });
      });
      const path = (points) => new Path2D(`M${points.map(([a, b]) => `${a.toFixed(1)} ${b.toFixed(1)}`).join("L")}Z`), whole = new Path2D();
      if (open) whole.addPath(path([...faces[0], ...faces[1].reverse()])); else faces.forEach((face) => whole.addPath(path(face)));
      Object.assign(pen, { fillStyle: "#d9dde2", strokeStyle: "#3a434e", lineWidth: ratio });
      pen.fill(whole, "evenodd");
      pen.stroke(whole);
    });
  }
  edges(pen, inside, ratio) {
    const { x, y, corners, region } = this.mesh, fills = [null, "#f2b8a8", "#d6e6f2", null];
    Object.assign(pen, { strokeStyle: "#59636f", lineWidth: 0.5 * ratio });
    for (let e = 0; e < region.length; e++) {
      const p = [0, 1, 2].map((c) => this.at(x[corners[3 * e + c]], y[corners[3 * e + c]]));
      if (!p.some(inside)) continue;
      pen.beginPath();
      p.forEach(([a, b], j) => (j ? pen.lineTo(a, b) : pen.moveTo(a, b)));
      pen.closePath();
      if (fills[region[e]] && !this.scale) { pen.fillStyle = fills[region[e]]; pen.fill(); }
      pen.stroke();
    }
  }
  // the value of the point under the mouse
  point(event) {
    if (!this.scale) return;
    const box = this.place.getBoundingClientRect(), [x, y] = this.drawn.convertFromPixel({ gridIndex: 0 }, [event.clientX - box.left, event.clientY - box.top]);
    const snapshot = this.fields.snapshots[this.k], { low, high, log } = this.scale;
    let best = -1, closest = Infinity;
    for (let j = 0; j < snapshot.drawn; j++) {
      const [a, b] = this.place_of(snapshot, j), far = Math.hypot(a - x, b - y);
      if (far < closest) { closest = far; best = j; }
    }
    const share = snapshot[$("field").value][best] / 255, value = log ? low * (high / low) ** share : low + share * (high - low);
    $("pointed").textContent = closest < 0.5 ? `; at ${shown(x)}, ${shown(y)} m: ${share === 1 ? "≥ " : log && share === 0 ? "≤ " : ""}${shown(value)} ${this.scale.unit}` : "";
  }
}
