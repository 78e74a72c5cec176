// The numbers of a study: curves and extremes of every case at its inflow masses, and how each case is drawn.
const cases = (data.cases || []).map((entry, k) => ({
  ...entry, mass: unpack(entry.mass).values, shown: true, style: caseStyle(k, data.cases.length),
  overMass: unpackAll(entry.over_mass), pressures: unpackAll(entry.pressures), extremes: unpackAll(entry.extremes),
  models: entry.models.map((model) => ({ forces: unpackAll(model.forces), extremes: unpackAll(model.extremes) })),
}));
const stops = data.stops ? unpack(data.stops).values : [];
let model = 0;

// Few cases differ by colour and dash; many repeat the colours with another dash.
function caseStyle(k, count) {
  const dashes = [...DASHES, "14 4", "12 3 2 3 2 3"];
  const dash = count <= DASHES.length ? k : Math.floor(k / COLOURS.length);
  return { stroke: COLOURS[k % COLOURS.length], strokeDasharray: dashes[dash % dashes.length] };
}

for (const one of cases) {
  // time is unknown beyond what the case reached
  one.reached = one.overMass.time.values.reduce((last, value, j) => (Number.isFinite(value) ? j : last), 0);
  one.stopMasses = data.records.map((j) => one.mass[j]);
}

const visible = () => cases.filter((one) => one.shown);

// Record of a case at a stop of the slider: {curve, record} in curves and in series; null where it did not get there.
function recordAt(one, frame) {
  const mass = stops[frame], curve = nearest(one.stopMasses, mass), record = data.records[curve];
  const end = one.mass[one.reached], past = mass > end * (1 + 1e-6) && record >= one.reached;
  return past || record > one.reached ? null : { curve, record };
}
