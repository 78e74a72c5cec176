"""A short run, then its numbers with xarray: inflow, states at equal inflow mass, ratios to the initial state."""

import tempfile
from pathlib import Path

import coupling
from coupling.postprocess import at_inflow, ratio_to_initial

# a mesh so coarse that this takes a second; leave `discretisation` out for numbers that mean something
coarse = {"element_size": 4.0, "element_size_lining": 0.8, "element_size_interior": 0.5, "size_growth": 0.4}
scene = coupling.load_scene(
    "quick", stop={"inflow_mass": 50.0}, output={"snapshot_interval": 0.02}, discretisation=coarse
)
with tempfile.TemporaryDirectory() as folder:
    pressures = coupling.run(scene, out=Path(folder) / "run")
    tree = coupling.read_run(Path(folder) / "run").load()

history = tree["history"].to_dataset()
rate = history.inflow_mass.differentiate("time")
mass, time = history.inflow_mass[-1].item(), history.time[-1].item()
print(f"inflow {mass:.1f} kg/m in {time:.3f} s, now {rate[-1].item():.0f} kg/m/s")

state = at_inflow(pressures, 40.0)  # between records, at equal inflow mass: what may be compared between runs
print(f"at 40 kg/m the soil presses with {state.soil_pressure.sel(theta=0.0).item() / 1e3:.0f} kPa on the crown")
for name, angles in (("crown", (355, 0, 5)), ("gate", (85, 95))):
    print(
        f"{name}: water pressure {ratio_to_initial(pressures, 'water_pressure', 40.0, angles):.2f} of the initial one"
    )

around = pressures.soil_pressure.isel(time=[0, -1]).mean("theta")
print("mean around the ring, first and last [kPa]:", (around / 1e3).round(1).values)
last = tree["points"].to_dataset().isel(time=-1)
moved = (last.displacement_x**2 + last.displacement_y**2) ** 0.5
print(f"moved by more than 10 mm: {last.volume.where(moved > 0.01).sum().item():.2f} m2 of soil")
