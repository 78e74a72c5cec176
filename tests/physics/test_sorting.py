"""The list of points by element, repaired after points have moved, against sorting anew."""

import numpy as np
import pytest

from mpm.step.sort import sort_by_element, update_order


@pytest.mark.parametrize("removed", [0.0, 0.3])
def test_points_are_listed_with_the_element_that_holds_them_after_any_move(removed):
    rng = np.random.default_rng(5)
    n_elements, n_points = 40, 90
    element = rng.integers(0, n_elements, n_points).astype(np.int32)
    start, order, occupied = (np.zeros(n, np.int32) for n in (n_elements + 1, n_points, n_elements))
    spare = start.copy(), order.copy()
    counts = sort_by_element(element, n_elements, start, order, occupied)
    for _ in range(60):
        lowest = rng.integers(0, n_elements - 5)  # moves within a few elements leave the others where they are
        inside = np.flatnonzero((element >= lowest) & (element < lowest + rng.integers(2, n_elements)))
        moved = np.sort(rng.permutation(inside)[: rng.integers(1, 12)]).astype(np.int32)
        if not len(moved):
            continue
        origin = element[moved]
        element[moved] = rng.integers(lowest, n_elements, len(moved))
        element[moved[rng.random(len(moved)) < removed]] = -1
        counts = update_order(element, moved, origin, len(moved), start, order, occupied, counts[0], *spare)
        anew = np.zeros_like(start), np.zeros_like(order), np.zeros_like(occupied)
        expected = sort_by_element(element, n_elements, *anew)
        assert counts == expected
        np.testing.assert_array_equal(start, anew[0])
        np.testing.assert_array_equal(order[: counts[1]], anew[1][: counts[1]])
        np.testing.assert_array_equal(occupied[: counts[0]], anew[2][: counts[0]])
