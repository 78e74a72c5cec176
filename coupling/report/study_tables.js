// Tables of cases: sorted by any column, and the values of all chosen cases at the slider's inflow mass.
const NOW_COLUMNS = [
  ["time", "time", "s", 1, (one, r) => one.overMass.time.values[r]],
  ["flow_zone_area", "flow zone", "m²", 1, (one, r) => one.overMass.flow_zone_area.values[r]],
  ...PRESSURES.slice(0, 2).map((key) => [`${key}_max`, `largest ${key.replace("_", " ")}`, "kPa", 1e-3,
    (one, r) => one.extremes[`${key}_max`].values[r]]),
  ...[["axial_force_max", "largest N"], ["axial_force_min", "smallest N"], ["shear_force_max", "largest Q"],
    ["shear_force_min", "smallest Q"], ["bending_moment_max", "largest M"], ["bending_moment_min", "smallest M"],
    ["joint_opening_max", "joint opening (+) or closing (−)"], ["convergence_vertical", "vertical diameter shorter (+) or longer (−)"]].map(([key, name]) => {
    const [unit, factor] = QUANTITIES[key.replace(/_(max|min)$/, "")];
    return [key, name, unit, factor, (one, r) => one.models[model]?.extremes[key]?.values[r]];
  }),
];

// of the table at the slider's mass: it is made anew whenever the slider moves
let order = { column: 0, down: false };

function sortRows(body, column, down) {
  const value = (row) => {
    const text = row.cells[column].dataset.value ?? row.cells[column].textContent, number = Number(text);
    return text === "" ? null : Number.isNaN(number) ? text : number;
  };
  const compare = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b
    : String(a).localeCompare(String(b), "en", { numeric: true }));
  const rows = [...body.rows].map((row) => [value(row), row]);
  // what is missing stays below
  rows.sort(([a], [b]) => (a === null || b === null ? (a === null) - (b === null) : (down ? -1 : 1) * compare(a, b)));
  for (const [, row] of rows) body.append(row);
}

function sortTable(heading, down) {
  const table = heading.closest("table");
  for (const other of table.tHead.rows[0].cells) if (other.hasAttribute("aria-sort")) other.setAttribute("aria-sort", "none");
  heading.setAttribute("aria-sort", down ? "descending" : "ascending");
  sortRows(table.tBodies[0], heading.cellIndex, down);
}

document.addEventListener("click", (event) => {
  const heading = event.target.closest("button.sort")?.closest("th");
  if (!heading) return;
  const down = heading.getAttribute("aria-sort") === "ascending";
  if (heading.closest("#now-table")) order = { column: heading.cellIndex, down };
  sortTable(heading, down);
});

class NowTable {
  build() {
    this.table = document.getElementById("now-table");
    this.columns = NOW_COLUMNS.filter(([key]) => cases.some((one) => Number.isFinite(NOW_COLUMNS.find((c) => c[0] === key)[4](one, 0))));
    this.body = tableWith(this.table, "",
      [["case", false], ["inflow mass [kg/m]", true], ...this.columns.map(([, name, unit]) => [`${name} [${unit}]`, true])]);
    for (const heading of this.table.tHead.rows[0].cells) {
      const button = document.createElement("button");
      button.type = "button";
      button.className = "sort";
      button.append(...heading.childNodes);
      heading.append(button);
      heading.setAttribute("aria-sort", "none");
      if (heading.cellIndex === 0) heading.classList.add("text");
    }
  }
  draw(frame) {
    this.body.replaceChildren();
    for (const one of visible()) {
      const at = recordAt(one, frame), row = this.body.insertRow();
      row.dataset.now = one.number;
      cell(row, one.label, { head: "row" }).dataset.value = one.number;
      const filled = (text, value, small = null) => { cell(row, text, { number: true, small }).dataset.value = Number.isFinite(value) ? value : ""; };
      filled(at ? shown(one.mass[at.record]) : "not reached", at ? one.mass[at.record] : NaN);
      for (const [key, , , factor, value] of this.columns) {
        const now = at ? value(one, at.record) * factor : NaN, start = value(one, 0) * factor;
        const change = now - start, sign = change > 0 ? "+" : "";
        filled(shown(now), now, key === "time" || !Number.isFinite(change) ? null : `${sign}${shown(change)}`);
      }
    }
    sortTable(this.table.tHead.rows[0].cells[order.column], order.down);
  }
}
