// What is drawn by ECharts, around a ring and over time or inflow mass: build() after a choice, draw() after a move of
// the slider.
const MOST_NAMED = 4, INK = "#3f4a57", GREY = "#6b7480", RED = "#c1272d";
const FONT = { color: INK, fontSize: 12, fontFamily: "inherit" };
const AXIS = {
  axisLabel: { ...FONT, hideOverlap: true, formatter: (v) => shown(v) }, nameTextStyle: FONT, nameLocation: "middle",
  axisLine: { onZero: false, lineStyle: { color: GREY } }, splitLine: { lineStyle: { color: "#dde2e8" } },
};
const UNMARKED = { axisLine: { show: false }, axisTick: { show: false } };
// the wheel alone scrolls the page, and so does a finger
const ZOOM = { type: "inside", filterMode: "none", zoomOnMouseWheel: "shift", preventDefaultMouseMove: false };
const START = { color: GREY, type: [5, 3], width: 1.4 };
const line = (id, style, data = [], more = {}) => ({
  id, type: "line", data, lineStyle: style, itemStyle: { color: style.color }, symbol: "none", clip: false, ...more,
});

// A line for each entry that is shown and each lining model that is chosen: {one, from (whose values), name, style}.
function lines(ofModel) {
  const many = entries.length > 1;
  return entries.flatMap((one, e) => {
    const chosen = one.models.filter((_, m) => state.model < 0 || m === state.model);
    if (!one.shown) return [];
    if (!ofModel) return [{ one, from: one, name: many ? one.label : "now", style: caseStyle(e) }];
    return chosen.map((from) => {
      const m = one.models.indexOf(from), name = [many && one.label, (chosen.length > 1 || !many) && from.name];
      const style = many ? caseStyle(e, chosen.length > 1 ? m : null) : caseStyle(m, m);
      return { one, from, name: name.filter(Boolean).join(", "), style };
    });
  });
}

// Few cases differ by colour and dash; many repeat the colours with another dash, and several models take the dashes.
function caseStyle(e, model = null) {
  const dash = model ?? (entries.length <= MOST_NAMED ? e : Math.floor(e / COLOURS.length));
  return { color: COLOURS[e % COLOURS.length], type: DASHES[dash % DASHES.length], width: 2 };
}

const swatch = ({ color, type }) => `<svg class="swatch" viewBox="0 0 28 10" aria-hidden="true">
  <path d="M0 5H28" stroke="${color}" stroke-width="2" stroke-dasharray="${type}"/></svg>`;
// record of an entry at the slider; -1 where it did not get there
const recordAt = (one) => (one.at[state.stop] < 0 ? -1 : one.records[one.at[state.stop]]);

class Chart {
  constructor(about, renderer = "svg") {
    Object.assign(this, about);
    this.place = $(this.name);
    this.drawn = echarts.init(this.place, null, { renderer });
    this.place.firstElementChild.setAttribute("aria-hidden", "true"); // the name of the place says it in words
    this.waiting = [];
    new ResizeObserver(() => this.drawn.resize()).observe(this.place);
    new IntersectionObserver(([last]) => { this.seen = last.isIntersecting; if (this.seen) this.flush(); }).observe(this.place);
  }
  // what is out of sight is drawn when it comes into sight: of what waits the last build and the last draw
  set(option, anew = false) {
    this.waiting = [...(anew ? [] : this.waiting.filter((w) => w.anew)), { option, anew }];
    if (this.seen) this.flush();
  }
  flush() {
    for (const { option, anew } of this.waiting.splice(0)) this.drawn.setOption({ animation: false, ...option }, anew);
  }
  // all values at the place of the mouse
  tooltip(head) {
    const text = (p, v) => `${p.marker}${echarts.format.encodeHTML(p.seriesName)} ${shown(v)} ${this.unit}`;
    return { trigger: "axis", confine: true, transitionDuration: 0, textStyle: FONT, formatter: (found) => {
      const named = found.filter((p) => p.seriesId.startsWith("line") || p.seriesId === "start");
      return [head(named[0]), ...named.map((p) => text(p, p.data[this.valueAt ?? 1]))].join("<br>");
    } };
  }
  // the legend with what each line is at the slider: [{name, style, text, size}]; of many that one which is largest
  tell(found, more = "") {
    const words = ({ name, text }) => [name !== "now" && name, text].filter(Boolean).join(": ");
    const told = [...found.map(words), more].filter(Boolean).join("; ") || "nothing is shown";
    this.place.setAttribute("aria-label", `${this.title}${this.unit ? ` in ${this.unit}` : ""}: ${told}`);
    const largest = found.filter((f) => Number.isFinite(f.size)).sort((a, b) => b.size - a.size).slice(0, 1);
    $(`${this.name}-text`).replaceChildren(...(found.length > MOST_NAMED ? largest : found).map((f) => {
      const row = document.createElement("div");
      row.innerHTML = swatch(f.style);
      row.append(words(f));
      return row;
    }), more);
  }
}

class RingChart extends Chart {
  build() {
    const polar = state.shape === "polar", [key] = this.keys, { theta } = data;
    const system = { coordinateSystem: polar ? "polar" : "cartesian2d", silent: true };
    this.valueAt = polar ? 0 : 1;
    this.at = (angle, value) => (polar ? [value, angle] : [angle, value]);
    // where another model has no such curve there is no line
    this.lines = lines(this.of_model).filter((l) => l.from.curves[key]);
    const [first] = this.lines, all = this.lines.flatMap((l) => l.one.records.map((_, r) => this.curve(l, r)));
    const axis = range(all, this.factor, true, polar);
    const alone = first && state.against === "value" && this.lines.every((l) => l.one === first.one);
    this.start = alone ? [line("start", START, this.points(this.curve(first, 0)), { ...system, name: "start" })] : [];
    const across = (angle) => [this.at(angle, axis.min), this.at(angle, axis.max), [null, null]];
    const joints = (first?.one.joint_angle || []).flatMap(across);
    const zero = axis.min < 0 ? [...theta, 360].map((angle) => this.at(angle, 0)) : [];
    this.set({
      ...(polar ? this.polar(axis) : this.unrolled(axis)),
      tooltip: this.tooltip((p) => `${shown(p.data[1 - this.valueAt])}°`),
      series: [
        line("joints", { color: "#8b949e", width: 1, type: [1, 3] }, joints, system),
        line("zero", { color: GREY, width: 1 }, zero, system), this.numbers(polar, axis, first), this.gates(polar, axis),
        ...this.start,
        ...this.lines.map((l, k) => line(`line${k}`, l.style, [], { ...system, name: l.name })),
      ],
    }, true);
  }
  polar(axis) {
    const gates = new Set(this.lines.map((l) => l.one.gate)), [gate] = gates;
    const free = (v) => gates.size > 1 || gate === null || Math.abs((v - gate + 540) % 360 - 180) > 15;
    const turn = { min: 0, max: 360, interval: 45, startAngle: 90 };
    return {
      polar: { radius: [axis.min < 0 ? "24%" : 0, `${(100 - 9000 / this.place.clientWidth).toFixed(0)}%`] },
      angleAxis: { ...AXIS, ...UNMARKED, ...turn, type: "value",
        axisLabel: { ...FONT, margin: 12, formatter: (v) => (free(v) ? `${v}°` : "") } },
      radiusAxis: { ...AXIS, ...UNMARKED, ...axis, z: 4, axisLabel: { ...AXIS.axisLabel, showMinLabel: false,
        showMaxLabel: false, textBorderColor: "#fff", textBorderWidth: 3 } },
    };
  }
  unrolled(axis) {
    return {
      grid: { left: 54, right: 16, top: 20, bottom: 42 }, dataZoom: [ZOOM], yAxis: { ...AXIS, ...axis },
      xAxis: { ...AXIS, min: 0, max: 360, interval: 60, name: "angle from the crown, clockwise [°]", nameGap: 24 },
    };
  }
  // the numbers of the joints, inside the rim
  numbers(polar, axis, first) {
    const marks = (first?.one.joint_angle || []).map((angle, j) => {
      const turn = angle * Math.PI / 180, offset = polar ? [-9 * Math.sin(turn), 9 * Math.cos(turn)] : [6, 8];
      return { value: this.at(angle, axis.max), label: { show: true, formatter: String(j + 1), position: "inside", offset } };
    });
    return {
      id: "numbers", type: "scatter", coordinateSystem: polar ? "polar" : "cartesian2d", clip: false, z: 5, silent: true,
      symbolSize: 1, itemStyle: { color: "transparent" }, tooltip: { show: false }, data: marks,
      label: { color: INK, fontSize: 10, textBorderColor: "#fff", textBorderWidth: 2 },
    };
  }
  // a triangle at the gate; where cases have different ones, in the colour of the case that is alone there
  gates(polar, axis) {
    const angles = [...new Set(this.lines.map((l) => l.one.gate))].filter((angle) => angle !== null);
    const marks = angles.map((angle) => {
      const here = this.lines.filter((l) => l.one.gate === angle), turn = polar ? angle * Math.PI / 180 : 0;
      const own = angles.length > 1 && here.every((l) => l.one === here[0].one), x = Math.sin(turn), y = -Math.cos(turn);
      return {
        value: this.at(angle, axis.max), symbolRotate: polar ? -angle : 0, symbolOffset: [6 * x, 6 * y],
        itemStyle: { color: own ? here[0].style.color : RED, opacity: 1 },
        label: { show: angles.length === 1, formatter: "gate", color: RED, fontWeight: 600, position: "inside",
          offset: polar ? [23 * x, 15 * y] : [26, 0] },
      };
    });
    return {
      id: "gates", type: "scatter", coordinateSystem: polar ? "polar" : "cartesian2d", clip: false, z: 5, silent: true,
      symbol: "path://M0 0h10l-5 9z", symbolSize: [11, 10], tooltip: { show: false }, data: marks,
    };
  }
  // values around the ring in a row, less those of the start where changes are shown; null where there are none
  curve({ one, from }, r = one.at[state.stop]) {
    if (r < 0) return null;
    const curves = from.curves[this.keys[0]], now = row(curves, r), start = row(curves, 0);
    return state.against === "change" ? now.map((v, j) => v - start[j]) : now;
  }
  points(values) {
    const { theta } = data;
    return values ? [...theta, 360].map((angle, j) => this.at(angle, values[j % theta.length] * this.factor)) : [];
  }
  draw() {
    this.set({ series: this.lines.map((l, k) => ({ id: `line${k}`, data: this.points(this.curve(l)) })) });
    // of all angles, also where curves are thinned
    const told = this.lines.map(({ one, from, name, style }) => {
      const end = (e, tail = "") => from.series[`${this.keys[0]}_${e}${tail}`]?.[recordAt(one)] ?? NaN;
      const ends = ["max", "min"].map((e) => `${e} ${shown(end(e) * this.factor)} at ${shown(end(e, "_angle"))}°`);
      return { name, style, size: end("max"), text: Number.isFinite(end("max")) ? ends.join(", ") : "not reached" };
    });
    const change = state.against === "change" ? "Drawn: the change since the gate opened." : "";
    this.tell([...this.start.map(() => ({ name: "start", style: START })), ...told], change);
  }
}

class ProgressChart extends Chart {
  build() {
    const along = this.kind === "time" ? "time" : state.along, [name, unit] = along === "time"
      ? ["time since the gate opened", "s"] : ["inflow mass", "kg/m"];
    const found = this.values ? [{ ...lines(false)[0], y: this.values }] : lines(this.of_model).flatMap((l) =>
      this.keys.filter((key) => l.from.series[key]).map((key) => ({ ...l, y: l.from.series[key] })));
    this.lines = found.map((l) => ({ ...l, x: l.one.series[along] }));
    const last = Math.max(1e-9, ...this.lines.flatMap((l) => Array.from(l.x).filter(Number.isFinite)));
    this.axis = range(this.lines.map((l) => l.y), this.factor, !this.of_model && !this.values);
    const known = (point) => point.every(Number.isFinite);
    const points = ({ x, y }) => Array.from(x, (v, j) => [v, y[j] * this.factor]).filter(known);
    this.set({
      grid: { left: 54, right: 18, top: 14, bottom: 42 }, dataZoom: [ZOOM],
      xAxis: { ...AXIS, min: 0, max: last, name: `${name} [${unit}]`, nameGap: 24, splitLine: { show: false } },
      yAxis: { ...AXIS, ...this.axis },
      tooltip: this.tooltip((p) => `${name} ${shown(p.data[0])} ${unit}`),
      series: [line("cursor", { color: RED, type: "solid", width: 1.5 }, [], { silent: true }),
        ...this.lines.map((l, k) => line(`line${k}`, l.style, points(l), { name: l.name })),
        { id: "dots", type: "scatter", symbolSize: 8, silent: true, data: [], z: 5, tooltip: { show: false } }],
    }, true);
    // a click moves the slider where all lines are at the same place
    this.own = data.stops.along === along || entries.length === 1;
    const [one] = entries, places = data.stops.along === along ? stops : one.records.map((r) => one.series[along][r]);
    this.drawn.getZr().off("click");
    if (this.own) this.drawn.getZr().on("click", ({ offsetX, offsetY }) =>
      move(nearest(places, this.drawn.convertFromPixel({ gridIndex: 0 }, [offsetX, offsetY])[0])));
  }
  draw() {
    const told = new Map(), dots = this.lines.map(({ one, x, y, name, style }) => {
      const r = recordAt(one), value = r < 0 ? NaN : y[r] * this.factor;
      told.set(name, { name, style, values: [...(told.get(name)?.values || []), value] });
      const at = Number.isFinite(value) ? [x[r], value] : [null, null];
      return { value: at, itemStyle: { color: style.color, borderColor: "#fff" } };
    });
    const [known] = this.own ? dots.filter((d) => d.value[0] !== null) : [];
    const cursor = known ? [this.axis.min, this.axis.max].map((y) => [known.value[0], y]) : [];
    this.set({ series: [{ id: "dots", data: dots }, { id: "cursor", data: cursor }] });
    this.tell([...told.values()].map(({ name, style, values }) => ({ name, style, size: values[0],
      text: values.some(Number.isFinite) ? `${values.map(shown).join(" and ")} ${this.unit}` : "not reached" })));
  }
}
