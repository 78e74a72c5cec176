// What is drawn by ECharts: around a ring, over time or inflow mass, the deformed ring. Each has build() after a choice and
// draw() after a move of the slider.
const MOST_NAMED = 4, INK = "#3f4a57", GREY = "#6b7480", RED = "#c1272d", FONT = { color: INK, fontSize: 12, fontFamily: "inherit" };
const AXIS = { axisLabel: { ...FONT, hideOverlap: true, formatter: (v) => shown(v) }, axisLine: { onZero: false, lineStyle: { color: GREY } },
  splitLine: { lineStyle: { color: "#dde2e8" } }, nameTextStyle: FONT, nameLocation: "middle" };
const START = { id: "start", name: "start", itemStyle: { color: GREY }, lineStyle: { color: GREY, type: [5, 3], width: 1.4 } };
const LINE = { type: "line", showSymbol: false, silent: true, clip: false, emphasis: { disabled: true } };

// A line for each entry that is shown and each lining model that is chosen: {one, model, name, style}.
function lines(ofModel) {
  const many = entries.length > 1;
  return entries.flatMap((one, e) => {
    if (!one.shown) return [];
    if (!ofModel) return [{ one, model: null, from: one, name: many ? one.label : "now", style: caseStyle(e) }];
    const chosen = one.models.filter((_, m) => state.model < 0 || m === state.model);
    return chosen.map((model) => {
      const m = one.models.indexOf(model), style = many ? { ...caseStyle(e), ...(chosen.length > 1 && { type: DASHES[m], width: 2 - 0.7 * m }) }
        : { color: COLOURS[m], type: DASHES[m], width: 2 };
      const name = [many && one.label, (chosen.length > 1 || !many) && model.name].filter(Boolean).join(", ");
      return { one, model, from: model, name, style };
    });
  });
}

// Few cases differ by colour and dash; many repeat the colours with another dash.
function caseStyle(e) {
  const dash = entries.length <= 4 ? e : Math.floor(e / COLOURS.length);
  return { color: COLOURS[e % COLOURS.length], type: DASHES[dash % DASHES.length], width: 2 };
}

// A curve at the slider, less that of the start where changes are shown; null where the entry did not get there.
function curve(from, one, key, r = one.at[state.stop]) {
  if (r < 0 || !from.curves[key]) return null;
  const now = row(from.curves[key], r), start = row(from.curves[key], 0);
  return state.against === "change" ? now.map((v, j) => v - start[j]) : now;
}

// a place at an angle clockwise from the crown
const turned = (degree, r = 1) => [r * Math.sin(degree * Math.PI / 180), r * Math.cos(degree * Math.PI / 180)];
const recordAt = (one) => (one.at[state.stop] < 0 ? -1 : one.records[one.at[state.stop]]);
const swatch = ({ color, type, width = 2 }) => `<svg class="swatch" viewBox="0 0 28 10" aria-hidden="true"><path d="M0 5H28" stroke="${color}" stroke-width="${width}" stroke-dasharray="${type}"/></svg>`;
const tip = (title, unit) => ({ trigger: "axis", confine: true, transitionDuration: 0, textStyle: FONT, axisPointer: { type: "line", snap: true },
  formatter: (found) => [title(found[0]), ...found.filter((p) => p.seriesName).map((p) => `${p.marker}${echarts.format.encodeHTML(p.seriesName)} ${shown(p.data[p.encode?.y?.[0] ?? 0] ?? p.data[0])} ${unit}`)].join("<br>") });

class Chart {
  constructor(about, renderer = "svg") {
    Object.assign(this, about);
    this.place = $(this.name);
    this.drawn = echarts.init(this.place, null, { renderer });
    new ResizeObserver(() => this.drawn.resize()).observe(this.place);
  }
  set(option, anew = false) { this.drawn.setOption({ animation: false, ...option }, { notMerge: anew, lazyUpdate: false }); }
  // the legend with what each line is at the slider: [{name, style, text}]; of many that one alone which is largest
  tell(found, more = "") {
    const words = ({ name, text }) => [name !== "now" && name, text].filter(Boolean).join(": "), caption = $(`${this.name}-text`);
    this.place.setAttribute("aria-label", `${this.title}${this.unit ? ` in ${this.unit}` : ""}: ${[...found.map(words), more].filter(Boolean).join("; ") || "nothing is shown"}`);
    const largest = found.filter((f) => Number.isFinite(f.size)).sort((a, b) => b.size - a.size).slice(0, 1);
    caption.replaceChildren(...(found.length > MOST_NAMED ? largest : found).map((f) => {
      const line = document.createElement("div");
      line.innerHTML = swatch(f.style);
      line.append(words(f));
      return line;
    }), more);
  }
}

class RingChart extends Chart {
  build() {
    const polar = state.shape === "polar", theta = data.theta, key = this.keys[0];
    this.lines = lines(this.of_model).filter((l) => l.from.curves[key]);
    const all = this.lines.flatMap(({ one, from }) => one.records.map((_, r) => curve(from, one, key, r)));
    const axis = this.axis = range(all, this.factor, true, polar);
    const at = (angle, value) => (polar ? [value, angle] : [angle, value]);
    this.points = (values) => (values ? [...theta, 360].map((angle, j) => at(angle, values[j % theta.length] * this.factor)) : []);
    const system = { coordinateSystem: polar ? "polar" : "cartesian2d" }, first = this.lines[0];
    const alone = this.lines.every((l) => l.one === first.one);
    const gates = new Map(this.lines.filter((l) => l.one.gate !== null).map((l) => [l.one.gate, l]));
    const only = gates.size === 1 ? this.lines.find((l) => l.one.gate !== null).one.gate : null;
    const shares = (angle) => new Set(this.lines.filter((l) => l.one.gate === angle).map((l) => l.one)).size > 1;
    const still = [
      { ...LINE, ...system, lineStyle: { color: "#8b949e", width: 1, type: [1, 3] },
        data: (first?.one.joint_angle || []).flatMap((angle) => [at(angle, axis.min), at(angle, axis.max), [null, null]]) },
      { ...LINE, ...system, lineStyle: { color: GREY, width: 1 }, data: axis.min < 0 ? [...theta, 360].map((angle) => at(angle, 0)) : [] },
      { ...LINE, ...system, type: "scatter", symbol: "path://M0 0h10l-5 9z", symbolSize: [11, 10], clip: false, z: 5,
        data: [...gates].map(([angle, l]) => {
          const [x, y] = [1, -1].map((sign, c) => sign * turned(polar ? angle : 0)[c]);
          return { value: at(angle, axis.max), symbolRotate: polar ? -angle : 0, symbolOffset: [6 * x, 6 * y], itemStyle: { color: gates.size > 1 && !shares(angle) ? l.style.color : RED, opacity: 1 },
            label: { show: only !== null, formatter: "gate", color: RED, fontSize: 12, fontWeight: 600, position: "inside", offset: polar ? [23 * x, 15 * y] : [26, 0] } };
        }) },
    ].map((s, k) => ({ ...s, id: `still${k}`, tooltip: { show: false } }));
    this.start = alone && first && state.against === "value" ? [{ ...LINE, ...system, ...START, data: this.points(curve(first.from, first.one, key, 0)) }] : [];
    const moving = this.lines.map((l, k) => ({ ...LINE, ...system, id: `line${k}`, name: l.name, lineStyle: l.style, itemStyle: { color: l.style.color }, data: [] }));
    const unrolled = { type: "value", min: 0, max: 360, interval: 60 };
    this.set({
      ...(polar ? { polar: { center: ["50%", "50%"], radius: [axis.min < 0 ? "24%" : 0, `${(100 - 9000 / this.place.clientWidth).toFixed(0)}%`] },
        angleAxis: { ...AXIS, ...unrolled, interval: 45, startAngle: 90, axisLabel: { ...FONT, margin: 12, formatter: (v) => (only !== null && Math.abs((v - only + 540) % 360 - 180) < 16 ? "" : `${v}°`) }, axisLine: { show: false }, axisTick: { show: false } },
        radiusAxis: { ...AXIS, ...axis, axisLine: { show: false }, axisTick: { show: false }, z: 4, axisLabel: { ...AXIS.axisLabel, showMinLabel: false, showMaxLabel: false, textBorderColor: "#fff", textBorderWidth: 3 } } }
        : { grid: { left: 54, right: 16, top: 20, bottom: 42 }, dataZoom: [{ type: "inside", filterMode: "none" }],
          xAxis: { ...AXIS, ...unrolled, name: "angle from the crown, clockwise [°]", nameGap: 24 }, yAxis: { ...AXIS, ...axis } }),
      series: [...still, ...this.start, ...moving],
      tooltip: tip((p) => `${shown(polar ? p.data[1] : p.data[0])}°`, this.unit),
    }, true);
  }
  draw() {
    const key = this.keys[0];
    this.set({ series: this.lines.map(({ from, one }, k) => ({ id: `line${k}`, data: this.points(curve(from, one, key)) })) });
    this.tell([...this.start.map((s) => ({ name: "start", style: s.lineStyle })), ...this.lines.map(({ one, from, name, style }) => {
      const r = recordAt(one), end = (e, tail = "") => from.series[`${key}_${e}${tail}`]?.[r] ?? NaN;
      const told = ["max", "min"].map((e) => `${e} ${shown(end(e) * this.factor)} at ${shown(end(e, "_angle"))}°`);
      return { name, style, size: end("max"), text: Number.isFinite(end("max")) ? told.join(", ") : "not reached" };
    })], state.against === "change" ? "Drawn: the change since the gate opened." : "");
  }
}

class ProgressChart extends Chart {
  build() {
    const along = this.kind === "time" ? "time" : state.along;
    this.own = data.stops.along === along || entries.length === 1;
    this.lines = this.values ? [{ one: entries[0], style: caseStyle(0), name: "now", x: entries[0].series[along], y: this.values }]
      : lines(this.of_model).flatMap((l) => this.keys.filter((k) => l.from.series[k]).map((k) => ({ ...l, x: l.one.series[along], y: l.from.series[k] })));
    this.names = [...new Set(this.lines.map((l) => l.name))];
    this.points = this.lines.map(({ x, y }) => Array.from(x, (v, j) => [v, y[j] * this.factor]).filter(([a, b]) => Number.isFinite(a) && Number.isFinite(b)));
    const xs = range(this.lines.map((l) => l.x), 1, true), style = (l) => ({ itemStyle: { color: l.style.color } });
    this.set({
      grid: { left: 54, right: 18, top: 14, bottom: 42 }, dataZoom: [{ type: "inside", filterMode: "none" }],
      xAxis: { ...AXIS, min: 0, max: Math.max(...this.lines.flatMap((l) => Array.from(l.x).filter(Number.isFinite)), xs.max / 1e3), name: along === "time" ? "time since the gate opened [s]" : "inflow mass [kg/m]", nameGap: 24, splitLine: { show: false } },
      yAxis: { ...AXIS, ...range(this.lines.map((l) => l.y), this.factor, !this.of_model && !this.values) },
      tooltip: tip((p) => `${along === "time" ? "time" : "inflow mass"} ${shown(p.data[0])} ${along === "time" ? "s" : "kg/m"}`, this.unit),
      series: [...this.lines.map((l, k) => ({ ...LINE, id: `line${k}`, name: l.name, lineStyle: l.style, ...style(l), data: this.points[k], silent: false })),
        { id: "dots", type: "scatter", symbolSize: 8, silent: true, data: [], z: 5, tooltip: { show: false } }],
    }, true);
    this.drawn.getZr().off("click");
    if (this.own) this.drawn.getZr().on("click", ({ offsetX, offsetY }) => {
      const [x] = this.drawn.convertFromPixel({ gridIndex: 0 }, [offsetX, offsetY]), one = entries[0], at = one.series[along];
      move(data.stops.along === along ? nearest(stops, x) : nearest(one.records.map((r) => at[r]), x));
    });
  }
  draw() {
    const told = new Map(), dots = this.lines.map((l) => {
      const r = recordAt(l.one), y = r < 0 ? NaN : l.y[r] * this.factor;
      told.set(l.name, [...(told.get(l.name) || []), y]);
      return { value: r < 0 || !Number.isFinite(y) ? [null, null] : [l.x[r], y], itemStyle: { color: l.style.color, borderColor: "#fff" } };
    });
    const at = dots.find((d) => d.value[0] !== null)?.value[0];
    this.set({ series: [{ id: "dots", data: dots, markLine: { silent: true, symbol: "none", label: { show: false }, animation: false, precision: 9, lineStyle: { color: RED, type: "solid", width: 1.5 }, data: this.own && at !== undefined ? [{ xAxis: at }] : [] } }] });
    this.tell(this.names.map((name) => ({ name, text: told.get(name).some(Number.isFinite) ? `${told.get(name).map(shown).join(" and ")} ${this.unit}` : "not reached", style: this.lines.find((l) => l.name === name).style, size: told.get(name)[0] })));
  }
}

class DeformedRing extends Chart {
  build() {
    this.lines = lines(true).filter((l) => l.model.curves.displacement_radial);
    const first = this.lines[0];
    if (!first) { this.set({ series: [] }, true); return; }
    const [outer, inner] = first.one.radii;
    this.radius = (outer + inner) / 2;
    const sizes = this.lines.flatMap(({ one, model }) => one.records.flatMap((_, r) => this.shape(one, model, r).map(([a, b]) => Math.hypot(a, b) || 0)));
    const raw = 0.3 * this.radius / sizes.reduce((a, b) => Math.max(a, b), 1e-12), power = 10 ** Math.floor(Math.log10(raw));
    this.enlarged = Math.max(...[1, 2, 5].filter((s) => s * power <= raw * 1.000001)) * power;
    const circle = (r) => Array.from({ length: 121 }, (_, k) => turned(3 * k, r));
    const alone = this.lines.every((l) => l.one === first.one), edge = { min: -1.4 * outer, max: 1.4 * outer, show: false };
    this.start = alone ? [{ ...LINE, ...START, data: this.path(first.one, first.model, 0) }] : [];
    const moving = this.lines.map((l, k) => ({ ...LINE, id: `line${k}`, name: l.name, lineStyle: l.style, itemStyle: { color: l.style.color }, data: [] }));
    const names = { type: "scatter", symbolSize: 0, silent: true, label: { show: true, formatter: (p) => p.data[2], ...FONT, color: "#1b2430" } };
    this.set({
      grid: { left: 0, right: 0, top: 0, bottom: 0 }, xAxis: { type: "value", ...edge }, yAxis: { type: "value", ...edge },
      series: [...[outer, inner].map((r, k) => ({ ...LINE, id: `face${k}`, lineStyle: { color: "#c4cad2", width: 1 }, data: circle(r) })), ...this.start, ...moving,
        { id: "joints", type: "scatter", symbolSize: 9, silent: true, itemStyle: { color: "#fff", borderColor: RED, borderWidth: 1.5 }, z: 5, data: [] },
        { id: "names", ...names, data: first.one.joint_angle.map((angle, j) => [...turned(angle, 0.68 * this.radius), String(j + 1)]) }],
    }, true);
  }
  // displacement [radial, tangential] at each angle without the mean motion of the ring: what moves as a whole does not deform
  shape(one, model, r) {
    const radial = row(model.curves.displacement_radial, r), along = row(model.curves.displacement_tangential, r), n = data.theta.length;
    const turn = data.theta.map((degree) => turned(degree));
    const right = turn.reduce((sum, [s, c], k) => sum + radial[k] * s + along[k] * c, 0) / n, up = turn.reduce((sum, [s, c], k) => sum + radial[k] * c - along[k] * s, 0) / n;
    return turn.map(([s, c], k) => [radial[k] - right * s - up * c, along[k] - right * c + up * s]);
  }
  put(degree, [radial, along]) {
    const [s, c] = turned(degree), r = this.radius + this.enlarged * radial, t = this.enlarged * along;
    return [r * s + t * c, r * c - t * s];
  }
  path(one, model, r) {
    const moved = this.shape(one, model, r), theta = data.theta, n = theta.length;
    return Array.from({ length: n + 1 }, (_, j) => j % n).flatMap((k, j) => {
      const before = theta[(k + n - 1) % n], span = (theta[k] - before + 360) % 360, point = this.put(theta[k], moved[k]);
      // a joint between two angles interrupts the line
      return j > 0 && one.joint_angle.some((at) => (at - before + 360) % 360 < span) ? [[null, null], point] : [point];
    });
  }
  draw() {
    if (!this.lines.length) { this.tell([]); return; }
    const there = this.lines.filter(({ one }) => one.at[state.stop] >= 0), n = data.theta.length;
    const at = (one) => one.at[state.stop];
    const joints = there.flatMap(({ one, model }) => {
      const moved = this.shape(one, model, at(one));
      return one.joint_angle.map((angle) => {
        const i = Math.max(0, data.theta.findIndex((v) => v >= angle)), h = (i + n - 1) % n;
        return this.put(angle, [0, 1].map((c) => (moved[i][c] + moved[h][c]) / 2));
      });
    });
    this.set({ series: [...this.lines.map(({ one, model }, k) => ({ id: `line${k}`, data: at(one) < 0 ? [] : this.path(one, model, at(one)) })), { id: "joints", data: joints }] });
    this.tell([...this.start.map((s) => ({ name: "start", style: s.lineStyle })), ...there.map(({ one, model, name, style }) => {
      const size = 1e3 * Math.max(...this.shape(one, model, at(one)).map(([a, b]) => Math.hypot(a, b) || 0));
      return { name, style, size, text: `largest ${shown(size)} mm` };
    })], `${shown(this.enlarged)} times enlarged, without the motion of the ring as a whole.`);
  }
}
