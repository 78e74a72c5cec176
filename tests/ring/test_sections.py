"""Capacity of a reinforced section against hand calculations with the stress block of EN 1992-1-1."""

import numpy as np
import pytest
from scipy.optimize import brentq

from structure import InputError, SegmentSection
from structure.capacity import interaction, moment_utilisation, radial_utilisation, resultants

THICKNESS, DEPTH = 0.35, 0.05
FCD, FYD, MODULUS = 0.85 * 50e6 / 1.5, 500e6 / 1.15, 200e9
YIELD = FYD / MODULUS
# Parabola (n = 2) up to 2, rectangle up to 3.5 per mille: area 1 - 2/3.5/3 and centroid of the block, by hand.
FULLNESS, CENTROID = 17 / 21, 99 / 238


# 16 mm at 125 mm
AREA = 1.6084954386379742e-3


def section(**changes):
    values = dict(
        code="EN 1992-1-1",
        concrete="C50/60",
        concrete_long_term_factor=0.85,
        steel="B500B",
        cover_outer=0.042,
        cover_inner=0.042,
        bar_diameter_outer=0.016,
        bar_diameter_inner=0.016,
        bar_spacing_outer=0.125,
        bar_spacing_inner=0.125,
    )
    return SegmentSection(**(values | changes))


# 3.1416e-3 m2 outside, 0.7854e-3 m2 inside, 60 mm from that face
UNEQUAL = dict(bar_diameter_outer=0.020, bar_spacing_outer=0.100, cover_outer=0.040,
               bar_diameter_inner=0.010, bar_spacing_inner=0.100, cover_inner=0.055)  # fmt: skip
AREAS = (np.pi * 1e-3, np.pi * 0.25e-3)


def state(axis_depth):
    """Forces and strains of eps_cu2 at the inner face and a neutral axis this deep, by hand."""
    strain = {at: 0.0035 * (1 - at / axis_depth) for at in (DEPTH, THICKNESS - DEPTH, THICKNESS)}
    displaced = FCD * (1 - (1 - min(max(strain[DEPTH] / 0.002, 0), 1)) ** 2)
    pressed = AREA * (min(MODULUS * strain[DEPTH], FYD) - displaced)
    pulled = AREA * max(MODULUS * strain[THICKNESS - DEPTH], -FYD)
    block = FULLNESS * FCD * axis_depth
    axial = block + pressed + pulled
    moment = block * (THICKNESS / 2 - CENTROID * axis_depth) + (pressed - pulled) * (THICKNESS / 2 - DEPTH)
    return axial, moment, strain[THICKNESS]


def test_pure_compression_and_pure_tension():
    capacity = interaction(section(), THICKNESS)
    steel = 2 * AREA
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
    assert moment == pytest.approx(AREA * FYD * 0.9 * (THICKNESS - DEPTH), rel=0.1)
    capacity = interaction(section(), THICKNESS)
    for measure in (radial_utilisation, moment_utilisation):
        # 1e-3: chords of the polygon.
        assert measure(capacity, np.array(0.0), np.array([moment, -moment])) == pytest.approx([1, 1], rel=1e-3)


@pytest.mark.parametrize("concrete", ["C50/60", "C80/95"])
def test_integration_against_fibres(concrete):
    concrete = section(concrete=concrete, **UNEQUAL)
    outer, inner = np.array([0.0035, -0.01, 0.002, 1e-4, 0.0]), np.array([-0.004, 0.0026, 0.002, 0.0026, 0.0])
    axial, moment = resultants(concrete, THICKNESS, outer, inner)
    depth = (np.arange(400_000) + 0.5) / 400_000 * THICKNESS
    for k in range(len(outer)):
        strain = outer[k] + (inner[k] - outer[k]) * depth / THICKNESS
        stress = concrete.concrete_stress(strain)
        force, couple = stress.mean() * THICKNESS, (stress * (depth - THICKNESS / 2)).mean() * THICKNESS
        for area, at in zip(AREAS, (DEPTH, THICKNESS - 0.06), strict=True):
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
    faces = {"outer": "inner", "inner": "outer"}
    turned = {f"{name.rpartition('_')[0]}_{faces[name.rpartition('_')[2]]}": value for name, value in UNEQUAL.items()}
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


@pytest.mark.parametrize(
    ("concrete", "strain", "limit", "exponent", "tension", "modulus"),
    [
        ("C30/37", 2.0, 3.5, 2.0, 2.9, 33),
        ("C50/60", 2.0, 3.5, 2.0, 4.1, 37),
        ("C55/67", 2.2, 3.1, 1.75, 4.2, 38),
        ("C70/85", 2.4, 2.7, 1.45, 4.6, 41),
        ("C90/105", 2.6, 2.6, 1.4, 5.0, 44),
    ],
)
def test_classes_of_concrete_at_rows_of_table_3_1(concrete, strain, limit, exponent, tension, modulus):
    of_class = section(concrete=concrete)
    # As printed in EN 1992-1-1, Table 3.1: half of the last digit, 0.05 of the strains, of n and of f_ctm, 0.5 of E_cm.
    assert 1e3 * of_class.concrete_peak_strain == pytest.approx(strain, abs=0.05)
    assert 1e3 * of_class.concrete_strain_limit == pytest.approx(limit, abs=0.05)
    assert of_class.concrete_exponent == pytest.approx(exponent, abs=0.05)
    assert of_class.concrete_tensile_strength / 1e6 == pytest.approx(tension, abs=0.05)
    assert of_class.concrete_modulus / 1e9 == pytest.approx(modulus, abs=0.7)
    assert of_class.concrete_strength == 1e6 * int(concrete[1:3])


def test_class_of_steel_says_how_strong_and_ductile_it_is():
    steel = section(steel="B450C")
    assert steel.steel_design_strength == pytest.approx(450e6 / 1.15)
    assert steel.steel_strain_limit == pytest.approx(0.9 * 0.075)


def test_factors_that_the_code_recommends_may_be_those_of_a_national_annex():
    bare = {name: value for name, value in section().model_dump().items() if "factor" not in name}
    assert SegmentSection(**bare).concrete_design_strength == pytest.approx(50e6 / 1.5)
    other = SegmentSection(**bare, concrete_partial_factor=1.4, steel_partial_factor=1.1)
    assert other.concrete_design_strength == pytest.approx(50e6 / 1.4)
    assert other.steel_design_strength == pytest.approx(500e6 / 1.1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(concrete="C50"), "did you mean 'C50/60'"),
        (dict(concrete=50e6), "must be 'C12/15'"),
        (dict(steel="S500"), "write it like 'B500B'"),
        (dict(steel="B700B"), "from 400 to 600"),
        (dict(code="GB 50010"), "must be 'EN 1992-1-1'"),
        (dict(bar_spacing_outer=0.016), "bar_spacing_outer must exceed bar_diameter_outer 0.016 m, got 0.016 m"),
        (dict(cover_inner=0.0), "greater than 0"),
        (dict(concrete_partial_factor=0.9), "greater than or equal to 1"),
    ],
)
def test_impossible_sections_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        section(**change)


def test_only_what_the_code_recommends_may_be_left_out():
    left = {name for name, field in SegmentSection.model_fields.items() if not field.is_required()}
    assert left == {"concrete_long_term_factor", "concrete_partial_factor", "steel_partial_factor"}


def test_bars_beyond_the_middle_are_refused():
    with pytest.raises(ValueError, match="cover_inner and half of bar_diameter_inner must be below half the thickness"):
        interaction(section(cover_inner=0.2), THICKNESS)
