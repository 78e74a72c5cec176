"""What both models of finite elements are made of: whole movements, even loads, tangents, factors in a band."""

import numpy as np
import pytest
from rings import case_3_pressures, ground, largest, ring
from scipy import sparse

from structure import BeamSpringLining, ContinuumLining, LiningFailure
from structure.banded import BandedTangent, Mechanism, folded
from structure.lining import THETA

FREE = dict(ground=None, balance_uplift=True)
#: Nodes and lines lie between the angles of the response.
MODELS = {
    "beams": lambda **changes: BeamSpringLining(ring(n_elements=101, **changes)),
    "continuum": lambda **changes: ContinuumLining(ring(**changes), columns=101),
    "strip": lambda **changes: ContinuumLining(ring(**changes), columns=101, joint="equivalent_strip"),
}
ALL = pytest.mark.parametrize("model", MODELS)


@ALL
def test_ring_that_moves_as_a_whole_is_read_so_and_bears_nothing(model):
    lining = MODELS[model]()
    angle = np.radians(THETA)
    expected = {0: (np.sin(angle), np.cos(angle)), 1: (np.cos(angle), -np.sin(angle)), 2: (0 * angle, 1 + 0 * angle)}
    for way, movements in expected.items():
        for part, movement in zip(lining.readings.movement, movements, strict=True):
            # 3e-5: between nodes beams turn as their chord does, (span/2)^2/2 on a circle of 101 chords, and its
            # columns are quadratic; of a thick section (t/R)^2/12 is left in the mean of a turn.
            np.testing.assert_allclose(part @ lining.parts.rigid[way], movement, atol=6e-4 if way == 2 else 3e-5)
        # 1e-6 of the force that a strain of 1/R would make: rounding of stiffnesses of 1e10 times 1 m.
        for part in lining.readings.forces:
            assert largest(part @ lining.parts.rigid[way]) < 1e-6 * lining.ring.axial_stiffness / 3.125
        # 1e-5: the mean is the whole movement, without the two others; elements of unequal length leave (span)^2/12 of
        # their difference, a few per cent.
        np.testing.assert_allclose(lining.parts.mean @ lining.parts.rigid[way], np.eye(3)[way], atol=1e-5)


@pytest.mark.parametrize("model", [*MODELS, "slot"])
def test_even_loads_have_one_resultant_each(model):
    if model == "slot":
        lining = ContinuumLining(ring(joint_angles=(), **FREE), columns=101, gate=(20.0, 0.8))
    else:
        lining = MODELS[model](**FREE)
    # 1e-12: solved to rounding, also where the face is not closed.
    np.testing.assert_allclose(lining._even @ lining.parts.rigid.T, np.eye(3), atol=1e-12)
    assert lining._uplift @ lining.parts.rigid[1] == pytest.approx(1, rel=1e-12)


LAWS = {
    "linear": {},
    "centre line": dict(ground=ground(slip_at="centre_line")),
    "contact only": dict(joint_contact_only=True),
    "gaping": dict(joint_contact_height=0.175),
    "sliding": dict(joint_friction_coefficient=0.1),
}


@pytest.mark.parametrize(
    ("model", "law"), [*(("beams", law) for law in LAWS), ("continuum", "linear"), ("continuum", "centre line")]
)
def test_factors_are_those_of_the_slope_of_the_residual(model, law):
    equilibrium = MODELS[model](**LAWS[law])._equilibrium
    rng = np.random.default_rng(7)
    size = len(equilibrium.parts.arm)
    at = 1e-3 * equilibrium.parts.rigid[0] + 5e-5 * rng.uniform(-1, 1, size)
    way, step = rng.uniform(-1, 1, size) / equilibrium.parts.arm, 1e-9
    ends = [equilibrium.residual(at + sign * step * way, 0 * at, equilibrium.unslipped)[0] for sign in (1, -1)]
    solve = equilibrium.tangent.factor(equilibrium.residual(at, 0 * at, equilibrium.unslipped)[1])
    # 1e-3 of the largest: the difference loses seven digits, times the softness of a ring whose joints are open.
    np.testing.assert_allclose(solve(-(ends[0] - ends[1]) / (2 * step)), way, atol=1e-3)


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("tied", [True, False])
def test_band_solves_as_a_full_matrix_does(symmetric, tied):
    rng = np.random.default_rng(3)
    size, count = 40, 12
    node = np.arange(size)
    around = sparse.coo_array((rng.uniform(-1, 0, size), (node, (node + 1) % size)), shape=(size, size))
    constant = (around + around.T + sparse.diags_array(np.full(size, 5.0))).tocsr()
    neighbours = np.stack([node[:count], node[1 : count + 1]], axis=1)
    place = (np.repeat(np.arange(count), 2), neighbours.ravel())
    rows = sparse.coo_array((rng.uniform(0.1, 1, 2 * count), place), shape=(count, size)).tocsr()
    pairs = np.stack([np.arange(count), np.arange(count) if symmetric else np.roll(np.arange(count), 1)], axis=1)
    pairs = pairs[1:]  # the first of the rolled ones would join both ends of the chain
    ties = sparse.csr_array(np.eye(size)[[3, 20]] - np.eye(size)[[30, 9]]) if tied else None
    held = np.array([5, 17])
    band = BandedTangent(constant, rows, pairs, folded(size), held, symmetric, ties)
    coefficients = rng.uniform(0, 2, len(pairs))
    full = constant.toarray() + rows.toarray()[pairs[:, 0]].T @ (coefficients[:, None] * rows.toarray()[pairs[:, 1]])
    of_ties = np.array([4.0, 0.5]) if tied else np.zeros(0)
    full += (ties.T @ (of_ties[:, None] * ties.toarray())) if tied else 0.0
    free = np.setdiff1d(node, held)
    right = rng.uniform(-1, 1, size)
    right[held] = 0
    expected = np.zeros(size)
    expected[free] = np.linalg.solve(full[np.ix_(free, free)], right[free])
    np.testing.assert_allclose(band.factor(np.append(coefficients, of_ties))(right), expected, atol=1e-13)
    assert band.width < 6


@pytest.mark.parametrize("symmetric", [True, False])
def test_motion_of_a_mechanism_costs_no_force(symmetric):
    size = 30
    node = np.arange(size)
    chain = np.eye(size) - np.roll(np.eye(size), 1, axis=1)
    stiffness = chain.T @ chain  # a closed chain of springs: free to move as a whole
    nothing = sparse.csr_array((0, size)), np.zeros((0, 2), dtype=int)
    band = BandedTangent(sparse.csr_array(stiffness), *nothing, folded(size), node[:0], symmetric)
    with pytest.raises(Mechanism) as mechanism:
        band.factor(np.zeros(0))
    # 1e-6: inverse iteration on a matrix that is 1e-9 stiffer
    np.testing.assert_allclose(mechanism.value.motion / mechanism.value.motion[0], 1.0, atol=1e-6)


@pytest.mark.parametrize("columns", [45, 360])
def test_hinged_continuum_ring_is_a_mechanism_on_any_mesh(columns):
    hinged = ring(joint_rotational_stiffness=0.0, **FREE)
    with pytest.raises(LiningFailure, match=r"mechanism.* joint \d \(\d+ degrees\) turns most freely"):
        ContinuumLining(hinged, columns=columns).respond(case_3_pressures())


def test_continuum_ring_whose_stiffness_is_lost_in_rounding_is_refused():
    thin = ring(outer_diameter=6.251, inner_diameter=6.249, joint_angles=(), concrete_unit_weight=0.0, **FREE)
    with pytest.raises(LiningFailure, match="too thin for this mesh"):
        ContinuumLining(thin).respond(case_3_pressures(1e-7))


@pytest.mark.parametrize("model", ["beams", "continuum"])
def test_failure_of_any_model_says_where_and_which_joint(model):
    with pytest.raises(LiningFailure, match=r"m at 1\d\d[.\d]* degrees.*; joint \d .*; soil springs press on \d+% of"):
        MODELS[model]().respond(case_3_pressures(10.0))
