"""No kernel reads or writes beyond its arrays: events through all of them, compiled so that each index is looked at.

That takes minutes to compile and is of no use without: `NUMBA_BOUNDSCHECK=1`, as `.ci/bounds` sets it.
"""

import numba
import numpy as np
import pytest

import mpm
import mpm.solver
from mpm.laws.law import built_in_laws, soil_law
from mpm.machine.compile import index, kernel, kernel_part, step_kernel
from verification.problems.soil_laws import CLAY
from verification.small_event import small_scene

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not numba.config.BOUNDSCHECK, reason="indices are not looked at; see .ci/bounds"),
]

#: What a layer changes of sand, by its top; tunnel and gate are in the last one.
LAYERS = {
    0.0: {"model": "elastic"},
    10.0: {
        "model": "softening-mohr-coulomb", "residual_cohesion": 0.0, "residual_friction_angle": 20.0,
        "residual_dilatancy_angle": 0.0, "softening_strain": 0.05,
    },
    15.0: CLAY,
    18.0: {"model": "mohr-coulomb"},
}  # fmt: skip
WAYS = {
    "two velocities, levels, jointed lining": {"tunnels.0.lining": "jointed"},
    "one velocity, one step for all, sink": {
        "water.drainage": "undrained", "numerics.local_time_stepping": False, "interior": "sink",
    },
    "dry, floating lining, altitude": {
        "water": "none", "tunnels.0.lining": "floating", "numerics.critical_step": "altitude",
    },
    "half of two velocities": {"gate.angle": 180.0, "symmetry": "half"},
}  # fmt: skip


def layered(**changes):
    """The small event in ground of all laws."""
    sand = small_scene().soils[0].model_dump(exclude_none=True)
    soils = []
    for depth, own in LAYERS.items():
        known = soil_law(own["model"]).model_fields
        soil = {**sand, **own, "name": own["model"], "top_depth": depth}
        soils.append({key: value for key, value in soil.items() if key in known})
    return small_scene(soils=soils, **changes)


@pytest.mark.parametrize("changes", WAYS.values(), ids=WAYS)
def test_no_kernel_looks_beyond_its_arrays(changes, monkeypatch):
    monkeypatch.setattr(mpm.solver, "SMALLEST_PARALLEL", 0)  # else one thread does all
    scene = layered(stop={"inflow_mass": 20.0, "time": 2.0}, output={"interval": 0.05}, **changes)
    assert {type(soil) for soil in scene.soils} == set(built_in_laws())
    *_, last = mpm.simulate(scene, threads=2)
    assert last.inflow_mass > 20.0  # points have come through the gate and are sorted anew


@pytest.mark.parametrize("kind", [kernel, step_kernel])
def test_an_index_beyond_is_found_in_what_kernels_call(kind):
    @kernel_part
    def read(values, place):
        return values[place]

    @kind
    def last(values):
        return read(values, index(values.size))

    with pytest.raises(IndexError):
        last(np.zeros(3))
