"""Equilibrium of a continuum ring in nonlinear soil springs: Newton's method with banded Cholesky factors."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.linalg import lapack

from structure.banded import SMALLEST_PIVOT
from structure.equilibrium import LARGEST_DISPLACEMENT, MAX_ITERATIONS, RESIDUAL_TOLERANCE, NoEquilibrium, convex_step
from structure.ring import Ring
from structure.ring_forces import TANGENT_FLOOR
from structure.springs import soil_reaction, soil_springs

#: Roundings of the largest product in a row of the stiffness (up to 60 terms) that residuals cannot get below.
ROUNDINGS = 16


class SpringEquilibrium:
    """Finds displacements under nodal forces.

    Parameters
    ----------
    ring : Ring
    stiffness : (n, n) sparse
        Of concrete and joints, symmetric.
    feel, area : (n_springs, n) sparse, (n_springs,) float64
        From :func:`structure.continuum_face.spring_feelers`; the first half normal springs.
    place : (n,) int
        Place of each unknown in the band.
    held : (n_held,) int
        Unknowns held at zero.
    ties : (n_ties, n) sparse, optional
        Elongation of springs between places far apart, which would widen the band: they join in as a low-rank update
        of its factors (Woodbury).
    tie_stiffness : float
        Of each [N/m per m].
    """

    def __init__(
        self, ring: Ring, stiffness, feel, area, place: np.ndarray, held: np.ndarray, ties=None, tie_stiffness=0.0
    ):
        self.largest = LARGEST_DISPLACEMENT * ring.outer_radius
        self.ties, self.tie_stiffness = ties, tie_stiffness
        whole = stiffness if ties is None else (stiffness + tie_stiffness * (ties.T @ ties)).tocsr()
        self.stiffness, self.magnitudes = whole, abs(whole)
        self.held, self.place = held, place
        self.springs = soil_springs(ring) if ring.ground is not None else None
        self.feel, self.area = feel, area
        self.pull = feel.T.tocsr()
        self.iterations: list[int] = []
        self.residuals: list[float] = []
        free = np.ones(stiffness.shape[0])
        free[held] = 0.0
        constant = _lower_part(stiffness, place, free)
        products = self._spring_products(free) if self.springs is not None else None
        self.bandwidth = int(max(part[0].max() for part in (constant, products) if part is not None))
        shape = (self.bandwidth + 1, stiffness.shape[0])
        self.band = np.zeros(shape, order="F")
        np.add.at(self.band, constant[:2], constant[2])
        self.band[0, place[held]] = stiffness.diagonal().max()
        self._factor = None
        if ties is not None:
            self._tied = np.zeros((stiffness.shape[0], ties.shape[0]), order="F")
            self._tied[place] = (ties * free).T.toarray()
        if products is not None:
            below, column, value, spring = products
            where = np.ravel_multi_index((below, column), shape, order="F")
            self._touched, compact = np.unique(where, return_inverse=True)
            self._spring_band = sparse.coo_array(
                (value, (compact, spring)), shape=(len(self._touched), len(area))
            ).tocsr()

    def _spring_products(self, free):
        """Band place, value per spring tangent, and spring of every product of two entries of a feeler."""
        feel = self.feel.tocsr()
        counts = np.diff(feel.indptr)
        parts = []
        for width in np.unique(counts[counts > 0]):
            rows = np.flatnonzero(counts == width)
            entries = feel.indptr[rows][:, None] + np.arange(width)
            unknowns = feel.indices[entries]
            values = feel.data[entries] * free[unknowns]
            left, right = np.repeat(unknowns, width, axis=1).ravel(), np.tile(unknowns, (1, width)).ravel()
            product = (values[:, :, None] * values[:, None, :]).ravel()
            spring = np.repeat(rows, width**2)
            below = self.place[left] - self.place[right]
            lower = (below >= 0) & (product != 0)
            parts.append((below[lower], self.place[right][lower], product[lower], spring[lower]))
        return tuple(np.concatenate(columns) for columns in zip(*parts, strict=True))

    def spring_forces(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Nodal forces of the soil on the ring, (n,), and tangents times area (n_springs,) [N/m2]."""
        if self.springs is None:
            return np.zeros_like(displacement), np.zeros(0)
        reaction, tangent = self.reactions(displacement)
        return -(self.pull @ (self.area * reaction)), self.area * tangent

    def reactions(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Reaction of the soil [Pa] and its tangent [Pa/m] at every spring, (n_springs,)."""
        felt = np.split(self.feel @ displacement, 2)
        pairs = [soil_reaction(part, spring) for part, spring in zip(felt, self.springs, strict=True)]
        floor = TANGENT_FLOOR * self.springs[0].stiffness
        return np.concatenate([pair[0] for pair in pairs]), np.maximum(np.concatenate([p[1] for p in pairs]), floor)

    def residual(self, displacement: np.ndarray, loads: np.ndarray):
        """Out-of-balance nodal forces, zero where held, and the spring tangents."""
        springs, tangents = self.spring_forces(displacement)
        out_of_balance = loads + springs - self.stiffness @ displacement
        out_of_balance[self.held] = 0
        return out_of_balance, tangents

    def _factorised(self, tangents: np.ndarray) -> np.ndarray:
        if self._factor is not None and self.springs is None:
            return self._factor
        band = self.band.copy(order="F")
        if self.springs is not None:
            flat = band.reshape(-1, order="F")
            flat[self._touched] += self._spring_band @ tangents
        diagonal = band[0].copy()
        self._factor, failed = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        if failed or np.min(self._factor[0] ** 2 / diagonal) < SMALLEST_PIVOT:
            tied = "" if self.ties is None else " (its bolts left aside)"
            raise NoEquilibrium(f"the ring is a mechanism{tied}: joints too weak to hold it without more ground")
        return self._factor

    def _direction(self, out_of_balance: np.ndarray, tangents: np.ndarray) -> np.ndarray:
        right = np.empty_like(out_of_balance)
        right[self.place] = out_of_balance
        factor = self._factorised(tangents)
        step, _ = lapack.dpbtrs(factor, right, lower=1)
        if self.ties is not None:
            by_tie, _ = lapack.dpbtrs(factor, self._tied, lower=1)
            compliance = np.eye(self._tied.shape[1]) / self.tie_stiffness + self._tied.T @ by_tie
            step = step - by_tie @ np.linalg.solve(compliance, self._tied.T @ step)
        return step[self.place]

    def solve(self, loads: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Displacements in equilibrium with nodal loads, from a first guess.

        Appends their number to `iterations`; `residuals` are the largest out-of-balance forces of this solution [N/m].

        Newton's method with the line search of :class:`structure.equilibrium.RingEquilibrium`: the forces derive from
        a convex energy, so it cannot cycle.

        Raises
        ------
        NoEquilibrium
            A mechanism, displacements beyond the theory, or no convergence.
        """
        tolerance = RESIDUAL_TOLERANCE * np.abs(loads).sum()
        displacement = start.copy()
        out_of_balance, tangents = self.residual(displacement, loads)
        self.residuals = []
        for iteration in range(MAX_ITERATIONS):
            rounding = ROUNDINGS * np.finfo(float).eps * (self.magnitudes @ np.abs(displacement)).max()
            self.residuals.append(float(np.abs(out_of_balance).max()))
            if self.residuals[-1] <= max(tolerance, rounding):
                self.iterations.append(iteration)
                return displacement
            step = self._direction(out_of_balance, tangents)
            displacement, out_of_balance, tangents = convex_step(
                lambda moved: self.residual(moved, loads), displacement, step, out_of_balance
            )
            largest = np.abs(displacement).max()
            if not largest <= self.largest:
                raise NoEquilibrium(
                    f"displacements reach {largest:.3g} m, beyond {self.largest:.3g} m (a tenth of the outer radius):"
                    " the ground cannot carry the loads, or the joints are too weak"
                )
        raise NoEquilibrium(
            f"the largest out-of-balance force is still {np.abs(out_of_balance).max():.3g} N/m after {MAX_ITERATIONS}"
            f" iterations (wanted {tolerance:.3g}): the loads are close to what the ground can carry"
        )


def _lower_part(matrix, place, free):
    """Row below the diagonal, column and value of the lower band of a symmetric matrix in the band's order."""
    entries = matrix.tocoo()
    value = entries.data * free[entries.row] * free[entries.col]
    below = place[entries.row] - place[entries.col]
    lower = (below >= 0) & (value != 0)
    return below[lower], place[entries.col][lower], value[lower]
