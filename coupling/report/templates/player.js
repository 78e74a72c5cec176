// One slider for every chart of the page: which entries are shown, how, and at which stop; keys, playing, printing.
const SECONDS_OF_PLAY = 8, MOST_AT_FIRST = 12, FIRST_OF_MANY = 8;
const slider = $("slider"), play = $("play");
let timer = null, noted = null;

// many lines in one frame cannot be told apart: begin with some, spread over the design; of tunnels with that of the gate
const spread = (j) => Math.round(j * (entries.length - 1) / (FIRST_OF_MANY - 1));
const first = data.section ? [0] : entries.length <= MOST_AT_FIRST ? [...entries.keys()]
  : Array.from({ length: FIRST_OF_MANY }, (_, j) => spread(j));
const boxOf = (one) => $(`case-${one.number}`);
entries.forEach((one, e) => {
  one.shown = first.includes(e);
  if (!boxOf(one)) return;
  boxOf(one).checked = one.shown;
  boxOf(one).insertAdjacentHTML("afterend", swatch(caseStyle(e)));
  boxOf(one).addEventListener("change", (event) => { one.shown = event.target.checked; redraw(); });
});
for (const [id, checked] of [["all", true], ["none", false]]) $(id)?.addEventListener("click", () => {
  for (const one of entries) one.shown = boxOf(one).checked = checked;
  redraw();
});

const table = new NowTable(), chartOf = (about) => new (about.kind === "ring" ? RingChart : ProgressChart)(about);
const views = data.charts.map(chartOf);
views.push(table, ...($("joint-table") ? [new JointTable()] : []), ...($("ground") ? [new Ground()] : []));
function redraw() {
  for (const view of views) { view.build(); view.draw(); }
}
for (const id of ["shape", "against", "along", "model"]) {
  if ($(id) && id !== "model") $(id).value = state[id];
  $(id)?.addEventListener("change", (event) => {
    state[id] = id === "model" ? Number(event.target.value) : event.target.value;
    redraw();
  });
}

function show(stop) {
  state.stop = Math.max(0, Math.min(stops.length - 1, Math.round(stop)));
  slider.value = state.stop;
  $("now").textContent = data.stops.told[state.stop];
  slider.setAttribute("aria-valuetext", data.stops.told[state.stop]);
  for (const view of views) view.draw();
  if (timer === null) note();
}

// the place of the slider in the address, once it rests: browsers bear few changes of it in a second
const place = () => Number(new URLSearchParams(location.hash.slice(1)).get(data.stops.along) ?? NaN);
function note() {
  clearTimeout(noted);
  noted = setTimeout(() => window.history.replaceState(null, "", `#${data.stops.along}=${+stops[state.stop].toPrecision(6)}`), 300);
}
window.addEventListener("hashchange", () => { if (Number.isFinite(place())) move(nearest(stops, place())); });

function playing(on) {
  clearInterval(timer);
  timer = on ? setInterval(() => {
    if (state.stop < stops.length - 1) show(state.stop + 1);
    if (state.stop >= stops.length - 1) playing(false);
  }, Math.min(400, Math.max(40, 1000 * SECONDS_OF_PLAY / stops.length))) : null;
  if (!on) note();
  play.textContent = on ? "Stop" : "Play";
  play.setAttribute("aria-pressed", String(on));
}

function move(stop) {
  playing(false);
  show(stop);
}

function toggle() {
  if (timer === null && state.stop >= stops.length - 1) show(0);
  playing(timer === null);
}

slider.max = stops.length - 1;
slider.addEventListener("input", () => move(Number(slider.value)));
play.addEventListener("click", toggle);
$("player").addEventListener("keydown", (event) => {
  const elsewhere = "select, button, summary, pre, a, input:not(#slider)";
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest(elsewhere)) return;
  const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
  if (event.key === " ") toggle();
  else if (event.target === slider || event.target.closest(".scroll")) return;
  else if (event.key === "Home") move(0);
  else if (event.key === "End") move(stops.length - 1);
  else if (step) move(state.stop + step);
  else return;
  event.preventDefault();
});
// all of a chart again
document.addEventListener("dblclick", ({ target }) => {
  const batch = [0, 1].map((dataZoomIndex) => ({ dataZoomIndex, start: 0, end: 100 }));
  views.find((view) => view.place?.contains(target))?.drawn.dispatchAction({ type: "dataZoom", batch });
});

// what was recorded is drawn when it is unfolded
function recorded() {
  for (const [name, one] of Object.entries($("recorded").dataset.drawn ? {} : data.recorded)) {
    const chart = new ProgressChart({ ...one, name: `recorded-${name}`, kind: "time", factor: 1, keys: [] });
    chart.build();
    chart.draw();
    views.push(chart);
  }
  $("recorded").dataset.drawn = "yes";
}
$("recorded")?.addEventListener("toggle", recorded);

// on paper a chart takes the width that it is given
window.addEventListener("beforeprint", () => {
  for (const view of views) if (view.drawn) { view.flush(); view.drawn.getZr().flush(); }
  for (const svg of document.querySelectorAll(".chart svg")) {
    svg.setAttribute("viewBox", `0 0 ${svg.getAttribute("width")} ${svg.getAttribute("height")}`);
  }
});
window.addEventListener("afterprint", () => {
  for (const svg of document.querySelectorAll(".chart svg")) svg.removeAttribute("viewBox");
});

for (const view of views) view.build();
if (Number.isFinite(place())) {
  show(nearest(stops, place()));
  $("player").scrollIntoView();
} else show(stops.length - 1);
document.querySelector("main").setAttribute("aria-busy", "false");
