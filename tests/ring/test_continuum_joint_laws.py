"""Joints of the continuum that open, gape and slide: laws of the ring of beams, on the mean movement of the faces."""

from functools import cache

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

import coupling
from structure import BeamSpringLining, ContinuumLining, Ring
from structure.joint_laws import FACE_POINTS, FaceLaw, FacePoints, contact_moment
from verification.robustness.random_rings import growing_load

HEIGHT, FRICTION = 0.3, 0.06
SECTION = {"joint_contact_only": True, "joint_contact_height": HEIGHT, "joint_friction_coefficient": FRICTION}
#: Softer than concrete one contact height deep (3.4e10), as with packers.
FACE = {
    "joint_contact": "face", "joint_contact_height": HEIGHT, "joint_friction_coefficient": FRICTION,
    "joint_normal_stiffness": 1e10,
}  # fmt: skip


def case_3(laws):
    values = coupling.load_scene("case-3").ring.model_dump()
    if laws.get("joint_contact") == "face":
        del values["joint_rotational_stiffness"]
    return Ring(**(values | laws))


@cache
def answers_of(contact):
    """Of both models to twelve loads, one dataset each along `load`."""
    ring, rng = case_3({"section": SECTION, "face": FACE}[contact]), np.random.default_rng(0)
    models, loads = (BeamSpringLining(ring), ContinuumLining(ring, columns=90)), [growing_load(rng) for _ in range(12)]
    return tuple(xr.concat([model.respond(load) for load in loads], "load") for model in models)


@pytest.fixture(params=["section", "face"])
def answers(request):
    return answers_of(request.param)


def apart(answers, name):
    beams, continuum = (answer[name].values for answer in answers)
    return np.abs(beams - continuum).max() / np.abs(beams).max()


def test_joints_gape_and_slide(answers):
    axial, moment, shear = (
        answers[1][f"joint_{name}"].isel(time=-1).values for name in ("axial_force", "bending_moment", "shear_force")
    )
    gaping = np.abs(moment) > axial * HEIGHT / 6
    sliding = np.abs(shear) >= (1 - 1e-9) * axial * FRICTION
    assert 0.2 < gaping.mean() < 1 and 0.03 < sliding.mean() < 1
    assert answers[1]["equilibrium_residual"].max() < 1e-9


def test_both_models_agree_where_joints_gape_and_slide(answers):
    assert apart(answers, "axial_force") < 0.005
    assert apart(answers, "joint_opening") < 0.03
    assert apart(answers, "joint_rotation") < 0.03
    # the moment mostly by that of the thrust in a curved section, N t^2/(12 R), as with linear joints
    beams, continuum = (answer["bending_moment"].values for answer in answers)
    curved = np.abs(answers[0]["axial_force"].values).max() * 0.35**2 / (12 * 3.125)
    assert np.abs(continuum - beams).max() < 1.5 * curved < 0.05 * np.abs(beams).max()


def test_faces_turn_under_a_moment_as_a_block_without_tension():
    for answer, most in zip(answers_of("face"), (0.005, 0.02), strict=True):
        axial, moment, turned = (
            answer[f"joint_{name}"].isel(time=-1).values for name in ("axial_force", "bending_moment", "rotation")
        )
        # sections of beams stay plane but for 40 points; faces of the continuum bend
        block, *_ = contact_moment(turned, axial, 1e10 * HEIGHT**2 / 12, HEIGHT)
        assert np.abs(moment - block).max() < most * np.abs(block).max()
        assert (np.abs(moment) > 0.2 * axial * HEIGHT).any()  # some beyond N h/6


def test_stresses_are_those_of_the_section_beside_a_gaping_joint():
    ring = case_3(SECTION)
    model, loads = ContinuumLining(ring, columns=180), growing_load(np.random.default_rng(0))
    field, answer = model.stress_field(loads).isel(time=-1), model.respond(loads).isel(time=-1)
    edge = np.isclose(field["radius"], field["radius"].max())
    hoop, outer = field["stress_tt"].values[edge], field["theta"].values[edge]
    section = -answer["axial_force"] / ring.thickness + answer["bending_moment"] * 6 / ring.thickness**2
    away = np.abs((outer[:, None] - np.array(ring.joint_angles) + 180) % 360 - 180).min(axis=1) > 15
    found = np.interp(outer, answer["theta"], section.values, period=360)
    assert hoop[away] == pytest.approx(found[away], abs=0.25 * np.abs(found).max())  # points lie inside the outer face


def test_strips_are_linear():
    ring = coupling.load_scene("case-3").ring.model_copy(update={"joint_contact_height": 0.3})
    with pytest.raises(ValueError, match=r"joint_contact_height must be None .* strips are linear"):
        ContinuumLining(ring, joint="equivalent_strip")


def face_of_a_block(force, friction):
    """Law of one face pressed by `force` [N/m], its points at a rotation and slide."""
    ring = case_3(FACE | {"joint_friction_coefficient": friction, "joint_angles": (0.0,)})
    lever = HEIGHT * ((np.arange(FACE_POINTS) + 0.5) / FACE_POINTS - 0.5)
    law = FaceLaw(ring, FacePoints(np.zeros(FACE_POINTS, int), lever, np.full(FACE_POINTS, HEIGHT / FACE_POINTS)))

    def forces(rotation, slide):
        def moved(opening):
            return np.stack([opening + rotation * lever, np.full(FACE_POINTS, slide)], axis=-1)

        def excess(opening):
            return law.forces(moved(opening), np.zeros(FACE_POINTS)).axial.sum() - force

        opening = brentq(excess, -1.0, rotation * HEIGHT, xtol=1e-16, rtol=1e-14)
        found = law.forces(moved(opening), np.zeros(FACE_POINTS))
        return found.shear.sum(), -(found.axial * lever).sum(), np.abs(found.slip).max()

    return forces


@pytest.mark.parametrize("rotation", [0.0, 3e-4])
def test_block_on_a_face_slides_at_the_exact_load(rotation):
    force, friction = 1.2e6, 0.4
    push = face_of_a_block(force, friction)
    first = friction * force / 8e7  # where the shear springs ask for mu N, pressed evenly
    shear, _, slip = push(rotation, 0.999 * first)
    assert (slip == 0) == (rotation == 0)  # an edge that gapes slides earlier
    assert shear <= friction * force
    shear, *_ = push(rotation, 20 * first)
    assert shear == pytest.approx(friction * force, rel=1e-12)


@pytest.mark.parametrize("share", [0.5, 1.5, 4.0, 20.0])
def test_moment_of_a_face_is_that_of_a_block_without_tension(share):
    force, turning = 1.2e6, 1e10 * HEIGHT**2 / 12
    rotation = share * force * HEIGHT / (6 * turning)
    _, moment, _ = face_of_a_block(force, 0.4)(rotation, 0.0)
    closed, *_ = contact_moment(np.array(rotation), np.array(force), turning, HEIGHT)
    # 40 points: a midpoint rule, whose contact zone ends at any place between two
    assert moment == pytest.approx(closed.item(), rel=2e-3)
