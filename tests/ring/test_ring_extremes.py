"""Extreme rings and loads: each is solved in equilibrium or refused with its reason, none silently wrong."""

import numpy as np
import pytest
from rings import ground, pressures, ring

from structure import BeamSpringLining, LiningFailure, theory

STIFFNESSES = ("joint_rotational_stiffness", "joint_normal_stiffness", "joint_shear_stiffness")
HINGES = dict(joint_rotational_stiffness=0.0)
NO_GROUND = dict(ground=None, balance_uplift=True)
ELASTIC = dict(ground=ground(law="linear", two_way=True))
DRY = dict(joint_contact_only=True, joint_contact_height=0.2, joint_friction_coefficient=0.4)
FORTY = dict(joint_angles=tuple(np.arange(40) * 9.0 + 3.0))
SQUARE = dict(joint_angles=(0.0, 90.0, 180.0, 270.0))
WEAK_SOIL = dict(limit_pressure_normal=1e-3, limit_pressure_tangential=1e-3)


def every_stiffness(value):
    return dict.fromkeys(STIFFNESSES, value)


def thickness(value):
    return dict(outer_diameter=6.25 + value, inner_diameter=6.25 - value)


def undisturbed():
    return pressures()


def half_gone():
    loads = pressures()
    return loads.where(loads["theta"] < 180, 0.0)


def suction():
    loads = pressures() * 0
    return loads.assign(water_pressure=loads["water_pressure"] - 2e5)


def hundredfold():
    return pressures() * 100


def nothing():
    return pressures() * 0


SOLVED = {
    "hinges in ground": (HINGES, undisturbed),
    "hinges in elastic ground": (HINGES | ELASTIC, undisturbed),
    "three hinges without ground": (HINGES | NO_GROUND | dict(joint_angles=(0.0, 120.0, 240.0)), undisturbed),
    "loose segments in elastic ground": (every_stiffness(0.0) | ELASTIC, undisturbed),
    "no shear stiffness in ground": (dict(joint_shear_stiffness=0.0), undisturbed),
    "joints of 1e15": (every_stiffness(1e15), undisturbed),
    "joints of 1e15 without ground": (every_stiffness(1e15) | NO_GROUND, undisturbed),
    "dry joints of 1e15": (every_stiffness(1e15) | DRY, undisturbed),
    "one joint": (dict(joint_angles=(30.0,)), undisturbed),
    "one joint without ground": (dict(joint_angles=(30.0,)) | NO_GROUND, undisturbed),
    "one dry joint": (dict(joint_angles=(30.0,)) | DRY, undisturbed),
    "40 joints": (FORTY, undisturbed),
    "40 joints without ground": (FORTY | NO_GROUND, undisturbed),
    "40 dry joints": (FORTY | DRY, undisturbed),
    "no ground": (NO_GROUND, undisturbed),
    "ground 1e3 times stiffer": (dict(ground=ground(youngs_modulus=40e9)), undisturbed),
    "elastic ground 1e3 times stiffer": (
        dict(ground=ground(youngs_modulus=40e9, law="linear", two_way=True)),
        undisturbed,
    ),
    "dry joints in ground 1e3 times stiffer": (DRY | dict(ground=ground(youngs_modulus=40e9)), undisturbed),
    "soil without limit pressure": (dict(ground=ground(**WEAK_SOIL), balance_uplift=True), undisturbed),
    "half the ring unloaded in elastic ground": (ELASTIC, half_gone),
    "suction": ({}, suction),
    "suction on dry joints in elastic ground": (ELASTIC | DRY, suction),
    "1 mm thick in elastic ground": (thickness(1e-3) | ELASTIC, undisturbed),
    "2 m thick": (thickness(2.0), undisturbed),
    "2 m thick without ground": (thickness(2.0) | NO_GROUND, undisturbed),
    "2 m thick with dry joints": (thickness(2.0) | DRY, undisturbed),
    "no load at all": (dict(concrete_unit_weight=0.0), nothing),
}

CANNOT_CARRY = r"displacements reach .* the ground cannot carry the loads, or the joints are too weak"
REFUSED = {
    "six hinges without ground": (HINGES | NO_GROUND, undisturbed, r"mechanism.* joint \d \(\d+ degrees\) turns"),
    "four hinges without ground": (HINGES | NO_GROUND | SQUARE, undisturbed, r"mechanism.* turns most freely"),
    "four hinges without ground or work": (HINGES | NO_GROUND | SQUARE, nothing, r"mechanism.* turns most freely"),
    "no shear stiffness without ground": (
        dict(joint_shear_stiffness=0.0) | NO_GROUND,
        undisturbed,
        r"mechanism.* slides most freely",
    ),
    "no normal stiffness without ground": (
        dict(joint_normal_stiffness=0.0) | NO_GROUND,
        undisturbed,
        r"mechanism.* opens or closes most freely",
    ),
    "loose segments without ground": (every_stiffness(0.0) | NO_GROUND, undisturbed, "mechanism"),
    "loose segments in ground": (every_stiffness(0.0), undisturbed, CANNOT_CARRY),
    "uplift without ground": (dict(ground=None), undisturbed, "loads must balance where nothing carries their sum"),
    "soil without limit pressure under uplift": (dict(ground=ground(**WEAK_SOIL)), undisturbed, CANNOT_CARRY),
    "soil without any reaction under uplift": (
        dict(ground=ground(limit_pressure_normal=0.0, limit_pressure_tangential=0.0)),
        undisturbed,
        "a net force of .* limit pressure above 0",
    ),
    "half the ring unloaded": ({}, half_gone, CANNOT_CARRY + r".*; soil springs press on \d+% of the ring"),
    "half the ring unloaded without ground": (NO_GROUND, half_gone, "loads must balance"),
    "dry joints that must pull": (DRY, suction, CANNOT_CARRY + r".*; joint 1 is open"),
    "1 mm thick": (thickness(1e-3), undisturbed, CANNOT_CARRY),
    "1 mm thick without ground": (thickness(1e-3) | NO_GROUND, undisturbed, CANNOT_CARRY),
    "dry joints beyond their moments": (DRY | NO_GROUND, undisturbed, r"is gaping at one edge"),
    "loads x 100": ({}, hundredfold, CANNOT_CARRY),
    "loads x 100 in elastic ground": (ELASTIC, hundredfold, CANNOT_CARRY),
    "loads x 100 on dry joints": (DRY, hundredfold, CANNOT_CARRY),
}


#: Suction, and pressures beyond any tunnel's, are warned of and meant here.
EXTREME = pytest.mark.filterwarnings("ignore:pressures. soil and water")


@pytest.mark.parametrize("case", SOLVED)
@EXTREME
def test_extreme_is_solved_in_equilibrium(case):
    changes, loads = SOLVED[case]
    response = BeamSpringLining(ring(**changes)).respond(loads())
    assert all(np.isfinite(variable).all() for variable in response.data_vars.values())
    # 1e-8 of the loads is asked for.
    assert response["equilibrium_residual"].max() <= 1e-8


@pytest.mark.parametrize("case", REFUSED)
@EXTREME
def test_extreme_is_refused_with_its_reason(case):
    changes, loads, reason = REFUSED[case]
    with pytest.raises((LiningFailure, ValueError), match=reason) as refusal:
        BeamSpringLining(ring(**changes)).respond(loads())
    assert "at time 0 s" in str(refusal.value)


def test_collapse_of_dry_joints_is_no_failure_of_the_solver():
    """Whether six joints of at most N h/2 can balance the free ring's moments, by linear programming: they cannot.

    M of any state in equilibrium is that of the free ring plus a + b cos + c sin; N at the joints is taken from the
    free ring, a tenth higher to be safe.
    """
    from scipy.optimize import linprog

    free = BeamSpringLining(ring(**NO_GROUND, joint_angles=())).respond(undisturbed()).isel(time=0)
    angles = np.array(ring().joint_angles)
    moment, axial = (free[name].interp(theta=angles).values for name in ("bending_moment", "axial_force"))
    limit = 1.1 * axial * 0.2 / 2
    shapes = np.stack([np.ones(6), np.cos(np.radians(angles)), np.sin(np.radians(angles))], axis=1)
    answer = linprog(
        np.zeros(3),
        A_ub=np.concatenate([shapes, -shapes]),
        b_ub=np.concatenate([limit - moment, limit + moment]),
        bounds=(None, None),
    )
    assert answer.status == 2  # infeasible


def test_joints_of_1e15_are_the_homogeneous_ring():
    loads = pressures()
    stiff, none = (
        BeamSpringLining(ring(**changes)).respond(loads)["bending_moment"].sortby("theta").values
        for changes in (every_stiffness(1e15), dict(joint_angles=()))
    )
    # 1e-3 of the largest: the elements of the two rings lie up to half a degree apart, and M has extremes.
    angle = BeamSpringLining(ring(joint_angles=())).respond(loads)["theta"].values
    placed = np.interp(angle, BeamSpringLining(ring()).respond(loads)["theta"].values, stiff[0], period=360)
    assert np.abs(placed - none[0]).max() < 1e-3 * np.abs(none).max()


def test_hinged_ring_under_uniform_pressure_would_hide_its_mechanism():
    loads = theory.theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=0.0, coefficient_at_rest=1.0, water_unit_weight=0.0
    )
    uniform = loads.assign(soil_pressure=loads["soil_pressure"] + 1e5)
    hinged = ring(**HINGES, **NO_GROUND, **SQUARE, concrete_unit_weight=0.0)
    with pytest.raises(LiningFailure, match="mechanism"):
        BeamSpringLining(hinged).respond(uniform)
