"""Tangent stiffness of a ring in a narrow band, and its factors: Cholesky where it is symmetric, LU where it is not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.linalg import lapack

#: What turns forces on the unknowns into displacements, (n,) to (n,).
Solver = Callable[[np.ndarray], np.ndarray]

#: A pivot this much below its diagonal is rounding: the structure is a mechanism. Sound rings stay above 1e-9.
SMALLEST_PIVOT = 1e-13
#: Added to the scaled diagonal to see how a mechanism moves: above rounding, below every sound pivot.
SHIFT = 1e-9


class Mechanism(ArithmeticError):
    """The tangent is singular; `motion` is a displacement that costs (almost) no force, (n,) float64."""

    def __init__(self, motion: np.ndarray):
        super().__init__("the ring is a mechanism")
        self.motion = motion


def softest_motion(solve: Solver, scale: np.ndarray) -> tuple[float, np.ndarray]:
    """Smallest eigenvalue of a matrix scaled by 1/`scale` on both sides, and its motion, largest entry one.

    Inverse iteration from a fixed random start; six steps settle the order of magnitude.
    """
    vector = np.random.default_rng(0).standard_normal(len(scale))
    eigenvalue = np.inf
    for _ in range(6):
        vector /= np.linalg.norm(vector)
        following = scale * solve(scale * vector)
        product = vector @ following
        eigenvalue = 1 / product if product != 0 else np.inf
        vector = following
    motion = vector / scale
    return abs(eigenvalue), motion / np.abs(motion).max()


def folded(count: int) -> np.ndarray:
    """(count,) place of each node of a ring that is folded flat: neighbours are two places apart at most."""
    node = np.arange(count)
    return np.where(2 * node < count, 2 * node, 2 * (count - node) - 1)


def row_products(rows: sparse.csr_array, pairs: np.ndarray):
    """Products of all entries of one row with all of another, for pairs of rows (n_pairs, 2).

    Returns
    -------
    first, second : (n_products,) int
        Columns of the two entries.
    value : (n_products,) float64
    pair : (n_products,) int
    """
    counts = np.diff(rows.indptr)
    one, other = pairs.T
    each = counts[one] * counts[other]
    pair = np.repeat(np.arange(len(pairs)), each)
    within = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
    left = rows.indptr[one[pair]] + within // counts[other[pair]]
    right = rows.indptr[other[pair]] + within % counts[other[pair]]
    return rows.indices[left], rows.indices[right], rows.data[left] * rows.data[right], pair


class BandedTangent:
    """A constant matrix, and products of rows times coefficients that change, in a band that LAPACK factors.

    Parameters
    ----------
    constant : (n, n) sparse
    rows : (n_rows, n) sparse
        Springs, as what they feel of the unknowns.
    pairs : (n_coefficients, 2) int
        Coefficient k adds itself times the product of the rows pairs[k].
    place : (n,) int
        Place of each unknown in the band.
    held : (n_held,) int
        Unknowns held at zero.
    symmetric : bool
    ties : (n_ties, n) sparse, optional
        Elongation of springs between places far apart, which would widen the band: they join in as a low-rank update
        of its factors (Woodbury); their stiffnesses are the last coefficients.
    """

    def __init__(self, constant, rows, pairs, place, held, symmetric: bool, ties=None):
        self.place, self.symmetric = place, symmetric
        self.size = len(place)
        free = np.ones(self.size)
        free[held] = 0.0
        entries = constant.tocoo()
        parts = [(entries.row, entries.col, entries.data, None), row_products(rows.tocsr(), pairs)]
        placed = []
        for first, second, value, coefficient in parts:
            value, below = value * free[first] * free[second], place[first] - place[second]
            kept = (value != 0) & ((below >= 0) | (not symmetric))
            kinds = None if coefficient is None else coefficient[kept]
            placed.append((below[kept], place[second][kept], value[kept], kinds))
        self.width = int(max(np.abs(below).max(initial=0) for below, *_ in placed))
        #: Row of the diagonal; above it LU has the upper half and as many rows for its fill.
        self.main = 0 if symmetric else 2 * self.width
        shape = (self.main + self.width + 1, self.size)
        self.band = np.zeros(shape, order="F")
        (below, column, value, _), (row, at, product, coefficient) = placed
        np.add.at(self.band, (self.main + below, column), value)
        self.band[self.main, place[held]] = constant.diagonal().max()
        where = np.ravel_multi_index((self.main + row, at), shape, order="F")
        self._touched, compact = np.unique(where, return_inverse=True)
        self._products = sparse.coo_array(
            (product, (compact, coefficient)), shape=(len(self._touched), len(pairs))
        ).tocsr()
        self._ties = None if ties is None else np.asfortranarray((ties * free).T.toarray())
        self._constant: Solver | None = None

    def factor(self, coefficients: np.ndarray) -> Solver:
        """Solver of the tangent with these coefficients.

        Raises
        ------
        Mechanism
            The matrix is singular up to rounding, or not positive definite where it is symmetric.
        """
        if self._constant is not None:
            return self._constant
        banded = coefficients if self._ties is None else coefficients[: -self._ties.shape[1]]
        solve = self._cholesky(banded) if self.symmetric else self._lu(banded)
        if self._ties is not None:
            solve = self._tied(solve, coefficients[-self._ties.shape[1] :])
        if not len(coefficients):
            self._constant = solve
        return solve

    def _cholesky(self, coefficients, shift=0.0):
        band = self._assembled(coefficients)
        diagonal = band[0].copy()
        band[0] += shift * diagonal
        factor, failed = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        solve = self._placed(lambda right: lapack.dpbtrs(factor, right, lower=1)[0])
        if not shift and (failed or np.min(factor[0] ** 2 / diagonal) < SMALLEST_PIVOT):
            raise self._mechanism(self._cholesky(coefficients, SHIFT), diagonal)
        return solve if not failed else None

    def _lu(self, coefficients, shift=0.0):
        """Rows and columns are scaled to a diagonal of one, of which pivots then are shares.

        Where faces lean, friction may turn the sign of a diagonal.
        """
        band, width, main = self._assembled(coefficients), self.width, self.main
        diagonal = np.abs(band[main])
        diagonal = np.where(diagonal > 0, diagonal, 1.0)
        scale = 1 / np.sqrt(diagonal)
        for offset in range(-width, width + 1):
            columns = np.arange(max(0, -offset), self.size - max(0, offset))
            band[main + offset, columns] *= scale[columns] * scale[columns + offset]
        band[main] += shift
        factor, pivots, failed = lapack.dgbtrf(band, width, width, overwrite_ab=1)
        solve = self._placed(
            lambda right: (lapack.dgbtrs(factor, width, width, (right.T * scale).T, pivots)[0].T * scale).T
        )
        if not shift and (failed or np.abs(factor[main]).min() < SMALLEST_PIVOT):
            raise self._mechanism(self._lu(coefficients, SHIFT), diagonal)
        return solve if not failed else None

    def _assembled(self, coefficients):
        band = self.band.copy(order="F")
        band.reshape(-1, order="F")[self._touched] += self._products @ coefficients
        return band

    def _mechanism(self, shifted, diagonal):
        """The failure, with the motion that a slightly stiffer matrix leaves easiest; unknown where that fails too."""
        if shifted is None:
            return Mechanism(np.full(self.size, np.nan))
        return Mechanism(softest_motion(shifted, np.sqrt(diagonal)[self.place])[1])

    def _placed(self, solve):
        def solve_in_place(right):
            ordered = np.empty_like(right, order="F")
            ordered[self.place] = right
            return solve(ordered)[self.place]

        return solve_in_place

    def _tied(self, solve, stiffness):
        by_tie = solve(self._ties)
        coupling = np.eye(len(stiffness)) + stiffness[:, None] * (self._ties.T @ by_tie)

        def solve_tied(right):
            step = solve(right)
            return step - by_tie @ np.linalg.solve(coupling, stiffness * (self._ties.T @ step))

        return solve_tied
