"""A ring between rings that are turned, coupled along the circumferential joints."""

import numpy as np
import pytest
from rings import FORCES, ground, largest, pressures, ring, tractions

from structure import BeamSpringLining, Bolts, ContinuumLining, InputError, Neighbour
from structure.reduced import ReducedRing

BOTH = pytest.mark.parametrize("model", [BeamSpringLining, ContinuumLining])
STIFF = dict(rotation=22.5, ring_width=1.5, radial_stiffness=1e9, tangential_stiffness=1e9)
#: Joints that open, gape and slide, with bolts: all that a pair has to carry along.
WEAK = dict(
    joint_contact_only=True, joint_contact_height=0.3, joint_friction_coefficient=0.3,
    joint_bolts=Bolts(offset=-0.05, length=0.4, stiffness=1e8, preload=2e5),
)  # fmt: skip


def staggered(**changes):
    return Neighbour(**(STIFF | changes))


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize("laws", [{}, WEAK], ids=["linear", "weak"])
def test_rings_without_coupling_answer_as_alone(model, laws):
    loads = pressures(3).isel(time=[2])
    alone = model(ring(**laws)).respond(loads)
    free = staggered(radial_stiffness=0.0, tangential_stiffness=0.0)
    paired = model(ring(neighbour=free, **laws)).respond(loads)
    for name in (*FORCES, "displacement_radial", "joint_rotation"):
        # 1e-7 of the largest: Newton's tolerance
        assert largest(paired[name] - alone[name]) < 1e-7 * largest(alone[name]), name
    assert largest(paired["circumferential_radial_force"]) == 0


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize("laws", [{}, WEAK], ids=["linear", "weak"])
def test_ring_beside_answers_the_same_seen_from_its_side(model, laws):
    loads = pressures(3).isel(time=[2])
    given = ring(neighbour=staggered(), **laws)
    here, there = (model(one).respond(loads) for one in (given, given.beside))
    for name in FORCES:
        # 1e-6 of the largest: Newton's tolerance in rings of 1e9 N/m2 between them
        assert largest(here[f"neighbour_{name}"].values - there[name].values) < 1e-6 * largest(here[name]), name
    for way in ("radial", "tangential"):
        name = f"circumferential_{way}_force"
        assert largest(here[name].values + there[name].values) < 1e-6 * largest(here[name])
        assert largest(here[name]) > 1e3
    assert here["equilibrium_residual"].max() < 1e-8 and there["equilibrium_residual"].max() < 1e-8


@pytest.mark.slow
@BOTH
def test_rings_that_are_not_turned_pass_nothing_on(model):
    loads = pressures(3).isel(time=[2])
    response, alone = (model(ring(**more)).respond(loads) for more in (dict(neighbour=staggered(rotation=0.0)), {}))
    # 1e-6 of the loads
    assert largest(response["circumferential_radial_force"]) < 1e-6 * 4e5
    assert largest(response["bending_moment"] - alone["bending_moment"]) < 1e-6 * largest(alone["bending_moment"])


@pytest.mark.slow
@BOTH
def test_a_stiff_neighbour_takes_the_moment_that_a_joint_releases(model):
    """Soft joints; the pair stands between the ring alone and one without joints, and what a joint drops the other
    ring takes: half the sum of both rings is the moment of a ring in equilibrium."""
    soft = dict(joint_rotational_stiffness=1e7, ground=ground(slip_at="centre_line"))  # soil brings no couple
    loads = tractions(lambda a: 3e5 + 3e4 * np.cos(2 * a))
    pair, alone, whole = (
        model(given).respond(loads).isel(time=0)
        for given in (ring(neighbour=staggered(rotation=32.5), **soft), ring(**soft), ring(joint_angles=()))
    )
    ovals = [abs(response["convergence_vertical"].item()) for response in (whole, pair, alone)]
    assert ovals[0] < ovals[1] < ovals[2]
    at_joints = ring().joint_angles
    own, other = (pair[name].interp(theta=list(at_joints)) for name in ("bending_moment", "neighbour_bending_moment"))
    largest_joint = int(np.abs(whole["bending_moment"].interp(theta=list(at_joints)).values).argmax())
    assert abs(other[largest_joint]) > 2 * abs(own[largest_joint])
    mean = (pair["bending_moment"] + pair["neighbour_bending_moment"]) / 2
    shear = (pair["shear_force"] + pair["neighbour_shear_force"]) / 2
    slope = (np.roll(mean, -1) - np.roll(mean, 1)) / (2 * np.radians(1.0) * 3.125)
    inner = np.ones(360, bool)
    for angle in (*at_joints, *(np.array(at_joints) + 32.5)):
        inner &= np.abs((np.arange(360) - angle + 180) % 360 - 180) > 2
    # 2 % of the largest: differences over two degrees
    assert largest((shear + slope)[inner]) < 0.02 * largest(whole["shear_force"])


def test_pair_without_ground_stands_by_its_own_balance():
    free = ring(ground=None, concrete_unit_weight=0.0, neighbour=staggered(rotation=30.0))
    loads = tractions(lambda a: 3e5 + 3e4 * np.cos(2 * a))
    response = BeamSpringLining(free).respond(loads).isel(time=0)
    assert response["equilibrium_residual"] < 1e-8
    sprung = ring(
        concrete_unit_weight=0.0, neighbour=staggered(rotation=30.0), ground=ground(youngs_modulus=1.0, two_way=True)
    )
    held = BeamSpringLining(sprung).respond(loads).isel(time=0)
    # 1e-4: ground of next to no stiffness
    assert largest(response["bending_moment"] - held["bending_moment"]) < 1e-4 * largest(held["bending_moment"])


def test_pair_that_moves_in_the_ground_and_one_without_joints_are_refused():
    with pytest.raises(InputError, match="neighbour must be left out of a ring that moves"):
        ReducedRing(BeamSpringLining(ring(neighbour=staggered())), 2500.0, 9.81)
    with pytest.raises(InputError, match="neighbour: must be left out of a ring without joints"):
        ring(joint_angles=(), neighbour=staggered())
    with pytest.raises(ValueError, match="must have a neighbour, got none"):
        _ = ring().beside
