"""Water that passes the sides of the box, against Darcy's law, and ground at rest between them."""

import numpy as np
import pytest

import mpm
from mpm.walls.sides import SIDES, pressure_at_start
from verification.boxes import box_mesh, box_scene, run_to, state
from verification.problems.columns import seepage

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("conductivity", [1e-2, 1e-3])
@pytest.mark.parametrize(("upward", "error"), [(True, 2e-3), (False, 1e-6)])
def test_flow_between_held_sides_is_darcys(upward, conductivity, error):
    found = seepage(cells=10, conductivity=conductivity, upward=upward)
    assert found.values["flow"] == pytest.approx(1.0, abs=error)  # of the grains' drag nothing is left out
    assert found.error < max(error, 1e-5)


def test_what_comes_in_through_the_sides_is_there():
    found = seepage(cells=10, conductivity=1e-2, upward=False)
    assert found.values["recharge"] > 1e-3  # kg/m, more than goes out: pressed water is denser
    assert abs(found.values["water_missing"]) < 1e-3 * found.values["recharge"]


def test_ground_at_rest_stays_at_rest_between_held_sides():
    size = 0.25
    scene = box_scene(
        "rest", size, 2.0, 1.0, model="elastic", youngs_modulus=4e7, porosity=0.45, hydraulic_conductivity=1e-3,
        bulk_modulus=8e7, sides="held",
    )  # fmt: skip
    solver = mpm.Solver(scene, box_mesh(np.linspace(-1, 1, 9), np.linspace(-1, size, 6)), threads=1)
    run_to(solver, 0.05)
    for axis in "xy":
        assert np.abs(state(solver, f"velocity_liquid_{axis}")).max() < 1e-6
    assert abs(solver.ledger["recharge"].sum()) < 1e-6


def test_undrained_ground_has_no_open_sides():
    with pytest.raises(ValueError, match="sides = 'held' needs water with a velocity of its own"):
        box_scene("tight", 0.25, 2.0, 1.0, bulk_modulus=8e7, drainage="undrained", sides="held")


def test_a_head_of_its_own_is_one_row_of_the_table_of_sides(monkeypatch):
    # heads beyond all sides that grow by a fifth of the depth: water rises evenly, by Darcy's law with k i
    monkeypatch.setitem(SIDES, "held", lambda scene, depth: 1.2 * pressure_at_start(scene, depth))
    size, conductivity, porosity = 0.125, 1e-3, 0.45
    scene = box_scene(
        "artesian", size, 0.5, 1.0, model="elastic", youngs_modulus=4e7, porosity=porosity,
        hydraulic_conductivity=conductivity, bulk_modulus=8e7, sides="held",
    )  # fmt: skip
    solver = mpm.Solver(scene, box_mesh(np.linspace(-0.25, 0.25, 5), np.linspace(-1, size, 10)), threads=1)
    run_to(solver, 1.0)
    depth, pressure = -state(solver, "y"), state(solver, "pore_pressure")
    assert np.abs(pressure - 1.2 * 9810 * depth).max() < 0.01 * 1.2 * 9810  # waves that are left
    rising = porosity * state(solver, "velocity_liquid_y").mean()
    assert rising == pytest.approx(0.2 * conductivity, rel=0.01)
