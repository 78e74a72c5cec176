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

// A value with its change since the start.
function changing(parent, now, start, plain = false) {
  const change = plain || !Number.isFinite(now - start) ? null : `${now > start ? "+" : ""}${shown(now - start)}`;
  return cell(parent, shown(now), { number: true, value: now, small: change });
}

class NowTable {
  constructor() { Object.assign(this, { table: $("now-table"), order: { column: 0, down: false } }); }
  build() {
    const answered = lines(true);
    this.lines = answered.length ? answered : lines(false);
    this.columns = data.columns.filter(([key, , , , ofModel]) =>
      (ofModel ? entries.flatMap((one) => one.models) : entries).some((from) => from.series[key]));
    const heads = [[entries.length > 1 ? "case" : "model"], ...this.columns.map(([, name, unit]) => [`${name} [${unit}]`])];
    this.table.innerHTML = `<thead><tr>${heads.map(([text]) => `<th scope="col" aria-sort="none">
      <button type="button" class="sort">${text}</button></th>`).join("")}</tr></thead><tbody></tbody>`;
  }
  draw() {
    const [body] = this.table.tBodies, [first] = this.lines;
    body.replaceChildren();
    const add = (name, value, one, numbers) => {
      const tr = body.insertRow(), r = recordAt(one);
      tr.dataset.now = one.number;
      cell(tr, name, { head: "row", value });
      for (const [key, , , factor, ofModel] of this.columns) {
        const plain = ["time", "inflow_mass"].includes(key), at = (j) => (r < 0 ? NaN : numbers(key, ofModel, j) * factor);
        if (key === "inflow_mass" && r < 0) cell(tr, "not reached", { value: NaN });
        else changing(tr, at(r), at(0), plain);
      }
    };
    this.lines.forEach(({ one, from, name }, k) =>
      add(name, k, one, (key, ofModel, j) => (ofModel ? from : one).series[key]?.[j] ?? NaN));
    // how far another model is from the first
    for (const { one, from, name } of entries.length === 1 ? this.lines.slice(1) : []) {
      const apart = (key, ofModel, j) => (ofModel && from.series[key] ? from.series[key][j] - first.from.series[key][j] : NaN);
      add(`${name} less ${first.name}`, NaN, one, apart);
    }
    sortTable(this.table.tHead.rows[0].cells[this.order.column], this.order.down);
  }
}

class JointTable {
  build() {}
  draw() {
    const there = lines(true).filter((l) => l.from.joints.joint_opening && recordAt(l.one) >= 0);
    const heads = ["joint", "at", "answer", ...data.joint_columns.map(([, name, unit]) => `${name} [${unit}]`)];
    $("joint-table").innerHTML = `<thead><tr>${heads.map((text) => `<th scope="col">${text}</th>`).join("")}</tr></thead>
      <tbody></tbody>`;
    const most = Math.max(0, ...there.map((l) => l.one.joint_angle.length));
    for (let j = 0; j < most; j++) there.forEach(({ one, from, name }, k) => {
      const tr = $("joint-table").tBodies[0].insertRow();
      Object.assign(tr.dataset, { joint: j, model: from.name });
      if (!k) tr.className = "first";
      cell(tr, k ? "" : String(j + 1), { head: "row" });
      cell(tr, `${shown(one.joint_angle[j])}°`, { number: true });
      cell(tr, name).className = "text";
      for (const [key, , , factor] of data.joint_columns) {
        const at = (r) => (from.joints[key] ? row(from.joints[key], r)[j] * factor : NaN);
        changing(tr, at(one.at[state.stop]), at(0));
      }
    });
  }
}

function sortTable(heading, down) {
  const [body] = heading.closest("table").tBodies, column = heading.cellIndex;
  for (const other of heading.parentNode.querySelectorAll("[aria-sort]")) other.setAttribute("aria-sort", "none");
  heading.setAttribute("aria-sort", down ? "descending" : "ascending");
  const value = (tr) => {
    const text = tr.cells[column].dataset.value ?? "";
    return text === "" || Number.isNaN(Number(text)) ? text : Number(text);
  };
  const compare = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b
    : String(a).localeCompare(String(b), "en", { numeric: true }));
  // what is missing stays below
  const rows = [...body.rows].map((tr) => [value(tr), tr]).sort(([a], [b]) =>
    (a === "" || b === "" ? (a === "") - (b === "") : (down ? -1 : 1) * compare(a, b)));
  body.append(...rows.map(([, tr]) => tr));
}

document.addEventListener("click", (event) => {
  const heading = event.target.closest("button.sort")?.closest("th");
  if (!heading) return;
  const down = heading.getAttribute("aria-sort") === "ascending";
  if (heading.closest("#now-table")) table.order = { column: heading.cellIndex, down };
  sortTable(heading, down);
});
