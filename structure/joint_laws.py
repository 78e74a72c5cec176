"""Laws of a joint between segments: forces over opening, dislocation and rotation, with tangent and memory.

Linear springs, or any of three limits that a dry joint has: it opens (no tension), it rotates about a shrinking contact
zone once its edge decompresses (Janssen), and it slides when friction is used up (Coulomb).
Signs as in :mod:`structure.response`; everything per metre of tunnel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from structure.ring import Ring

#: Share of the stiffness of joint or segment, whichever is less, kept in the *tangent* only of a joint that is open,
#: sliding or nearly hinged: the ring stays factorisable, and convergence slows by no more than this factor a step.
TANGENT_FLOOR = 1e-6
#: Of Newton's method for a rotation, and the relative change at which it stops.
MAX_STEPS, CLOSE = 60, 1e-8
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


def contact_moment(
    rotation: np.ndarray, axial_force: np.ndarray, stiffness: np.ndarray, height: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Moment of a joint whose faces press on each other but cannot pull, and its derivatives.

    The joint is an elastic block as deep as its contact zone is high (h), of modulus E' = 12 k/h^2. Compressed over all
    of its height it is linear, M = k phi. The edge decompresses at |M| = N h/6, that is |phi| = phi_d = N h/(6 k); from
    there on a triangle of stress of length c = 3 (h/2 - |M|/N) and peak 2 N/c turns the block by (2 N/c)/(E' c) h,

        phi = 8 N/(9 h E' (1 - 2 |M|/(N h))^2)   or   |M| = N h/2 (1 - 2/3 sqrt(phi_d/|phi|)).

    Value and slope are continuous at phi_d, and |M| approaches N h/2, the force on the very edge. Without compression
    there is no moment.

    Parameters
    ----------
    rotation : (...) float64
        phi [rad].
    axial_force : (...) float64
        N [N/m], compression positive.
    stiffness : (...) float64
        k [N m/rad per metre], while the whole height is compressed.
    height : (...) float64
        h [m].

    Returns
    -------
    moment, by_rotation, by_axial_force : (...) float64
        M [N m/m], dM/dphi [N m/rad/m], dM/dN [m].

    Source: Leonhardt & Reimann (1966), concrete hinges; Janssen (1983) for the joints of segments.
    """
    compression = np.maximum(axial_force, 0.0)
    size = np.abs(rotation)
    decompression = compression * height / (6 * stiffness)
    gaping = size > decompression
    share = np.sqrt(decompression / np.where(gaping, size, 1.0))
    edge = np.sign(rotation) * height / 2
    moment = np.where(gaping, edge * compression * (1 - 2 / 3 * share), stiffness * rotation)
    by_rotation = np.where(gaping, stiffness * share**3, stiffness)
    by_axial_force = np.where(gaping & (axial_force > 0), edge * (1 - share), 0.0)
    return moment, by_rotation, by_axial_force


def gaping_rotation(
    both: np.ndarray, compression: np.ndarray, stiffness: np.ndarray, height: np.ndarray, around: np.ndarray
) -> np.ndarray:
    """Rotation at which the moment of :func:`contact_moment` plus `around` times the rotation is `both`; all (n,).

    For joints that gape there, of others at least the decompressed one. With q = sqrt(phi_d/phi), 0 < q <= 1, the root
    of N h/2 (1 - 2 q/3) + around phi_d/q^2 = both, convex and falling in q, by Newton's method from its left.
    """
    decompression, edge = compression * height / (6 * stiffness), compression * height / 2
    alone, wide = both / around, decompression > 0
    most = np.where(wide, decompression, 1.0)
    share = np.minimum(np.sqrt(most / np.where(wide, np.maximum(alone, most), 1.0)), 1.0)
    for _ in range(MAX_STEPS):
        left = edge * (1 - 2 / 3 * share) + around * most / share**2 - both
        longer = np.clip(share + left / (2 / 3 * edge + 2 * around * most / share**3), share, 1.0)
        share, change = longer, longer - share
        if np.all(change <= CLOSE * share):
            break
    return np.where(wide, most / share**2, alone)


def limited_shear(
    dislocation: np.ndarray, slip: np.ndarray, axial_force: np.ndarray, stiffness: np.ndarray, friction: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Shear force of a joint that slides where its stiffness asks for more than friction gives (return mapping).

    Trial Q = k (d - slip); beyond mu N it returns to mu N and the slip takes up the rest.

    Parameters
    ----------
    dislocation, slip : (...) float64
        d and its irreversible part so far [m].
    axial_force : (...) float64
        N [N/m]; a joint in tension has no friction.
    stiffness : (...) float64
        k [N/m per metre], above 0.
    friction : (...) float64
        mu [-].

    Returns
    -------
    shear, by_dislocation, by_axial_force, slip : (...) float64
        Q [N/m], dQ/dd [N/m2], dQ/dN [-], the new slip [m].
    """
    limit = friction * np.maximum(axial_force, 0.0)
    trial = stiffness * (dislocation - slip)
    sliding = np.abs(trial) > limit
    shear = np.clip(trial, -limit, limit)
    by_dislocation = np.where(sliding, 0.0, stiffness)
    by_axial_force = np.where(sliding & (axial_force > 0), friction * np.sign(trial), 0.0)
    slip = np.where(sliding, dislocation - shear / stiffness, slip)
    return shear, by_dislocation, by_axial_force, slip


class JointLaw:
    """The law of every joint of a ring, on the mean movement of its faces.

    Parameters
    ----------
    ring : Ring
        Its ``joint_contact_only``, ``joint_contact_height`` and ``joint_friction_coefficient`` choose the law.

    Attributes
    ----------
    linear : bool
        Three independent linear springs.
    conservative : bool
        The forces derive from a convex energy.
    remembers : bool
        The forces depend on the way there (sliding).
    count, moves : int
        How many joints there are, and in how many ways each moves.
    springs : (count, moves) float64
        Stiffness against each, while nothing limits it.
    """

    moves = 3

    def __init__(self, ring: Ring):
        self.count = len(ring.joint_angles)
        self.springs = ring.joint_springs
        self.normal, self.shear, self.rotation = self.springs.T
        along, across = ring.axial_stiffness / ring.centre_radius, ring.bending_stiffness / ring.centre_radius
        self.floors = TANGENT_FLOOR * np.minimum(self.springs, [along, along, across])
        self.contact_only = ring.joint_contact_only
        self.height, self.friction = (
            None if getattr(ring, name) is None else ring.per_joint(name)
            for name in ("joint_contact_height", "joint_friction_coefficient")
        )
        self.remembers = self.friction is not None and bool(ring.joint_angles)
        limited = self.contact_only or self.height is not None or self.friction is not None
        self.linear = not (limited and ring.joint_angles)
        self.conservative = self.linear or (self.height is None and self.friction is None)

    def forces(self, moved: np.ndarray, slip: np.ndarray, pressed: np.ndarray | None = None) -> JointForces:
        """Forces in the joints.

        Parameters
        ----------
        moved : (..., n_joints, 3) float64
            Opening [m], dislocation [m], rotation [rad].
        slip : (..., n_joints) float64
            Slip before [m]; zero for a joint that never slid.
        pressed : (..., n_joints) float64, optional
            Axial forces [N/m] that limit Q and M in place of those of the openings; the forces then have an energy.
        """
        opening, dislocation, rotation = np.moveaxis(moved, -1, 0)
        tangent = np.zeros((*moved.shape, 3))
        gap = opening > 0 if self.contact_only else np.zeros(opening.shape, dtype=bool)
        axial = np.where(gap, 0.0, -self.normal * opening)
        tangent[..., 0, 0] = np.where(gap, self.floors[:, 0], self.normal)
        axial_by_opening = np.where(gap, 0.0, -self.normal)
        if self.friction is None:
            shear, by_dislocation = self.shear * dislocation, self.shear
        else:
            limiting = axial if pressed is None else pressed
            shear, by_dislocation, by_axial, slip = limited_shear(
                dislocation, slip, limiting, self.shear, self.friction
            )
            tangent[..., 1, 0] = by_axial * axial_by_opening if pressed is None else 0.0
        tangent[..., 1, 1] = np.maximum(by_dislocation, self.floors[:, 1])
        if self.height is None:
            moment, by_rotation = self.rotation * rotation, self.rotation
        else:
            limiting = axial if pressed is None else pressed
            moment, by_rotation, by_axial = contact_moment(rotation, limiting, self.rotation, self.height)
            tangent[..., 2, 0] = by_axial * axial_by_opening if pressed is None else 0.0
        tangent[..., 2, 2] = np.maximum(by_rotation, self.floors[:, 2])
        return JointForces(np.stack([-axial, shear, moment], axis=-1), tangent, slip)

    def between(self, both: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
        """Movements (n_joints, 3) at which forces plus `stiffness` times movements are `both`, of unslipped joints."""
        opening, dislocation, rotation = (both / (self.springs + stiffness)).T
        around, beside, about = stiffness.T
        if self.contact_only:
            opening = np.where(opening > 0, both[:, 0] / around, opening)
        compression = np.maximum(-self.normal * opening, 0.0)
        if self.friction is not None:
            limit, trial = self.friction * compression, self.shear * dislocation
            sliding = np.abs(trial) > limit
            dislocation = np.where(sliding, (both[:, 1] - np.clip(trial, -limit, limit)) / beside, dislocation)
        if self.height is not None:
            gaping = np.abs(rotation) > compression * self.height / (6 * self.rotation)
            if gaping.any():
                turned = gaping_rotation(np.abs(both[:, 2]), compression, self.rotation, self.height, about)
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


class FaceLaw:
    """Contact along the faces of the joints: every point presses where they overlap, and slides by friction.

    Parameters
    ----------
    ring : Ring
        Its ``joint_contact`` is "face"; normal and shear stiffness are spread evenly over the contact height.
    points : FacePoints

    Attributes
    ----------
    As of :class:`JointLaw`, of points instead of joints.
    """

    moves, linear = 2, False

    def __init__(self, ring: Ring, points: FacePoints):
        self.points, self.count = points, len(points.joint)
        share = points.length / np.bincount(points.joint, points.length)[points.joint]
        self.springs = share[:, None] * ring.joint_springs[points.joint, :2]
        self.normal, self.shear = self.springs.T
        along = ring.axial_stiffness / ring.centre_radius * share
        self.floors = TANGENT_FLOOR * np.minimum(self.springs.T, along)
        friction = ring.joint_friction_coefficient
        self.friction = None if friction is None else ring.per_joint("joint_friction_coefficient")[points.joint]
        self.conservative, self.remembers = friction is None, friction is not None

    def forces(self, moved: np.ndarray, slip: np.ndarray, pressed: np.ndarray | None = None) -> JointForces:
        """Forces at the points from gap and slide (..., n, 2) [m] and the slip before (..., n) [m].

        pressed : as of :meth:`JointLaw.forces`
        """
        opening, slide = np.moveaxis(moved, -1, 0)
        tangent = np.zeros((*moved.shape, 2))
        apart = opening > 0
        axial = np.where(apart, 0.0, -self.normal * opening)
        tangent[..., 0, 0] = np.where(apart, self.floors[0], self.normal)
        if self.friction is None:
            shear, by_slide = self.shear * slide, self.shear
        else:
            limiting = axial if pressed is None else pressed
            shear, by_slide, by_axial, slip = limited_shear(slide, slip, limiting, self.shear, self.friction)
            tangent[..., 1, 0] = np.where(apart | (pressed is not None), 0.0, -self.normal * by_axial)
        tangent[..., 1, 1] = np.maximum(by_slide, self.floors[1])
        return JointForces(np.stack([-axial, shear], axis=-1), tangent, slip)

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


class BoltLaw(NamedTuple):
    """Bolts across the joints, as of :class:`structure.ring.Bolts`: they pull once their slack is used up.

    stiffness [N/m2], slack [m], preload [N/m] : (n_joints,) float64 each.
    """

    stiffness: np.ndarray
    slack: np.ndarray
    preload: np.ndarray

    def pull(self, elongation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force [N/m] and its derivative [N/m2] at elongations (..., n_joints) [m]."""
        force = self.preload + self.stiffness * (elongation - self.slack)
        return np.maximum(force, 0.0), np.where(force > 0, self.stiffness, TANGENT_FLOOR * self.stiffness)

    def between(self, both: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
        """Elongations (n_joints,) [m] at which pull plus `stiffness` times elongation is `both`."""
        loose = both / stiffness
        pulls = self.preload + self.stiffness * (loose - self.slack) > 0
        tight = (both - self.preload + self.stiffness * self.slack) / (self.stiffness + stiffness)
        return np.where(pulls, tight, loose)


def bolt_law(ring: Ring) -> BoltLaw:
    """That of the bolts of a ring that has some."""
    stated = [(bolts.stiffness, bolts.slack, bolts.preload) for bolts in ring.bolts]
    return BoltLaw(*np.array(stated).T)


class LawOfBoth:
    """The laws of the joints of two rings, those of the first before those of the other.

    one, other : JointLaw or FaceLaw, alike

    Attributes
    ----------
    As of :class:`JointLaw`.
    """

    def __init__(self, one: JointLaw | FaceLaw, other: JointLaw | FaceLaw):
        self.one, self.other = one, other
        self.count, self.moves = one.count + other.count, one.moves
        self.linear, self.conservative, self.remembers = one.linear, one.conservative, one.remembers
        self.springs = np.concatenate([one.springs, other.springs])

    def forces(self, moved: np.ndarray, slip: np.ndarray, pressed: np.ndarray | None = None) -> JointForces:
        """As of the two laws, (..., count, moves) and (..., count)."""
        first, found = self.one.count, []
        for law, part in ((self.one, slice(None, first)), (self.other, slice(first, None))):
            found.append(
                law.forces(moved[..., part, :], slip[..., part], None if pressed is None else pressed[..., part])
            )
        pairs = zip(zip(*found, strict=True), (-2, -3, -1), strict=True)
        return JointForces(*(np.concatenate(pair, axis) for pair, axis in pairs))

    def states(self, moved: np.ndarray, forces: JointForces) -> list[str]:
        """As of the two laws."""
        first = self.one.count
        ends = (self.one, slice(None, first)), (self.other, slice(first, None))
        return [
            word
            for law, part in ends
            for word in law.states(moved[part], JointForces(*(each[part] for each in forces)))
        ]
