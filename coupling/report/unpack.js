// The numbers of the page: text back to arrays, SI; factors to the units shown.
const data = JSON.parse(document.getElementById("data").textContent);
const KINDS = { f4: Float32Array, u1: Uint8Array, u2: Uint16Array, u4: Uint32Array };

function unpack(entry) {
  const text = atob(entry.data), bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
  const stored = new KINDS[entry.kind](bytes.buffer), width = entry.shape.length > 1 ? entry.shape[1] : 1;
  const values = entry.step === undefined ? stored
    : Float32Array.from(stored, (v) => (v === 65535 ? NaN : entry.low + v * entry.step));
  return { values, width, row: (k) => values.subarray(k * width, (k + 1) * width) };
}

function unpackAll(entries) {
  return Object.fromEntries(Object.entries(entries).map(([name, entry]) => [name, unpack(entry)]));
}

// Name of a quantity to the unit it is shown in and the factor to it.
const QUANTITIES = data.quantities;

// As coupling.report.frame.shown: three significant digits, whole numbers from 100 on, a true minus sign.
function shown(value) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size === 0) return "0";
  if (size >= 1e6 || size < 1e-4) return value.toExponential(2).replace("e+", "e").replace(/-/g, "−");
  if (size >= 100) return value.toFixed(0).replace("-", "−");
  return String(Number(value.toPrecision(3))).replace("-", "−");
}

function rangeOf(arrays, factor) {
  let low = Infinity, high = -Infinity;
  for (const values of arrays) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return low <= high ? [low * factor, high * factor] : [0, 1];
}

function extremes(values, factor, angles) {
  let low = -1, high = -1;
  for (let k = 0; k < values.length; k++) {
    if (Number.isNaN(values[k])) continue;
    if (low < 0 || values[k] < values[low]) low = k;
    if (high < 0 || values[k] > values[high]) high = k;
  }
  if (low < 0) return null;
  return { min: values[low] * factor, max: values[high] * factor, minAt: angles[low], maxAt: angles[high] };
}

// Index of the value that is nearest.
function nearest(ascending, value) {
  let low = 0, high = ascending.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (ascending[middle] <= value) low = middle; else high = middle;
  }
  return Math.abs(ascending[low] - value) <= Math.abs(ascending[high] - value) ? low : high;
}
