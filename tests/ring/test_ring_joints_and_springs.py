"""Joints, soil springs, equilibrium and refusals of the beam-spring ring."""

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from rings import JOINTS, ground, mirrored, pressures, ring

from structure import BeamSpringLining, ContinuumLining, InputError, LiningFailure, theory
from structure.beams.mesh import RingMesh
from structure.springs import SoilSpring, limit_pressures, soil_reaction


@pytest.mark.parametrize("n_elements", [360, 100, 77])
def test_nodes_lie_exactly_on_the_joints(n_elements):
    mesh = RingMesh(ring(n_elements=n_elements))
    assert len(mesh.first) == n_elements
    for nodes in (mesh.joint_before, mesh.joint_after):
        # 1e-12 degrees: conversion to radians and back.
        np.testing.assert_allclose(np.degrees(mesh.node_angle[nodes]) % 360, JOINTS, atol=1e-12 * 360)
    assert mesh.node_span.sum() == pytest.approx(2 * np.pi, rel=1e-14)


def test_loads_and_springs_balance_to_rounding():
    response = BeamSpringLining(ring()).respond(pressures(5))
    # 1e-8 is asked for; Newton stops at 1e-11 of the loads at every node.
    assert response["equilibrium_residual"].max() < 1e-8
    for way in ("horizontal", "vertical"):
        gap = response[f"load_sum_{way}"] + response[f"spring_sum_{way}"]
        # 1e-8 of the 8 MN/m that all nodal loads add up to.
        assert np.abs(gap).max() < 1e-8 * 8e6


def test_shear_is_the_slope_of_the_moment():
    response = BeamSpringLining(ring()).respond(pressures(3))
    # 1e-3 of the largest shear: central differences over one degree.
    assert response["shear_moment_residual"].max() < 1e-3 * np.abs(response["shear_force"]).max()


def test_joint_forces_are_those_of_the_adjoining_segments():
    response = BeamSpringLining(ring()).respond(pressures())
    for name in ("axial_force", "shear_force", "bending_moment"):
        across = [response[name].interp(theta=angle).item() for angle in JOINTS]
        largest = np.abs(response[name]).max().item()
        # 5e-3 of the largest: forces vary by a load of half a degree between a joint and the element's middle.
        np.testing.assert_allclose(response[f"joint_{name}"].values[0], across, atol=5e-3 * largest)


def test_joint_laws_and_signs():
    jointed = ring()
    response = BeamSpringLining(jointed).respond(pressures()).isel(time=0)
    # 1e-12: the same product.
    np.testing.assert_allclose(response["joint_axial_force"], -6e8 * response["joint_opening"], rtol=1e-12)
    np.testing.assert_allclose(response["joint_shear_force"], 8e7 * response["joint_dislocation"], rtol=1e-12)
    np.testing.assert_allclose(response["joint_bending_moment"], 5e8 * response["joint_rotation"], rtol=1e-12)
    assert (response["joint_opening"] < 0).all()
    assert response["joint_rotation"][1] > 0 > response["joint_rotation"][0]


def test_mirrored_pressures_give_the_mirrored_response():
    model = BeamSpringLining(ring())
    loads = pressures(3).isel(time=[2])
    one, other = model.respond(loads), model.respond(mirrored(loads))
    for name, sign in {"axial_force": 1, "bending_moment": 1, "shear_force": -1, "displacement_radial": 1}.items():
        largest = np.abs(one[name]).max().item()
        # 1e-7: Newton's tolerance, amplified by the softness of the ring.
        np.testing.assert_allclose(other[name].values[:, -np.arange(360)], sign * one[name].values, atol=1e-7 * largest)


def test_answer_does_not_depend_on_the_history_of_the_guess():
    model, loads = BeamSpringLining(ring()), pressures(6)
    together = model.respond(loads)["bending_moment"].isel(time=-1)
    alone = model.respond(loads.isel(time=[-1]))["bending_moment"].isel(time=0)
    # 1e-7 of the largest moment: Newton's tolerance from two different starts; the springs have no memory.
    np.testing.assert_allclose(together, alone, atol=1e-7 * np.abs(alone).max().item())


def test_springs_have_consistent_tangents():
    # Away from the kink at zero.
    displacement = np.array([-3e-2, -1e-3, 1e-3, 3e-2])
    for law in (SoilSpring(1.8e7, 1.5e5, False), SoilSpring(6e6, 7e4, True), SoilSpring(1.8e7, np.inf, True)):
        step = 1e-7
        slope = (soil_reaction(displacement + step, law)[0] - soil_reaction(displacement - step, law)[0]) / (2 * step)
        # 1e-6: error of the central difference and its cancellation.
        np.testing.assert_allclose(soil_reaction(displacement, law)[1], slope, rtol=1e-6, atol=1e-3)


def test_hyperbolic_spring_starts_at_eta_and_ends_at_the_limit():
    law = SoilSpring(1.8e7, 1.5e5, False)
    reaction, tangent = soil_reaction(np.array([-0.1, 0.0, 1e6]), law)
    # 1e-6: at 1e6 m the hyperbola is still 1e-8 below its limit.
    np.testing.assert_allclose(reaction, [0.0, 0.0, 1.5e5], rtol=1e-6)
    assert tangent[0] == 0 and tangent[1] == 1.8e7


def test_limit_pressure_follows_the_quoted_formula_unless_given():
    sine = np.sin(np.radians(25.0))
    confinement = (2.07e5 + 8.9e4) / 2 * 3 / 7
    # 1e-12: the same expression.
    assert limit_pressures(ground())[0] == pytest.approx((1 + sine) / (1 - sine) * confinement, rel=1e-12)
    assert limit_pressures(ground(limit_pressure_normal=1.0, limit_pressure_tangential=2.0)) == (1.0, 2.0)


def test_vanishing_soil_limit_leaves_the_free_ring():
    loads = pressures()
    soft = ring(ground=ground(limit_pressure_normal=1e-3, limit_pressure_tangential=1e-3), balance_uplift=True)
    free = ring(ground=None, balance_uplift=True)
    one, other = (BeamSpringLining(each).respond(loads)["bending_moment"] for each in (soft, free))
    # 1e-5: springs of 1 mPa against pressures of 1e5 Pa, and the samples' resultant of 1e-9.
    np.testing.assert_allclose(one, other, atol=1e-5 * np.abs(other).max().item())


def test_soil_too_weak_for_the_uplift_is_a_clear_failure():
    weak = ring(ground=ground(limit_pressure_normal=1e3, limit_pressure_tangential=1e2))
    with pytest.raises(LiningFailure, match=r"no equilibrium at time 0 s .* the ground cannot carry"):
        BeamSpringLining(weak).respond(pressures())


def test_ring_of_free_hinges_without_ground_is_a_mechanism():
    hinged = ring(ground=None, joint_rotational_stiffness=0.0, balance_uplift=True)
    with pytest.raises(LiningFailure, match="mechanism"):
        BeamSpringLining(hinged).respond(pressures())


def test_ring_of_free_hinges_is_held_by_two_way_ground():
    held = ring(ground=ground(two_way=True, law="linear"), joint_rotational_stiffness=0.0)
    response = BeamSpringLining(held).respond(pressures())
    # 1e-6 of the largest moment: free hinges carry none.
    assert np.abs(response["joint_bending_moment"]).max() < 1e-6 * np.abs(response["bending_moment"]).max()
    assert response["equilibrium_residual"].max() < 1e-8


def test_unbalanced_loads_without_ground_are_refused():
    with pytest.raises(ValueError, match=r"loads must balance .* N/m up.* balance_uplift"):
        BeamSpringLining(ring(ground=None)).respond(pressures())


def test_torque_without_tangential_springs_is_refused():
    twisted = pressures()
    twisted["soil_shear"] = twisted["soil_shear"] + 1e3
    with pytest.raises(ValueError, match="switch tangential_springs on"):
        BeamSpringLining(ring(ground=ground(tangential_springs=False))).respond(twisted)


@pytest.mark.parametrize("model", [BeamSpringLining, ContinuumLining])
@pytest.mark.parametrize("shear", [1.0, 10e3])
def test_undrained_clay_holds_a_ring_under_uniform_shear_by_its_cohesion(model, shear):
    clay = ground(friction_angle=0.0, cohesion=40e3)
    loads = xr.zeros_like(pressures())
    loads["soil_shear"] = loads["soil_shear"] + shear
    turned = model(ring(ground=clay, concrete_unit_weight=0.0)).respond(loads).isel(time=0)
    # every point of the outer face slips until eta d c/(c + eta d) = shear; the ring turns as one, its centre line less
    stiffness = 4 / 1.3 * 40e6 / 6.6 / 3
    slip = shear * 40e3 / (stiffness * (40e3 - shear))
    # 1e-4: displacements of straight elements of one degree
    np.testing.assert_allclose(turned["displacement_tangential"], slip * 3.125 / 3.3, rtol=1e-4)


@pytest.mark.parametrize("model", [BeamSpringLining, ContinuumLining])
def test_undrained_clay_carries_the_pressures_of_the_ground(model):
    response = model(ring(ground=ground(friction_angle=0.0, cohesion=40e3))).respond(pressures())
    assert response["equilibrium_residual"].max() < 1e-8


def test_limit_of_the_tangential_spring_is_coulombs():
    friction = 1.48e5 * np.tan(np.radians(25.0))
    # 1e-12: the same product
    assert limit_pressures(ground())[1] == pytest.approx(friction, rel=1e-12)
    assert limit_pressures(ground(cohesion=5e3))[1] == pytest.approx(5e3 + friction, rel=1e-12)


def test_any_sampling_of_the_same_pressures_gives_the_same_forces():
    fine = pressures()
    rng = np.random.default_rng(3)
    uneven = np.sort(np.concatenate([np.arange(0, 360, 2.0), rng.uniform(0, 360, 60)]))
    other = theory.theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8900.0, coefficient_at_rest=3 / 7, theta=uneven
    )
    shuffled = other.isel(theta=rng.permutation(len(uneven)))
    model = BeamSpringLining(ring())
    one, two = (model.respond(each)["bending_moment"] for each in (fine, shuffled))
    # 2e-3: two-degree samples, linear in between, (2 span)^2/8 = 6e-4 of the second harmonic's load, and its larger
    # thrust.
    np.testing.assert_allclose(two, one, atol=2e-3 * np.abs(one).max().item())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.drop_vars("soil_shear"), "soil_shear must be given"),
        (lambda d: d.isel(time=0), r"dimensions \(time, theta\)"),
        (lambda d: d.assign(water_pressure=d["water_pressure"] * np.nan), "must be finite, got 360"),
        (lambda d: d.isel(theta=slice(0, 200)), "no gap of more than 60 degrees"),
        (lambda d: d.assign(soil_pressure=d["soil_pressure"].assign_attrs(units="kg")), "must be in Pa, got 'kg'"),
        (lambda d: d.isel(time=[]), "at least one record"),
    ],
)
def test_wrong_pressures_are_refused_with_a_remedy(change, message):
    with pytest.raises(ValueError, match=message):
        BeamSpringLining(ring()).respond(change(pressures()))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(inner_diameter=7.0), "inner_diameter must be below"),
        (dict(joint_angles=(8.0, 73.0, 360.0)), r"must lie in \[0, 360\)"),
        (dict(joint_angles=(73.0, 8.0)), "must increase"),
        (dict(joint_angles=(8.0, 8.5)), "at least two elements"),
        (dict(support="invert"), "must be 'free' where there is ground"),
        (dict(colour="red"), "colour: unknown key, got 'red'; known: outer_diameter"),
    ],
)
def test_wrong_rings_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        ring(**change)


def test_every_response_variable_has_units_and_a_long_name():
    response = BeamSpringLining(ring()).respond(pressures())
    assert all({"units", "long_name"} <= set(variable.attrs) for variable in response.data_vars.values())


def test_import_structure_loads_nothing_heavy():
    code = "import sys, structure; print([m for m in ('numpy', 'xarray', 'pydantic', 'scipy') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
