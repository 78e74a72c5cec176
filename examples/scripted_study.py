"""A study from a script: two permeabilities, compared at equal inflow mass."""

import tempfile

import coupling

definition = {
    "name": "two-permeabilities",
    "scene": "quick",
    "records": 3,
    "parameters": {
        "soils.0.hydraulic_conductivity": [1e-4, 1e-3],
        "stop.inflow_mass": [50.0],
        # a mesh so coarse that this takes seconds; leave these out for numbers that mean something
        "discretisation.element_size": [4.0],
        "discretisation.element_size_lining": [0.8],
        "discretisation.element_size_interior": [0.5],
        "discretisation.size_growth": [0.4],
    },
}

if __name__ == "__main__":  # worker processes import this file
    with tempfile.TemporaryDirectory() as folder:
        study = coupling.study(definition, out=folder, workers=0, progress=print).load()
    for case in study.case.values:
        one = study.sel(case=case).isel(progress=-1)
        moment = one.bending_moment.max().item() / 1e3
        print(
            f"k = {one.soils_0_hydraulic_conductivity.item():.0e} m/s: 50 kg/m after {one.time.item():.3f} s,"
            f" largest moment {moment:.0f} kN m/m"
        )
