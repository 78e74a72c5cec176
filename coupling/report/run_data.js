// The numbers of a run: pressures and responses at the times of the slider, histories, where tunnel and gate are.
const times = unpack(data.time).values, inflow = unpack(data.inflow_mass).values;
const tunnels = data.lining ? data.lining.tunnels.map(unpackAll) : [];
const unpackModel = (model) => ({
  ...model, fields: unpackAll(model.fields), joints: unpackAll(model.joints),
  series: Object.fromEntries(Object.entries(model.series).map(([k, v]) => [k, { ...v, ...unpack(v) }])),
});
const history = {
  time: unpack(data.history.time).values,
  series: Object.fromEntries(Object.entries(data.history.series).map(([k, v]) => [k, { ...v, ...unpack(v) }])),
};
const gate = data.section.gate;
// of the tunnel that is shown: its number, and the answers of its lining models
let tunnel = gate ? gate.tunnel : 0;
const modelsOf = new Map([[tunnel, data.models], ...Object.entries(data.models_beside).map(([k, v]) => [Number(k), v])]
  .map(([k, answers]) => [k, answers.map(unpackModel)]));
let models = modelsOf.get(tunnel);
const home = data.section.tunnels[gate ? gate.tunnel : 0];
