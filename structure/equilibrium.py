"""Equilibrium of a ring of beams in nonlinear soil springs: Newton's method with banded Cholesky factors."""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from structure.beam_geometry import RingMesh, constant_stiffness
from structure.ring import Ring
from structure.springs import soil_reaction, soil_springs

#: Out-of-balance force at a node over the sum of all nodal loads at which Newton stops.
RESIDUAL_TOLERANCE = 1e-11
#: Roundings of the largest product in a row of the stiffness, of 18 terms, that no out-of-balance force gets below.
ROUNDINGS = 8
MAX_ITERATIONS = 100
#: Displacement over outer radius beyond which small displacements no longer describe the ring.
LARGEST_DISPLACEMENT = 0.1
#: Share of the initial spring stiffness kept in the *tangent* only (never in the reaction) of an open or yielded
#: spring: it keeps a ring that has lost contact on one side factorisable, and slows convergence by no more than this
#: factor an iteration.
TANGENT_FLOOR = 1e-6
#: A pivot this much below its diagonal is rounding: the structure is a mechanism. Sound rings stay above 1e-9.
SMALLEST_PIVOT = 1e-13
#: Neighbours in the folded numbering are two nodes apart, with three unknowns each.
BANDWIDTH = 8


class NoEquilibrium(ArithmeticError):
    """Newton's method found no equilibrium; the message says what went wrong."""


class RingEquilibrium:
    """Finds displacements under nodal forces; unknowns as in :mod:`structure.beam_geometry`.

    Parameters
    ----------
    ring : Ring
    mesh : RingMesh
    held : (n_held,) int
        Unknowns held at zero.
    """

    def __init__(self, ring: Ring, mesh: RingMesh, held: np.ndarray):
        self.largest = LARGEST_DISPLACEMENT * ring.outer_radius
        on_face = ring.ground is not None and ring.ground.slip_at == "outer_face"
        self.lever = ring.thickness / 2 if on_face else 0.0
        self.centre_radius = ring.centre_radius
        self.area = ring.outer_radius * mesh.node_span
        self.springs = soil_springs(ring) if ring.ground is not None else None
        self.stiffness = constant_stiffness(ring, mesh)
        self.magnitudes = abs(self.stiffness)
        self.held = held
        size = 3 * mesh.n_nodes
        nodes = np.arange(mesh.n_nodes)
        # Folding the ring flat puts both neighbours of a node within two places and closes the ring inside the band.
        folded = np.where(2 * nodes < mesh.n_nodes, 2 * nodes, 2 * (mesh.n_nodes - nodes) - 1)
        self.place = (3 * folded[:, None] + np.arange(3)).ravel()
        self.band = self._constant_band(size)

    def _constant_band(self, size: int) -> np.ndarray:
        matrix = self.stiffness.tocoo()
        free = ~np.isin(matrix.row, self.held) & ~np.isin(matrix.col, self.held)
        row, column = self.place[matrix.row], self.place[matrix.col]
        lower = free & (row >= column)
        band = np.zeros((BANDWIDTH + 1, size), order="F")
        np.add.at(band, (row[lower] - column[lower], column[lower]), matrix.data[lower])
        band[0, self.place[self.held]] = self.stiffness.diagonal().max()
        return band

    def spring_forces(self, displacement: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Nodal forces of the soil on the ring (n_nodes, 3); normal and tangential tangents times area [N/m2].

        The area is that of the outer face; slip there is the tangential displacement plus half the thickness times
        the rotation.
        """
        forces = np.zeros((len(self.area), 3))
        if self.springs is None:
            return forces, (forces[:, 0], forces[:, 0])
        nodal = displacement.reshape(-1, 3)
        normal, tangential = self.springs
        pressure, normal_tangent = soil_reaction(nodal[:, 0], normal)
        friction, slip_tangent = soil_reaction(nodal[:, 1] + self.lever * nodal[:, 2], tangential)
        forces[:, 0] = -self.area * pressure
        forces[:, 1] = -self.area * friction
        forces[:, 2] = self.lever * forces[:, 1]
        floor = TANGENT_FLOOR * normal.stiffness
        return forces, (
            self.area * np.maximum(normal_tangent, floor),
            self.area * np.maximum(slip_tangent, floor),
        )

    def residual(self, displacement: np.ndarray, loads: np.ndarray):
        """Out-of-balance nodal forces, zero where held, and the spring tangents."""
        spring, tangents = self.spring_forces(displacement)
        out_of_balance = loads + spring.ravel() - self.stiffness @ displacement
        out_of_balance[self.held] = 0
        return out_of_balance, tangents

    def _direction(self, out_of_balance: np.ndarray, tangents) -> np.ndarray:
        band = self.band.copy(order="F")
        normal, slip = tangents
        radial, tangential, rotation = self.place.reshape(-1, 3).T
        band[0, radial] += normal
        band[0, tangential] += slip
        band[1, tangential] += self.lever * slip
        band[0, rotation] += self.lever**2 * slip
        diagonal = band[0].copy()
        factor, failed = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        if failed or np.min(factor[0] ** 2 / diagonal) < SMALLEST_PIVOT:
            raise NoEquilibrium("the ring is a mechanism: joints too weak to hold it without more ground")
        right = np.empty_like(out_of_balance)
        right[self.place] = out_of_balance
        step, _ = lapack.dpbtrs(factor, right, lower=1)
        return step[self.place]

    def solve(self, loads: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Displacements in equilibrium with nodal loads, from a first guess.

        Newton's method; where a full step overshoots (the work of the residual along it changes sign and does not
        halve), the root of that work along the step is found by bisection. The forces derive from a convex energy, so
        this cannot cycle.
        """
        nodal = loads.reshape(-1, 3)
        scale = np.abs(nodal[:, :2]).sum() + np.abs(nodal[:, 2]).sum() / self.centre_radius
        tolerance = RESIDUAL_TOLERANCE * scale
        displacement = start.copy()
        out_of_balance, tangents = self.residual(displacement, loads)
        for _ in range(MAX_ITERATIONS):
            rounding = ROUNDINGS * np.finfo(float).eps * (self.magnitudes @ np.abs(displacement)).max()
            if np.abs(out_of_balance).max() <= max(tolerance, rounding):
                return displacement
            step = self._direction(out_of_balance, tangents)
            displacement, out_of_balance, tangents = self._advance(displacement, step, out_of_balance, loads)
            largest = np.abs(displacement.reshape(-1, 3)[:, :2]).max()
            if not largest <= self.largest:
                raise NoEquilibrium(
                    f"displacements reach {largest:.3g} m, beyond {self.largest:.3g} m (a tenth of the outer radius):"
                    " the ground cannot carry the loads, or the joints are too weak"
                )
        raise NoEquilibrium(
            f"the largest out-of-balance force is still {np.abs(out_of_balance).max():.3g} N/m after {MAX_ITERATIONS}"
            f" iterations (wanted {tolerance:.3g}): the loads are close to what the ground can carry"
        )

    def _advance(self, displacement, step, out_of_balance, loads):
        work = out_of_balance @ step
        low, high, share = 0.0, 1.0, 1.0
        for _ in range(30):
            moved = displacement + share * step
            residual, tangents = self.residual(moved, loads)
            left = residual @ step
            if left >= -0.5 * work:
                if share == 1.0 or left <= 0.5 * work:
                    break
                low = share
            else:
                high = share
            share = (low + high) / 2
        return moved, residual, tangents
