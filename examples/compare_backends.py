"""Two lining models under the same pressures: where and by how much they differ."""

import numpy as np

import coupling
import structure

ring = coupling.load_scene("case-3").ring
pressures = structure.theoretical_pressures(
    outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8.9e3, coefficient_at_rest=0.577
)
responses = {name: structure.lining_model(name)(ring).respond(pressures) for name in ("beam-spring", "continuum")}
beam, continuum = (responses[name].isel(time=0) for name in responses)

for name, unit, scale in (
    ("axial_force", "kN/m", 1e-3),
    ("shear_force", "kN/m", 1e-3),
    ("bending_moment", "kN m/m", 1e-3),
    ("displacement_radial", "mm", 1e3),
):
    difference = continuum[name].values - beam[name].values
    largest = int(np.abs(difference).argmax())
    share = abs(difference[largest]) / np.abs(beam[name].values).max()
    at = beam.theta.values[largest]
    print(f"{name:20s} {difference[largest] * scale:+8.3f} {unit:7s} {share:6.2%} of the extreme, at {at:.1f} degrees")
