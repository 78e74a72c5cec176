// Tables that move with the slider, and the sorting of all tables of cases.
function cell(parent, text, { head = "", number = false, value = null, small = null } = {}) {
  const made = parent.appendChild(document.createElement(head ? "th" : "td"));
  if (head) made.scope = head;
  if (number) made.className = "number";
  if (value !== null) made.dataset.value = Number.isFinite(value) ? value : "";
  made.append(text);
  if (small !== null) made.appendChild(document.createElement("small")).textContent = small;
  return made;
}

// a value with its change since the start
const changing = (parent, now, start, plain) => cell(parent, shown(now), { number: true, value: now,
  small: plain || !Number.isFinite(now - start) ? null : `${now > start ? "+" : ""}${shown(now - start)}` });

class NowTable {
  constructor() { this.table = $("now-table"); this.order = { column: 0, down: false }; }
  build() {
    this.lines = lines(data.charts.some((c) => c.of_model)).length ? lines(true) : lines(false);
    this.columns = data.columns.filter(([key,,,, ofModel]) => entries.some((one) => (ofModel ? one.models.some((m) => m.series[key]) : one.series[key])));
    this.table.replaceChildren();
    const head = this.table.createTHead().insertRow();
    for (const [name, unit] of [[entries.length > 1 ? "case" : "model"], ...this.columns.map((c) => [c[1], c[2]])]) {
      const made = cell(head, "", { head: "col" }), button = made.appendChild(document.createElement("button"));
      Object.assign(button, { type: "button", className: "sort", textContent: `${name}${unit ? ` [${unit}]` : ""}` });
      made.setAttribute("aria-sort", "none");
    }
    this.body = this.table.createTBody();
  }
  draw() {
    this.body.replaceChildren();
    this.lines.forEach((line, k) => {
      const { one, model, name } = line, r = recordAt(one), tr = this.body.insertRow();
      tr.dataset.now = one.number;
      cell(tr, name, { head: "row", value: k });
      for (const [key, , , factor, ofModel] of this.columns) {
        const values = ofModel ? model?.series[key] : one.series[key], at = (j) => (values && r >= 0 ? values[j] * factor : NaN);
        if (key === "inflow_mass" && r < 0) cell(tr, "not reached", { value: NaN }); else changing(tr, at(r), at(0), key === "time" || key === "inflow_mass");
      }
    });
    // how far another model is from the first
    if (entries.length === 1) this.lines.slice(1).forEach(({ one, model, name }) => {
      const first = this.lines[0], r = recordAt(one), tr = this.body.insertRow();
      cell(tr, `${name} less ${first.name}`, { head: "row", value: Infinity });
      for (const [key, , , factor, ofModel] of this.columns) {
        const apart = (j) => (ofModel && model.series[key] ? (model.series[key][j] - first.model.series[key][j]) * factor : NaN);
        changing(tr, apart(r), apart(0), !ofModel);
      }
    });
    sortTable(this.table.tHead.rows[0].cells[this.order.column], this.order.down);
  }
}

class JointTable {
  build() {}
  draw() {
    const table = $("joint-table"), there = lines(true).filter((l) => l.model.joints?.joint_opening && recordAt(l.one) >= 0);
    table.replaceChildren();
    const head = table.createTHead().insertRow(), body = table.createTBody();
    for (const name of ["joint", "at", "answer", ...data.joint_columns.map(([, n, unit]) => `${n} [${unit}]`)]) cell(head, name, { head: "col" });
    const most = Math.max(0, ...there.map((l) => l.one.joint_angle.length));
    for (let j = 0; j < most; j++) there.forEach(({ one, model, name }, k) => {
      const tr = body.insertRow(), r = one.at[state.stop];
      Object.assign(tr.dataset, { joint: j, model: model.name });
      if (!k) tr.className = "first";
      cell(tr, k ? "" : String(j + 1), { head: "row" });
      cell(tr, `${shown(one.joint_angle[j])}°`, { number: true });
      cell(tr, name).className = "text";
      for (const [key, , , factor] of data.joint_columns) changing(tr, ...[r, 0].map((i) => (model.joints[key] ? row(model.joints[key], i)[j] * factor : NaN)));
    });
  }
}

function sortTable(heading, down) {
  const body = heading.closest("table").tBodies[0], column = heading.cellIndex;
  for (const other of heading.parentNode.cells) if (other.hasAttribute("aria-sort")) other.setAttribute("aria-sort", "none");
  heading.setAttribute("aria-sort", down ? "descending" : "ascending");
  const value = (tr) => { const text = tr.cells[column].dataset.value ?? ""; return text === "" || Number.isNaN(Number(text)) ? text : Number(text); };
  const compare = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b), "en", { numeric: true }));
  // what is missing stays below
  const rows = [...body.rows].map((tr) => [value(tr), tr]).sort(([a], [b]) => (a === "" || b === "" ? (a === "") - (b === "") : (down ? -1 : 1) * compare(a, b)));
  body.append(...rows.map(([, tr]) => tr));
}

document.addEventListener("click", (event) => {
  const heading = event.target.closest("button.sort")?.closest("th");
  if (!heading) return;
  const down = heading.getAttribute("aria-sort") === "ascending";
  if (heading.closest("#now-table")) now.order = { column: heading.cellIndex, down };
  sortTable(heading, down);
});
