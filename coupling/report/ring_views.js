// What is drawn around the ring: pressures, internal forces, the deformed ring; the tables of joints and of models.
const modelClass = (k) => `line model-${k % 4}`;
let shape = "polar";

class RingChart {
  // sources: () => [{name, rows}], one for each line "now"; compared: () => arrays that share the range of values
  constructor(key, angles, sources, compared = () => sources().map((l) => l.rows.values)) {
    Object.assign(this, { key, angles, sources, compared });
    [this.unit, this.factor] = QUANTITIES[key];
    this.build();
  }
  build() {
    const lines = this.sources(), svg = document.getElementById(this.key);
    const range = roundRange(rangeOf(this.compared(), this.factor), true);
    const options = { x: this.angles, yRange: range, marks: gate && gate.tunnel === tunnel ? [{ angle: gate.angle, text: "gate" }] : [],
      classes: ["initial", ...lines.map((_, k) => modelClass(k))] };
    this.chart = shape === "polar" ? new PolarChart(svg, options) : new LineChart(svg, { ...options,
      xLabel: "angle from the crown, clockwise [°]", xTicks: [0, 60, 120, 180, 240, 300, 360], height: 250 });
    this.chart.set(0, lines[0].rows.row(0), this.factor);
    this.lines = lines;
    this.legend = legend([["start", "initial"], ...lines.map((l, k) => [l.name, modelClass(k)])]);
  }
  draw(frame) {
    const told = [];
    this.lines.forEach((line, k) => {
      const row = line.rows.row(frame), found = extremes(row, this.factor, this.angles);
      this.chart.set(k + 1, row, this.factor);
      const name = this.lines.length > 1 ? `${line.name}: ` : "";
      told.push(found ? `${name}max ${shown(found.max)} at ${found.maxAt}°, min ${shown(found.min)} at ${found.minAt}°`
        : `${name}no response at this time`);
    });
    caption(this.key, ...this.legend, ...told.map(sentence));
    document.getElementById(this.key).setAttribute("aria-label", `${this.key.replace(/_/g, " ")} in ${this.unit}: ${told.join("; ")}`);
  }
}

function ringCharts() {
  const made = [];
  for (const key of tunnels.length ? ["soil_pressure", "water_pressure", "soil_shear"] : []) {
    made.push(new RingChart(key, data.lining.theta, () => [{ name: "now", rows: tunnels[tunnel][key] }],
      () => tunnels.map((t) => t[key].values)));
  }
  for (const key of models.length ? ["axial_force", "shear_force", "bending_moment"] : []) {
    made.push(new RingChart(key, models[0].theta, () => models.map((m) => ({ name: m.name, rows: m.fields[key] }))));
  }
  return made;
}

class DeformedRing {
  constructor() {
    this.svg = document.getElementById("deformed");
    this.svg.replaceChildren();
    const { outer_radius: outer, inner_radius: inner } = models[0];
    this.radius = (outer + inner) / 2;
    this.svg.setAttribute("viewBox", `${-1.4 * outer} ${-1.3 * outer} ${2.8 * outer} ${2.6 * outer}`);
    this.svg.style.strokeWidth = 0.02;
    const frames = Array.from(times.keys());
    const largest = Math.max(1e-12, ...models.flatMap((m) => frames.map((f) => {
      const size = this.shape(m, f).reduce((most, [r, t]) => Math.max(most, Math.hypot(r, t) || 0), 0);
      return size;
    })));
    const raw = 0.3 * this.radius / largest, power = 10 ** Math.floor(Math.log10(raw));
    this.enlarged = Math.max(...[1, 2, 5].filter((s) => s * power <= raw * 1.000001)) * power;
    for (const r of [outer, inner]) element("circle", { r, class: "rule", "vector-effect": "non-scaling-stroke" }, this.svg);
    const line = (name) => element("path", { class: name, "vector-effect": "non-scaling-stroke" }, this.svg);
    this.start = line("initial");
    this.paths = models.map((_, k) => line(modelClass(k)));
    this.joints = models.map((m) => m.joint_angle.map(() =>
      element("circle", { r: 0.022 * this.radius, class: "joint", "vector-effect": "non-scaling-stroke" }, this.svg)));
    this.names = models[0].joint_angle.map((angle, k) => {
      const a = angle * Math.PI / 180, r = 0.7 * this.radius;
      return element("text", { x: r * Math.sin(a), y: -r * Math.cos(a) + 0.05 * this.radius, "text-anchor": "middle",
        style: `font-size:${0.11 * this.radius}px` }, this.svg, String(k + 1));
    });
    this.start.setAttribute("d", this.path(models[0], 0));
  }
  // displacement without the mean motion of the ring: a ring that moves as a whole does not deform
  shape(model, frame) {
    const radial = model.fields.displacement_radial.row(frame), along = model.fields.displacement_tangential.row(frame);
    let right = 0, up = 0, count = 0;
    model.theta.forEach((degree, k) => {
      if (!Number.isFinite(radial[k])) return;
      const s = Math.sin(degree * Math.PI / 180), c = Math.cos(degree * Math.PI / 180);
      right += radial[k] * s + along[k] * c;
      up += radial[k] * c - along[k] * s;
      count += 1;
    });
    right /= count || 1;
    up /= count || 1;
    return model.theta.map((degree, k) => {
      const s = Math.sin(degree * Math.PI / 180), c = Math.cos(degree * Math.PI / 180);
      return [radial[k] - right * s - up * c, along[k] - right * c + up * s];
    });
  }
  place(degree, [radial, along]) {
    const a = degree * Math.PI / 180, r = this.radius + this.enlarged * radial, t = this.enlarged * along;
    return [r * Math.sin(a) + t * Math.cos(a), -(r * Math.cos(a) - t * Math.sin(a))];
  }
  path(model, frame) {
    const moved = this.shape(model, frame), xs = [], ys = [], n = model.theta.length;
    for (let j = 0; j <= n; j++) {
      const k = j % n, before = model.theta[(k + n - 1) % n], here = model.theta[k];
      const span = (here - before + 360) % 360;
      // a joint between two angles interrupts the line
      if (j > 0 && model.joint_angle.some((at) => (at - before + 360) % 360 < span)) { xs.push(NaN); ys.push(NaN); }
      const [x, y] = this.place(here, moved[k]);
      xs.push(x * 1000);
      ys.push(y * 1000);
    }
    return linePath(xs, ys).replace(/(-?[\d.]+)/g, (v) => (v / 1000).toFixed(5));
  }
  draw(frame) {
    let told = "";
    models.forEach((model, k) => {
      this.paths[k].setAttribute("d", this.path(model, frame));
      const moved = this.shape(model, frame), n = model.theta.length;
      const size = moved.reduce((most, [r, t]) => Math.max(most, Math.hypot(r, t) || 0), 0);
      told += `${k ? "; " : ""}${models.length > 1 ? `${model.name} ` : ""}largest ${shown(1e3 * size)} mm`;
      this.joints[k].forEach((circle, j) => {
        const at = model.joint_angle[j];
        const after = model.theta.findIndex((v) => v >= at), i = after < 0 ? 0 : after, h = (i + n - 1) % n;
        const mean = [0, 1].map((c) => (moved[i][c] + moved[h][c]) / 2), [x, y] = this.place(at, mean);
        circle.setAttribute("cx", Number.isFinite(x) ? x : 99);
        circle.setAttribute("cy", Number.isFinite(y) ? y : 99);
      });
    });
    const text = `${tickText(this.enlarged)} times enlarged, without the motion of the ring as a whole; ${told}`;
    caption("deformed", ...legend([["start", "initial"], ...models.map((m, k) => [models.length > 1 ? m.name : "now", modelClass(k)])]), sentence(text));
    this.svg.setAttribute("aria-label", `deformed ring: ${text}`);
  }
}

const JOINT_COLUMNS = [["joint_axial_force", "N"], ["joint_shear_force", "Q"], ["joint_bending_moment", "M"],
  ["joint_opening", "opening (+) or closing (−)"], ["joint_dislocation", "dislocation"], ["joint_rotation", "rotation"]];

function drawJointTable(frame) {
  const body = tableWith(document.getElementById("joint-table"), "Now; below each value that of the start.",
    [["joint", false], ["at", true], ...(models.length > 1 ? [["model", false]] : []),
      ...JOINT_COLUMNS.map(([key, name]) => [`${name} [${QUANTITIES[key][0]}]`, true])]);
  (models[0]?.joint_angle || []).forEach((angle, j) => {
    models.forEach((model, k) => {
      const row = body.insertRow();
      row.dataset.joint = j;
      row.dataset.model = model.name;
      if (k === 0) row.className = "first-of-group";
      cell(row, k === 0 ? String(j + 1) : "", { head: "row" });
      cell(row, k === 0 ? `${shown(angle)}°` : "", { number: true });
      if (models.length > 1) cell(row, model.name);
      for (const [key] of JOINT_COLUMNS) {
        const values = model.joints[key], factor = QUANTITIES[key][1];
        cell(row, values ? shown(values.row(frame)[j] * factor) : "–", { number: true, small: values ? shown(values.row(0)[j] * factor) : null });
      }
    });
  });
}

const biggest = (values) => values.reduce((most, v) => (Number.isFinite(v) ? Math.max(most, Math.abs(v)) : most), 0);
const least = (values) => values.reduce((most, v) => (Number.isFinite(v) ? Math.min(most, v) : most), Infinity);
const most = (values) => -least(values.map((v) => -v));
const MODEL_ROWS = [
  ...[["axial_force", "axial force N"], ["shear_force", "shear force Q"], ["bending_moment", "bending moment M"]].flatMap(
    ([key, name]) => [[`${name}, largest`, key, "fields", most], [`${name}, smallest`, key, "fields", least]]),
  ["joint opening (+) or closing (−), largest", "joint_opening", "joints", most],
  ["joint dislocation, largest size", "joint_dislocation", "joints", biggest],
  ["joint rotation, largest size", "joint_rotation", "joints", biggest],
  ["horizontal diameter shorter (+) or longer (−)", "convergence_horizontal", "series", (v) => v[0]],
  ["vertical diameter shorter (+) or longer (−)", "convergence_vertical", "series", (v) => v[0]],
  ["settlement", "settlement", "series", (v) => v[0]],
];

function drawModelTable(frame) {
  const alone = models.length < 2;
  const body = tableWith(document.getElementById("model-table"),
    `Now; below each value that of the start.${alone && models.length ? " This run holds one lining model; the answer of another one would stand beside it." : ""}`,
    [["quantity", false], ...models.map((m) => [m.name, true]), ...models.slice(1).map((m) => [`${m.name} less ${models[0].name}`, true])]);
  for (const [name, key, group, reduce] of MODEL_ROWS) {
    if (!models.some((m) => m[group][key])) continue;
    const [unit, factor] = QUANTITIES[key], row = body.insertRow();
    row.dataset.row = name;
    cell(row, `${name} [${unit}]`, { head: "row" });
    const value = (m, f) => (m[group][key] ? reduce(Array.from(m[group][key].row(f))) * factor : NaN);
    const now = models.map((m) => value(m, frame));
    models.forEach((m, k) => cell(row, shown(now[k]), { number: true, small: shown(value(m, 0)) }));
    models.slice(1).forEach((m, k) => cell(row, shown(now[k + 1] - now[0]), { number: true, small: shown(value(m, 0) - value(models[0], 0)) }));
  }
}
