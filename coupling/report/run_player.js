// The player of a run: all charts over time, the choice of shape and tunnel.
function pick(time) {
  stop();
  show(nearest(times, time));
}

const OF_MODELS = ["axial_force", "shear_force", "bending_moment", "deformed", "convergence"];
const fieldView = data.fields ? [new FieldView()] : [];
let rings = [];
// all that moves with the slider, for the tunnel that is chosen
function moving() {
  models = modelsOf.get(tunnel) || [];
  rings = ringCharts();
  const made = [...rings, ...timeCharts(pick), ...fieldView];
  if (models.length) made.push(new DeformedRing());
  for (const key of models.length ? [] : OF_MODELS) {
    if (!document.getElementById(key)) continue;
    document.getElementById(key).replaceChildren();
    document.getElementById(key).setAttribute("aria-label", `${key.replace(/_/g, " ")}: no answer for this tunnel`);
    caption(key, "No lining model has answered for this tunnel.");
  }
  if (document.getElementById("model-table")) made.push({ draw: drawModelTable });
  if (document.getElementById("joint-table")) made.push({ draw: drawJointTable });
  return made;
}
const parts = moving();
document.getElementById("shape").addEventListener("change", (event) => {
  shape = event.target.value;
  for (const ring of rings) { ring.build(); ring.draw(Number(slider.value)); }
});
const tunnelChoice = document.getElementById("tunnel");
if (tunnelChoice) {
  tunnelChoice.value = tunnel;
  tunnelChoice.addEventListener("change", () => {
    tunnel = Number(tunnelChoice.value);
    parts.splice(0, parts.length, ...moving());
    show(Number(slider.value));
  });
}
if (data.mesh) new MeshView();
drawSection();
startSlider(times.length, (k) => `${shown(times[k])} s, ${shown(inflow[k])} kg/m`, parts);
