"""The event begins with a state that the lining's friction bears, or the run would slip when the gate opens."""

import numpy as np
import pytest

import coupling
import mpm
from coupling.runs.recorded_simulation import MOST_UNBORNE
from coupling.scenes.features import features
from coupling.scenes.layers import scene_names
from mpm.k0_procedure import bond_friction, lateral_pressure_range
from verification.small_event import small_scene

QUICK = coupling.load_scene("quick")


def slit(k0, friction=0.2, initial_contact="bonded", **changes):
    """A slit of 5 mm at the invert of nearly tight ground: in 0.02 s nothing of note comes in."""
    sand = QUICK.soils[0].model_dump() | {"friction_angle": 35.0, "k0": k0, "hydraulic_conductivity": 1e-7}
    tunnel = QUICK.tunnels[0].model_dump() | {"friction_coefficient": friction}
    return small_scene(
        soils=[sand], gate={"angle": 180.0, "width": 0.005}, tunnels=[tunnel], numerics={}, stop={"time": 0.02},
        output={"interval": 0.02}, initial_contact=initial_contact, **changes,
    )  # fmt: skip


def share_beyond(k0, friction):
    """Share of the shear of K0 stress on a circle that is beyond friction, also where stress grows with depth."""
    a = np.linspace(0.0, np.pi / 2, 100_001)
    shear, pressure = (1 - k0) * np.sin(a) * np.cos(a), np.cos(a) ** 2 + k0 * np.sin(a) ** 2
    return np.maximum(shear - friction * pressure, 0.0).sum() / shear.sum()


def shear_and_friction(solver):
    return np.abs(solver.impulse["shear"]), solver.contact["friction"] * solver.impulse["soil"]


@pytest.mark.slow
def test_bonded_ground_beyond_friction_slips_before_the_gate_opens_and_stays_after():
    simulation = mpm.Simulation(slit(0.43), threads=1)
    first = simulation.begin().lining[0]
    # of the shear of K0 stress on a circle 0.358 is beyond friction; the polygon has 50 sides
    assert simulation.unborne_shear == pytest.approx(share_beyond(0.43, 0.2), rel=0.02)
    shear, limit = shear_and_friction(simulation.solver)
    # 1e-3 of the largest: what the relaxation leaves
    assert (shear <= limit + 1e-3 * limit.max()).all()
    after = simulation.advance().lining[0]
    side = (np.abs(first["theta"] % 180 - 90) < 60) & (np.abs(first["theta"] - 180) > 15)
    # 2 % of the largest, where half of it was lost at once: the slit itself, and what the relaxation leaves
    change = np.abs(after["soil_shear"] - first["soil_shear"])[side].max()
    assert change < 0.02 * np.abs(first["soil_shear"]).max()


@pytest.mark.slow
def test_slipped_bond_is_the_frictional_state_of_a_held_lining():
    shears = []
    for contact in ("bonded", "frictional"):
        simulation = mpm.Simulation(slit(0.43, initial_contact=contact), threads=1)
        shears.append(simulation.begin().lining[0]["soil_shear"])
    assert simulation.unborne_shear == 0
    assert np.abs(shears[0] - shears[1]).max() < 1e-3 * np.abs(shears[1]).max()


@pytest.mark.slow
@pytest.mark.parametrize(("k0", "friction"), [(1.0, 0.0), (0.577, 0.29)])
def test_bonded_ground_that_friction_bears_is_left_as_it_is(k0, friction):
    scene = slit(k0, friction)
    simulation = mpm.Simulation(scene, threads=1)
    simulation.begin()
    assert simulation.unborne_shear == 0
    alone = mpm.Solver(scene, simulation.solver.mesh, threads=1)
    alone.relax()
    np.testing.assert_array_equal(alone.points, simulation.solver.points)


@pytest.mark.parametrize("k0", [0.43, 0.577, 1.0, 2.0])
def test_friction_that_bears_the_bond_is_the_largest_of_shear_over_pressure(k0):
    scene = slit(k0)
    a = np.linspace(0.0, np.pi, 100_001)
    ratio = (1 - k0) * np.sin(a) * np.cos(a) / (np.cos(a) ** 2 + k0 * np.sin(a) ** 2)
    assert bond_friction(scene, scene.tunnels[0]) == pytest.approx(np.abs(ratio).max(), abs=1e-8)


def test_friction_that_bears_the_bond_is_of_the_soils_beside_the_tunnel():
    upper = QUICK.soils[0].model_copy(update={"k0": 0.577})
    lower = upper.model_copy(update={"top_depth": 40.0, "k0": 0.43})
    alone, scene = (QUICK.model_copy(update={"soils": soils}) for soils in ((upper,), (upper, lower)))
    tunnel = scene.tunnels[0]
    assert bond_friction(scene, tunnel) == bond_friction(alone, tunnel) < 0.28
    deep = tunnel.model_copy(update={"cover": 35.0})
    assert bond_friction(scene, deep) > 0.43


@pytest.mark.parametrize(("friction", "slips"), [(0.2, True), (0.29, False)])
def test_plan_says_whether_the_ground_slips(friction, slips):
    row = {one["feature"]: one for one in features(slit(0.577, friction), 1)}[
        "slip along the lining before the gate opens"
    ]
    assert row["active"] is slips
    assert row["reason"] == f"K0 asks for a coefficient of 0.28, the lining has {friction:g}"


@pytest.mark.parametrize("name", scene_names())
def test_built_in_scenes_bear_most_of_the_bond_or_ask_for_friction(name):
    scene = coupling.load_scene(name)
    shares = [
        share_beyond(k0, tunnel.friction_coefficient)
        for soil in scene.soils for k0 in lateral_pressure_range(scene, soil) for tunnel in scene.tunnels
    ]  # fmt: skip
    assert scene.initial_contact == "frictional" or max(shares) < MOST_UNBORNE


@pytest.mark.slow
def test_run_warns_where_much_of_the_bond_slipped(tmp_path):
    told = []
    coupling.run(slit(0.43), tmp_path / "run", warn=told.append)
    (line,) = [line for line in told if "initial_contact = 'bonded'" in line]
    assert "give a coefficient of 0.44 or more" in line
    assert 0.3 < coupling.datasets.read_attributes(tmp_path / "run")["initial_unborne_shear"] < 0.4


@pytest.mark.slow
def test_run_of_a_built_in_scene_asks_for_friction_and_is_not_warned_of_slip(tmp_path):
    told = []
    coupling.run(small_scene(stop={"time": 0.01}), tmp_path / "run", warn=told.append)
    assert not [line for line in told if "initial_contact" in line]
    assert coupling.datasets.read_attributes(tmp_path / "run")["initial_unborne_shear"] == 0


@pytest.mark.slow
def test_run_only_notes_a_slip_of_little_shear(tmp_path):
    told = []
    scene = small_scene(stop={"time": 0.01}, initial_contact="bonded", **{"soils.0.k0": 0.577})
    coupling.run(scene, tmp_path / "run", warn=told.append)
    assert not [line for line in told if "initial_contact" in line]
    assert "friction does not bear 13." in (tmp_path / "run" / "run.log").read_text()
    assert 0.1 < coupling.datasets.read_attributes(tmp_path / "run")["initial_unborne_shear"] < 0.2
