// The ground: a field between its points, the mesh, the linings, painted as one picture behind the axes of a chart.
const REGIONS = [null, "#f2b8a8", "#d6e6f2"]; // of the mesh: ground, gate, inside of the tunnel
// Of the picture, one value of the field; in sides of a point's square: how far it counts, how far its ground
// reaches where all around is ground, and in a tunnel.
const PIXELS = 2, FAR = 2, EDGE = [1.6, 0.9];

class Ground extends Chart {
  constructor() {
    super({ name: "ground", title: "ground", unit: "" }, "canvas");
    const { fields, mesh, section: { gate, tunnels } } = data;
    Object.assign(this, { fields, mesh, gate, tunnels, home: tunnels[gate ? gate.tunnel : 0] });
    [this.picture, this.small] = [0, 1].map(() => document.createElement("canvas"));
    const there = { tunnel: this.home || fields, gate, box: mesh };
    for (const name of Object.keys(there)) if (!there[name]) $("view").querySelector(`[value=${name}]`).remove();
    if (!fields) $("edges").checked = true;
    $("view").addEventListener("change", () => this.build());
    for (const id of ["field", "edges"]) $(id)?.addEventListener("change", () => this.draw(true));
    this.place.addEventListener("mousemove", (event) => this.point(event));
  }
  // middle of the view and half its width
  view() {
    const { home, gate, mesh, fields } = this, middle = (v) => (Math.min(...v) + Math.max(...v)) / 2;
    if ($("view").value === "gate") {
      const a = gate.angle * Math.PI / 180, r = (home.outer + home.inner) / 2;
      return { x: home.x + r * Math.sin(a), y: home.y + r * Math.cos(a), half: Math.max(5 * gate.width, 0.8) };
    }
    if ($("view").value === "tunnel") return fields?.view || { ...home, half: 1.6 * home.outer };
    const [x, y] = [range([mesh.x], 1, false), range([mesh.y], 1, false)].map(({ min, max }) => [min, max]);
    return { x: middle(x), y: middle(y), half: 0.5 * Math.max(x[1] - x[0], y[1] - y[0]) };
  }
  build() {
    const { x, y, half } = this.view(), label = { ...AXIS.axisLabel, showMinLabel: false, showMaxLabel: false };
    const axis = { ...AXIS, splitLine: { show: false }, splitNumber: 4, axisLabel: label };
    this.set({
      grid: { left: 50, right: 8, top: 8, bottom: 50 }, dataZoom: [{ ...ZOOM, xAxisIndex: 0 }, { ...ZOOM, yAxisIndex: 0 }],
      xAxis: { ...axis, min: x - half, max: x + half, name: "x [m]", nameGap: 22 },
      yAxis: { ...axis, min: y - half, max: y + half, name: "y [m]", nameGap: 34 },
      series: [{ type: "custom", id: "picture", silent: true, data: [[x, y]], renderItem: (_, api) => this.paint(api) }],
    }, true);
    this.draw(true);
  }
  draw(anew = false) {
    const { fields } = this, record = recordAt(entries[0]);
    const k = fields ? nearest(fields.snapshots.map((s) => s.time), entries[0].series.time[record]) : 0;
    if (k !== this.k || anew) {
      this.k = k;
      this.scale = fields?.fields[$("field").value];
      this.set({ series: [{ id: "picture", data: [[this.view().x, this.view().y]] }] });
    }
    if (!this.scale) { this.tell([], "Mesh: ground, gate (red), inside of the tunnel (blue)."); return; }
    const { label, low, high, log, colours } = this.scale, unit = this.scale.unit === "-" ? "" : ` ${this.scale.unit}`;
    const text = `${label}, stored at ${shown(fields.snapshots[k].time)} s (nearest to the slider)`;
    this.tell([], `${text}; from ${shown(low)} to ${shown(high)}${unit}`);
    const ends = [shown(low), shown(log ? Math.sqrt(low * high) : (low + high) / 2), `≥ ${shown(high)}`];
    $("ground-text").innerHTML = `<div class="colours" style="background:linear-gradient(to right,
      ${colours.map((c) => `rgb(${c})`)})"></div><div class="ends">${ends.map((end) => `<span>${end}${unit}</span>`).join("")}
      </div>${text}<span id="pointed"></span>`;
  }
  placeOf(snapshot, j) {
    const { x, y, half } = this.fields.view, step = 2 * half / 65535;
    return [x - half + snapshot.x[j] * step, y - half + snapshot.y[j] * step];
  }
  // what is seen of the plane, at the resolution of the screen, as an element of the chart
  paint(api) {
    const frame = this.drawn.getModel().getComponent("grid").coordinateSystem.getRect(), { x, y, width, height } = frame;
    const ratio = devicePixelRatio || 1, pen = this.pen = this.picture.getContext("2d");
    Object.assign(this.picture, { width: width * ratio, height: height * ratio });
    this.at = (place) => { const [a, b] = api.coord(place); return [(a - x) * ratio, (b - y) * ratio]; };
    this.seen = ([a, b]) => a > -9 && b > -9 && a < width * ratio + 9 && b < height * ratio + 9;
    if (this.scale) this.paintPoints(api.size([1, 1])[0] * ratio);
    pen.lineWidth = ratio;
    this.tunnels.forEach((tunnel, k) => this.paintLining(tunnel, this.gate?.tunnel === k ? this.gate : null));
    pen.lineWidth = 0.5 * ratio;
    if (this.mesh && $("edges").checked) this.paintMesh();
    return { type: "image", style: { image: this.picture, ...frame } };
  }
  // a pixel that the ground of a point covers is the mean of the points around it, near and small ones counting most;
  // none of them lies behind a lining
  paintPoints(metre) {
    const snapshot = this.fields.snapshots[this.k], values = snapshot[$("field").value], { picture } = this;
    const wide = Math.ceil(picture.width / PIXELS), high = Math.ceil(picture.height / PIXELS), count = wide * high;
    const sum = new Float32Array(count), weight = new Float32Array(count), nearest = new Float32Array(count).fill(Infinity);
    const rooms = this.rooms(wide, high), grow = snapshot.spread * this.fields.largest_side / 255 * metre / PIXELS;
    for (let j = 0; j < snapshot.drawn; j++) {
      const place = this.placeOf(snapshot, j), room = this.roomOf(...place), [a, b] = this.at(place).map((v) => v / PIXELS - 0.5);
      const side = Math.max(snapshot.side[j] * grow, 0.6), far = FAR * side;
      for (let q = Math.max(0, Math.ceil(b - far)); q <= Math.min(high - 1, b + far); q++) {
        for (let p = Math.max(0, Math.ceil(a - far)); p <= Math.min(wide - 1, a + far); p++) {
          const pixel = q * wide + p, square = ((p - a) ** 2 + (q - b) ** 2) / side ** 2;
          if (square >= FAR ** 2 || rooms[pixel] !== room) continue;
          const counts = (1 - square / FAR ** 2) ** 3 / side ** 2;
          sum[pixel] += counts * values[j];
          weight[pixel] += counts;
          nearest[pixel] = Math.min(nearest[pixel], square);
        }
      }
    }
    const stops = this.scale.colours, last = stops.length - 1, image = new ImageData(wide, high);
    for (let pixel = 0; pixel < count; pixel++) {
      if (!weight[pixel]) continue;
      const v = sum[pixel] / weight[pixel] / 255 * last, low = Math.min(Math.floor(v), last - 1);
      for (let c = 0; c < 3; c++) image.data[4 * pixel + c] = stops[low][c] + (v - low) * (stops[low + 1][c] - stops[low][c]);
      image.data[4 * pixel + 3] = 255 * Math.max(0, Math.min(1, (EDGE[rooms[pixel] ? 1 : 0] - Math.sqrt(nearest[pixel])) * 5));
    }
    Object.assign(this.small, { width: wide, height: high }).getContext("2d").putImageData(image, 0, 0);
    this.pen.drawImage(this.small, 0, 0, wide * PIXELS, high * PIXELS);
  }
  // 0 in the ground, k in tunnel k, counted from 1
  roomOf(x, y) {
    return this.tunnels.findIndex((one) => Math.hypot(x - one.x, y - one.y) < (one.outer + one.inner) / 2) + 1;
  }
  rooms(wide, high) {
    const found = new Uint8Array(wide * high);
    this.tunnels.forEach((one, k) => {
      const [a, b] = this.at([one.x, one.y]), [right] = this.at([one.x + (one.outer + one.inner) / 2, one.y]);
      for (let pixel = 0; pixel < found.length; pixel++) {
        const p = (pixel % wide + 0.5) * PIXELS - a, q = (Math.floor(pixel / wide) + 0.5) * PIXELS - b;
        if (Math.hypot(p, q) < right - a) found[pixel] = k + 1;
      }
    });
    return found;
  }
  paintLining(tunnel, gate) {
    // the walls of the gate are parallel: its angle differs on the two faces
    const [outer, inner] = [tunnel.outer, tunnel.inner].map((r) => {
      const half = gate ? Math.asin(gate.width / 2 / r) : 0, first = (gate ? gate.angle * Math.PI / 180 : 0) + half;
      return Array.from({ length: 361 }, (_, j) => first + 2 * (Math.PI - half) * j / 360)
        .map((a) => this.at([tunnel.x + r * Math.sin(a), tunnel.y + r * Math.cos(a)]));
    });
    Object.assign(this.pen, { fillStyle: "#d9dde2", strokeStyle: "#3a434e" });
    this.trace(gate ? [[...outer, ...inner.reverse()]] : [outer, inner]);
    this.pen.fill("evenodd");
    this.pen.stroke();
  }
  paintMesh() {
    const { x, y, corners, region } = this.mesh;
    this.pen.strokeStyle = "#59636f";
    for (let e = 0; e < region.length; e++) {
      const triangle = [0, 1, 2].map((c) => this.at([x[corners[3 * e + c]], y[corners[3 * e + c]]]));
      if (!triangle.some(this.seen)) continue;
      this.trace([triangle]);
      this.pen.fillStyle = REGIONS[region[e]] || "transparent";
      if (!this.scale) this.pen.fill();
      this.pen.stroke();
    }
  }
  trace(polygons) {
    this.pen.beginPath();
    for (const places of polygons) {
      places.forEach((place, j) => (j ? this.pen.lineTo(...place) : this.pen.moveTo(...place)));
      this.pen.closePath();
    }
  }
  // the value of the point under the mouse
  point({ clientX, clientY }) {
    if (!this.scale) return;
    const box = this.place.getBoundingClientRect(), { low, high, log, unit } = this.scale;
    const [x, y] = this.drawn.convertFromPixel({ gridIndex: 0 }, [clientX - box.left, clientY - box.top]);
    const snapshot = this.fields.snapshots[this.k], far = Array.from({ length: snapshot.drawn }, (_, j) => {
      const [a, b] = this.placeOf(snapshot, j);
      return Math.hypot(a - x, b - y);
    });
    const best = nearest(far, 0), share = snapshot[$("field").value][best] / 255;
    const value = `${share === 1 ? "≥ " : ""}${shown(log ? low * (high / low) ** share : low + share * (high - low))}`;
    $("pointed").textContent = far[best] < 0.5 ? `; at ${shown(x)}, ${shown(y)} m: ${value} ${unit}` : "";
  }
}
