// One slider for every chart: the frame that is shown, playing, keys.
const slider = document.getElementById("time"), play = document.getElementById("play"), now = document.getElementById("now");
const last = times.length - 1, SECONDS_OF_PLAY = 8;
let views = [], timer = null;

function show(frame) {
  const k = Math.max(0, Math.min(last, Math.round(frame)));
  slider.value = k;
  const text = `${shown(times[k])} s, ${shown(inflow[k])} kg/m`;
  now.textContent = text;
  slider.setAttribute("aria-valuetext", text);
  for (const view of views) view.draw(k);
}

function stop() {
  clearInterval(timer);
  timer = null;
  play.textContent = "Play";
  play.setAttribute("aria-pressed", "false");
}

function toggle() {
  if (timer !== null) { stop(); return; }
  if (Number(slider.value) >= last) show(0);
  play.textContent = "Stop";
  play.setAttribute("aria-pressed", "true");
  timer = setInterval(() => {
    const next = Number(slider.value) + 1;
    if (next <= last) show(next);
    if (next >= last) stop();
  }, Math.min(400, Math.max(40, 1000 * SECONDS_OF_PLAY / Math.max(last, 1))));
}

function pick(time) {
  stop();
  show(nearest(times, time));
}

function onKey(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("select, button, summary, pre")) return;
  const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
  if (event.key === " ") toggle();
  else if (event.target === slider || event.target.closest(".scroll")) return;
  else if (event.key === "Home") show(0);
  else if (event.key === "End") show(last);
  else if (step) { stop(); show(Number(slider.value) + step); }
  else return;
  event.preventDefault();
}

slider.max = last;
let rings = ringCharts();
const fixed = [...timeCharts(pick)];
if (models.length) {
  fixed.push(new DeformedRing(), { draw: drawModelTable });
  if (document.getElementById("joint-table")) fixed.push({ draw: drawJointTable });
}
if (data.fields) fixed.push(new FieldView());
views = [...rings, ...fixed];
slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
play.addEventListener("click", toggle);
document.getElementById("player").addEventListener("keydown", onKey);
document.getElementById("shape").addEventListener("change", (event) => {
  shape = event.target.value;
  for (const ring of rings) { ring.build(); ring.draw(Number(slider.value)); }
});
const tunnelChoice = document.getElementById("tunnel");
if (tunnelChoice) {
  tunnelChoice.value = tunnel;
  tunnelChoice.addEventListener("change", () => {
    tunnel = Number(tunnelChoice.value);
    for (const ring of rings) { ring.build(); ring.draw(Number(slider.value)); }
  });
}
if (data.mesh) new MeshView();
drawSection();
show(last);

// on paper nothing can be unfolded
let opened = [];
window.addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details:not([open])")];
  for (const part of opened) part.open = true;
});
window.addEventListener("afterprint", () => { for (const part of opened) part.open = false; });
