"""The list of points by element, repaired after points have moved, against sorting anew."""

import numba
import numpy as np
import pytest

from mpm.step.sort import ascend, sort_by_element, update_order


@pytest.mark.parametrize("removed", [0.0, 0.3])
def test_points_are_listed_with_the_element_that_holds_them_after_any_move(removed):
    rng = np.random.default_rng(5)
    n_elements, n_points = 40, 90
    element = rng.integers(0, n_elements, n_points).astype(np.int32)
    start, order, occupied = (np.zeros(n, np.int32) for n in (n_elements + 1, n_points, n_elements))
    spare = order.copy()
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
        keys = (moved.astype(np.int64) << 32) + origin
        counts = update_order(element, keys, len(keys), start, order, occupied, counts[0], spare)
        anew = np.zeros_like(start), np.zeros_like(order), np.zeros_like(occupied)
        expected = sort_by_element(element, n_elements, *anew)
        assert counts == expected
        np.testing.assert_array_equal(start, anew[0])
        np.testing.assert_array_equal(order[: counts[1]], anew[1][: counts[1]])
        np.testing.assert_array_equal(occupied[: counts[0]], anew[2][: counts[0]])


def test_whole_numbers_are_sorted_like_numpy_does():
    sort = numba.njit(ascend.py_func)  # a kernel's part has no code of its own to call
    rng = np.random.default_rng(3)
    for count in (0, 1, 2, 3, 10, 257):
        keys = rng.integers(0, 100, count + 2)
        expected = np.concatenate([np.sort(keys[:count]), keys[count:]])
        sort(keys, count)
        np.testing.assert_array_equal(keys, expected)
