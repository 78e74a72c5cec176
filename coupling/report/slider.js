// One slider for every chart of a page: the frame that is shown, playing, keys.
const slider = document.getElementById("slider"), play = document.getElementById("play"), now = document.getElementById("now");
const SECONDS_OF_PLAY = 8;
let last = 0, views = [], told = null, timer = null;

// `count` frames, `text` of a frame; `drawn`: what has a method draw(frame)
function startSlider(count, text, drawn) {
  last = count - 1;
  told = text;
  views = drawn;
  slider.max = last;
  slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
  play.addEventListener("click", toggle);
  document.getElementById("player").addEventListener("keydown", onKey);
  show(last);
}

function show(frame) {
  const k = Math.max(0, Math.min(last, Math.round(frame)));
  slider.value = k;
  now.textContent = told(k);
  slider.setAttribute("aria-valuetext", told(k));
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

function onKey(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("select, button, summary, pre, a, input:not(#slider)")) return;
  const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
  if (event.key === " ") toggle();
  else if (event.target === slider || event.target.closest(".scroll")) return;
  else if (event.key === "Home") show(0);
  else if (event.key === "End") show(last);
  else if (step) { stop(); show(Number(slider.value) + step); }
  else return;
  event.preventDefault();
}

// on paper nothing can be unfolded
let opened = [];
window.addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details:not([open])")];
  for (const part of opened) part.open = true;
});
window.addEventListener("afterprint", () => { for (const part of opened) part.open = false; });
