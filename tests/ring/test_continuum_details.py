"""Gasket grooves and bolts in the joints of the continuum ring."""

from itertools import pairwise

import numpy as np
import pytest
from rings import FORCES, JOINTS, largest, tractions
from rings import case_3_ground as ground
from rings import case_3_pressures as pressures
from rings import case_3_ring as ring

from structure import BeamSpringLining, Bolts, ContinuumLining, GasketGroove, LiningFailure

GROOVE = GasketGroove(cover=0.05, height=0.04, depth=0.02)
#: Tightened so that they never lose their pull.
EVEN = (30.0, 90.0, 150.0, 210.0, 270.0, 330.0)
BOLTS = Bolts(offset=-0.05, length=0.4, stiffness=2e8, preload=1e6)


@pytest.fixture(scope="module")
def plain():
    return ContinuumLining(ring()).respond(pressures()).isel(time=0)


@pytest.fixture(scope="module")
def grooved():
    model = ContinuumLining(ring(), groove=GROOVE, layers=6)
    return model, model.respond(pressures()).isel(time=0)


@pytest.fixture(scope="module")
def bolted():
    model = ContinuumLining(ring(joint_bolts=BOLTS))
    return model, model.respond(pressures()).isel(time=0)


def test_vanishing_groove_leaves_the_ring_whole(plain):
    tiny = ContinuumLining(ring(), groove=(0.05, 1e-4, 1e-4)).respond(pressures()).isel(time=0)
    for name in (*FORCES, "displacement_radial", "joint_opening", "joint_rotation"):
        # 2e-3 of the largest: 1e-4/0.35 of the face is missing, and other elements beside it.
        assert largest(tiny[name] - plain[name]) < 2e-3 * largest(plain[name]), name


def test_joint_with_a_groove_keeps_the_stiffnesses_of_the_ring(grooved):
    _, response = grooved
    for name in FORCES:
        # Forces of the joint's laws against stresses integrated five degrees to either side, clear of the groove.
        # 2 %: what the load between adds to their mean, as large without a groove (0.2, 1.6, 1.3 %).
        beside = np.stack([response[name].interp(theta=np.array(JOINTS) + side) for side in (-4.5, 4.5)])
        assert largest(response[f"joint_{name}"].values - beside.mean(0)) < 0.02 * largest(response[name]), name


def test_groove_leaves_thrust_and_closure_as_they_are():
    # The faces touch off the centre line, but opening and rotation are those on it.
    model = ContinuumLining(ring(ground=None, concrete_unit_weight=0.0), groove=GROOVE)
    response = model.respond(tractions(lambda a: 3e5)).isel(time=0)
    thrust = 3e5 * 3.3
    plain = ContinuumLining(model.ring).respond(tractions(lambda a: 3e5)).isel(time=0)
    # 0.3 %: the moment of the curved section bends the ring between its unevenly spaced joints, with or without groove.
    np.testing.assert_allclose(response["joint_axial_force"], thrust, rtol=3e-3)
    np.testing.assert_allclose(response["joint_opening"], -thrust / 6e8, rtol=3e-3)
    # Thrust runs past the groove off the centre line over its depth, and turns the joint by as much as that bends the
    # concrete: N e depth/EI over the ring's own compliance; below 2 % of the kern moment N t/6.
    assert largest(response["joint_bending_moment"] - plain["joint_bending_moment"]) < 0.02 * thrust * 0.35 / 6


def test_no_stress_in_the_groove_and_more_beside_it(grooved):
    model, response = grooved
    stress = model.stress_field(pressures()).isel(time=0)
    empty = model.mesh.is_groove.ravel()[stress["element"].values]
    hoop = stress["stress_tt"].values
    # 1e-4: what fills it has 1e-6 of the stiffness; across 2 cm it follows the joint's closure of 2 mm, a strain 100
    # times that of the concrete.
    assert empty.any() and largest(hoop[empty]) < 1e-4 * largest(hoop)
    # Beside a joint all of N runs through the 0.31 m that touch.
    beside = model.mesh.is_groove.any(axis=1)
    points = np.repeat(np.repeat(beside[:, None], model.mesh.layers, axis=1).ravel(), 4)
    height = np.tile(np.repeat(model.mesh.layer_height, 4), len(beside))
    mean = (hoop * height)[points & ~empty].sum() / height[points & ~empty].sum()
    # 1 %: stress points lie within 2 cm of the joint, where N still is the joint's to 0.2 %.
    assert mean == pytest.approx(-response["joint_axial_force"].mean().item() / 0.31, rel=0.01)


def test_groove_takes_its_weight_out():
    given = ring(balance_uplift=False, ground=ground(two_way=True, law="linear"))
    sums = [
        ContinuumLining(given, **options).respond(pressures())["load_sum_vertical"].item()
        for options in ({}, dict(groove=GROOVE))
    ]
    outer, inner = 3.3 - 0.05, 3.3 - 0.09
    volume = len(JOINTS) * 2 * (0.02 / 3.125) * (outer**2 - inner**2) / 2
    # 1e-3: one-degree columns are chords.
    assert sums[1] - sums[0] == pytest.approx(25e3 * volume, rel=1e-3)


def test_bolts_pull_as_much_as_their_anchors_part(bolted):
    _, response = bolted
    change = response["joint_bolt_force"].values - BOLTS.preload
    gap = (response["joint_opening"] + BOLTS.offset * response["joint_rotation"]).values
    # 3 %: concrete between the anchors shortens, bends and dents; the joint itself is 30 times softer.
    np.testing.assert_allclose(change, BOLTS.stiffness * gap, rtol=0.03)
    assert (change < 0).all() and (response["joint_bolt_force"] > 0).all()


@pytest.mark.parametrize("model", [BeamSpringLining, ContinuumLining])
def test_bolts_and_joint_share_the_thrust_of_a_uniform_pressure(model):
    given = ring(ground=None, concrete_unit_weight=0.0, joint_angles=EVEN)
    bolts = dict(offset=0.0, length=0.4, stiffness=2e8, preload=1e6)
    response = model(given.model_copy(update=dict(joint_bolts=bolts))).respond(tractions(lambda a: 3e5)).isel(time=0)
    thrust = 3e5 * 3.3
    # Anchors come closer by e = (F - P)/k_b under the pull F, joint and concrete between them by (N + F)(1/k_n + L/EA);
    # beams feel the bolts in the section of the joint.
    soft = 1 / 6e8 + (0.4 / given.axial_stiffness if model is ContinuumLining else 0.0)
    expected = (1e6 / 2e8 - thrust * soft) / (1 / 2e8 + soft)
    # 1 %: stresses spread from the anchors, and the ring is curved.
    np.testing.assert_allclose(response["joint_bolt_force"], expected, rtol=0.01)
    # 0.1 %: a chain of beams is shorter than the circle.
    np.testing.assert_allclose(response["joint_axial_force"], thrust, rtol=1e-3)
    # Statics: whole sections carry p r at every angle, also where bolts carry part of it.
    assert largest(response["axial_force"] - thrust) < 1e-3 * thrust


@pytest.mark.parametrize("model", [BeamSpringLining, ContinuumLining])
def test_bolts_with_slack_pull_only_beyond_it(model):
    given = ring(ground=None, concrete_unit_weight=0.0, joint_contact_only=True, joint_angles=EVEN)
    slack = 2e-3
    bolts = dict(offset=0.0, length=0.4, stiffness=2e8, slack=slack)
    bolted = model(given.model_copy(update=dict(joint_bolts=bolts)))
    pressed = bolted.respond(tractions(lambda a: 3e5)).isel(time=0)
    np.testing.assert_array_equal(pressed["joint_bolt_force"], 0.0)
    pulled = bolted.respond(tractions(lambda a: -1e5)).isel(time=0)
    pull = 1e5 * 3.3  # joints without contact: bolts alone carry the ring
    np.testing.assert_allclose(pulled["joint_bolt_force"], pull, rtol=1e-3)
    # the joint parts by slack and stretch; in the continuum concrete between the anchors gives way, too
    np.testing.assert_allclose(pulled["joint_opening"], slack + pull / 2e8, rtol=0.04)


def test_bolts_keep_equilibrium_and_newton_quadratic(bolted):
    model, response = bolted
    assert response["equilibrium_residual"] < 1e-8
    # 3e-3 of the largest shear, away from the anchors, where a concentrated force acts; columns beside them are uneven.
    assert response["shear_moment_residual"] < 3e-3 * largest(response["shear_force"])
    model.respond(pressures(3.0))
    residuals = np.array(model.residuals)
    near = residuals[residuals < 1e-3 * residuals[0]] / residuals[0]
    # The update of the factors is exact: the relative residual is at least squared, down to rounding.
    assert len(near) >= 2 and all(after < max(before**2, 1e-10) for before, after in pairwise(near))


def test_bolts_without_stiffness_to_speak_of_change_nothing(plain):
    weak = dict(offset=-0.05, length=0.4, stiffness=1.0)
    soft = ContinuumLining(ring(joint_bolts=weak)).respond(pressures()).isel(time=0)
    for name in FORCES:
        # 2e-4: lines of the mesh at the anchors; 1 N/m2 beside 6e8 is nothing.
        assert largest(soft[name] - plain[name]) < 2e-4 * largest(plain[name])
    assert set(soft.data_vars) - set(plain.data_vars) == {"joint_bolt_force"}


def test_ring_that_only_bolts_hold_is_refused_with_that_reason():
    hinged = ring(joint_rotational_stiffness=0.0, ground=None, joint_bolts=BOLTS)
    with pytest.raises(LiningFailure, match=r"mechanism \(its bolts left aside\)"):
        ContinuumLining(hinged).respond(pressures())


@pytest.mark.parametrize(
    ("options", "changes", "message"),
    [
        (dict(groove=(0.3, 0.1, 0.02)), {}, "cover \\+ height below the thickness"),
        (dict(groove=(0.05, 0.04, 3.0)), {}, "depth must be below a quarter"),
        (dict(groove=GROOVE), dict(joint_angles=()), "must have joints"),
        (dict(groove=GROOVE, joint="equivalent_strip"), {}, "no faces to cut into"),
        ({}, dict(joint_bolts=Bolts(offset=0.2, length=0.4, stiffness=2e8)), "offset must lie within half the thick"),
        ({}, dict(joint_bolts=Bolts(offset=0.1, length=2.5, stiffness=2e8)), "shorten it or move it inward"),
        ({}, dict(joint_bolts=BOLTS, joint_angles=()), "must have joints"),
        (dict(gate=(76.5, 0.2)), dict(joint_bolts=BOLTS), "open gate"),
    ],
)
def test_details_that_mean_nothing_are_refused(options, changes, message):
    with pytest.raises(ValueError, match=message):
        ContinuumLining(ring(**changes), **options)
