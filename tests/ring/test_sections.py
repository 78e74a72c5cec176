"""Capacity of a reinforced section against hand calculations with the stress block of EN 1992-1-1."""

import numpy as np
import pytest
from scipy.optimize import brentq

from structure import InputError
from structure.capacity import (
    SegmentSection,
    interaction,
    moment_utilisation,
    radial_utilisation,
    resultants,
    table_3_1,
)

THICKNESS, DEPTH = 0.35, 0.05
FCD, FYD, MODULUS = 0.85 * 50e6 / 1.5, 500e6 / 1.15, 200e9
YIELD = FYD / MODULUS
# Parabola (n = 2) up to 2, rectangle up to 3.5 per mille: area 1 - 2/3.5/3 and centroid of the block, by hand.
FULLNESS, CENTROID = 17 / 21, 99 / 238


def section(**changes):
    values = dict(
        concrete_strength=50e6,
        concrete_long_term_factor=0.85,
        concrete_partial_factor=1.5,
        **table_3_1(50e6),
        steel_area_outer=1.5e-3,
        steel_area_inner=1.5e-3,
        bar_depth_outer=DEPTH,
        bar_depth_inner=DEPTH,
        steel_strength=500e6,
        steel_partial_factor=1.15,
        steel_modulus=MODULUS,
        steel_strain_limit=0.045,
    )
    return SegmentSection(**(values | changes))


UNEQUAL = dict(steel_area_outer=3e-3, steel_area_inner=0.8e-3, bar_depth_inner=0.06)


def state(axis_depth):
    """Forces and strains of eps_cu2 at the inner face and a neutral axis this deep, by hand."""
    strain = {at: 0.0035 * (1 - at / axis_depth) for at in (DEPTH, THICKNESS - DEPTH, THICKNESS)}
    displaced = FCD * (1 - (1 - min(max(strain[DEPTH] / 0.002, 0), 1)) ** 2)
    pressed = 1.5e-3 * (min(MODULUS * strain[DEPTH], FYD) - displaced)
    pulled = 1.5e-3 * max(MODULUS * strain[THICKNESS - DEPTH], -FYD)
    block = FULLNESS * FCD * axis_depth
    axial = block + pressed + pulled
    moment = block * (THICKNESS / 2 - CENTROID * axis_depth) + (pressed - pulled) * (THICKNESS / 2 - DEPTH)
    return axial, moment, strain[THICKNESS]


def test_pure_compression_and_pure_tension():
    capacity = interaction(section(), THICKNESS)
    steel = 3e-3
    # 1e-12: the same sums; at 2 per mille the steel bears 400 MPa, below f_yd.
    assert capacity.axial_force[0] == pytest.approx(FCD * (THICKNESS - steel) + steel * 400e6, rel=1e-12)
    assert capacity.axial_force.min() == pytest.approx(-steel * FYD, rel=1e-12)
    # 1e-9 of N h: rounding.
    assert abs(capacity.bending_moment[0]) < 1e-9 * capacity.axial_force[0] * THICKNESS


@pytest.mark.parametrize("axis_depth", [0.08, 0.0035 / (0.0035 + YIELD) * (THICKNESS - DEPTH), 0.29])
def test_states_of_bending_by_hand(axis_depth):
    """The second is the balanced point: the steel yields as the concrete crushes."""
    axial, moment, other = state(axis_depth)
    computed = resultants(section(), THICKNESS, strain_outer=[other], strain_inner=[0.0035])
    # 1e-12: Gauss points integrate a parabola exactly.
    assert computed[0][0] == pytest.approx(axial, rel=1e-12)
    assert computed[1][0] == pytest.approx(moment, rel=1e-12)
    capacity = interaction(section(), THICKNESS)
    # 1e-3: chords of 200 states between pure compression and the limit of the steel; inside, but for rounding.
    for measure in (radial_utilisation, moment_utilisation):
        assert 1 - 1e-12 <= measure(capacity, np.array(axial), np.array(moment)) < 1.001


def test_balanced_point_carries_the_largest_moment():
    _, moment, _ = state(0.0035 / (0.0035 + YIELD) * (THICKNESS - DEPTH))
    # 1e-12: it is a corner of the polygon.
    assert interaction(section(), THICKNESS).bending_moment.max() == pytest.approx(moment, rel=1e-12)


def test_pure_bending_by_hand():
    axis_depth = brentq(lambda x: state(x)[0], 0.02, 0.3, xtol=1e-15)
    moment = state(axis_depth)[1]
    # A rule of thumb: lever arm 0.9 d and no steel on the pressed side; 10 % above it, for both are more here.
    assert moment == pytest.approx(1.5e-3 * FYD * 0.9 * (THICKNESS - DEPTH), rel=0.1)
    capacity = interaction(section(), THICKNESS)
    for measure in (radial_utilisation, moment_utilisation):
        # 1e-3: chords of the polygon.
        assert measure(capacity, np.array(0.0), np.array([moment, -moment])) == pytest.approx([1, 1], rel=1e-3)


@pytest.mark.parametrize("strength", [50e6, 80e6])
def test_integration_against_fibres(strength):
    concrete = section(concrete_strength=strength, **table_3_1(strength), **UNEQUAL)
    outer, inner = np.array([0.0035, -0.01, 0.002, 1e-4, 0.0]), np.array([-0.004, 0.0026, 0.002, 0.0026, 0.0])
    axial, moment = resultants(concrete, THICKNESS, outer, inner)
    depth = (np.arange(400_000) + 0.5) / 400_000 * THICKNESS
    for k in range(len(outer)):
        strain = outer[k] + (inner[k] - outer[k]) * depth / THICKNESS
        stress = concrete.concrete_stress(strain)
        force, couple = stress.mean() * THICKNESS, (stress * (depth - THICKNESS / 2)).mean() * THICKNESS
        for area, at in ((3e-3, DEPTH), (0.8e-3, THICKNESS - 0.06)):
            bar = outer[k] + (inner[k] - outer[k]) * at / THICKNESS
            bar_force = area * (np.clip(MODULUS * bar, -FYD, FYD) - concrete.concrete_stress(np.array(bar)))
            force, couple = force + bar_force, couple + bar_force * (at - THICKNESS / 2)
        # 1e-6 of f_cd h: 12 Gauss points where the exponent is 1.4 and the slope at eps_c2 has a kink.
        largest = concrete.concrete_design_strength * THICKNESS
        assert axial[k] == pytest.approx(force, abs=1e-6 * largest)
        assert moment[k] == pytest.approx(couple, abs=1e-6 * largest * THICKNESS)


def test_equal_steel_gives_a_symmetric_diagram():
    capacity = interaction(section(), THICKNESS)
    mirrored = np.roll(capacity.bending_moment[::-1], 1)
    # 1e-9 of the largest: rounding.
    np.testing.assert_allclose(capacity.bending_moment, -mirrored, atol=1e-9 * capacity.bending_moment.max())


def test_unequal_steel_mirrors_with_the_faces():
    turned = dict(steel_area_outer=0.8e-3, steel_area_inner=3e-3, bar_depth_outer=0.06, bar_depth_inner=DEPTH)
    one, other = interaction(section(**UNEQUAL), THICKNESS), interaction(section(**turned), THICKNESS)
    axial, moment = np.array([0.0, 2e6, -4e5]), np.array([1.5e5, -2e5, 5e4])
    for measure in (radial_utilisation, moment_utilisation):
        # 1e-9: rounding.
        np.testing.assert_allclose(measure(one, axial, moment), measure(other, axial, -moment), rtol=1e-9)
    # more steel near the outer face resists tension there: nearly as the ratio of the areas, 3.75, in pure bending
    outside, inside = moment_utilisation(one, np.zeros(2), np.array([1e5, -1e5]))
    assert 2.5 < inside / outside < 3.75


def test_polygon_converges_from_inside_with_the_square_of_its_states():
    axial, moment = np.array([1.2e6, 4e6, -3e5]), np.array([3e5, -3e5, 8e4])
    fine = radial_utilisation(interaction(section(), THICKNESS, count=3200), axial, moment)
    coarse = [radial_utilisation(interaction(section(), THICKNESS, count=n), axial, moment) - fine for n in (50, 200)]
    # Inside: the coarse polygon never calls more admissible; 1e-6 for the hollow near pure tension (8e-7 measured).
    assert (np.array(coarse) > -1e-6).all()
    # 16 times fewer per 4 times more states, within a factor of 3 for where the corners fall.
    assert coarse[1].max() < coarse[0].max() / 5


def test_utilisation_is_one_on_the_boundary_and_grows_with_the_forces():
    capacity = interaction(section(**UNEQUAL), THICKNESS)
    # 1e-9: corners of the polygon themselves; coinciding ones apart.
    np.testing.assert_allclose(radial_utilisation(capacity, *capacity), 1.0, rtol=1e-9)
    # 1e-12: the same ray.
    assert 2 * radial_utilisation(capacity, np.array(2e6), np.array(1e5)) == pytest.approx(
        radial_utilisation(capacity, np.array(4e6), np.array(2e5)), rel=1e-12
    )
    assert radial_utilisation(capacity, np.array(0.0), np.array(0.0)) == 0
    beyond = np.array([1.1 * capacity.axial_force.max(), 1.1 * capacity.axial_force.min()])
    assert np.isinf(moment_utilisation(capacity, beyond, np.array([1e4, 1e4]))).all()
    assert (radial_utilisation(capacity, beyond, np.array([0.0, 0.0])) > 1).all()


def test_table_3_1_at_its_rows():
    # EN 1992-1-1, Table 3.1, C30, C70 and C90, rounded there to two digits.
    assert list(table_3_1(30e6).values()) == [0.002, 0.0035, 2.0]
    assert list(table_3_1(70e6).values()) == pytest.approx([0.0024, 0.0027, 1.45], rel=0.02)
    assert list(table_3_1(90e6).values()) == pytest.approx([0.0026, 0.0026, 1.4], rel=0.02)
    with pytest.raises(ValueError, match="give it in Pa"):
        table_3_1(50.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(concrete_strain_limit=0.001), "concrete_strain_limit must be at least"),
        (dict(steel_strain_limit=0.001), "must let the steel yield"),
        (dict(steel_area_outer=0.0), "greater than 0"),
        (dict(concrete_partial_factor=0.9), "greater than or equal to 1"),
    ],
)
def test_impossible_sections_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        section(**change)


def test_section_has_no_default():
    assert all(field.is_required() for field in SegmentSection.model_fields.values())


def test_bars_beyond_the_middle_are_refused():
    with pytest.raises(ValueError, match="bar_depth_inner must be below half the thickness"):
        interaction(section(bar_depth_inner=0.2), THICKNESS)
