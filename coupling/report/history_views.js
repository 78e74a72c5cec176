// What is drawn over time, with a cursor at the slider's time; a click moves the slider.
class TimeChart {
  // lines: [{name, model, time, values, factor, style}]; lines of one name differ by their model only
  constructor(key, svg, lines, onPick, { fromZero = true, unit = "" } = {}) {
    Object.assign(this, { key, svg, lines, unit, names: [...new Set(lines.map((l) => l.name))] });
    const range = roundRange(rangeOf(lines.map((l) => rangeOf([l.values], l.factor)), 1), fromZero);
    this.chart = new LineChart(svg, { x: lines[0].time, xLabel: "time since the gate opened [s]", yRange: range,
      classes: lines.map(() => "line"), styles: lines.map((l) => l.style), onPick });
    lines.forEach((line, k) => this.chart.set(k, line.values, line.factor));
    const of = (name) => lines.filter((l) => l.name === name);
    this.models = of(this.names[0]).map((l) => l.model).filter(Boolean);
    this.legend = this.names.length > 1 ? legend(this.names.map((name) => [name, "line", of(name)[0].style])) : [];
    if (this.models.length > 1) {
      this.legend.push(...legend(this.models.map((m, k) => [m, "line", { stroke: "#55606e", strokeDasharray: DASHES[k] }])));
    }
  }
  draw(frame) {
    this.chart.cursor(times[frame]);
    const told = this.names.map((name) => {
      const now = this.lines.filter((l) => l.name === name).map((l) => shown(l.values[nearest(l.time, times[frame])] * l.factor));
      return `${this.names.length > 1 ? `${name} ` : ""}${now.join(" | ")}${this.unit ? ` ${this.unit}` : ""}`;
    }).join(", ") + (this.models.length > 1 ? ` (${this.models.join(" | ")})` : "");
    caption(this.key, ...this.legend, sentence(told));
    this.svg.setAttribute("aria-label", `${this.key.replace(/_/g, " ")} over time, now ${told}`);
  }
}

function timeCharts(onPick) {
  const find = (key) => document.getElementById(key), made = [];
  const line = (name, label, k) => ({ name: label, time: history.time, values: history.series[name].values, factor: 1,
    style: { stroke: COLOURS[k], strokeDasharray: DASHES[k] } });
  made.push(new TimeChart("inflow_mass", find("inflow_mass"), [line("inflow_mass", "inflow", 0)], onPick, { unit: "kg/m" }));
  made.push(new TimeChart("zones", find("zones"), [line("flow_zone_area", "over 50 mm", 0),
    line("disturbed_area", "10 to 50 mm", 1)], onPick, { unit: "m²" }));
  const moved = [["convergence_horizontal", "horizontal"], ["convergence_vertical", "vertical"], ["settlement", "settlement"]];
  const lines = models.flatMap((model, m) => moved.map(([key, label], k) => model.series[key] && {
    name: label, model: model.name, time: times, values: model.series[key].values, factor: 1e3,
    style: { stroke: COLOURS[k], strokeDasharray: DASHES[m] } })).filter(Boolean);
  if (lines.length) made.push(new TimeChart("convergence", find("convergence"), lines, onPick, { unit: "mm" }));
  return [...made, ...recordedCharts(onPick)];
}

// "m^2" as m², and "kg m-1" of older files as kg/m
const readable = (units) => (units === "1" ? "" : units.replace(/ (\w+)-1/g, "/$1").replace(/m\^?2\b/, "m²"));

function recordedCharts(onPick) {
  const place = document.getElementById("history"), made = [];
  place.replaceChildren();
  for (const [name, series] of Object.entries(history.series)) {
    const figure = document.createElement("figure"), title = document.createElement("h3"), text = document.createElement("figcaption");
    const unit = readable(series.units), svg = element("svg", { id: `history-${name}`, role: "img" });
    figure.dataset.chart = `history-${name}`;
    title.textContent = `${series.label}${unit ? ` [${unit}]` : ""}`;
    text.id = `history-${name}-text`;
    figure.append(title, svg, text);
    place.append(figure);
    const drawn = [{ name, time: history.time, values: series.values, factor: 1, style: {} }];
    made.push(new TimeChart(`history-${name}`, svg, drawn, onPick, { fromZero: false, unit }));
  }
  return made;
}
