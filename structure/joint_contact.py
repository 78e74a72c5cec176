"""What one joint, or one point of its faces, resists: a contact zone that shrinks (Janssen), friction (Coulomb)."""

from __future__ import annotations

import numpy as np

#: Share of the stiffness of joint or segment, whichever is less, kept in the *tangent* only of a joint that is open,
#: sliding or nearly hinged: the ring stays factorisable, and convergence slows by no more than this factor a step.
TANGENT_FLOOR = 1e-6
#: Of Newton's method for a rotation, and the relative change at which it stops.
MAX_STEPS, CLOSE = 60, 1e-8


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
