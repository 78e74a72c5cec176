"""Joints that open, gape and slide: their laws against limits and a block integrated by force, and in the ring."""

import numpy as np
import pytest
from rings import ground, mirrored, pressures, ring
from scipy.optimize import brentq

from structure import BeamSpringLining, InputError, LiningFailure, additional, theory
from structure.joint_laws import JointLaw, contact_moment, limited_shear

STIFFNESS, HEIGHT, FORCE = 5e8, 0.2, 1.2e6
DECOMPRESSION = FORCE * HEIGHT / (6 * STIFFNESS)
NONLINEAR = {
    "contact only": dict(joint_contact_only=True),
    "gaping": dict(joint_contact_height=0.175),
    "sliding": dict(joint_friction_coefficient=0.1),
    "all": dict(joint_contact_only=True, joint_contact_height=0.2, joint_friction_coefficient=0.12),
}


def moment_of_fibres(rotation, axial_force, stiffness, height, fibres=200_000):
    """Moment of a block on springs that only press, its centre found so that the springs carry the axial force."""
    modulus = 12 * stiffness / height**2
    offset = (np.arange(fibres) + 0.5) / fibres * height - height / 2

    def stress(closure):
        return modulus / height * np.maximum(closure + rotation * offset, 0.0)

    def excess(closure):
        return stress(closure).mean() * height - axial_force

    closure = brentq(excess, -rotation * height, rotation * height + axial_force / modulus, xtol=1e-16, rtol=1e-14)
    return (stress(closure) * offset).mean() * height


@pytest.mark.parametrize("share", [0.3, 0.999, 1.001, 2.0, 30.0])
def test_contact_moment_is_that_of_a_block_without_tension(share):
    rotation = share * DECOMPRESSION
    moment = contact_moment(np.array(rotation), np.array(FORCE), STIFFNESS, HEIGHT)[0]
    # 1e-8: midpoint rule of 200 000 fibres, of which the contact zone cuts one.
    assert moment == pytest.approx(moment_of_fibres(rotation, FORCE, STIFFNESS, HEIGHT), rel=1e-8)


def test_contact_moment_follows_the_published_rotation():
    rotation = DECOMPRESSION * np.geomspace(1.01, 1e4, 20)
    moment, *_ = contact_moment(rotation, np.full(20, FORCE), STIFFNESS, HEIGHT)
    modulus = 12 * STIFFNESS / HEIGHT**2
    published = 8 * FORCE / (9 * HEIGHT * modulus * (1 - 2 * moment / (FORCE * HEIGHT)) ** 2)
    # 1e-11: (1 - 2 M/(N h))^2 loses four digits at the largest rotation.
    np.testing.assert_allclose(published, rotation, rtol=1e-11)


def test_contact_moment_is_smooth_at_decompression_and_ends_on_the_edge():
    around = DECOMPRESSION * np.array([1 - 1e-9, 1 + 1e-9, 1e12])
    moment, slope, _ = contact_moment(around, np.full(3, FORCE), STIFFNESS, HEIGHT)
    # 1e-8: the distance from the decompression.
    np.testing.assert_allclose(moment[:2], FORCE * HEIGHT / 6, rtol=1e-8)
    np.testing.assert_allclose(slope[:2], STIFFNESS, rtol=1e-8)
    # 1e-6: 2/3 sqrt(1e-12) is left to the edge.
    assert moment[2] == pytest.approx(FORCE * HEIGHT / 2, rel=1e-6)


def test_contact_moment_is_odd_and_needs_compression():
    rotation = DECOMPRESSION * np.array([0.5, 3.0, 3.0])
    force = np.array([FORCE, FORCE, -FORCE])
    moment = contact_moment(rotation, force, STIFFNESS, HEIGHT)[0]
    np.testing.assert_array_equal(contact_moment(-rotation, force, STIFFNESS, HEIGHT)[0], -moment)
    assert moment[2] == 0


def test_sliding_dissipates_and_leaves_a_slip():
    """One cycle of the dislocation: a parallelogram in the Q-d plane, worked out by hand."""
    friction, stiffness, slip = 0.2, 8e7, np.zeros(1)
    limit = friction * FORCE
    elastic = limit / stiffness
    path = elastic * np.concatenate([np.linspace(0, 3, 31), np.linspace(3, -3, 61), np.linspace(-3, 3, 61)])
    forces = []
    for dislocation in path:
        shear, _, _, slip = limited_shear(np.array([dislocation]), slip, np.array([FORCE]), stiffness, friction)
        forces.append(shear[0])
    forces = np.array(forces)
    assert np.abs(forces).max() == limit
    # 1e-12: the same sums; the loop is 2 limit high and 6 - 2 elastic lengths wide.
    cycle = np.trapezoid(forces[30:], path[30:])
    assert cycle == pytest.approx(2 * limit * 4 * elastic, rel=1e-12)
    assert slip[0] == pytest.approx(2 * elastic, rel=1e-12)


@pytest.mark.parametrize("law", NONLINEAR)
def test_joint_tangent_is_the_slope_of_the_forces(law):
    joints = JointLaw(ring(**NONLINEAR[law]))
    rng = np.random.default_rng(1)
    jumps = rng.uniform([-3e-3, -4e-3, -2e-3], [1e-3, 4e-3, 2e-3], (40, 6, 3))
    slip = np.zeros((40, 6))
    tangent, step = joints.forces(jumps, slip).tangent, 1e-8
    slopes = []
    for way in range(3):
        ends = [joints.forces(jumps + sign * step * np.eye(3)[way], slip) for sign in (1, -1)]
        high, low = (end.resisting for end in ends)
        slopes.append((high - low) / (2 * step))
    # 1e-4 of the own stiffness: the step of the difference near the kinks, and the floor of 1e-6 in the tangent.
    scale = np.array([6e8, 8e7, 5e8])[:, None]
    np.testing.assert_allclose(tangent / scale, np.stack(slopes, axis=-1) / scale, atol=1e-4)


@pytest.mark.parametrize("law", NONLINEAR)
def test_nonlinear_joints_keep_equilibrium_and_their_limits(law):
    model = BeamSpringLining(ring(**NONLINEAR[law]))
    response = model.respond(pressures(8).isel(time=slice(0, 6)))
    # 1e-8 is asked for; Newton stops at 1e-11 of the loads.
    assert response["equilibrium_residual"].max() < 1e-8
    assert response["shear_moment_residual"].max() < 1e-3 * np.abs(response["shear_force"]).max()
    axial = response["joint_axial_force"]
    height, friction = model.ring.joint_contact_height, model.ring.joint_friction_coefficient
    if height is not None:
        assert (np.abs(response["joint_bending_moment"]) < axial * height / 2).all()
        assert (np.abs(response["joint_bending_moment"]) > axial * height / 6).any()
    if friction is not None:
        # 1e-12: the same product.
        assert (np.abs(response["joint_shear_force"]) <= friction * axial * (1 + 1e-12)).all()
        assert (np.abs(response["joint_shear_force"]) >= friction * axial * (1 - 1e-12)).any()


def test_joints_far_from_their_limits_are_linear():
    loads = pressures(4)
    linear = BeamSpringLining(ring()).respond(loads)
    far = ring(joint_contact_only=True, joint_friction_coefficient=5.0)
    other = BeamSpringLining(far).respond(loads)
    for name in ("bending_moment", "axial_force", "joint_rotation", "joint_dislocation"):
        # 1e-7 of the largest: Newton's tolerance, amplified by the softness of the ring.
        np.testing.assert_allclose(other[name], linear[name], atol=1e-7 * np.abs(linear[name]).max().item())


def test_gaping_joints_relieve_themselves():
    loads = pressures()
    linear, gaping = (BeamSpringLining(ring(joint_contact_height=h)).respond(loads) for h in (None, 0.175))
    assert (np.abs(gaping["joint_bending_moment"][0, :2]) < 0.8 * np.abs(linear["joint_bending_moment"][0, :2])).all()
    assert (np.abs(gaping["joint_rotation"][0, :2]) > 1.5 * np.abs(linear["joint_rotation"][0, :2])).all()


@pytest.mark.parametrize("law", ["contact only", "gaping"])
def test_elastic_joints_do_not_remember_the_way(law):
    model, loads = BeamSpringLining(ring(**NONLINEAR[law])), pressures(6)
    together = model.respond(loads)["bending_moment"].isel(time=-1)
    alone = model.respond(loads.isel(time=[-1]))["bending_moment"].isel(time=0)
    # 1e-7 of the largest moment: Newton's tolerance from two different starts.
    np.testing.assert_allclose(together, alone, atol=1e-7 * np.abs(alone).max().item())


def test_sliding_joints_remember_the_way():
    model, loads = BeamSpringLining(ring(joint_friction_coefficient=0.1)), pressures(8)
    there_and_back = loads.isel(time=[0, 5, 0]).assign_coords(time=[0.0, 1.0, 2.0])
    response = model.respond(there_and_back)
    left = additional(response)["joint_dislocation"].isel(time=-1)
    assert np.abs(left).max() > 1e-4
    assert response["equilibrium_residual"].max() < 1e-8
    halfway = loads.isel(time=[0, 5, 5]).assign_coords(time=[0.0, 1.0, 2.0])
    again = additional(model.respond(halfway).isel(time=[1, 2]))
    # 1e-9 m: repeated loads let nothing slide; Newton's tolerance over the joint stiffness.
    assert np.abs(again["joint_dislocation"]).max() < 1e-9


def test_sliding_joints_want_records_in_time_order():
    loads = pressures(3).isel(time=[0, 2, 1])
    with pytest.raises(ValueError, match=r"time must increase .* got 1 s after 2 s; sortby"):
        BeamSpringLining(ring(joint_friction_coefficient=0.1)).respond(loads)


@pytest.mark.parametrize("law", NONLINEAR)
def test_mirrored_pressures_give_the_mirrored_joints(law):
    model = BeamSpringLining(ring(**NONLINEAR[law]))
    loads = pressures(8).isel(time=[0, 4])
    one, other = model.respond(loads), model.respond(mirrored(loads))
    signs = dict(joint_axial_force=1, joint_bending_moment=1, joint_shear_force=-1, joint_dislocation=-1)
    for name, sign in signs.items():
        # 1e-6: Newton's tolerance, amplified by a ring whose joints slide or gape.
        largest = np.abs(one[name]).max().item()
        np.testing.assert_allclose(other[name].values[:, ::-1], sign * one[name].values, atol=1e-6 * largest)


@pytest.mark.filterwarnings("ignore:pressures. soil and water pull the ring outward")
def test_open_joints_carry_nothing():
    held = ring(ground=ground(law="linear", two_way=True), joint_contact_only=True, joint_contact_height=0.35)
    loads = pressures()
    pulling = loads.assign(soil_pressure=-2 * loads["water_pressure"])
    response = BeamSpringLining(held).respond(pulling)
    open_joints = response["joint_opening"] > 0
    assert open_joints.all()
    for name in ("joint_axial_force", "joint_bending_moment"):
        np.testing.assert_array_equal(response[name].where(open_joints, 0.0), 0.0)
    assert response["equilibrium_residual"].max() < 1e-8


def test_dry_joints_on_a_clamped_invert():
    joints = (8.0, 73.0, 180.0, 287.0)
    dry = dict(NONLINEAR["all"], joint_friction_coefficient=0.5)
    held = ring(ground=None, support="invert", joint_angles=joints, **dry)
    loads = theory.theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8900.0, coefficient_at_rest=0.9
    )
    response = BeamSpringLining(held).respond(loads)
    assert np.abs(response["joint_bending_moment"] / response["joint_axial_force"]).max() > 0.2 / 6
    # 1e-8 is asked for, the clamp beside a joint included.
    assert response["equilibrium_residual"].max() < 1e-8
    up = response["spring_sum_vertical"] + response["load_sum_vertical"]
    assert np.abs(up).max() < 1e-8 * 8e6


def test_failure_says_which_joint_and_when():
    with pytest.raises(LiningFailure, match=r"at time 16 s .* joint 2 \(73 degrees\).* joint 2 is sliding") as failure:
        BeamSpringLining(ring(joint_friction_coefficient=0.02)).respond(pressures(20))
    assert failure.value.time == 16.0


@pytest.mark.parametrize("law", ["linear", *NONLINEAR])
def test_newton_converges_quadratically_near_the_solution(law):
    model = BeamSpringLining(ring(**NONLINEAR.get(law, {})))
    equilibrium = model._equilibrium
    load = model.loads(pressures(8).isel(time=[4]))[0]
    none = equilibrium.unslipped
    solution = equilibrium.solve(load, np.zeros_like(load), none)
    # A disturbance of a tenth crosses no kink here: inside one branch of every law the forces are smooth.
    start, error = 1.1 * solution, 0.1
    residual, coefficients = equilibrium.residual(start, load, none)
    for _ in range(4):
        start, residual, coefficients = equilibrium.advance(start, residual, coefficients, load, none)
        before, error = error, np.abs(start - solution).max() / np.abs(solution).max()
        # The square of the error before, times the curvature of the laws (0.7 measured); 1e-9: the solution is known
        # to Newton's tolerance over the softness of the ring, 1e-10 measured.
        assert error < before**2 + 1e-9


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(joint_contact_height=0.4), "must not exceed the thickness 0.35 m"),
        (dict(joint_contact_height=0.2, joint_rotational_stiffness=0.0), "joint_rotational_stiffness must be above 0"),
        (dict(joint_friction_coefficient=0.2, joint_shear_stiffness=0.0), "joint_shear_stiffness must be above 0"),
        (dict(joint_friction_coefficient=-0.1), "greater than or equal to 0"),
    ],
)
def test_impossible_joint_laws_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        ring(**change)


def test_additional_forces_start_at_zero_and_carry_the_inflow():
    loads = pressures(3).assign(inflow_mass=("time", [0.0, 10.0, 20.0]))
    response = BeamSpringLining(ring(joint_contact_height=0.2)).respond(loads)
    added = additional(response)
    assert (
        all(not added[name].isel(time=0).any() for name in added.data_vars if name != "inflow_mass")
        and "equilibrium_residual" not in added
    )
    np.testing.assert_array_equal(added["inflow_mass"], [0.0, 10.0, 20.0])
    np.testing.assert_array_equal(
        added["bending_moment"].isel(time=2), response["bending_moment"][2] - response["bending_moment"][0]
    )
    assert added["bending_moment"].attrs["units"] == "N m/m"
    assert added["bending_moment"].attrs["long_name"].startswith("additional bending moment")
    with pytest.raises(ValueError, match="must have a time dimension"):
        additional(response.isel(time=0))
