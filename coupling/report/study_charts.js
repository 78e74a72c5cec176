// Charts of all chosen cases in one frame: around the ring, over time, over inflow mass.
let shape = "polar", against = "value";
const PRESSURES = ["soil_pressure", "water_pressure", "soil_shear"], FORCES = ["axial_force", "shear_force", "bending_moment"];

function gapMarks(shownCases) {
  const angles = [...new Set(shownCases.map((one) => one.gate).filter((angle) => angle !== null))];
  if (angles.length < 2) return angles.map((angle) => ({ angle, text: "gate" }));
  // cases that share an angle share a mark; a case alone at its angle gives it its colour
  return angles.map((angle) => {
    const here = shownCases.filter((one) => one.gate === angle);
    return { angle, colour: here.length === 1 ? here[0].style.stroke : null };
  });
}

// Names of the cases beside their lines, where they are few; many are told by the check boxes.
const namesOf = (shownCases) => (shownCases.length > COLOURS.length ? []
  : legend(shownCases.map((one) => [one.label, "line", one.style])));

class RingComparison {
  constructor(key) {
    this.key = key;
    [this.unit, this.factor] = QUANTITIES[key];
    this.angles = data.theta;
  }
  rows(one) { return PRESSURES.includes(this.key) ? one.pressures[this.key] : one.models[model].forces[this.key]; }
  row(one, curve) {
    const row = this.rows(one).row(curve), start = this.rows(one).row(0);
    return against === "change" ? row.map((value, j) => value - start[j]) : row;
  }
  build() {
    // a case without a ring has pressures only
    this.cases = visible().filter((one) => PRESSURES.includes(this.key) || one.models.length);
    const svg = document.getElementById(this.key), records = Array.from(data.records.keys());
    const range = roundRange(rangeOf(this.cases.flatMap((one) => records.map((r) => this.row(one, r))), this.factor), true);
    const options = { x: this.angles, yRange: range, marks: gapMarks(this.cases), classes: this.cases.map(() => "line"),
      styles: this.cases.map((one) => one.style) };
    this.chart = shape === "polar" ? new PolarChart(svg, options) : new LineChart(svg, { ...options,
      xLabel: "angle from the crown, clockwise [°]", xTicks: [0, 60, 120, 180, 240, 300, 360], height: 250 });
  }
  draw(frame) {
    const told = [];
    this.cases.forEach((one, k) => {
      const at = recordAt(one, frame), none = new Float32Array(this.angles.length).fill(NaN);
      this.chart.set(k, at ? this.row(one, at.curve) : none, this.factor);
      told.push(`case ${one.label}: ${at ? this.extremes(one, at.record) : "did not get there"}`);
    });
    const what = `${this.key.replace(/_/g, " ")} in ${this.unit}${against === "change" ? ", change" : ""}`;
    document.getElementById(this.key).setAttribute("aria-label", `${what}: ${told.join("; ") || "no case is shown"}`);
    caption(this.key, ...namesOf(this.cases), sentence(this.summary(frame)));
  }
  // exact also where the curves are thinned
  extremes(one, record) {
    const from = PRESSURES.includes(this.key) ? one.extremes : one.models[model].extremes;
    const [low, high] = ["min", "max"].map((end) => shown(from[`${this.key}_${end}`].values[record] * this.factor));
    const [lowAt, highAt] = ["min", "max"].map((end) => shown(from[`${this.key}_${end}_angle`].values[record]));
    return `from ${low} at ${lowAt}° to ${high} at ${highAt}°`;
  }
  summary(frame) {
    const from = (one) => (PRESSURES.includes(this.key) ? one.extremes : one.models[model].extremes);
    let best = null;
    for (const one of this.cases) {
      const at = recordAt(one, frame);
      if (!at) continue;
      const value = from(one)[`${this.key}_max`].values[at.record] * this.factor;
      if (Number.isFinite(value) && (!best || value > best.value)) {
        best = { value, label: one.label, angle: from(one)[`${this.key}_max_angle`].values[at.record] };
      }
    }
    return best ? `largest ${shown(best.value)} at ${shown(best.angle)}°, case ${best.label}` : "no case is shown";
  }
}

// Lines of every case over time or inflow mass, with a dot where the slider is.
class CaseLines {
  // curves: (one) => [{x, y}], arrays (n_progress,) in SI
  constructor(key, xLabel, curves, { unit, factor = 1, fromZero = false, cursor = false }) {
    Object.assign(this, { key, xLabel, curves, unit, factor, fromZero, withCursor: cursor });
  }
  build() {
    this.cases = visible();
    this.lines = this.cases.flatMap((one) => this.curves(one).map((curve) => ({ one, ...curve })));
    const svg = document.getElementById(this.key);
    const range = roundRange(rangeOf(this.lines.map((line) => line.y), this.factor), this.fromZero);
    const x = rangeOf(this.lines.map((line) => line.x), 1);
    this.chart = new LineChart(svg, { x, xLabel: this.xLabel, yRange: range, classes: this.lines.map(() => "line"),
      styles: this.lines.map((line) => line.one.style), onPick: this.withCursor ? (mass) => { stop(); show(nearest(stops, mass)); } : null });
    this.lines.forEach((line, k) => this.chart.set(k, line.y, this.factor, line.x));
  }
  draw(frame) {
    if (this.withCursor) this.chart.cursor(stops[frame]);
    const told = new Map();
    this.lines.forEach((line, k) => {
      const at = recordAt(line.one, frame);
      this.chart.dot(k, at ? line.x[at.record] : NaN, at ? line.y[at.record] : NaN, this.factor);
      const value = at ? shown(line.y[at.record] * this.factor) : "–";
      told.set(line.one.label, [...(told.get(line.one.label) || []), value]);
    });
    const text = [...told].map(([label, values]) => `case ${label}: ${values.join(" and ")}`).join("; ");
    caption(this.key, ...namesOf(this.cases));
    document.getElementById(this.key).setAttribute("aria-label",
      `${this.key.replace(/_/g, " ")} in ${this.unit}, now ${text || "no case is shown"}`);
  }
}

function studyCharts() {
  const time = "time since the gate opened [s]", mass = "inflow mass [kg/m]", made = PRESSURES.map((key) => new RingComparison(key));
  if (data.models.length) made.push(...FORCES.map((key) => new RingComparison(key)));
  const overTime = (y) => (one) => [{ x: one.overMass.time.values, y: y(one) }];
  made.push(new CaseLines("inflow_over_time", time, overTime((one) => one.mass), { unit: "kg/m", fromZero: true }));
  made.push(new CaseLines("zone_over_time", time, overTime((one) => one.overMass.flow_zone_area.values), { unit: "m²", fromZero: true }));
  made.push(new CaseLines("zone_over_mass", mass, (one) => [{ x: one.mass, y: one.overMass.flow_zone_area.values }],
    { unit: "m²", fromZero: true, cursor: true }));
  if (!data.models.length) return made;
  const overMass = (keys) => (one) => keys.filter((key) => one.models[model]?.extremes[key])
    .map((key) => ({ x: one.mass, y: one.models[model].extremes[key].values }));
  for (const [chart, keys, quantity] of [
    ["axial_over_mass", ["axial_force_max", "axial_force_min"], "axial_force"],
    ["shear_over_mass", ["shear_force_max", "shear_force_min"], "shear_force"],
    ["moment_over_mass", ["bending_moment_max", "bending_moment_min"], "bending_moment"],
    ["opening_over_mass", ["joint_opening_max"], "joint_opening"],
    ["rotation_over_mass", ["joint_rotation_max"], "joint_rotation"],
    ["convergence_over_mass", ["convergence_vertical"], "convergence_vertical"],
  ]) {
    const [unit, factor] = QUANTITIES[quantity];
    made.push(new CaseLines(chart, mass, overMass(keys), { unit, factor, cursor: true }));
  }
  return made;
}
