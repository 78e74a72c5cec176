"""Equilibrium of a ring of beams in nonlinear soil springs and joints: Newton's method with banded factors."""

from __future__ import annotations

import numpy as np

from structure.banded import Mechanism, softest_motion
from structure.beam_geometry import RingMesh
from structure.ring import Ring
from structure.ring_forces import RingForces

#: Out-of-balance force at a node over the sum of all nodal loads at which Newton stops.
RESIDUAL_TOLERANCE = 1e-11
#: Roundings of the largest product in a row of the stiffness, of 18 terms, that no out-of-balance force gets below.
ROUNDINGS = 8
MAX_ITERATIONS = 100
#: Displacement over outer radius beyond which small displacements no longer describe the ring.
LARGEST_DISPLACEMENT = 0.1
#: Smallest eigenvalue of the tangent, scaled to a diagonal of one, of a ring that is held. Measured: mechanisms of 4 to
#: 6 hinges and sliding joints below 1.1e-15 (rounding); sound rings of 100 to 2000 elements above 1.9e-14 (1 mm thick).
SOFTEST = 2e-15
#: Smallest part of a load increment tried before a ring with nonlinear joints is given up.
SMALLEST_INCREMENT = 1 / 256
#: Smallest part of a Newton step tried.
SMALLEST_SHARE = 2.0**-10


class NoEquilibrium(ArithmeticError):
    """Newton's method found no equilibrium; the message says what went wrong and where."""


class RingEquilibrium(RingForces):
    """Finds displacements under nodal forces, of a ring that may be held at some unknowns."""

    def __init__(self, ring: Ring, mesh: RingMesh, held: np.ndarray):
        super().__init__(ring, mesh, held)
        self.largest = LARGEST_DISPLACEMENT * ring.outer_radius
        self.loose = self._mechanism() if ring.ground is None else ""

    def _mechanism(self) -> str:
        """How the undeformed ring can move without resistance, empty where it cannot.

        Asked once and not left to the loads: those in balance with a mechanism would hide it.
        """
        still = np.zeros(3 * self.mesh.n_nodes)
        tangents = self.residual(still, still, self.unslipped)[1]
        try:
            solver = self.solver(still, tangents, self.unslipped)
        except Mechanism as mechanism:
            return self.loose_place(mechanism.motion)
        softness, motion = softest_motion(solver, np.sqrt(self.magnitudes.diagonal()))
        return self.loose_place(motion) if softness < SOFTEST else ""

    def follow(
        self, loads: np.ndarray, start: np.ndarray, slip: np.ndarray, loads_before: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Displacements in equilibrium with nodal loads, from the state before.

        The increment is taken in one step; where nonlinear joints find no equilibrium so, in smaller ones, the slip
        of each kept.

        Parameters
        ----------
        loads, loads_before : (3 n_nodes,) float64
            Now, and those in equilibrium with `start`.
        start : (3 n_nodes,) float64
        slip : (n_joints,) float64
            Irreversible dislocations before [m].

        Returns
        -------
        displacement : (3 n_nodes,) float64
        slip : (n_joints,) float64
            Slips from which the last increment started: with them :meth:`joint_forces` gives the forces.
        """
        done, increment, displacement = 0.0, 1.0, start
        while True:
            target = min(1.0, done + increment)
            part = loads if target == 1.0 else loads_before + target * (loads - loads_before)
            try:
                reached = self.solve(part, displacement, slip)
            except NoEquilibrium as problem:
                increment /= 4
                if self.joints.linear:
                    raise
                if increment < SMALLEST_INCREMENT:
                    raise NoEquilibrium(f"{problem} ({done:.1%} of the load increment was reached)") from problem
                continue
            if target == 1.0:
                return reached, slip
            displacement, done = reached, target
            slip = self.joint_forces(displacement, slip).slip

    def solve(self, loads: np.ndarray, start: np.ndarray, slip: np.ndarray | None = None) -> np.ndarray:
        """Displacements in equilibrium with nodal loads, by Newton's method from a first guess."""
        if self.loose:
            raise NoEquilibrium(self.loose)
        slip = self.unslipped if slip is None else slip
        nodal = loads.reshape(-1, 3)
        scale = np.abs(nodal[:, :2]).sum() + np.abs(nodal[:, 2]).sum() / self.ring.centre_radius
        tolerance = RESIDUAL_TOLERANCE * scale
        displacement = start.copy()
        out_of_balance, tangents = self.residual(displacement, loads, slip)
        advance = self._advance_convex if self.joints.conservative else self._advance
        for _ in range(MAX_ITERATIONS):
            rounding = ROUNDINGS * np.finfo(float).eps * (self.magnitudes @ np.abs(displacement))
            if np.all(np.abs(out_of_balance) <= np.maximum(tolerance, rounding)):
                return displacement
            try:
                solver = self.solver(displacement, tangents, slip)
            except Mechanism as mechanism:
                raise NoEquilibrium(self.loose_place(mechanism.motion)) from mechanism
            displacement, out_of_balance, tangents = advance(displacement, solver, out_of_balance, loads, slip)
            largest = np.abs(displacement.reshape(-1, 3)[:, :2]).max()
            if not largest <= self.largest:
                worst = int(np.abs(displacement.reshape(-1, 3)[:, :2]).max(1).argmax())
                raise NoEquilibrium(
                    f"displacements reach {largest:.3g} m {self.place(worst)}, beyond {self.largest:.3g} m (a tenth of"
                    " the outer radius): the ground cannot carry the loads, or the joints are too weak"
                    + self.freest_joint(displacement)
                    + self.conditions(displacement, slip)
                )
        worst = int(np.abs(out_of_balance).argmax()) // 3
        raise NoEquilibrium(
            f"the largest out-of-balance force is still {np.abs(out_of_balance).max():.3g} N/m {self.place(worst)}"
            f" after {MAX_ITERATIONS} iterations (wanted {tolerance:.3g}): the loads are close to what the ground and"
            " the joints can carry" + self.conditions(displacement, slip)
        )

    def _advance_convex(self, displacement, solver, out_of_balance, loads, slip):
        step = solver(out_of_balance)
        return convex_step(lambda moved: self.residual(moved, loads, slip), displacement, step, out_of_balance)

    def _advance(self, displacement, solver, out_of_balance, loads, slip):
        """One Newton step, halved until the step that the same tangent would take next is shorter.

        This natural monotonicity test needs neither an energy, which sliding and gaping joints lack, nor weights
        between forces and couples. Source: Deuflhard (2011), Newton Methods for Nonlinear Problems, section 3.3.
        """
        step = solver(out_of_balance)
        length, force = self._length(step), np.linalg.norm(out_of_balance)
        share = 1.0
        while True:
            moved = displacement + share * step
            residual, tangents = self.residual(moved, loads, slip)
            closer = self._length(solver(residual)) <= (1 - share / 4) * length
            if closer or share <= SMALLEST_SHARE or np.linalg.norm(residual) <= (1 - share / 4) * force:
                return moved, residual, tangents
            share /= 2

    def _length(self, step):
        nodal = step.reshape(-1, 3)
        return np.sqrt((nodal[:, :2] ** 2).sum() + (self.ring.centre_radius * nodal[:, 2]) ** 2 @ np.ones(len(nodal)))


def convex_step(residual, displacement, step, out_of_balance):
    """One Newton step; where it overshoots, the root of the residual's work along it is found by bisection.

    Overshooting: the work changes sign and does not halve. The forces derive from a convex energy, so this cannot
    cycle.

    Returns
    -------
    The new displacement, and what `residual` gives there.
    """
    work = out_of_balance @ step
    low, high, share = 0.0, 1.0, 1.0
    for _ in range(30):
        moved = displacement + share * step
        left, tangents = residual(moved)
        if left @ step >= -0.5 * work:
            if share == 1.0 or left @ step <= 0.5 * work:
                break
            low = share
        else:
            high = share
        share = (low + high) / 2
    return moved, left, tangents
