// The player of a run: all charts over time, the choice of shape and tunnel.
function pick(time) {
  stop();
  show(nearest(times, time));
}

const rings = ringCharts(), fixed = [...timeCharts(pick)];
if (models.length) {
  fixed.push(new DeformedRing(), { draw: drawModelTable });
  if (document.getElementById("joint-table")) fixed.push({ draw: drawJointTable });
}
if (data.fields) fixed.push(new FieldView());
function redrawRings() {
  for (const ring of rings) { ring.build(); ring.draw(Number(slider.value)); }
}
document.getElementById("shape").addEventListener("change", (event) => { shape = event.target.value; redrawRings(); });
const tunnelChoice = document.getElementById("tunnel");
if (tunnelChoice) {
  tunnelChoice.value = tunnel;
  tunnelChoice.addEventListener("change", () => { tunnel = Number(tunnelChoice.value); redrawRings(); });
}
if (data.mesh) new MeshView();
drawSection();
startSlider(times.length, (k) => `${shown(times[k])} s, ${shown(inflow[k])} kg/m`, [...rings, ...fixed]);
