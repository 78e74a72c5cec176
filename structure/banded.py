"""Factors of a ring's tangent stiffness in a narrow band: Cholesky where it is symmetric, LU where it is not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.linalg import lapack

#: A pivot this much below its diagonal is rounding: the structure is a mechanism. Sound rings stay above 1e-9.
SMALLEST_PIVOT = 1e-13
#: Neighbours in the folded numbering are two nodes apart, with three unknowns each.
BANDWIDTH = 8
#: Added to the scaled diagonal to see how a mechanism moves: above rounding, below every sound pivot.
SHIFT = 1e-9


class Mechanism(ArithmeticError):
    """The tangent is singular; `motion` is a displacement that costs (almost) no force, (size,) float64."""

    def __init__(self, motion: np.ndarray):
        super().__init__("the ring is a mechanism")
        self.motion = motion


def softest_motion(solve: Callable[[np.ndarray], np.ndarray], scale: np.ndarray) -> tuple[float, np.ndarray]:
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


class FoldedRing:
    """Numbering that closes a ring of nodes inside a narrow band, and solves in it.

    Folding the ring flat puts both neighbours of a node within two places.

    Parameters
    ----------
    n_nodes : int
        Nodes around the ring, three unknowns each.
    held : (n_held,) int
        Unknowns held at zero.
    """

    def __init__(self, n_nodes: int, held: np.ndarray):
        nodes = np.arange(n_nodes)
        folded = np.where(2 * nodes < n_nodes, 2 * nodes, 2 * (n_nodes - nodes) - 1)
        self.place = (3 * folded[:, None] + np.arange(3)).ravel()
        self.held = held
        self.size = 3 * n_nodes

    def lower_band(self, matrix: sparse.csr_array) -> np.ndarray:
        """Lower triangle of a symmetric matrix, (BANDWIDTH + 1, size); held unknowns get a diagonal only."""
        entries, row, column = self._free_entries(matrix)
        lower = row >= column
        band = np.zeros((BANDWIDTH + 1, self.size), order="F")
        np.add.at(band, (row[lower] - column[lower], column[lower]), entries[lower])
        band[0, self.place[self.held]] = matrix.diagonal().max()
        return band

    def full_band(self, matrix: sparse.csr_array) -> np.ndarray:
        """The matrix as LAPACK's banded LU wants it, (3 BANDWIDTH + 1, size), the first rows left for its fill."""
        entries, row, column = self._free_entries(matrix)
        band = np.zeros((3 * BANDWIDTH + 1, self.size), order="F")
        np.add.at(band, (2 * BANDWIDTH + row - column, column), entries)
        band[2 * BANDWIDTH, self.place[self.held]] = matrix.diagonal().max()
        return band

    def _free_entries(self, matrix):
        entries = matrix.tocoo()
        free = ~np.isin(entries.row, self.held) & ~np.isin(entries.col, self.held)
        return entries.data[free], self.place[entries.row[free]], self.place[entries.col[free]]

    def cholesky(self, band: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Solver from a lower band, which is overwritten.

        Raises
        ------
        Mechanism
            The matrix is not positive definite by more than rounding.
        """
        diagonal = band[0].copy()
        untouched = band.copy(order="F")
        factor, failed = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        if failed or np.min(factor[0] ** 2 / diagonal) < SMALLEST_PIVOT:
            untouched[0] += SHIFT * diagonal
            shifted, worse = lapack.dpbtrf(untouched, lower=1)
            raise Mechanism(self._motion(lambda right: lapack.dpbtrs(shifted, right, lower=1)[0], diagonal, worse))
        return lambda right: self._folded(right, lambda folded: lapack.dpbtrs(factor, folded, lower=1)[0])

    def lu(self, band: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Solver from a full band, which is overwritten; rows and columns are scaled to a diagonal of one.

        Raises
        ------
        Mechanism
            The matrix is singular up to rounding.
        """
        diagonal = band[2 * BANDWIDTH].copy()
        scale = 1 / np.sqrt(diagonal)
        for offset in range(-BANDWIDTH, BANDWIDTH + 1):
            columns = np.arange(max(0, -offset), self.size - max(0, offset))
            band[2 * BANDWIDTH + offset, columns] *= scale[columns] * scale[columns + offset]
        untouched = band.copy(order="F")
        factor, pivots, failed = lapack.dgbtrf(band, BANDWIDTH, BANDWIDTH, overwrite_ab=1)
        if failed or np.abs(factor[2 * BANDWIDTH]).min() < SMALLEST_PIVOT:
            untouched[2 * BANDWIDTH] += SHIFT
            shifted, swaps, worse = lapack.dgbtrf(untouched, BANDWIDTH, BANDWIDTH)

            def solve_shifted(right):
                return scale * lapack.dgbtrs(shifted, BANDWIDTH, BANDWIDTH, scale * right, swaps)[0]

            raise Mechanism(self._motion(solve_shifted, diagonal, worse))
        return lambda right: self._folded(
            right, lambda folded: scale * lapack.dgbtrs(factor, BANDWIDTH, BANDWIDTH, scale * folded, pivots)[0]
        )

    def _folded(self, right, solve):
        folded = np.empty_like(right)
        folded[self.place] = right
        return solve(folded)[self.place]

    def _motion(self, solve, diagonal, failed):
        if failed:
            return np.full(self.size, np.nan)
        return softest_motion(solve, np.sqrt(diagonal))[1][self.place]
