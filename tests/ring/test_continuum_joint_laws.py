"""Joints of the continuum that open, gape and slide: laws of the ring of beams, on the mean movement of the faces."""

import numpy as np
import pytest
import xarray as xr

import coupling
from structure import BeamSpringLining, ContinuumLining
from structure.lining import THETA

LAWS = {"joint_contact_only": True, "joint_contact_height": 0.3, "joint_friction_coefficient": 0.1}
A = np.radians(THETA)


def random_loads(records, seed=0):
    """Pressures of three to five waves that gape and slide about half of the joints, and a shear that ovalises."""
    rng, time = np.random.default_rng(seed), np.arange(float(records))
    pressure = 3.9e5 * (1 + 0.15 * time / records)[:, None] + sum(
        rng.uniform(-3e5, 3e5, (records, 1)) / n * np.cos(n * A - rng.uniform(0, 6.3, (records, 1)))
        for n in range(2, 6)
    )
    shear = 1.5e4 * np.sin(2 * A - rng.uniform(0, 6, (records, 1)))
    parts = {"soil_pressure": pressure, "water_pressure": np.zeros_like(pressure), "soil_shear": shear}
    return xr.Dataset({name: (("time", "theta"), part) for name, part in parts.items()}, {"time": time, "theta": THETA})


@pytest.fixture(scope="module")
def answers():
    ring, loads = coupling.load_scene("case-3").ring.model_copy(update=LAWS), random_loads(10)
    return BeamSpringLining(ring).respond(loads), ContinuumLining(ring, columns=180).respond(loads)


def apart(answers, name):
    beams, continuum = (answer[name].values for answer in answers)
    return np.abs(beams - continuum).max() / np.abs(beams).max()


def test_joints_gape_and_slide(answers):
    axial, moment, shear = (
        answers[1][f"joint_{name}"].values for name in ("axial_force", "bending_moment", "shear_force")
    )
    gaping = np.abs(moment) > axial * LAWS["joint_contact_height"] / 6
    sliding = np.abs(shear) >= (1 - 1e-9) * axial * LAWS["joint_friction_coefficient"]
    assert 0.2 < gaping.mean() < 1 and 0.15 < sliding.mean() < 1
    assert answers[1]["equilibrium_residual"].max() < 1e-9


def test_both_models_agree_where_joints_gape_and_slide(answers):
    assert apart(answers, "axial_force") < 0.005
    assert apart(answers, "joint_opening") < 0.01
    assert apart(answers, "joint_rotation") < 0.05
    # the moment mostly by that of the thrust in a curved section, N t^2/(12 R), as with linear joints
    beams, continuum = (answer["bending_moment"].values for answer in answers)
    curved = np.abs(answers[0]["axial_force"].values).max() * 0.35**2 / (12 * 3.125)
    assert np.abs(continuum - beams).max() < 1.5 * curved < 0.05 * np.abs(beams).max()


def test_stresses_are_those_of_the_section_beside_a_gaping_joint():
    ring = coupling.load_scene("case-3").ring.model_copy(update=LAWS)
    model, loads = ContinuumLining(ring, columns=180), random_loads(1)
    field, answer = model.stress_field(loads).isel(time=0), model.respond(loads).isel(time=0)
    edge = np.isclose(field["radius"], field["radius"].max())
    hoop, outer = field["stress_tt"].values[edge], field["theta"].values[edge]
    section = -answer["axial_force"] / ring.thickness + answer["bending_moment"] * 6 / ring.thickness**2
    away = np.abs((outer[:, None] - np.array(ring.joint_angles) + 180) % 360 - 180).min(axis=1) > 15
    found = np.interp(outer, THETA, section.values, period=360)
    assert hoop[away] == pytest.approx(found[away], abs=0.25 * np.abs(found).max())  # points lie inside the outer face


def test_strips_are_linear():
    ring = coupling.load_scene("case-3").ring.model_copy(update={"joint_contact_height": 0.3})
    with pytest.raises(ValueError, match=r"joint_contact_height must be None .* strips are linear"):
        ContinuumLining(ring, joint="equivalent_strip")
