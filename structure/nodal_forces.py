"""Forces on the unknowns of a ring at given displacements, their tangent, and words for where something happens."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from structure.bolts import BoltLaw
from structure.joint_laws import FaceLaw, JointForces, JointLaw
from structure.ring import Ring
from structure.springs import soil_reaction, soil_springs

#: Share of the initial spring stiffness kept in the *tangent* only (never in the reaction) of an open or yielded
#: spring: it keeps a ring that has lost contact on one side factorisable, and slows convergence by no more than this
#: factor an iteration.
TANGENT_FLOOR = 1e-6


class RingParts(NamedTuple):
    """A ring as matrices over the n unknowns of a discretisation: all that equilibrium, balances and movements need.

    segments : (n, n) sparse
        Stiffness of the segments, symmetric, and of what joints store in a gap beyond their jumps, linear under any
        law.
    jumps : (3 n_joints, n) sparse
        Opening, dislocation and rotation of every joint.
    law, moves : JointLaw or FaceLaw, (law.moves law.count, n) sparse
        What the joints' law takes of the unknowns: their jumps, or gap and slide at every point of their faces.
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
    bolts, bolt_law : (n_joints, n) sparse, BoltLaw
        Elongation of the bolts of every joint; no rows without bolts.
    bolts_reach : bool
        Whether they join places far apart, which would widen the band.
    """

    segments: sparse.csr_array
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
    law: JointLaw | FaceLaw
    moves: sparse.csr_array
    bolts: sparse.csr_array
    bolt_law: BoltLaw
    bolts_reach: bool = False

    @property
    def linear(self) -> sparse.csr_array:
        """Stiffness of all but bolts while nothing limits the joints, (n, n)."""
        return (self.segments + springs_at(self.moves, self.law.springs)).tocsr()


def whole_movements(size: int, nodes: np.ndarray, angle: np.ndarray, lever: np.ndarray | float) -> np.ndarray:
    """Movements of nodes to the right, up, and clockwise by `lever`, (3, size); shapes as in :class:`RingParts`."""
    moved = np.zeros((3, size))
    radial, tangential = nodes.T
    moved[0, radial], moved[0, tangential] = np.sin(angle), np.cos(angle)
    moved[1, radial], moved[1, tangential] = np.cos(angle), -np.sin(angle)
    moved[2, tangential] = lever
    return moved


def springs_at(rows: sparse.csr_array, springs: np.ndarray) -> sparse.csr_array:
    """Stiffness (n, n) of springs (n_rows in any shape) against what rows (n_rows, n) give of the unknowns."""
    return (rows.T @ sparse.diags_array(np.ravel(springs)) @ rows).tocsr()


def tilted(rows: sparse.csr_array, tilts: np.ndarray) -> sparse.csr_array:
    """Openings and dislocations square to and along faces that lean, from those of radial faces.

    Parameters
    ----------
    rows : (k n, n_unknowns) sparse
        Opening, dislocation and what else moves, k at each of n places.
    tilts : (n,) float64
        By how much the outer end of the face leans clockwise [rad].
    """
    if not np.any(tilts):
        return rows
    ways = rows.shape[0] // len(tilts)
    turned = np.tile(np.eye(ways), (len(tilts), 1, 1))
    turned[:, 0, 0] = turned[:, 1, 1] = np.cos(tilts)
    turned[:, 0, 1], turned[:, 1, 0] = np.sin(tilts), -np.sin(tilts)
    return (sparse.block_diag(turned) @ rows).tocsr()


class RingForces:
    """Segments, joints and soil springs of a ring in one set of unknowns.

    Attributes
    ----------
    joints : JointLaw or FaceLaw
        Linear joints are part of the constant stiffness, others join in at every iteration.
    unslipped : (joints.count,) float64
        Slips of joints, or of points of their faces, that never slid.
    """

    def __init__(self, ring: Ring, parts: RingParts):
        self.ring, self.parts = ring, parts
        self.springs = soil_springs(ring) if ring.ground is not None else None
        self.joints = parts.law
        self.unslipped = np.zeros(parts.law.count)
        #: As of :meth:`structure.joint_laws.JointLaw.forces`, on the way to an equilibrium.
        self.pressed: np.ndarray | None = None
        self.stiffness = parts.linear if self.joints.linear else parts.segments
        self._push, self._force, self._pull = (part.T.tocsr() for part in (parts.feel, parts.moves, parts.bolts))

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

    def moved(self, displacement: np.ndarray) -> np.ndarray:
        """What the joints' law takes (..., law.count, law.moves) of displacements (..., n)."""
        return (self.parts.moves @ displacement.T).T.reshape(*displacement.shape[:-1], -1, self.joints.moves)

    def joint_forces(self, displacement: np.ndarray, slip: np.ndarray) -> JointForces:
        """Forces in the joints, or at points of their faces, at displacements (..., n) reached from slips."""
        return self.joints.forces(self.moved(displacement), slip, self.pressed)

    def bolt_forces(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pull of the bolts of every joint [N/m] and its tangent [N/m2], (..., n_joints); none without bolts."""
        return self.parts.bolt_law.pull((self.parts.bolts @ displacement.T).T)

    def internal_forces(self, displacement: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces that hold segments, joints and bolts deformed (n,), and the tangents of what is not linear."""
        forces, tangents = self.stiffness @ displacement, []
        if not self.joints.linear:
            of_joints = self.joint_forces(displacement, slip)
            forces = forces + self._force @ of_joints.resisting.ravel()
            tangents.append(of_joints.tangent.ravel())
        pull, stiffening = self.bolt_forces(displacement)
        return forces + self._pull @ pull, np.concatenate([*tangents, stiffening])

    def residual(self, displacement: np.ndarray, loads: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Out-of-balance forces, zero where held, and the coefficients of the tangent."""
        reactions, stiffening = self.reactions(displacement)
        internal, inside = self.internal_forces(displacement, slip)
        out_of_balance = loads + self.spring_forces(reactions) - internal
        out_of_balance[self.parts.held] = 0
        return out_of_balance, np.concatenate([self.parts.area[: len(stiffening)] * stiffening, inside])

    def sizes(self, vectors: np.ndarray) -> np.ndarray:
        """Sizes at the nodes (..., n_nodes) of forces or displacements (..., n)."""
        return np.hypot(vectors[..., self.parts.nodes[:, 0]], vectors[..., self.parts.nodes[:, 1]])

    def place(self, node: int) -> str:
        """Where a node is, in words."""
        angle = np.degrees(self.parts.node_angle[node]) % 360
        for joint, at in enumerate(self.ring.joint_angles):
            if abs((angle - at + 180) % 360 - 180) < 1e-9:
                return f"at {self.joint_words(joint)}"
        return f"at {angle:.4g} degrees"

    def loose_place(self, motion: np.ndarray) -> str:
        """What is said of a mechanism."""
        if not self.joints.count:
            return "rounding hides the stiffness of the ring: it is too thin for this mesh to hold without more ground"
        aside = " (its bolts left aside)" if self.parts.bolts_reach else ""
        weak = "joints too weak to hold it without more ground"
        return f"the ring is a mechanism{aside}: {weak}{self.freest_joint(motion)}"

    def freest_joint(self, motion: np.ndarray) -> str:
        """Which joint moves most in a motion and how, for the message of a failure."""
        if not self.joints.count or not np.isfinite(motion).all():
            return ""
        jumps = np.abs(self.jumps(motion)) * [1, 1, self.ring.centre_radius]
        joint, way = np.unravel_index(int(jumps.argmax()), jumps.shape)
        if jumps[joint, way] < 1e-3 * np.abs(motion).max():
            return "; it moves as a whole"
        verb = ("opens or closes", "slides", "turns")[way]
        return f"; {self.joint_words(int(joint))} {verb} most freely"

    def joint_words(self, joint: int) -> str:
        """Number and place of a joint."""
        count = len(self.ring.joint_angles)
        if joint >= count:
            angle = self.ring.beside.joint_angles[joint - count]
            return f"joint {joint - count + 1} of the ring beside ({angle:g} degrees)"
        return f"joint {joint + 1} ({self.ring.joint_angles[joint]:g} degrees)"

    def conditions(self, displacement: np.ndarray, slip: np.ndarray) -> str:
        """Joints that are not closed and how much of the ring the ground presses on, for the message of a failure."""
        words = ""
        if not self.joints.linear:
            states = self.joints.states(self.moved(displacement), self.joint_forces(displacement, slip))
            loose = [f"joint {k + 1} is {state}" for k, state in enumerate(states) if state != "closed"]
            words += "; " + (", ".join(loose) or "all joints are closed")
        if self.springs is not None and not self.springs[0].pulls:
            felt, _ = np.split(self.parts.feel @ displacement, 2)
            area, _ = np.split(self.parts.area, 2)
            words += f"; soil springs press on {area[felt > 0].sum() / area.sum():.0%} of the ring"
        return words
