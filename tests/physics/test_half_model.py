"""A symmetric scene is computed by its half; what comes out is the whole's."""

from dataclasses import fields

import numpy as np
import pytest

import coupling
import mpm
from mpm.fields import values
from mpm.mesh import Mesh, areas
from mpm.mesh.half import right_half, with_mirror_image
from verification.small_event import COARSE, small_scene

pytestmark = pytest.mark.slow

# Sums at the nodes are the same up to their order; the event multiplies their last bits by some 1e3 in a hundred steps.
ROUND_OFF = 1e-11
EVENT = 1e-7


def scene(angle=0.0, **changes):
    """The small event with the gate on the mirror line, or without a gate."""
    gate = "none" if angle is None else {"angle": angle}
    return small_scene(gate=gate, **changes)


#: Ground that sticks to the lining and is far from yielding: slip and the active state multiply last bits by more.
STURDY = {"initial_contact": "bonded", "soils.0.k0": 0.577}


def pair(**settings):
    """The same scene as a half and as a whole on the same mesh, relaxed; a coefficient that makes contacts slip."""
    case = scene(**settings)
    mesh = mpm.build_mesh(case)
    solvers = [mpm.Solver(case.model_copy(update={"symmetry": s}), mesh, threads=1) for s in ("half", "whole")]
    for solver in solvers:
        solver.relax()
    assert solvers[1].n_points == 2 * solvers[0].n_points
    return solvers


def same_pressures(half, whole, duration, tolerance):
    (mine,), (theirs,) = half.lining_pressures(duration), whole.lining_pressures(duration)
    assert np.array_equal(mine["theta"], theirs["theta"]) and np.allclose(mine["arc"], theirs["arc"], rtol=1e-12)
    largest = max(theirs["soil_pressure"].max(), theirs["water_pressure"].max())
    for name in ("soil_pressure", "water_pressure", "soil_shear"):
        assert np.abs(mine[name] - theirs[name]).max() < tolerance * largest, name
    for name in ("soil_pressure_std", "water_pressure_std"):  # differences of squares
        assert np.abs(mine[name] - theirs[name]).max() < 1e-7 * max(largest, theirs[name].max()), name
    return mine


@pytest.mark.parametrize("angle", [0.0, 180.0, None])
@pytest.mark.parametrize("contact", ["bonded", "frictional"])
def test_initial_pressures_of_the_half_are_those_of_the_whole(angle, contact):
    half, whole = pair(angle=angle, initial_contact=contact)
    # a residual of 1e-3 that ends the relaxation is met in the same step by both
    pressures = same_pressures(half, whole, 1.0, ROUND_OFF)
    shear = pressures["soil_shear"]
    crown, invert = (int(np.argmin(np.abs(pressures["theta"] - a))) for a in (0.0, 180.0))
    assert shear[crown] == shear[invert] == 0.0 and np.abs(shear).max() > 1e4
    assert np.array_equal(shear[1:], -shear[:0:-1])


@pytest.mark.parametrize(("angle", "dry"), [(0.0, False), (180.0, False), (0.0, True)])
def test_event_of_the_half_is_that_of_the_whole(angle, dry):
    half, whole = pair(angle=angle, **STURDY, **({"water": "none"} if dry else {}))
    for solver in (half, whole):
        solver.open_gate()
        solver.impulse[:] = 0.0
        for _ in range(600):
            solver.step(1e-4)  # below the critical step, whose estimate is another one for the half
    assert half.step_count == whole.step_count == 600
    assert half.time == pytest.approx(whole.time, rel=EVENT)
    same_pressures(half, whole, half.time, EVENT)
    mine, theirs = half.measures(), whole.measures()
    assert theirs["disturbed_area"] > 0.1 and theirs["max_velocity"] > 0.1
    assert mine == pytest.approx(theirs, rel=EVENT)
    mine, theirs = half.balances(), whole.balances()
    for name in ("work_gravity", "work_stress", "work_drag", "kinetic_energy_change"):
        assert mine[name] == pytest.approx(theirs[name], rel=1e-5), name  # differences of large sums
    for name, value in half.flow_amounts().items():
        assert value == pytest.approx(whole.flow_amounts()[name], rel=1e-5, abs=1e-9), name
    weight = 9.81 * (half.initial_grain_mass + half.initial["water"]) * half.copies
    assert mine["momentum_departure"] < 1e-4 * weight * half.time and mine["contact_error"] < 1e-12


def test_points_of_the_half_and_their_images_are_those_of_the_whole():
    half, whole = pair(**STURDY)
    for solver in (half, whole):
        solver.open_gate()
        for _ in range(100):
            solver.step(2e-4)
    mine, theirs = half.points_by_name(), whole.points_by_name()
    order = [np.lexsort((p["y"].round(6), p["x"].round(6))) for p in (mine, theirs)]
    for name in theirs:
        a, b = mine[name][order[0]].astype(float), theirs[name][order[1]].astype(float)
        assert np.abs(a - b).max() <= EVENT * max(np.abs(b).max(), 1e-12), name
    assert np.abs(mine["velocity_solid_x"]).max() > 1e-3


def test_inflow_is_that_of_the_whole_and_stops_the_run():
    # steps that depend on altitudes alone: the largest eigenvalue of the half is that of the symmetric modes
    numerics = {"critical_step": "altitude"}
    case = scene(stop={"inflow_mass": 20.0, "time": 0.3}, interior="sink", numerics=numerics, **STURDY)
    *_, last = mpm.simulate(case, threads=1)
    whole = case.model_copy(update={"symmetry": "whole"})
    *_, other = mpm.simulate(whole, mpm.build_mesh(case), threads=1)
    # the masses of single points decide, and the flow has multiplied the last bits, those of the time step as well
    assert last.inflow_mass >= 20.0 and abs(last.steps - other.steps) <= 1
    assert last.inflow_mass == pytest.approx(other.inflow_mass, rel=1e-3)
    assert last.grain_mass == pytest.approx(other.grain_mass, rel=1e-12)


def test_mesh_of_a_half_model_is_its_own_mirror_image():
    for angle in (0.0, 180.0, None):
        case = scene(angle)
        mesh = mpm.build_mesh(case)
        half = right_half(mesh)
        assert half.nodes[:, 0].min() == 0.0 and 2 * len(half.elements) == len(mesh.elements)
        assert areas(half.nodes, half.elements).min() > 0
        assert np.all(half.nodes[half.left, 0] == 0.0)
        assert half.outer_theta[0][[0, -1]].tolist() == [0.0, 180.0]
        assert len(half.corner_nodes) == (0 if angle is None else 1)
        again = with_mirror_image(half)
        image = mesh.mirrored()
        for field in fields(Mesh):
            one, other = getattr(mesh, field.name), getattr(again, field.name)
            if isinstance(one, tuple):
                (one,), (other,) = one, other
            assert np.array_equal(one, other, equal_nan=True), field.name
        # the image has other numbers: compare places
        for name in ("corner_nodes", "opening_nodes", "wall_nodes", "inner_nodes", "inner_opening_nodes", "bottom"):
            ours, theirs = (np.round(m.nodes[getattr(m, name)], 9) + 0.0 for m in (mesh, image))
            assert set(map(tuple, ours.tolist())) == set(map(tuple, theirs.tolist())), name
        assert areas(mesh.nodes, mesh.elements).min() > 0


def test_half_model_fits_layers_above_beside_and_below_the_tunnel():
    layer = scene().soils[0].model_dump()
    soils = [layer, *({**layer, "top_depth": depth} for depth in (7.3, 22.0, 35.0))]
    mesh = mpm.build_mesh(scene(soils=soils))
    height = mesh.nodes[mesh.elements[mesh.region == 0]][:, :, 1]
    for depth in (7.3, 22.0, 35.0):
        assert not ((height.min(axis=1) < -depth - 1e-9) & (height.max(axis=1) > -depth + 1e-9)).any()


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"gate": {"angle": 90.0}}, "gate at 90 degrees"),
        ({"discretisation": {**COARSE, "elements_across_gate": 3}}, "3 elements across the gate"),
        ({"tunnels": [{**scene().tunnels[0].model_dump(), "x": 1.0}]}, "tunnel at x = 1 m"),
    ],
)
def test_scene_that_is_not_symmetric_is_computed_whole_and_half_is_refused(changes, reason):
    crown = {"gate": {"angle": 0.0}}
    assert not small_scene(**(crown | changes)).is_half
    with pytest.raises(coupling.SceneError, match=f"symmetry: 'half' must mirror the scene in x = 0, got .*{reason}"):
        small_scene(**(crown | changes), symmetry="half")
    assert not small_scene(**crown, symmetry="whole").is_half and small_scene(**crown).is_half


def test_mesh_whose_triangles_cross_the_mirror_line_is_refused():
    case = scene()
    with pytest.raises(ValueError, match="mirror line x = 0 of a half model must be a mesh line"):
        mpm.Solver(case, mpm.build_mesh(case.model_copy(update={"symmetry": "whole"})))


def test_ground_at_rest_stays_at_rest_beside_the_mirror_line():
    half, _ = pair(angle=None, tunnels=[{**scene().tunnels[0].model_dump(), "friction_coefficient": 0.6}])
    before = half.points.copy()
    for _ in range(200):
        half.step()
    assert (
        np.abs(
            values(half.points, ("stress_yy", "pore_pressure")) - values(before, ("stress_yy", "pore_pressure"))
        ).max()
        < 1e-6 * before["pore_pressure"].max()
    )
    assert np.abs(half.points["velocity_solid_x"]).max() < 1e-9  # m/s, round-off of 5e5 Pa
