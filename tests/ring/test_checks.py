"""Checks of a response: utilisations by hand, limits without defaults, and their picture."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from rings import pressures, ring
from scipy.optimize import brentq
from test_sections import UNEQUAL, section

from coupling.figures import utilisations as check_figures
from structure import BeamSpringLining, CapacityRule, InputError, Limits, additional, check
from structure.capacity import resultants
from structure.limits import UTILISATIONS
from structure.stability import bearing_resistance

RULE = dict(axial_force_factor=1.0, moment_factor=1.35, minimum_eccentricity=0.02, utilisation="radial", shear=True)
CHECKED = {
    f"{what}_utilisation"
    for what in ("section", "shear", "crack", "bearing", "gasket", "joint_dislocation", "convergence", "joint_rotation")
}


def limits(**changes):
    values = dict(
        segment=section(),
        capacity=CapacityRule(**RULE),
        gasket_opening=6e-3,
        gasket_offset=0.1,
        joint_contact_height=0.175,
        crack_width=0.2e-3,
        crack_duration="long-term",
        joint_dislocation=10e-3,
        convergence_per_mille=5.0,
        own=dict(joint_rotation=4e-3),
    )
    return Limits(**{name: value for name, value in (values | changes).items() if value is not None})


@pytest.fixture(scope="module")
def response():
    lining = ring(joint_normal_stiffness=2e10, joint_contact_height=0.175)
    return BeamSpringLining(lining).respond(pressures(4).assign(inflow_mass=("time", [0.0, 300.0, 600.0, 900.0])))


@pytest.fixture(scope="module")
def checked(response):
    return check(response, limits())


def test_response_stays_as_it_was_and_every_addition_is_described(response, checked):
    for name in response.data_vars:
        xr.testing.assert_identical(checked[name], response[name])
    added = set(checked.data_vars) - set(response.data_vars)
    assert CHECKED | {"largest_utilisation", "gasket_opening", "convergence_per_mille", "crack_width"} <= added
    for name in added:
        assert set(checked[name].attrs) == {"units", "long_name"}
    assert json.loads(checked.attrs["limits"])["capacity"]["moment_factor"] == 1.35


def utilisation_by_hand(given, axial, moment):
    """N over that of the state in which the pressed face reaches eps_cu2 = 3.5 per mille under the same M/N."""

    def forces(other):
        outer, inner = (other, 0.0035) if moment > 0 else (0.0035, other)
        return [part[0] for part in resultants(given, 0.35, strain_outer=[outer], strain_inner=[inner])]

    no_thrust = brentq(lambda other: forces(other)[0], -0.04, -1e-3)
    return axial / forces(brentq(lambda e: forces(e)[0] * moment - forces(e)[1] * axial, no_thrust, 0.0))[0]


@pytest.mark.parametrize("place", ["argmax", "argmin"])
def test_utilisation_of_one_section_by_hand(response, place):
    checked = check(response, limits(segment=section(**UNEQUAL)))
    at = int(getattr(response["bending_moment"].values[2], place)())
    axial, moment = (response[name].values[2, at] for name in ("axial_force", "bending_moment"))
    assert np.sign(moment) == (1 if place == "argmax" else -1)
    design = np.sign(moment) * max(1.35 * abs(moment), 0.02 * axial)
    expected = utilisation_by_hand(section(**UNEQUAL), axial, design)
    # 1e-3: chords of the diagram, of which the state by hand knows nothing.
    assert checked["section_utilisation"].values[2, at] == pytest.approx(expected, rel=1e-3)
    assert 0.1 < expected < 3


def test_least_eccentricity_acts_where_the_moment_vanishes(checked):
    eccentricity = np.abs(checked["design_bending_moment"]) / checked["design_axial_force"]
    # 1e-12: rounding of the division.
    assert eccentricity.min() == pytest.approx(0.02, rel=1e-12)


def test_joints_and_convergence_by_hand(response, checked):
    opening = response["joint_opening"].values + 0.1 * response["joint_rotation"].values
    assert (opening > 0).any() and (opening < 0).any()
    # 1e-12: the same expressions.
    np.testing.assert_allclose(checked["gasket_utilisation"], np.maximum(opening, 0) / 6e-3, rtol=1e-12)
    np.testing.assert_allclose(
        checked["joint_dislocation_utilisation"], np.abs(response["joint_dislocation"]) / 10e-3, rtol=1e-12
    )
    np.testing.assert_allclose(
        checked["joint_rotation_utilisation"], np.abs(response["joint_rotation"]) / 4e-3, rtol=1e-12
    )
    larger = np.maximum(np.abs(response["convergence_horizontal"]), np.abs(response["convergence_vertical"]))
    np.testing.assert_allclose(checked["convergence_per_mille"], 1e3 * larger / 6.6, rtol=1e-12)
    np.testing.assert_allclose(checked["convergence_utilisation"], 1e3 * larger / 6.6 / 5.0, rtol=1e-12)


def test_gasket_opens_on_the_side_that_the_rotation_opens(response):
    outside = check(response, limits(gasket_offset=0.15))["gasket_opening"]
    inside = check(response, limits(gasket_offset=-0.15))["gasket_opening"]
    assert ((outside > inside) == (response["joint_rotation"] > 0)).all()


def test_largest_utilisation_is_that_of_all_checks(checked):
    parts = [checked[name].max([d for d in checked[name].dims if d != "time"]).values for name in CHECKED]
    np.testing.assert_array_equal(checked["largest_utilisation"], np.max(parts, axis=0))


def test_only_what_is_limited_is_checked(response):
    one = check(response, Limits(convergence_per_mille=3.0))
    assert "section_utilisation" not in one and "gasket_utilisation" not in one
    np.testing.assert_array_equal(one["largest_utilisation"], one["convergence_utilisation"])


def test_what_the_event_adds_is_checked_alike(response):
    one = check(additional(response), Limits(convergence_per_mille=3.0))
    assert one["convergence_utilisation"][0] == 0 < one["convergence_utilisation"][-1]


def test_constant_axial_force_differs_from_radial(response, checked):
    rule = CapacityRule(**RULE | dict(utilisation="constant_axial_force"))
    other = check(response, limits(capacity=rule))["section_utilisation"]
    # below the balanced point compression helps: with N held the moment may grow further than along the ray
    assert (other[0] < checked["section_utilisation"][0]).any()
    assert ((other < 1) == (checked["section_utilisation"] < 1)).all()


def test_limits_from_toml_are_the_same(tmp_path):
    path = tmp_path / "limits.toml"
    given = limits().model_dump()
    lines = [f"{k} = {v!r}" for k, v in given.items() if not isinstance(v, dict | None)]
    for table in ("segment", "capacity", "own"):
        lines += [f"[{table}]", *(f"{k} = {v!r}" for k, v in given[table].items())]
    path.write_text("\n".join(lines).replace("True", "true"))
    assert Limits.from_toml(path) == limits()


def test_limits_in_the_documentation_are_valid(tmp_path):
    text = (Path(__file__).parents[2] / "docs" / "ring.md").read_text(encoding="utf-8")
    path = tmp_path / "limits.toml"
    path.write_text(text.split('```toml title="limits.toml"\n')[1].split("```")[0], encoding="utf-8")
    assert Limits.from_toml(path) == limits()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "at least one limit"),
        (dict(gasket_opening=6e-3), "gasket_offset must be given where gasket_opening is"),
        (dict(gasket_offset=0.1), "gasket_opening must be given where gasket_offset is"),
        (dict(segment=section()), "capacity or crack_width must be given where segment is"),
        (dict(convergence_per_mille=0.0), "greater than 0"),
        (dict(crack_width=2e-4, crack_duration="long-term"), "segment must be given where crack_width is"),
        (dict(crack_width=2e-4, segment=section()), "crack_duration must be given where crack_width is"),
        (dict(joint_contact_height=0.2), "capacity must be given where joint_contact_height is"),
        (dict(own=dict(joint_turn=1.0)), "must name quantities of a response, got 'joint_turn'"),
        (dict(own=dict(settlement=-1.0)), "settlement must be greater than 0, got -1"),
        (dict(opening=1.0), "unknown key, got 1.0; did you mean 'gasket_opening'"),
    ],
)
def test_incomplete_limits_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        Limits(**values)


def test_rule_of_the_capacity_has_no_default():
    assert all(field.is_required() for field in CapacityRule.model_fields.values())


def test_responses_that_lack_something_are_refused(response):
    with pytest.raises(ValueError, match="attribute 'ring'"):
        check(response.drop_attrs(), limits())
    unjointed = BeamSpringLining(ring(joint_angles=())).respond(pressures())
    assert "section_utilisation" in check(unjointed, Limits(segment=section(), capacity=CapacityRule(**RULE)))


@pytest.mark.parametrize(
    ("lining", "given", "message"),
    [
        (dict(joint_angles=()), dict(joint_dislocation=5e-3), "joint_dislocation must be left out of a ring without"),
        (dict(joint_angles=()), dict(own=dict(joint_rotation=5e-3)), "joint_rotation must be left out of a ring"),
        ({}, dict(gasket_opening=6e-3, gasket_offset=0.2), "gasket_offset must be at most half the thickness 0.35 m"),
        ({}, dict(joint_contact_height=0.4), "joint_contact_height must be at most the thickness 0.35 m, got 0.4 m"),
        (dict(joint_contact_height=0.3), dict(joint_contact_height=0.2), "of the ring, 0.3 m, got 0.2 m; correct one"),
        ({}, dict(segment=section(cover_outer=0.18)), "cover_outer and half of bar_diameter_outer must be below half"),
    ],
)
def test_limits_that_do_not_fit_a_ring_are_refused(lining, given, message):
    of_segment = dict(segment=section(), capacity=CapacityRule(**RULE))
    with pytest.raises(ValueError, match=message):
        Limits(**of_segment | given).check_ring(ring(**lining))


def test_figure_shows_the_numbers_of_the_dataset(checked):
    diagram, history = check_figures.checks(checked).axes[:2]
    assert f"{checked['section_utilisation'].max().item():.2f}" in diagram.get_title()
    assert diagram.get_xlabel() == "design bending moment M [kN m/m]"
    clouds = np.concatenate([cloud.get_offsets() for cloud in diagram.collections])
    assert clouds[:, 0].max() == pytest.approx(checked["design_bending_moment"].max().item() / 1e3)
    assert history.get_xlabel() == "inflow mass [kg/m]"
    labels = {line.get_label(): line for line in history.lines}
    for name in CHECKED:
        label, largest = UTILISATIONS[name], checked[name].max([d for d in checked[name].dims if d != "time"])
        np.testing.assert_array_equal(labels[label].get_ydata(), np.where(np.isfinite(largest), largest, np.nan))


def test_figure_of_a_single_state_without_section(response, tmp_path):
    one = check(response.isel(time=[0]).drop_vars("inflow_mass"), Limits(convergence_per_mille=3.0))
    figure = check_figures.checks(one)
    figure.savefig(tmp_path / "checks.png")
    assert len(figure.axes) == 1
    with pytest.raises(ValueError, match=r"must come from structure\.check"):
        check_figures.checks(response)


def stable(**changes):
    rule = dict(cover=20.0, buoyant_unit_weight=8900.0, uplift_factor=1.0, weight_factor=0.9, bearing_factor=1.4)
    return Limits(stability=rule | changes)


def test_flotation_is_the_uplift_over_the_weights_by_hand():
    response = BeamSpringLining(ring()).respond(pressures())
    checked = check(response, stable()).isel(time=0)
    weight = 25e3 * np.pi * (3.3**2 - 2.95**2) + 8900.0 * (6.6 * (20.0 + 3.3) - np.pi * 3.3**2 / 2)
    # 1e-3: pressures at whole degrees
    assert checked["flotation_utilisation"].item() == pytest.approx(9810 * np.pi * 3.3**2 / (0.9 * weight), rel=1e-3)
    lost = response.assign_coords(inflow_mass=("time", [5e4]))
    lighter = check(lost, stable()).isel(time=0)
    assert lighter["flotation_utilisation"].item() == pytest.approx(
        9810 * np.pi * 3.3**2 / (0.9 * (weight - 9.81 * 5e4)), rel=1e-3
    )
    assert lighter["largest_utilisation"] == lighter["flotation_utilisation"]


def test_bearing_of_the_ground_by_hand():
    """phi = 25 degrees: N_q = 10.66, N_gamma = 9.01, as tables have them."""
    response = BeamSpringLining(ring()).respond(pressures())
    checked = check(response, stable()).isel(time=0)
    resisted = 8900.0 * 26.6 * 10.662 + 0.5 * 8900.0 * 6.6 * 2 * 9.662 * np.tan(np.radians(25))
    theta = np.radians(np.arange(90.5, 270.0, 1.0))
    loads = pressures().isel(time=0).interp(theta=np.degrees(theta))
    upward = -np.cos(theta) * loads["soil_pressure"] - np.sin(theta) * loads["soil_shear"]
    stress = float(upward.sum()) * 3.3 * np.radians(1.0) / 6.6
    assert checked["ground_bearing_utilisation"].item() == pytest.approx(1.4 * stress / resisted, rel=1e-3)
    assert bearing_resistance(1e4, 0.0, 0.0, 0.0) == pytest.approx(1e4 * (np.pi + 2))


def test_stability_without_a_scene_needs_cover_and_unit_weight():
    with pytest.raises(ValueError, match=r"stability\.cover must be given where no scene has it"):
        check(BeamSpringLining(ring()).respond(pressures()), stable(cover=None))


def test_stability_needs_ground():
    with pytest.raises(ValueError, match="stability must be left out of a ring without ground"):
        check(BeamSpringLining(ring(ground=None, balance_uplift=True)).respond(pressures()), stable())
