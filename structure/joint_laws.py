"""Laws of a joint between segments: forces over opening, dislocation and rotation, with tangent and memory.

Linear springs, or any of three limits that a dry joint has: it opens (no tension), it rotates about a shrinking contact
zone once its edge decompresses (Janssen), and it slides when friction is used up (Coulomb).
Signs as in :mod:`structure.response`; everything per metre of tunnel.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from structure.joint_contact import TANGENT_FLOOR, contact_moment, gaping_rotation, limited_shear

if TYPE_CHECKING:
    from structure.ring import Ring

#: Points of a face where a joint touches along it.
FACE_POINTS = 40


class JointForces(NamedTuple):
    """Forces in joints, or at points of their faces, and how they change.

    resisting : (..., n, k) against what moves: -N, Q and M of a joint (k = 3), -N and Q of a point (k = 2).
    tangent : (..., n, k, k) its change with opening, dislocation and rotation.
    slip : (..., n) irreversible part of the dislocation once these forces are taken as reached [m].
    """

    resisting: np.ndarray
    tangent: np.ndarray
    slip: np.ndarray

    @property
    def axial(self) -> np.ndarray:
        """N [N/m], compression positive, (..., n)."""
        return -self.resisting[..., 0]

    @property
    def shear(self) -> np.ndarray:
        """Q [N/m], (..., n)."""
        return self.resisting[..., 1]

    @property
    def moment(self) -> np.ndarray:
        """M [N m/m] of a joint, (..., n)."""
        return self.resisting[..., 2]


class ContactLaw:
    """The law of joints, or of points of their faces, all alike but for their numbers.

    Parameters
    ----------
    springs : (count, moves) float64
        Stiffness against opening, dislocation and, of whole joints, rotation, while nothing limits it.
    floors : (count, moves) float64
        Least stiffness in the tangent.
    contact_only : bool
        Whether they only press.
    height, friction : (count,) float64 or None
        Of the contact zone [m]; mu [-].

    Attributes
    ----------
    linear : bool
        Independent linear springs.
    conservative : bool
        The forces derive from a convex energy.
    remembers : bool
        The forces depend on the way there (sliding).
    count, moves : int
        How many there are, and in how many ways each moves.
    """

    def __init__(
        self,
        springs: np.ndarray,
        floors: np.ndarray,
        contact_only: bool,
        height: np.ndarray | None,
        friction: np.ndarray | None,
    ):
        self.springs, self.floors = springs, floors
        self.contact_only, self.height, self.friction = contact_only, height, friction
        self.count, self.moves = springs.shape
        limited = contact_only or height is not None or friction is not None
        self.linear = not (limited and self.count)
        self.conservative = self.linear or (height is None and friction is None)
        self.remembers = friction is not None and self.count > 0

    def forces(self, moved: np.ndarray, slip: np.ndarray, pressed: np.ndarray | None = None) -> JointForces:
        """Forces in the joints, or at the points.

        Parameters
        ----------
        moved : (..., count, moves) float64
            Opening [m], dislocation [m] and, of joints, rotation [rad].
        slip : (..., count) float64
            Slip before [m]; zero for a joint that never slid.
        pressed : (..., count) float64, optional
            Axial forces [N/m] that limit Q and M in place of those of the openings; the forces then have an energy.
        """
        normal = self.springs[:, 0]
        apart = (moved[..., 0] > 0) & self.contact_only
        axial = np.where(apart, 0.0, -normal * moved[..., 0])
        limiting, by_opening = (axial, np.where(apart, 0.0, -normal)) if pressed is None else (pressed, 0.0)
        resisting, own = self.springs * moved, np.broadcast_to(self.springs, moved.shape).copy()
        tangent, diagonal = np.zeros((*moved.shape, self.moves)), np.arange(self.moves)
        resisting[..., 0], own[..., 0] = -axial, np.where(apart, 0.0, normal)
        if self.friction is not None:
            resisting[..., 1], own[..., 1], by_axial, slip = limited_shear(
                moved[..., 1], slip, limiting, self.springs[:, 1], self.friction
            )
            tangent[..., 1, 0] = by_axial * by_opening
        if self.height is not None:
            resisting[..., 2], own[..., 2], by_axial = contact_moment(
                moved[..., 2], limiting, self.springs[:, 2], self.height
            )
            tangent[..., 2, 0] = by_axial * by_opening
        tangent[..., diagonal, diagonal] = np.maximum(own, self.floors)
        return JointForces(resisting, tangent, slip)

    def followed_by(self, other: Self) -> Self:
        """The law of the joints of two rings built alike, those of this one first."""
        both = copy.copy(self)
        both.count = self.count + other.count
        for name in ("springs", "floors", "height", "friction"):
            if getattr(self, name) is not None:
                setattr(both, name, np.concatenate([getattr(self, name), getattr(other, name)]))
        return both


class JointLaw(ContactLaw):
    """The law of every joint of a ring, on the mean movement of its faces.

    Parameters
    ----------
    ring : Ring
        Its ``joint_contact_only``, ``joint_contact_height`` and ``joint_friction_coefficient`` choose the law.
    resists : bool
        False: springs of no stiffness, of joints that are soft material, part of the segments.
    """

    def __init__(self, ring: Ring, resists: bool = True):
        along, across = ring.axial_stiffness / ring.centre_radius, ring.bending_stiffness / ring.centre_radius
        height, friction = (
            None if getattr(ring, name) is None else ring.per_joint(name)
            for name in ("joint_contact_height", "joint_friction_coefficient")
        )
        springs = ring.joint_springs * resists
        floors = TANGENT_FLOOR * np.minimum(springs, [along, along, across])
        super().__init__(springs, floors, ring.joint_contact_only, height, friction)

    def between(self, both: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
        """Movements (n_joints, 3) at which forces plus `stiffness` times movements are `both`, of unslipped joints."""
        opening, dislocation, rotation = (both / (self.springs + stiffness)).T
        (normal, sliding, turning), (around, beside, about) = self.springs.T, stiffness.T
        if self.contact_only:
            opening = np.where(opening > 0, both[:, 0] / around, opening)
        compression = np.maximum(-normal * opening, 0.0)
        if self.friction is not None:
            limit, trial = self.friction * compression, sliding * dislocation
            rest = (both[:, 1] - np.clip(trial, -limit, limit)) / beside
            dislocation = np.where(np.abs(trial) > limit, rest, dislocation)
        if self.height is not None:
            gaping = np.abs(rotation) > compression * self.height / (6 * turning)
            if gaping.any():
                turned = gaping_rotation(np.abs(both[:, 2]), compression, turning, self.height, about)
                rotation = np.where(gaping, np.sign(rotation) * turned, rotation)
        return np.stack([opening, dislocation, rotation], axis=-1)

    def states(self, moved: np.ndarray, forces: JointForces) -> list[str]:
        """What each joint does, in words, from its movements (n_joints, 3) and forces."""
        compression = np.maximum(forces.axial, 0.0)
        happens = {"open": (moved[:, 0] > 0) & self.contact_only}
        if self.height is not None:
            happens["gaping at one edge"] = np.abs(forces.moment) > compression * self.height / 6
        if self.friction is not None:
            happens["sliding"] = np.abs(forces.shear) >= compression * self.friction
        return [", ".join(word for word in happens if happens[word][k]) or "closed" for k in range(len(moved))]


class FacePoints(NamedTuple):
    """Points of the faces of all joints, those of one joint after the other.

    joint : (n,) int;  lever : (n,) float64, outward from the centre line [m];  length : (n,) float64, of the face that
    each stands for [m].
    """

    joint: np.ndarray
    lever: np.ndarray
    length: np.ndarray


class FaceLaw(ContactLaw):
    """Contact along the faces of the joints: every point presses where they overlap, and slides by friction.

    Parameters
    ----------
    ring : Ring
        Its ``joint_contact`` is "face"; normal and shear stiffness are spread evenly over the contact height.
    points : FacePoints
    """

    def __init__(self, ring: Ring, points: FacePoints):
        self.points = points
        share = (points.length / np.bincount(points.joint, points.length)[points.joint])[:, None]
        springs = share * ring.joint_springs[points.joint, :2]
        floors = TANGENT_FLOOR * np.minimum(springs, ring.axial_stiffness / ring.centre_radius * share)
        friction = ring.joint_friction_coefficient
        if friction is not None:
            friction = ring.per_joint("joint_friction_coefficient")[points.joint]
        super().__init__(springs, floors, True, None, friction)

    def followed_by(self, other: Self) -> Self:
        """As of every law; joints are numbered on."""
        both = super().followed_by(other)
        further = other.points._replace(joint=other.points.joint + self.points.joint.max() + 1)
        both.points = FacePoints(*map(np.concatenate, zip(self.points, further, strict=True)))
        return both

    def states(self, moved: np.ndarray, forces: JointForces) -> list[str]:
        """What each joint does, in words, from the movements (n, 2) and forces of its points."""
        return [", ".join(filter(None, self._state(moved, forces, joint))) or "closed"
                for joint in range(self.points.joint.max() + 1)]  # fmt: skip

    def _state(self, moved, forces, joint):
        here = self.points.joint == joint
        apart = moved[here, 0] > 0
        gaps = "open" if apart.all() else "gaping at one edge" if apart.any() else ""
        if self.friction is None or apart.all():
            return gaps, ""
        slides = np.abs(forces.shear[here]) >= self.friction[here] * forces.axial[here]
        return gaps, "sliding" if slides[~apart].all() else ""
