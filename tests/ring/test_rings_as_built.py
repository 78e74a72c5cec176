"""Rings as they are built: joints of their own stiffness and friction, faces that lean beside a key."""

import numpy as np
import pytest
from rings import largest, mirrored, pressures, ring, tractions

import coupling
from structure import BeamSpringLining, Bolts, ContinuumLining, InputError, LiningFailure

BOTH = pytest.mark.parametrize("model", [BeamSpringLining, ContinuumLining])
#: A key of 20 degrees at the crown and four segments of 85.
KEY = (10.0, 95.0, 180.0, 265.0, 350.0)


@BOTH
def test_joints_of_one_kind_may_be_stated_one_by_one(model):
    count = len(ring().joint_angles)
    each = ring(
        joint_rotational_stiffness=(5e8,) * count, joint_normal_stiffness=(6e8,) * count,
        joint_shear_stiffness=(8e7,) * count, joint_inclinations=(0.0,) * count,
    )  # fmt: skip
    one, other = (model(given).respond(pressures()) for given in (ring(), each))
    np.testing.assert_array_equal(one["bending_moment"], other["bending_moment"])


@pytest.mark.slow
@BOTH
def test_ring_with_joints_of_its_own_is_mirrored_with_them(model):
    angles = (20.0, 100.0, 190.0, 300.0)
    own = dict(
        joint_rotational_stiffness=(1e8, 5e8, 2e9, 1e7), joint_normal_stiffness=(3e8, 6e8, 2e9, 1e9),
        joint_shear_stiffness=(8e7, 4e7, 2e8, 1e8), joint_friction_coefficient=(0.05, 0.2, 0.4, 0.6),
        joint_contact_height=(0.3, 0.2, 0.25, 0.35), joint_inclinations=(5.0, -3.0, 0.0, 8.0),
        joint_bolts=tuple(Bolts(offset=e, length=0.4, stiffness=1e8, preload=5e5) for e in (-0.1, 0.0, 0.05, 0.1)),
    )  # fmt: skip
    signs = {"joint_inclinations": -1}
    turned = {
        name: tuple(signs.get(name, 1) * each if name in signs else each for each in values[::-1])
        for name, values in own.items()
    }
    there = tuple(360 - angle for angle in angles[::-1])
    loads = pressures(3).isel(time=[2])
    one = model(ring(joint_angles=angles, **own)).respond(loads)
    other = model(ring(joint_angles=there, **turned)).respond(mirrored(loads))
    for name in ("axial_force", "bending_moment", "displacement_radial"):
        flipped = other[name].values[:, (360 - np.arange(360)) % 360]
        # 1e-6 of the largest: Newton's tolerance
        assert largest(one[name].values - flipped) < 1e-6 * largest(one[name])
    for name, sign in {
        "joint_rotation": 1,
        "joint_axial_force": 1,
        "joint_bolt_force": 1,
        "joint_dislocation": -1,
    }.items():
        assert largest(one[name].values - sign * other[name].values[:, ::-1]) < 1e-6 * largest(one[name])


def key_ring(lean, **changes):
    inclinations = (-lean, 0.0, 0.0, 0.0, lean)  # faces of the key converge outward
    return ring(joint_angles=KEY, joint_inclinations=inclinations, ground=None, concrete_unit_weight=0.0, **changes)


@BOTH
@pytest.mark.parametrize("contact", ["section", "face"])
def test_leaning_faces_carry_the_thrust_by_pressure_and_shear(model, contact):
    lean, thrust = 6.0, 3e5 * 3.3
    given = key_ring(
        lean,
        **({"joint_contact": "face", "joint_rotational_stiffness": 6e8 * 0.35**2 / 12} if contact == "face" else {}),
    )
    response = model(given).respond(tractions(lambda a: 3e5)).isel(time=0)
    # statics, at the faces' own axial and shear force of the section
    at = response.interp(theta=[10.0, 350.0])
    axial, shear = response["joint_axial_force"].values[[0, -1]], response["joint_shear_force"].values[[0, -1]]
    angle = np.radians([-lean, lean])
    expected = np.cos(angle) * at["axial_force"] - np.sin(angle) * at["shear_force"]
    np.testing.assert_allclose(axial, expected, rtol=2e-3)
    np.testing.assert_allclose(
        shear, np.cos(angle) * at["shear_force"] + np.sin(angle) * at["axial_force"], atol=5e-3 * thrust
    )
    # the key is squeezed inward
    plain = model(key_ring(0.0)).respond(tractions(lambda a: 3e5)).isel(time=0)
    assert response["displacement_radial"][0] < plain["displacement_radial"][0] - 1e-3


@pytest.mark.slow
@BOTH
def test_key_slides_out_where_its_faces_lean_more_than_friction_holds(model):
    """tan 6 degrees = 0.105: with friction above that the key holds without any ground, below it falls."""
    loads = tractions(lambda a: 3e5)
    held = model(key_ring(6.0, joint_friction_coefficient=0.115)).respond(loads).isel(time=0)
    ratio = np.abs(held["joint_shear_force"] / held["joint_axial_force"]).values[[0, -1]]
    np.testing.assert_allclose(ratio, np.tan(np.radians(6.0)), rtol=0.02)
    with pytest.raises(LiningFailure):
        model(key_ring(6.0, joint_friction_coefficient=0.095)).respond(loads)


def test_contact_field_carries_the_forces_of_the_joints():
    given = ring(joint_contact="face", joint_contact_height=0.3, joint_rotational_stiffness=6e8 * 0.3**2 / 12)
    for model in (BeamSpringLining(given), ContinuumLining(given)):
        loads = pressures(3).isel(time=[2])
        field, response = model.contact_field(loads).isel(time=0), model.respond(loads).isel(time=0)
        length = model.parts.law.points.length
        for joint in range(len(given.joint_angles)):
            here = field["joint"].values == joint + 1
            pressed = field["contact_pressure"].values[here] * length[here]
            assert pressed.sum() == pytest.approx(response["joint_axial_force"][joint].item(), rel=1e-12)
            moment = -(pressed * field["lever"].values[here]).sum()
            assert moment == pytest.approx(response["joint_bending_moment"][joint].item(), rel=1e-9)
        assert (field["contact_pressure"] >= 0).all()
        np.testing.assert_array_equal(field["contact_pressure"] == 0, field["contact_gap"] >= 0)
    with pytest.raises(ValueError, match="must be 'face', got 'section'"):
        BeamSpringLining(ring()).contact_field(pressures())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(joint_normal_stiffness=(6e8, 6e8)), "joint_normal_stiffness must be one for all joints or 6"),
        (dict(joint_inclinations=(50.0,) * 6), "within 45 degrees of the radius"),
        (dict(joint_contact="face"), r"must be k_n h\^2/12"),
        (dict(joint_normal_stiffness=(6e8, 0.0, 6e8, 6e8, 6e8, 6e8), joint_contact_only=True,
              joint_friction_coefficient=0.3), "joint_normal_stiffness must be above 0"),
        (dict(joint_bolts=dict(offset=0.0, length=0.4, stiffness=1e8, slack=1e-3, preload=1e5)), "slack must be 0"),
        (dict(joint_friction_coefficient=(0.1, -0.1, 0.1, 0.1, 0.1, 0.1)), "joint_friction_coefficient.1: must be"),
    ],
)  # fmt: skip
def test_joints_that_mean_nothing_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        ring(**changes)


SCENE = """
base = "quick"
[ring]
joint_normal_stiffness = ["600 MN/m", 6e8, 6e8, 6e8, 6e8, 6e8]
joint_inclinations = [-6, 0, 0, 0, 0, 6]
joint_friction_coefficient = [0.5, 0.4, 0.4, 0.4, 0.4, 0.5]
neighbour = { rotation = 30, ring_width = "1200 mm", radial_stiffness = "100 MN/m", tangential_stiffness = 1e8 }
joint_bolts = { offset = "-5 cm", length = 0.4, stiffness = "100 MN/m", preload = "200 kN" }
"""


def test_scene_takes_a_ring_as_it_is_built(tmp_path):
    path = tmp_path / "built.toml"
    path.write_text(SCENE)
    scene = coupling.load_scene(path)
    assert scene.ring.joint_springs[0, 0] == 6e8 and scene.ring.bolts[0].preload == 2e5
    assert scene.ring.neighbour.ring_width == 1.2 and scene.ring.bolts[0].offset == pytest.approx(-0.05)
    again = coupling.scenes.scene.parse_scene(scene.source, "again")
    assert again.ring == scene.ring
    each = [f'{{ offset = 0, length = 0.4, stiffness = "{k} MN/m" }}' for k in range(6)]
    path.write_text(SCENE.partition("joint_bolts")[0] + f"joint_bolts = [{', '.join(each)}]\n")
    scene = coupling.load_scene(path)
    assert [bolts.stiffness for bolts in scene.ring.bolts] == [1e6 * k for k in range(6)]
    assert coupling.scenes.scene.parse_scene(scene.source, "again").ring == scene.ring


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"600 MN/m", 6e8', '"600 MN/m", -6e8', "joint_normal_stiffness.1"),
        ("[-6, 0, 0, 0, 0, 6]", "[-6, 6]", "joint_inclinations must be one for all joints or 6"),
        ("offset =", "ofset =", "did you mean 'offset'"),
        ("rotation = 30, ", "", "rotation missing"),
        ('base = "quick"', 'base = "quick"\nlining = "jointed"', "neighbour must be left out of a ring that moves"),
    ],
)
def test_mistakes_in_a_ring_as_built_are_told(tmp_path, old, new, message):
    path = tmp_path / "built.toml"
    path.write_text(SCENE.replace(old, new))
    with pytest.raises(coupling.SceneError, match=message):
        coupling.load_scene(path)


@pytest.mark.parametrize("key", ["one", "several"])
def test_unknown_key_is_told_whatever_its_name(key):
    with pytest.raises(InputError, match=f"{key}: unknown key, got 1"):
        ring(**{key: 1})
