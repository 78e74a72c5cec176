// One slider for every chart of the page: which entries are shown, how, and at which stop; keys, playing, printing.
const SECONDS_OF_PLAY = 8, MOST_TOLD_APART = 12, FIRST_OF_MANY = 8;
const slider = $("slider"), play = $("play"), KINDS_OF_CHART = { ring: RingChart, deformed: DeformedRing };
let timer = null;

// many lines in one frame cannot be told apart: begin with some, spread over the design; of tunnels with that of the gate
const first = new Set(entries.length <= MOST_TOLD_APART ? entries.keys() : Array.from({ length: FIRST_OF_MANY }, (_, j) => Math.round(j * (entries.length - 1) / (FIRST_OF_MANY - 1))));
entries.forEach((one, e) => {
  const box = $(`case-${one.number}`);
  one.shown = first.has(e) && (!data.section || !box || e === 0);
  if (!box) return;
  box.checked = one.shown;
  box.insertAdjacentHTML("afterend", swatch(caseStyle(e)));
  box.addEventListener("change", () => { one.shown = box.checked; redraw(); });
});
for (const [id, checked] of [["all", true], ["none", false]]) {
  $(id)?.addEventListener("click", () => { entries.forEach((one) => { one.shown = $(`case-${one.number}`).checked = checked; }); redraw(); });
}

const now = new NowTable();
const views = [...data.charts.map((about) => new (KINDS_OF_CHART[about.kind] || ProgressChart)(about)), now, ...($("joint-table") ? [new JointTable()] : []), ...($("ground") ? [new Ground()] : [])];
function redraw() { for (const view of views) { view.build(); view.draw(); } }
for (const id of ["shape", "against", "along", "model"]) {
  if ($(id) && id !== "model") $(id).value = state[id];
  $(id)?.addEventListener("change", (event) => { state[id] = id === "model" ? Number(event.target.value) : event.target.value; redraw(); });
}

function show(stop) {
  state.stop = Math.max(0, Math.min(stops.length - 1, Math.round(stop)));
  slider.value = state.stop;
  $("now").textContent = data.stops.told[state.stop];
  slider.setAttribute("aria-valuetext", data.stops.told[state.stop]);
  for (const view of views) view.draw();
}
function halt() {
  clearInterval(timer);
  timer = null;
  play.textContent = "Play";
  play.setAttribute("aria-pressed", "false");
}
function move(stop) { halt(); show(stop); }
function toggle() {
  if (timer !== null) { halt(); return; }
  if (state.stop >= stops.length - 1) show(0);
  play.textContent = "Stop";
  play.setAttribute("aria-pressed", "true");
  timer = setInterval(() => {
    if (state.stop < stops.length - 1) show(state.stop + 1);
    if (state.stop >= stops.length - 1) halt();
  }, Math.min(400, Math.max(40, 1000 * SECONDS_OF_PLAY / stops.length)));
}

slider.max = stops.length - 1;
slider.addEventListener("input", () => move(Number(slider.value)));
play.addEventListener("click", toggle);
$("player").addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("select, button, summary, pre, a, input:not(#slider)")) return;
  const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
  if (event.key === " ") toggle();
  else if (event.target === slider || event.target.closest(".scroll")) return;
  else if (event.key === "Home") move(0);
  else if (event.key === "End") move(stops.length - 1);
  else if (step) move(state.stop + step);
  else return;
  event.preventDefault();
});
document.addEventListener("dblclick", (event) => {
  const view = views.find((v) => v.place?.contains(event.target));
  view?.drawn.dispatchAction({ type: "dataZoom", batch: [0, 1].map((k) => ({ dataZoomIndex: k, start: 0, end: 100 })) });
});

// what was recorded is drawn when it is unfolded
$("recorded")?.addEventListener("toggle", recorded);
function recorded() {
  if (recorded.done) return;
  recorded.done = true;
  for (const [name, { title, unit, values }] of Object.entries(data.recorded)) {
    const chart = new ProgressChart({ name: `recorded-${name}`, title, unit, values, kind: "time", factor: 1, keys: [] });
    chart.build();
    chart.draw();
    views.push(chart);
  }
}

// on paper nothing can be unfolded, and a chart takes the width that it is given
let unfolded = [];
window.addEventListener("beforeprint", () => {
  unfolded = [...document.querySelectorAll("details:not([open])")];
  for (const part of unfolded) part.open = true;
  if ($("recorded")) recorded();
  for (const svg of document.querySelectorAll(".chart svg")) svg.setAttribute("viewBox", `0 0 ${svg.getAttribute("width")} ${svg.getAttribute("height")}`);
});
window.addEventListener("afterprint", () => {
  for (const part of unfolded) part.open = false;
  for (const svg of document.querySelectorAll(".chart svg")) svg.removeAttribute("viewBox");
});

for (const view of views) view.build();
show(stops.length - 1);
document.querySelector("main").setAttribute("aria-busy", "false");
