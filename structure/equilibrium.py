"""Equilibrium of a ring of beams in nonlinear soil springs and joints: Newton's method with banded factors."""

from __future__ import annotations

import numpy as np

from structure.banded import BANDWIDTH, FoldedRing, Mechanism, softest_motion
from structure.beam_geometry import RingMesh, constant_stiffness, joint_matrices
from structure.joint_laws import JointForces, JointLaw
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
#: Smallest eigenvalue of the tangent, scaled to a diagonal of one, of a ring that is held. Measured: mechanisms of 4 to
#: 6 hinges and sliding joints below 1.1e-15 (rounding); sound rings of 100 to 2000 elements above 1.9e-14 (1 mm thick).
SOFTEST = 2e-15
#: Smallest part of a load increment tried before a ring with nonlinear joints is given up.
SMALLEST_INCREMENT = 1 / 256
#: Smallest part of a Newton step tried.
SMALLEST_SHARE = 2.0**-10


class NoEquilibrium(ArithmeticError):
    """Newton's method found no equilibrium; the message says what went wrong and where."""


class RingEquilibrium:
    """Finds displacements under nodal forces; unknowns as in :mod:`structure.beam_geometry`.

    Parameters
    ----------
    ring : Ring
    mesh : RingMesh
    held : (n_held,) int
        Unknowns held at zero.

    Attributes
    ----------
    joints : JointLaw
        Linear joints are part of the constant stiffness, others join in at every iteration.
    """

    def __init__(self, ring: Ring, mesh: RingMesh, held: np.ndarray):
        self.ring, self.mesh = ring, mesh
        self.largest = LARGEST_DISPLACEMENT * ring.outer_radius
        on_face = ring.ground is not None and ring.ground.slip_at == "outer_face"
        self.lever = ring.thickness / 2 if on_face else 0.0
        self.area = ring.outer_radius * mesh.node_span
        self.springs = soil_springs(ring) if ring.ground is not None else None
        self.joints = JointLaw(ring)
        self.jumps = joint_matrices(ring)[0]
        self.joint_unknowns = mesh.joint_unknowns()
        self.magnitudes = abs(constant_stiffness(ring, mesh))
        self.stiffness = constant_stiffness(ring, mesh, with_joints=self.joints.linear)
        self.held = held
        self.folded = FoldedRing(mesh.n_nodes, held)
        store = self.folded.lower_band if self.joints.linear else self.folded.full_band
        self.band = store(self.stiffness)
        self.unslipped = np.zeros(len(ring.joint_angles))
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
            return self._loose_place(mechanism.motion)
        softness, motion = softest_motion(solver, np.sqrt(self.magnitudes.diagonal()))
        return self._loose_place(motion) if softness < SOFTEST else ""

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

    def joint_forces(self, displacement: np.ndarray, slip: np.ndarray) -> JointForces:
        """Forces in the joints at displacements (..., 3 n_nodes) reached from slips (..., n_joints)."""
        return self.joints.forces(displacement[..., self.joint_unknowns] @ self.jumps.T, slip)

    def internal_forces(self, displacement: np.ndarray, slip: np.ndarray) -> np.ndarray:
        """Nodal forces that hold segments and joints deformed, (3 n_nodes,)."""
        forces = self.stiffness @ displacement
        if not self.joints.linear:
            axial, shear, moment, *_ = self.joint_forces(displacement, slip)
            np.add.at(forces, self.joint_unknowns, np.stack([-axial, shear, moment], axis=-1) @ self.jumps)
        return forces

    def residual(self, displacement: np.ndarray, loads: np.ndarray, slip: np.ndarray):
        """Out-of-balance nodal forces, zero where held, and the spring tangents."""
        spring, tangents = self.spring_forces(displacement)
        out_of_balance = loads + spring.ravel() - self.internal_forces(displacement, slip)
        out_of_balance[self.held] = 0
        return out_of_balance, tangents

    def solver(self, displacement: np.ndarray, tangents, slip: np.ndarray):
        """Function that turns out-of-balance forces into displacements with the tangent of this state."""
        normal, slide = tangents
        radial, tangential, rotation = self.folded.place.reshape(-1, 3).T
        symmetric = self.joints.linear
        band = self.band.copy(order="F")
        diagonal = 0 if symmetric else 2 * BANDWIDTH
        band[diagonal, radial] += normal
        band[diagonal, tangential] += slide
        band[diagonal + 1, tangential] += self.lever * slide
        band[diagonal, rotation] += self.lever**2 * slide
        if symmetric:
            return self.folded.cholesky(band)
        band[diagonal - 1, rotation] += self.lever * slide
        blocks = self.jumps.T @ self.joint_forces(displacement, slip).tangent @ self.jumps
        place = self.folded.place[self.joint_unknowns]
        row = np.repeat(place, 6, axis=1).reshape(-1, 6, 6)
        column = np.tile(place, (1, 6)).reshape(-1, 6, 6)
        blocks[np.isin(row, self.folded.place[self.held]) | np.isin(column, self.folded.place[self.held])] = 0
        np.add.at(band, (diagonal + row - column, column), blocks)
        return self.folded.lu(band)

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
            except NoEquilibrium:
                increment /= 4
                if self.joints.linear or increment < SMALLEST_INCREMENT:
                    raise
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
        advance = self._advance_symmetric if self.joints.linear else self._advance
        for _ in range(MAX_ITERATIONS):
            rounding = ROUNDINGS * np.finfo(float).eps * (self.magnitudes @ np.abs(displacement))
            if np.all(np.abs(out_of_balance) <= np.maximum(tolerance, rounding)):
                return displacement
            try:
                solver = self.solver(displacement, tangents, slip)
            except Mechanism as mechanism:
                raise NoEquilibrium(self._loose_place(mechanism.motion)) from mechanism
            displacement, out_of_balance, tangents = advance(displacement, solver, out_of_balance, loads, slip)
            largest = np.abs(displacement.reshape(-1, 3)[:, :2]).max()
            if not largest <= self.largest:
                worst = int(np.abs(displacement.reshape(-1, 3)[:, :2]).max(1).argmax())
                raise NoEquilibrium(
                    f"displacements reach {largest:.3g} m {self._place(worst)}, beyond {self.largest:.3g} m (a tenth of"
                    " the outer radius): the ground cannot carry the loads, or the joints are too weak"
                    + self._joint_states(displacement, slip)
                )
        worst = int(np.abs(out_of_balance).argmax()) // 3
        raise NoEquilibrium(
            f"the largest out-of-balance force is still {np.abs(out_of_balance).max():.3g} N/m {self._place(worst)}"
            f" after {MAX_ITERATIONS} iterations (wanted {tolerance:.3g}): the loads are close to what the ground and"
            " the joints can carry" + self._joint_states(displacement, slip)
        )

    def _advance_symmetric(self, displacement, solver, out_of_balance, loads, slip):
        """One Newton step; where it overshoots, the root of the residual's work along it is found by bisection.

        Overshooting: the work changes sign and does not halve. The forces derive from a convex energy, so this cannot
        cycle.
        """
        step = solver(out_of_balance)
        work = out_of_balance @ step
        low, high, share = 0.0, 1.0, 1.0
        for _ in range(30):
            moved = displacement + share * step
            residual, tangents = self.residual(moved, loads, slip)
            left = residual @ step
            if left >= -0.5 * work:
                if share == 1.0 or left <= 0.5 * work:
                    break
                low = share
            else:
                high = share
            share = (low + high) / 2
        return moved, residual, tangents

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

    def _place(self, node: int) -> str:
        for joint, sides in enumerate(zip(self.mesh.joint_before, self.mesh.joint_after, strict=True)):
            if node in sides:
                return f"at joint {joint + 1} ({self.ring.joint_angles[joint]:g} degrees)"
        return f"at {np.degrees(self.mesh.node_angle[node]) % 360:.4g} degrees"

    def _loose_place(self, motion: np.ndarray) -> str:
        message = "the ring is a mechanism: joints too weak to hold it without more ground"
        if not len(self.joint_unknowns) or not np.isfinite(motion).all():
            return message
        jumps = np.abs(motion[self.joint_unknowns] @ self.jumps.T) * [1, 1, self.ring.centre_radius]
        joint, way = np.unravel_index(int(jumps.argmax()), jumps.shape)
        if jumps[joint, way] < 1e-3 * np.abs(motion).max():
            return message + "; it moves as a whole"
        verb = ("opens", "slides", "turns")[way]
        return message + f"; joint {joint + 1} ({self.ring.joint_angles[joint]:g} degrees) {verb} most freely"

    def _joint_states(self, displacement: np.ndarray, slip: np.ndarray) -> str:
        """Which nonlinear joints are not closed, for the message of a failure."""
        if self.joints.linear:
            return ""
        jumps = displacement[self.joint_unknowns] @ self.jumps.T
        forces = self.joints.forces(jumps, slip)
        loose = [
            f"joint {k + 1} is {state}"
            for k, state in enumerate(self.joints.states(jumps, forces))
            if state != "closed"
        ]
        return f"; {', '.join(loose)}" if loose else "; all joints are closed"
