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


class JointForces(NamedTuple):
    """Forces in joints and how they change.

    axial : N [N/m], compression positive;  shear : Q [N/m];  moment : M [N m/m], each (..., n_joints).
    tangent : (..., n_joints, 3, 3) change of (-N, Q, M) per (opening, dislocation, rotation).
    slip : (..., n_joints) irreversible part of the dislocation once these forces are taken as reached [m].
    """

    axial: np.ndarray
    shear: np.ndarray
    moment: np.ndarray
    tangent: np.ndarray
    slip: np.ndarray


def contact_moment(
    rotation: np.ndarray, axial_force: np.ndarray, stiffness: float, height: float
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
    stiffness : float
        k [N m/rad per metre], while the whole height is compressed.
    height : float
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


def limited_shear(
    dislocation: np.ndarray, slip: np.ndarray, axial_force: np.ndarray, stiffness: float, friction: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Shear force of a joint that slides where its stiffness asks for more than friction gives (return mapping).

    Trial Q = k (d - slip); beyond mu N it returns to mu N and the slip takes up the rest.

    Parameters
    ----------
    dislocation, slip : (...) float64
        d and its irreversible part so far [m].
    axial_force : (...) float64
        N [N/m]; a joint in tension has no friction.
    stiffness : float
        k [N/m per metre].
    friction : float
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
    slip = np.where(sliding, dislocation - shear / stiffness, slip) if stiffness > 0 else slip
    return shear, by_dislocation, by_axial_force, slip


class JointLaw:
    """The law of every joint of a ring.

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
    """

    def __init__(self, ring: Ring):
        self.normal = ring.joint_normal_stiffness
        self.shear = ring.joint_shear_stiffness
        self.rotation = ring.joint_rotational_stiffness
        along, across = ring.axial_stiffness / ring.centre_radius, ring.bending_stiffness / ring.centre_radius
        self.floors = TANGENT_FLOOR * np.minimum([self.normal, self.shear, self.rotation], [along, along, across])
        self.contact_only = ring.joint_contact_only
        self.height = ring.joint_contact_height
        self.friction = ring.joint_friction_coefficient
        self.remembers = self.friction is not None and bool(ring.joint_angles)
        limited = self.contact_only or self.height is not None or self.friction is not None
        self.linear = not (limited and ring.joint_angles)
        self.conservative = self.linear or (self.height is None and self.friction is None)

    def forces(self, jumps: np.ndarray, slip: np.ndarray) -> JointForces:
        """Forces in the joints.

        Parameters
        ----------
        jumps : (..., n_joints, 3) float64
            Opening [m], dislocation [m], rotation [rad].
        slip : (..., n_joints) float64
            Slip before [m]; zero for a joint that never slid.
        """
        opening, dislocation, rotation = np.moveaxis(jumps, -1, 0)
        tangent = np.zeros((*jumps.shape, 3))
        gap = opening > 0 if self.contact_only else np.zeros(opening.shape, dtype=bool)
        axial = np.where(gap, 0.0, -self.normal * opening)
        tangent[..., 0, 0] = np.where(gap, self.floors[0], self.normal)
        axial_by_opening = np.where(gap, 0.0, -self.normal)
        if self.friction is None:
            shear, by_dislocation = self.shear * dislocation, np.asarray(self.shear)
        else:
            shear, by_dislocation, by_axial, slip = limited_shear(dislocation, slip, axial, self.shear, self.friction)
            tangent[..., 1, 0] = by_axial * axial_by_opening
        tangent[..., 1, 1] = np.maximum(by_dislocation, self.floors[1])
        if self.height is None:
            moment, by_rotation = self.rotation * rotation, np.asarray(self.rotation)
        else:
            moment, by_rotation, by_axial = contact_moment(rotation, axial, self.rotation, self.height)
            tangent[..., 2, 0] = by_axial * axial_by_opening
        tangent[..., 2, 2] = np.maximum(by_rotation, self.floors[2])
        return JointForces(axial, shear, moment, tangent, slip)

    def states(self, jumps: np.ndarray, forces: JointForces) -> list[str]:
        """What each joint does, in words, from its jumps (n_joints, 3) and forces."""
        compression = np.maximum(forces.axial, 0.0)
        happens = {"open": (jumps[:, 0] > 0) & self.contact_only}
        if self.height is not None:
            happens["gaping at one edge"] = np.abs(forces.moment) > compression * self.height / 6
        if self.friction is not None:
            happens["sliding"] = np.abs(forces.shear) >= compression * self.friction
        return [", ".join(word for word in happens if happens[word][k]) or "closed" for k in range(len(jumps))]
