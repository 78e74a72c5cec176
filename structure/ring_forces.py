"""Forces on the unknowns of a ring at given displacements, their tangent, and words for where something happens."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from structure.banded import BandedTangent
from structure.joint_laws import JointForces, JointLaw
from structure.ring import Ring
from structure.springs import soil_reaction, soil_springs

#: Share of the initial spring stiffness kept in the *tangent* only (never in the reaction) of an open or yielded
#: spring: it keeps a ring that has lost contact on one side factorisable, and slows convergence by no more than this
#: factor an iteration.
TANGENT_FLOOR = 1e-6


class RingParts(NamedTuple):
    """A ring as matrices over the n unknowns of a discretisation: all that equilibrium, balances and movements need.

    segments : (n, n) sparse
        Stiffness of the segments, symmetric.
    linear_joints : (n, n) sparse or None
        That of joints whose law is linear, as far as they are springs.
    jumps : (3 n_joints, n) sparse
        Opening, dislocation and rotation of every joint.
    feel, area : (n_springs, n) sparse, (n_springs,) float64
        What the soil springs feel, first all normal ones [m], outward, then as many tangential ones, clockwise; and
        the area that each reaction [Pa] acts on [m2/m].
    weight : (n,) float64
        Forces of the concrete's weight.
    mass : (n, n) sparse
        Of concrete with a density of one, lumped at the nodes [m2].
    place : (n,) int
        Place of each unknown in a narrow band.
    held : (n_held,) int
        Unknowns held at zero.
    nodes, node_angle : (n_nodes, 2) int, (n_nodes,) float64
        Radial and tangential unknown of every node, and its angle [rad].
    rigid : (3, n) float64
        Movements of the ring as a whole: to the right, up, and a clockwise turn by one over the radius of the centre
        line. Forces times them are their sums and their couple about the axis over that radius.
    mean : (3, n) float64
        Mean movement of the ring to the right, up and clockwise.
    arm : (n,) float64
        1 for displacements, the radius of the centre line for rotations [m].
    ties, tie_stiffness : (n_ties, n) sparse or None, float
        As of :class:`structure.banded.BandedTangent`.
    """

    segments: sparse.csr_array
    linear_joints: sparse.csr_array | None
    jumps: sparse.csr_array
    feel: sparse.csr_array
    area: np.ndarray
    weight: np.ndarray
    mass: sparse.csr_array
    place: np.ndarray
    held: np.ndarray
    nodes: np.ndarray
    node_angle: np.ndarray
    rigid: np.ndarray
    mean: np.ndarray
    arm: np.ndarray
    ties: sparse.csr_array | None = None
    tie_stiffness: float = 0.0


def whole_movements(size: int, nodes: np.ndarray, angle: np.ndarray, lever: np.ndarray | float) -> np.ndarray:
    """Movements of nodes to the right, up, and clockwise by `lever`, (3, size); shapes as in :class:`RingParts`."""
    moved = np.zeros((3, size))
    radial, tangential = nodes.T
    moved[0, radial], moved[0, tangential] = np.sin(angle), np.cos(angle)
    moved[1, radial], moved[1, tangential] = np.cos(angle), -np.sin(angle)
    moved[2, tangential] = lever
    return moved


def springs_at_joints(jumps: sparse.csr_array, springs: tuple[float, float, float]) -> sparse.csr_array:
    """Stiffness (n, n) of springs against opening, dislocation and rotation of every joint; jumps : (3 n_joints, n)."""
    return (jumps.T @ sparse.diags_array(np.tile(springs, jumps.shape[0] // 3)) @ jumps).tocsr()


def uneven_gaps(ring: Ring, parts: RingParts) -> sparse.csr_array:
    """What joints store in a gap beyond their jumps, (n, n): linear under any law; nothing where faces are plane."""
    if parts.linear_joints is None:
        return sparse.csr_array(parts.segments.shape)
    springs = ring.joint_normal_stiffness, ring.joint_shear_stiffness, ring.joint_rotational_stiffness
    return (parts.linear_joints - springs_at_joints(parts.jumps, springs)).tocsr()


class RingForces:
    """Segments, joints and soil springs of a ring in one set of unknowns.

    Attributes
    ----------
    joints : JointLaw
        Linear joints are part of the constant stiffness, others join in at every iteration.
    unslipped : (n_joints,) float64
        Slips of joints that never slid.
    """

    def __init__(self, ring: Ring, parts: RingParts):
        self.ring, self.parts, self.held = ring, parts, parts.held
        self.springs = soil_springs(ring) if ring.ground is not None else None
        self.joints = JointLaw(ring)
        self.unslipped = np.zeros(len(ring.joint_angles))
        linear = parts.segments if parts.linear_joints is None else (parts.segments + parts.linear_joints).tocsr()
        constant = linear if self.joints.linear else parts.segments + uneven_gaps(ring, parts)
        if parts.ties is None:
            bolts = sparse.csr_array(linear.shape)
        else:
            bolts = parts.tie_stiffness * (parts.ties.T @ parts.ties)
        self.stiffness, self.magnitudes = (constant + bolts).tocsr(), abs(linear + bolts).tocsr()
        self._push, self._force = parts.feel.T.tocsr(), parts.jumps.T.tocsr()
        rows, pairs = [], []
        if self.springs is not None:
            rows, pairs = [parts.feel], [np.repeat(np.arange(len(parts.area))[:, None], 2, axis=1)]
        if not self.joints.linear:
            first = sum(part.shape[0] for part in rows) + 3 * np.arange(len(self.unslipped))
            of_joint = np.stack(np.divmod(np.arange(9), 3), axis=1)
            rows, pairs = [*rows, parts.jumps], [*pairs, (first[:, None, None] + of_joint).reshape(-1, 2)]
        stacked = sparse.vstack(rows) if rows else sparse.csr_array((0, parts.segments.shape[0]))
        pairs = np.concatenate(pairs) if pairs else np.zeros((0, 2), dtype=int)
        self.tangent = BandedTangent(
            constant, stacked, pairs, parts.place, parts.held, self.joints.linear, parts.ties, parts.tie_stiffness
        )

    def reactions(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Reaction of the soil [Pa] and its tangent [Pa/m] at every spring, (n_springs,); none without ground."""
        if self.springs is None:
            return np.zeros_like(self.parts.area), np.zeros(0)
        felt = np.split(self.parts.feel @ displacement, 2)
        pairs = [soil_reaction(part, spring) for part, spring in zip(felt, self.springs, strict=True)]
        reaction, tangent = map(np.concatenate, zip(*pairs, strict=True))
        return reaction, np.maximum(tangent, TANGENT_FLOOR * self.springs[0].stiffness)

    def spring_forces(self, reactions: np.ndarray) -> np.ndarray:
        """Forces of the soil on the unknowns (..., n) from the reactions of its springs (..., n_springs)."""
        return -(self._push @ (self.parts.area * reactions).T).T

    def jumps(self, displacement: np.ndarray) -> np.ndarray:
        """Opening, dislocation and rotation of the joints (..., n_joints, 3) at displacements (..., n)."""
        return (self.parts.jumps @ displacement.T).T.reshape(*displacement.shape[:-1], -1, 3)

    def joint_forces(self, displacement: np.ndarray, slip: np.ndarray) -> JointForces:
        """Forces in the joints at displacements (..., n) reached from slips (..., n_joints)."""
        return self.joints.forces(self.jumps(displacement), slip)

    def internal_forces(self, displacement: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces that hold segments and joints deformed (n,), and the tangents of joints that are not linear."""
        forces = self.stiffness @ displacement
        if self.joints.linear:
            return forces, np.zeros(0)
        axial, shear, moment, tangent, _ = self.joint_forces(displacement, slip)
        return forces + self._force @ np.stack([-axial, shear, moment], axis=-1).ravel(), tangent.ravel()

    def residual(self, displacement: np.ndarray, loads: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Out-of-balance forces, zero where held, and the coefficients of the tangent."""
        reactions, stiffening = self.reactions(displacement)
        internal, of_joints = self.internal_forces(displacement, slip)
        out_of_balance = loads + self.spring_forces(reactions) - internal
        out_of_balance[self.held] = 0
        return out_of_balance, np.concatenate([self.parts.area[: len(stiffening)] * stiffening, of_joints])

    def sizes(self, vectors: np.ndarray) -> np.ndarray:
        """Sizes at the nodes (..., n_nodes) of forces or displacements (..., n)."""
        return np.hypot(vectors[..., self.parts.nodes[:, 0]], vectors[..., self.parts.nodes[:, 1]])

    def place(self, node: int) -> str:
        """Where a node is, in words."""
        angle = np.degrees(self.parts.node_angle[node]) % 360
        for joint, at in enumerate(self.ring.joint_angles):
            if abs((angle - at + 180) % 360 - 180) < 1e-9:
                return f"at joint {joint + 1} ({at:g} degrees)"
        return f"at {angle:.4g} degrees"

    def loose_place(self, motion: np.ndarray) -> str:
        """What is said of a mechanism."""
        if not len(self.unslipped):
            return "rounding hides the stiffness of the ring: it is too thin for this mesh to hold without more ground"
        aside = "" if self.parts.ties is None else " (its bolts left aside)"
        weak = "joints too weak to hold it without more ground"
        return f"the ring is a mechanism{aside}: {weak}{self.freest_joint(motion)}"

    def freest_joint(self, motion: np.ndarray) -> str:
        """Which joint moves most in a motion and how, for the message of a failure."""
        if not len(self.unslipped) or not np.isfinite(motion).all():
            return ""
        jumps = np.abs(self.jumps(motion)) * [1, 1, self.ring.centre_radius]
        joint, way = np.unravel_index(int(jumps.argmax()), jumps.shape)
        if jumps[joint, way] < 1e-3 * np.abs(motion).max():
            return "; it moves as a whole"
        verb = ("opens or closes", "slides", "turns")[way]
        return f"; joint {joint + 1} ({self.ring.joint_angles[joint]:g} degrees) {verb} most freely"

    def conditions(self, displacement: np.ndarray, slip: np.ndarray) -> str:
        """Joints that are not closed and how much of the ring the ground presses on, for the message of a failure."""
        words = ""
        if not self.joints.linear:
            states = self.joints.states(self.jumps(displacement), self.joint_forces(displacement, slip))
            loose = [f"joint {k + 1} is {state}" for k, state in enumerate(states) if state != "closed"]
            words += "; " + (", ".join(loose) or "all joints are closed")
        if self.springs is not None and not self.springs[0].pulls:
            felt, _ = np.split(self.parts.feel @ displacement, 2)
            area, _ = np.split(self.parts.area, 2)
            words += f"; soil springs press on {area[felt > 0].sum() / area.sum():.0%} of the ring"
        return words
