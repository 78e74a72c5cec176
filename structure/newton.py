"""Equilibrium of a ring in nonlinear soil springs and joints: Newton's method with banded factors and a line search."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.banded import BandedTangent, Mechanism, softest_motion
from structure.nodal_forces import RingForces, RingParts, springs_at
from structure.ring import Ring

#: Out-of-balance force on an unknown over the sum of all loads at which Newton stops.
RESIDUAL_TOLERANCE = 1e-11
#: Roundings of the largest product in a row of the stiffness, of up to 60 terms, that no out-of-balance force gets
#: below.
ROUNDINGS = 16
MAX_ITERATIONS = 100
#: Displacement over outer radius beyond which small displacements no longer describe the ring.
LARGEST_DISPLACEMENT = 0.1
#: Smallest eigenvalue of the tangent, scaled to a diagonal of one, of a ring that is held. Measured: mechanisms of 4 to
#: 6 hinges and sliding joints below 1.1e-15 (rounding); sound rings of 100 to 2000 beams above 1.9e-14 (1 mm thick), of
#: 12 to 1440 columns in plane strain above 7e-10 (350 mm thick). Those 1 mm thick lie below 1e-15 from 45 columns on:
#: their answers would be rounding.
SOFTEST = 2e-15
#: Smallest part of a load increment tried before a ring with nonlinear joints is given up.
SMALLEST_INCREMENT = 1 / 256
#: Iterations after which joints that slide or gape are tried with the axial forces found last as the limits of Q and M,
#: which gives their forces an energy; how often; and the change of displacements, over the largest, that ends it.
MAX_DIRECT, MAX_LIMITS, CLOSE = 30, 20, 1e-4
#: Axial force that limits nothing [N/m], of joints not loaded yet.
UNLIMITED = 1e30
#: Smallest part of a Newton step tried.
SMALLEST_SHARE = 2.0**-10


class NoEquilibrium(ArithmeticError):
    """Newton's method found no equilibrium; the message says what went wrong and where."""


class RingEquilibrium(RingForces):
    """Finds displacements under loads, of a ring that may be held at some unknowns.

    Attributes
    ----------
    iterations : list of int
        Newton steps of every call of :meth:`follow` that found an equilibrium.
    residuals : list of float
        Largest out-of-balance force of every iteration of the last solution [N/m].
    """

    def __init__(self, ring: Ring, parts: RingParts):
        super().__init__(ring, parts)
        self.magnitudes = abs(parts.linear + springs_at(parts.bolts, parts.bolt_law.stiffness)).tocsr()
        self.tangent = self._tangent()
        self.largest = LARGEST_DISPLACEMENT * ring.outer_radius
        self.iterations: list[int] = []
        self.residuals: list[float] = []
        self.loose = self._mechanism() if ring.ground is None else ""

    def _tangent(self) -> BandedTangent:
        """That of all forces, with a coefficient for every spring, joint and bolt whose stiffness changes."""
        parts, bolts = self.parts, self.parts.bolts
        blocks = []  # of springs whose stiffness changes: rows, how many change together
        if self.springs is not None:
            blocks.append((parts.feel, 1))
        if not self.joints.linear:
            blocks.append((parts.moves, self.joints.moves))
        blocks.append((bolts[:0] if parts.bolts_reach else bolts, 1))
        pairs, first = [], 0
        for rows, ways in blocks:
            block, one, other = np.indices((rows.shape[0] // ways, ways, ways)).reshape(3, -1)
            pairs.append(first + ways * block[:, None] + np.stack([one, other], axis=1))
            first += rows.shape[0]
        rows, ties = sparse.vstack([rows for rows, _ in blocks]), bolts if parts.bolts_reach else None
        return BandedTangent(
            self.stiffness, rows, np.concatenate(pairs), parts.place, parts.held, self.joints.linear, ties
        )

    def _mechanism(self) -> str:
        """How the undeformed ring can move without resistance, empty where it cannot.

        Asked once and not left to the loads: those in balance with a mechanism would hide it.
        """
        still = np.zeros(len(self.parts.arm))
        try:
            solver = self.tangent.factor(self.residual(still, still, self.unslipped)[1])
        except Mechanism as mechanism:
            return self.loose_place(mechanism.motion)
        softness, motion = softest_motion(solver, np.sqrt(self.magnitudes.diagonal()))
        return self.loose_place(motion) if softness < SOFTEST else ""

    def follow(
        self, loads: np.ndarray, start: np.ndarray, slip: np.ndarray, loads_before: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Displacements in equilibrium with loads, from the state before.

        The increment is taken in one step; where nonlinear joints find no equilibrium so, in smaller ones, the slip
        of each kept.

        Parameters
        ----------
        loads, loads_before : (n,) float64
            Now, and those in equilibrium with `start`.
        start : (n,) float64
        slip : (n_joints,) float64
            Irreversible dislocations before [m].

        Returns
        -------
        displacement : (n,) float64
        slip : (n_joints,) float64
            Slips from which the last increment started: with them :meth:`joint_forces` gives the forces.

        Raises
        ------
        NoEquilibrium
            A mechanism, displacements beyond the theory, or no convergence.
        """
        done, increment, displacement, steps = 0.0, 1.0, start, 0
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
            steps += len(self.residuals) - 1
            if target == 1.0:
                self.iterations.append(steps)
                return reached, slip
            displacement, done, increment = reached, target, 2 * increment
            slip = self.joint_forces(displacement, slip).slip

    def solve(self, loads: np.ndarray, start: np.ndarray, slip: np.ndarray | None = None) -> np.ndarray:
        """Displacements in equilibrium with loads, by Newton's method from a first guess; raises NoEquilibrium."""
        if self.loose:
            raise NoEquilibrium(self.loose)
        slip = self.unslipped if slip is None else slip
        if self.joints.conservative:
            return self._newton(loads, start, slip)
        try:
            return self._newton(loads, start, slip, MAX_DIRECT)
        except NoEquilibrium:
            return self._by_limits(loads, start, slip)

    def _by_limits(self, loads, start, slip):
        """As of :meth:`solve`: friction and moments limited by the axial forces found last, until these stay."""
        last = start
        for _ in range(MAX_LIMITS):
            axial = self.joint_forces(last, slip).axial
            self.pressed = axial if axial.any() else np.full_like(axial, UNLIMITED)
            try:
                reached = self._newton(loads, last, slip)
            finally:
                self.pressed = None
            close = self.sizes(reached - last).max() < CLOSE * self.sizes(reached).max()
            last = reached
            if close:
                try:
                    return self._newton(loads, last, slip, MAX_DIRECT)
                except NoEquilibrium:
                    continue  # rounding in a tangent without symmetry: more rounds get there, too
        return self._newton(loads, last, slip, MAX_DIRECT)

    def _newton(self, loads, start, slip, most=MAX_ITERATIONS):
        """As of :meth:`solve`, in so many iterations at most."""
        tolerance = RESIDUAL_TOLERANCE * np.abs(loads / self.parts.arm).sum()
        displacement, self.residuals = start.copy(), []
        out_of_balance, coefficients = self.residual(displacement, loads, slip)
        for _ in range(most):
            rounding = ROUNDINGS * np.finfo(float).eps * (self.magnitudes @ np.abs(displacement))
            self.residuals.append(float(np.abs(out_of_balance).max()))
            if np.all(np.abs(out_of_balance) <= np.maximum(tolerance, rounding)):
                return displacement
            displacement, out_of_balance, coefficients = self.advance(
                displacement, out_of_balance, coefficients, loads, slip
            )
            moved = np.abs(displacement[self.parts.nodes]).max(axis=1)
            worst = int(moved.argmax())
            if not moved[worst] <= self.largest:
                raise NoEquilibrium(
                    f"displacements reach {moved[worst]:.3g} m {self.place(worst)}, beyond {self.largest:.3g} m (a"
                    " tenth of the outer radius): the ground cannot carry the loads, or the joints are too weak"
                    + self.freest_joint(displacement)
                    + self.conditions(displacement, slip)
                )
        worst = int(self.sizes(out_of_balance).argmax())
        raise NoEquilibrium(
            f"the largest out-of-balance force is still {np.abs(out_of_balance).max():.3g} N/m {self.place(worst)}"
            f" after {most} iterations (wanted {tolerance:.3g}): the loads are close to what the ground and"
            " the joints can carry" + self.conditions(displacement, slip)
        )

    def advance(self, displacement, out_of_balance, coefficients, loads, slip):
        """One Newton step with its line search: the new displacement, and what `residual` gives there."""
        try:
            solver = self.tangent.factor(coefficients)
        except Mechanism as mechanism:
            raise NoEquilibrium(self.loose_place(mechanism.motion)) from mechanism
        conservative = self.joints.conservative or self.pressed is not None
        search = self._along_energy if conservative else self._towards_shorter_steps
        return search(displacement, solver(out_of_balance), solver, out_of_balance, loads, slip)

    def _along_energy(self, displacement, step, _, out_of_balance, loads, slip):
        """Where a step overshoots, the root of the residual's work along it, found by bisection.

        Overshooting: the work changes sign and does not halve. The forces derive from a convex energy, so this cannot
        cycle.
        """
        work = out_of_balance @ step
        low, high, share = 0.0, 1.0, 1.0
        for _ in range(30):
            moved = displacement + share * step
            left, coefficients = self.residual(moved, loads, slip)
            if left @ step >= -0.5 * work:
                if share == 1.0 or left @ step <= 0.5 * work:
                    break
                low = share
            else:
                high = share
            share = (low + high) / 2
        return moved, left, coefficients

    def _towards_shorter_steps(self, displacement, step, solver, out_of_balance, loads, slip):
        """A step halved until the one that the same tangent would take next is shorter.

        This natural monotonicity test needs neither an energy, which sliding and gaping joints lack, nor weights
        between forces and couples. Source: Deuflhard (2011), Newton Methods for Nonlinear Problems, section 3.3.
        """
        length, force = np.linalg.norm(self.parts.arm * step), np.linalg.norm(out_of_balance)
        share = 1.0
        while True:
            moved = displacement + share * step
            left, coefficients = self.residual(moved, loads, slip)
            closer = np.linalg.norm(self.parts.arm * solver(left)) <= (1 - share / 4) * length
            if closer or share <= SMALLEST_SHARE or np.linalg.norm(left) <= (1 - share / 4) * force:
                return moved, left, coefficients
            share /= 2
