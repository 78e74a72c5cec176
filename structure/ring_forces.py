"""Forces on the nodes of a ring at given displacements, their tangent, and words for where something happens."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from structure.banded import BANDWIDTH, FoldedRing
from structure.beam_geometry import RingMesh, constant_stiffness, joint_matrices
from structure.joint_laws import JointForces, JointLaw
from structure.ring import Ring
from structure.springs import soil_reaction, soil_springs

#: Share of the initial spring stiffness kept in the *tangent* only (never in the reaction) of an open or yielded
#: spring: it keeps a ring that has lost contact on one side factorisable, and slows convergence by no more than this
#: factor an iteration.
TANGENT_FLOOR = 1e-6


class RingForces:
    """Segments, joints and soil springs of a ring; unknowns as in :mod:`structure.beam_geometry`.

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
    unslipped : (n_joints,) float64
        Slips of joints that never slid.
    """

    def __init__(self, ring: Ring, mesh: RingMesh, held: np.ndarray):
        self.ring, self.mesh = ring, mesh
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

    def solver(self, displacement: np.ndarray, tangents, slip: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
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

    def place(self, node: int) -> str:
        for joint, sides in enumerate(zip(self.mesh.joint_before, self.mesh.joint_after, strict=True)):
            if node in sides:
                return f"at joint {joint + 1} ({self.ring.joint_angles[joint]:g} degrees)"
        return f"at {np.degrees(self.mesh.node_angle[node]) % 360:.4g} degrees"

    def loose_place(self, motion: np.ndarray) -> str:
        return "the ring is a mechanism: joints too weak to hold it without more ground" + self.freest_joint(motion)

    def freest_joint(self, motion: np.ndarray) -> str:
        """Which joint moves most in a motion and how, for the message of a failure."""
        if not len(self.joint_unknowns) or not np.isfinite(motion).all():
            return ""
        jumps = np.abs(motion[self.joint_unknowns] @ self.jumps.T) * [1, 1, self.ring.centre_radius]
        joint, way = np.unravel_index(int(jumps.argmax()), jumps.shape)
        if jumps[joint, way] < 1e-3 * np.abs(motion).max():
            return "; it moves as a whole"
        verb = ("opens or closes", "slides", "turns")[way]
        return f"; joint {joint + 1} ({self.ring.joint_angles[joint]:g} degrees) {verb} most freely"

    def conditions(self, displacement: np.ndarray, slip: np.ndarray) -> str:
        """Joints that are not closed and how much of the ring the ground presses on, for the message of a failure."""
        words = ""
        if not self.joints.linear:
            jumps = displacement[self.joint_unknowns] @ self.jumps.T
            states = self.joints.states(jumps, self.joints.forces(jumps, slip))
            loose = [f"joint {k + 1} is {state}" for k, state in enumerate(states) if state != "closed"]
            words += "; " + (", ".join(loose) or "all joints are closed")
        if self.springs is not None and not self.springs[0].pulls:
            pressed = self.area[displacement.reshape(-1, 3)[:, 0] > 0].sum() / self.area.sum()
            words += f"; soil springs press on {pressed:.0%} of the ring"
        return words
