"""Both lining models against closed forms of rings; where a thin ring's form falls short, the exact thick ring's."""

import numpy as np
import pytest
from rings import ground, tractions

from structure import BeamSpringLining, ContinuumLining, Ring, theory
from verification.problems import exact_rings

THIN = 0.02  # thickness over radius; stretching then changes displacements by (t/R)^2/12 = 3e-5


def ring(thickness=0.35, **changes):
    values = dict(
        outer_diameter=2 * (3.125 + thickness / 2),
        inner_diameter=2 * (3.125 - thickness / 2),
        concrete_modulus=34.5e9,
        concrete_poissons_ratio=0.2,
        concrete_unit_weight=0.0,
    )
    return Ring(**(values | changes))


BOTH = pytest.mark.parametrize("model", [BeamSpringLining, ContinuumLining])


def relative_error(response, name, expected, scale=None):
    return np.abs(response[name].values[0] - expected).max() / (np.abs(expected).max() if scale is None else scale)


def angles(response):
    return np.radians(response["theta"].values)


@BOTH
def test_uniform_pressure_gives_thrust_on_the_outer_face_and_no_moment(model):
    free = ring()
    response = model(free).respond(tractions(lambda a: 3e5))
    thrust = exact_rings.uniform_pressure(3e5, free.outer_radius, angles(response)).axial_force
    # 5e-5: the load polygon of one-degree chords, span^2/24 = 1.3e-5, and as much from the linear shares.
    assert relative_error(response, "axial_force", thrust) < 5e-5
    # Beams have none. Hoop stress in a thick ring is larger inside: its moment about the centre line is Lamé's.
    radius = np.linspace(free.inner_diameter / 2, free.outer_radius, 2001)
    hoop = exact_rings.thick_ring_uniform(3e5, radius[0], radius[-1], radius)[1]
    moment = np.trapezoid(hoop * (radius - free.centre_radius), radius) if model is ContinuumLining else 0.0
    # 1e-8 of N R: rounding, there is no other source of moment. 1e-4 of Lamé's: two elements across the thickness.
    assert np.abs(response["bending_moment"] - moment).max() < max(1e-8 * 3e5 * 3.3 * 3.125, 1e-4 * moment)


@BOTH
def test_cos2_pressure_gives_the_equilibrium_forces(model):
    free = ring()
    response = model(free).respond(tractions(lambda a: 6e4 * np.cos(2 * a)))
    on_centre_line = 6e4 * free.outer_radius / free.centre_radius
    expected = exact_rings.radial_cos2(on_centre_line, free.centre_radius, angles(response))
    for name in expected._fields:
        # 5e-4: one-degree elements resolve cos(2a) to (2 span)^2/8 = 1.5e-4; twice linear (samples, shares).
        assert relative_error(response, name, getattr(expected, name)) < 5e-4


@pytest.mark.parametrize("section", ["timoshenko", "euler-bernoulli"])
def test_cos2_displacement_includes_bending_stretching_and_shear(section):
    free = ring(section=section)
    response = BeamSpringLining(free).respond(tractions(lambda a: 6e4 * np.cos(2 * a)))
    expected = exact_rings.radial_cos2_displacement(
        6e4 * free.outer_radius / free.centre_radius,
        free.centre_radius,
        free.bending_stiffness,
        free.axial_stiffness,
        free.shear_stiffness,
    )
    # 1e-3: chords and linear loads, 5e-4 of the forces above, enter once more through the strains.
    assert response["convergence_vertical"].item() == pytest.approx(-2 * expected, rel=1e-3)
    assert response["convergence_horizontal"].item() == pytest.approx(2 * expected, rel=1e-3)


@pytest.mark.parametrize("tangential", [0.0, 3e4])
def test_continuum_has_the_displacements_and_stresses_of_the_exact_thick_ring(tangential):
    free = ring()
    loads = tractions(lambda a: 6e4 * np.cos(2 * a), lambda a: tangential * np.sin(2 * a), step=0.25)
    exact = exact_rings.thick_ring_cos2(6e4, tangential, free.inner_diameter / 2, free.outer_radius, 34.5e9, 0.2)
    model = ContinuumLining(free)
    across = np.linspace(free.inner_diameter / 2, free.outer_radius, 2001)
    mean = np.trapezoid(exact.radial_displacement(across, 0.0), across) / free.thickness
    # 3e-4: two elements across the thickness; measured 1.5e-4, and 1.9e-5 with four.
    assert model.respond(loads)["convergence_vertical"].item() == pytest.approx(-2 * mean, rel=3e-4)
    stress = model.stress_field(loads).isel(time=0)
    expected = exact.stresses(stress["radius"].values, np.radians(stress["theta"].values))
    largest = np.abs(expected[1]).max()
    for name, values in zip(("stress_rr", "stress_tt", "stress_rt"), expected, strict=True):
        # 1e-3 of the largest: stresses of two quadratic elements across the thickness; measured 3.7e-4.
        assert np.abs(stress[name].values - values).max() < 1e-3 * largest


@BOTH
def test_thin_ring_deflects_by_plane_strain_bending_alone(model):
    thin = ring(thickness=THIN * 3.125)
    response = model(thin).respond(tractions(lambda a: 1e2 * np.cos(2 * a)))
    # Written out, so that the ring's own property is checked too: a tunnel is in plane strain.
    bending_stiffness = 34.5e9 / (1 - 0.2**2) * (THIN * 3.125) ** 3 / 12
    expected = exact_rings.radial_cos2_displacement(
        1e2 * thin.outer_radius / thin.centre_radius, thin.centre_radius, bending_stiffness
    )
    # 1e-3: shear adds 4 EI/(G A_s R^2) = 4e-4 at this thickness, discretisation the rest.
    assert response["convergence_vertical"].item() == pytest.approx(-2 * expected, rel=1e-3)


@BOTH
def test_shear_acts_on_the_outer_face_with_its_couple(model):
    free = ring()
    response = model(free).respond(tractions(lambda a: 0.0, lambda a: 6e4 * np.sin(2 * a)))
    ratio = free.outer_radius / free.centre_radius
    force = exact_rings.tangential_sin2(6e4 * ratio, free.centre_radius, angles(response))
    couple = exact_rings.distributed_couple_sin2(6e4 * ratio * free.thickness / 2, free.centre_radius, angles(response))
    for name in force._fields:
        # 5e-4 as for the cos2 pressure.
        assert relative_error(response, name, getattr(force, name) + getattr(couple, name)) < 5e-4


@BOTH
def test_self_weight_on_a_point_support(model):
    thin = ring(thickness=THIN * 3.125, concrete_unit_weight=25e3, support="invert")
    response = model(thin).respond(tractions(lambda a: 0.0))
    weight = 25e3 * thin.thickness
    angle = angles(response)
    right = angle < np.pi
    expected = exact_rings.self_weight_on_point_support(weight, thin.centre_radius, angle[right])
    for name in expected._fields:
        error = np.abs(response[name].values[0, right] - getattr(expected, name)).max()
        # 1e-3 of the largest: one-degree chords at the kink over the support, and stretching (t/R)^2/12 = 3e-5.
        assert error < 1e-3 * np.abs(getattr(expected, name)).max()
    total = 2 * np.pi * thin.centre_radius * weight
    # 1e-8: equilibrium up to rounding.
    assert response["spring_sum_vertical"].item() == pytest.approx(total, rel=1e-8)


@BOTH
@pytest.mark.parametrize("thickness", [THIN * 3.125, 0.35])
@pytest.mark.parametrize("tangential", [False, True])
def test_winkler_ring_under_cos2_pressure_and_shear(model, thickness, tangential):
    soil = ground(law="linear", two_way=True, tangential_springs=tangential)
    beam = model is BeamSpringLining
    embedded = ring(thickness=thickness, ground=soil, section="euler-bernoulli" if beam else "timoshenko")
    shear = (lambda a: 1e4 * np.sin(2 * a)) if tangential else None
    response = model(embedded).respond(tractions(lambda a: 2e4 * np.cos(2 * a), shear))
    normal = 4 / 1.3 * 40e6 / embedded.outer_diameter
    stiffness = embedded.bending_stiffness
    if not beam:
        # The formula's ring bends only; the exact thick ring also shears and stretches, so take its stiffness.
        soft = exact_rings.thick_ring_cos2(1.0, 0.0, embedded.inner_diameter / 2, embedded.outer_radius, 34.5e9, 0.2)
        moved = soft.radial_displacement(embedded.outer_radius, 0.0)
        stiffness = -embedded.outer_radius * embedded.centre_radius**3 / (9 * moved)
    expected = exact_rings.winkler_cos2_displacement(
        2e4,
        1e4 * tangential,
        embedded.centre_radius,
        stiffness,
        normal,
        normal / 3 * tangential,
        embedded.thickness,
    )
    # 1e-3: the formula's ring does not stretch. Stretching sets the rest: measured 9e-4 in the thin ring, whatever
    # the number of
    # elements, and 5e-5 with a concrete a thousand times stiffer.
    # The thick continuum with its own stiffness: measured 8e-4.
    assert response["convergence_vertical"].item() == pytest.approx(-2 * expected, rel=1e-3)


@BOTH
def test_hinged_ring_closes_its_rotations(model):
    joints = (45.0, 135.0, 225.0, 315.0, 20.0, 160.0, 200.0, 340.0)
    # Stiff against opening and sliding, so that only rotation is released, as in the formula.
    hinged = ring(
        thickness=THIN * 3.125,
        joint_angles=tuple(sorted(joints)),
        joint_rotational_stiffness=2e5,
        joint_normal_stiffness=1e13,
        joint_shear_stiffness=1e13,
    )
    response = model(hinged).respond(tractions(lambda a: 1e2 * np.cos(2 * a)))
    load = 1e2 * hinged.outer_radius / hinged.centre_radius
    rigid = exact_rings.radial_cos2(load, hinged.centre_radius, np.radians(sorted(joints))).bending_moment
    expected = exact_rings.hinge_moments(rigid, 2e5, hinged.centre_radius, hinged.bending_stiffness)
    # The redundant moment must matter for the test to mean something.
    assert np.abs(expected - rigid).max() > 0.05 * np.abs(rigid).max()
    # 1e-3 of the largest: discretisation of the load and of the chords.
    error = np.abs(response["joint_bending_moment"].values[0] - expected).max()
    assert error < 1e-3 * np.abs(expected).max()


@BOTH
def test_opposite_point_loads(model):
    free = ring(thickness=THIN * 3.125)
    # A hat one degree wide to either side at crown and invert is the closest a sampled pressure comes to a point load.
    force = 1e3
    peak = force / (free.outer_radius * np.radians(1.0))
    loaded = tractions(lambda a: np.where(np.isclose(a % np.pi, 0), peak, 0.0))
    response = model(free).respond(loaded)
    angle = angles(response)
    away = (angle > np.radians(3)) & (angle < np.radians(177))
    expected = exact_rings.opposite_point_loads(force, free.centre_radius, angle[away]).bending_moment
    # 2e-3 of P R/pi: the load is spread over two degrees, which lowers the mean moment by about span/6.
    assert np.abs(response["bending_moment"].values[0, away] - expected).max() < 2e-3 * force * 3.125 / np.pi


@BOTH
def test_theoretical_pressures_sum_to_buoyancy_and_lost_overburden(model):
    dataset = theory.theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8900.0, coefficient_at_rest=0.43
    )
    response = model(ring(balance_uplift=True)).respond(dataset)
    # Stresses in equilibrium with their weight: the circle lifts with the weight of what it displaces (Archimedes).
    # 2e-4: one-degree samples, linear in between.
    assert response["balanced_uplift"].item() == pytest.approx(np.pi * 3.3**2 * (8900.0 + 9810.0), rel=2e-4)
