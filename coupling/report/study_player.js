// The player of a study: which cases are shown, and one slider over inflow mass for all of them.
const MOST_TOLD_APART = 12, FIRST_OF_MANY = 8;

function caseBoxes(redraw) {
  const place = document.getElementById("cases"), boxes = [];
  // many lines in one frame cannot be told apart: begin with some, spread over the design
  const first = new Set(cases.length <= MOST_TOLD_APART ? cases.keys()
    : Array.from({ length: FIRST_OF_MANY }, (_, j) => Math.round(j * (cases.length - 1) / (FIRST_OF_MANY - 1))));
  cases.forEach((one, k) => {
    const box = document.createElement("input"), label = document.createElement("label");
    box.type = "checkbox";
    box.id = `case-${one.number}`;
    box.checked = one.shown = first.has(k);
    box.addEventListener("change", () => { one.shown = box.checked; redraw(); });
    label.className = "case";
    label.append(box, ...legend([[one.label, "line", one.style]]));
    place.append(label);
    boxes.push(box);
  });
  for (const [id, checked] of [["all", true], ["none", false]]) {
    document.getElementById(id).addEventListener("click", () => {
      cases.forEach((one, k) => { one.shown = boxes[k].checked = checked; });
      redraw();
    });
  }
}

if (cases.length) {
  const parts = [...studyCharts(), new NowTable()];
  const redraw = () => {
    for (const part of parts) { part.build(); part.draw(Number(slider.value)); }
  };
  caseBoxes(redraw);
  for (const part of parts) part.build();
  const choices = { shape: (value) => { shape = value; }, against: (value) => { against = value; }, model: (value) => { model = Number(value); } };
  for (const [id, set] of Object.entries(choices)) {
    document.getElementById(id)?.addEventListener("change", (event) => { set(event.target.value); redraw(); });
  }
  startSlider(stops.length, (k) => `${shown(stops[k])} kg/m`, parts);
}
