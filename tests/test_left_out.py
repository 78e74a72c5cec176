"""What a scene does not need is not computed; where the feature is there but neutral, the answer is the same."""

import numpy as np
import pytest

import coupling
import mpm
import mpm.scene
from mpm.variables import EQ, SXX, SXY, SYY, SZZ, VSX, VSY, P, X, Y

MOTION = [X, Y, VSX, VSY, EQ]
STRESS = [SXX, SYY, SZZ, SXY]


def scene(**changes):
    return coupling.load_scene("quick").mpm.model_copy(update=changes)


def stepped(case, steps=60, weightless=False):
    """Points after some steps with the gate open, one thread."""
    solver = mpm.Solver(case, mpm.build_mesh(case), threads=1)
    solver.points[:, P] = 0.0 if weightless else solver.points[:, P]
    solver.relax()
    solver.open_gate()
    for _ in range(steps):
        solver.step(2e-5)
    return solver


def test_dry_scene_is_the_limit_of_water_without_weight_and_stiffness():
    dry = stepped(scene(water=None))
    # no validated scene can have such water: its bulk modulus and density are bounded from below
    nothing = mpm.scene.Water.model_construct(table_depth=0.0, density=1e-9, bulk_modulus=0.0)
    wet = stepped(scene(water=nothing), weightless=True)
    moved = np.hypot(dry.points[:, VSX], dry.points[:, VSY]).max()
    assert moved > 1e-3
    assert np.abs(dry.points[:, MOTION] - wet.points[:, MOTION]).max() < 1e-9
    scale = np.abs(dry.points[:, STRESS]).max()
    assert np.abs(dry.points[:, STRESS] - wet.points[:, STRESS]).max() < 1e-8 * scale


def test_elastic_scene_is_the_limit_of_a_strength_that_is_never_reached():
    soil = scene().soils[0]
    elastic = stepped(scene(soils=(soil.model_copy(update={"model": "elastic"}),)))
    strong = stepped(scene(soils=(soil.model_copy(update={"cohesion": 1e12, "tensile_strength": 1e12}),)))
    # two compilations fuse products and sums differently: round-off of 60 steps, over each variable's largest value
    scale = np.abs(elastic.points).max(axis=0)
    assert (np.abs(elastic.points - strong.points) <= 1e-12 * scale).all()


def test_dry_scene_has_no_water_pressure_and_less_weight():
    case = scene(water=None, stop=mpm.scene.Stop(time=0.004))
    first, *_, last = mpm.simulate(case)
    assert not first.lining[0]["water_pressure"].any() and not last.lining[0]["water_pressure"].any()
    crown = int(np.argmin(np.abs(first.lining[0]["theta"])))
    weight = 9.81 * 2650.0 * 0.55 * 20.0  # dry grains above the crown
    assert first.lining[0]["soil_pressure"][crown] == pytest.approx(weight, rel=0.02)


def test_scene_file_can_leave_out_the_water_of_its_base(tmp_path):
    file = tmp_path / "dry.toml"
    file.write_text('base = "quick"\nname = "dry"\nwater = "none"\n')
    dry = coupling.load_scene(str(file))
    assert dry.mpm.water is None
    # soil springs see the dry stress at the axis
    assert dry.ring.ground.vertical_stress == pytest.approx(9.81 * 2650.0 * 0.55 * 23.3)


def test_water_needs_a_permeability():
    data = coupling.load_scene("quick").mpm.model_dump()
    data["soils"][0]["hydraulic_conductivity"] = None
    with pytest.raises(ValueError, match="hydraulic_conductivity must be given where there is water"):
        mpm.scene.Scene.model_validate(data)
    mpm.scene.Scene.model_validate(data | {"water": None})
