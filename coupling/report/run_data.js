// The numbers of a run: pressures and responses at the times of the slider, histories, where tunnel and gate are.
const times = unpack(data.time).values, inflow = unpack(data.inflow_mass).values;
const tunnels = data.lining ? data.lining.tunnels.map(unpackAll) : [];
const models = data.models.map((model) => ({
  ...model, fields: unpackAll(model.fields), joints: unpackAll(model.joints),
  series: Object.fromEntries(Object.entries(model.series).map(([k, v]) => [k, { ...v, ...unpack(v) }])),
}));
const history = {
  time: unpack(data.history.time).values,
  series: Object.fromEntries(Object.entries(data.history.series).map(([k, v]) => [k, { ...v, ...unpack(v) }])),
};
const gate = data.section.gate;
const home = data.section.tunnels[gate ? gate.tunnel : 0];
