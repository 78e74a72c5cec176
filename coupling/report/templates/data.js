// The numbers of the page: a text back to JSON and arrays (see coupling/report/packing.py), SI; what is shown of them.
const KINDS = { f4: Float32Array, u1: Uint8Array, u2: Uint16Array, u4: Uint32Array };
const COLOURS = ["#0072b2", "#d55e00", "#117733", "#aa4499", "#332288", "#882255", "#8a6d00", "#4a4f57"];
const DASHES = ["solid", [8, 3], [2, 3], [8, 3, 2, 3], [14, 4], [12, 3, 2, 3, 2, 3]];
const $ = (id) => document.getElementById(id);

async function unpack() {
  const text = Uint8Array.from(atob($("data").textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([text]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = await new Response(stream).arrayBuffer(), [head] = new Uint32Array(bytes, 0, 1);
  // an array of two dimensions has a width
  return JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, head)), (_, entry) => {
    if (entry === null || entry.kind === undefined || entry.at === undefined) return entry;
    const stored = new KINDS[entry.kind](bytes, 4 + head + entry.at, entry.shape.reduce((a, b) => a * b, 1));
    const value = (v) => (v === 65535 ? NaN : entry.low + v * entry.step);
    return Object.assign(entry.step === undefined ? stored : Float32Array.from(stored, value), { width: entry.shape[1] });
  });
}

const row = (values, k) => values.subarray(k * values.width, (k + 1) * values.width);

// As coupling.report.numbers.shown: three significant digits, whole numbers from 100 on, a true minus sign.
function shown(value) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const text = size !== 0 && (size >= 1e6 || size < 1e-4) ? value.toExponential(2).replace("e+", "e")
    : size >= 100 ? value.toFixed(0) : String(Number(value.toPrecision(3)));
  return text.replace(/-/g, "−");
}

// Index of the value that is nearest.
function nearest(values, value) {
  return values.reduce((best, v, k) => (Math.abs(v - value) < Math.abs(values[best] - value) ? k : best), 0);
}

// Ends of an axis that hold all these arrays, at round numbers; the upper one `tight` above them.
function range(arrays, factor, fromZero, tight = false) {
  let low = fromZero ? 0 : Infinity, high = fromZero ? 0 : -Infinity;
  for (const values of arrays) for (const value of values || []) {
    if (value * factor < low) low = value * factor;
    if (value * factor > high) high = value * factor;
  }
  if (low > high) [low, high] = [0, 1];
  const pad = Math.abs(low) * 0.1 || 1;
  if (low === high) [low, high] = [low - pad, high + pad];
  const raw = (high - low) / 4, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 2.5, 5, 10].map((s) => s * power).find((s) => s >= raw * 0.999);
  const top = tight && high > 0 ? high + 0.04 * (high - low) : Math.ceil(high / step - 1e-9) * step;
  return { min: Math.floor(low / step + 1e-9) * step, max: top, interval: step };
}

const data = await unpack();
const stops = data.stops.values, entries = data.entries;
const state = {
  stop: stops.length - 1, shape: "polar", against: "value", along: data.stops.along, model: Number($("model")?.value ?? -1),
};
