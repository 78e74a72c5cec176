// Tables made by the script.
function cell(row, text, { head = null, number = false, small = null } = {}) {
  const made = document.createElement(head ? "th" : "td");
  if (head) made.scope = head;
  if (number) made.className = "number";
  made.append(text);
  if (small !== null) {
    const below = document.createElement("small");
    below.textContent = small;
    made.append(below);
  }
  row.append(made);
  return made;
}

function tableWith(table, text, headings) {
  table.replaceChildren();
  if (text) table.createCaption().textContent = text;
  const row = table.createTHead().insertRow();
  for (const [name, number] of headings) cell(row, name, { head: "col", number });
  return table.createTBody();
}
