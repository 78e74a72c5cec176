"""Exact stress paths of Mohr-Coulomb soil with tension cut-off under straight strain paths in fixed principal axes.

Slow and plain: the yield planes are listed one by one, whichever principal stresses they join, and the path is
integrated from event to event in rate form; nothing of the return mapping of `mpm` is used.
"""

from itertools import combinations, permutations

import numpy as np

TOLERANCE = 1e-10  # of the stress scale: a plane counts as reached


def stiffness(youngs_modulus, poissons_ratio):
    """Isotropic elasticity in principal axes: (3, 3) [Pa]."""
    shear = youngs_modulus / (2 * (1 + poissons_ratio))
    lam = 2 * shear * poissons_ratio / (1 - 2 * poissons_ratio)
    return lam * np.ones((3, 3)) + 2 * shear * np.eye(3)


def yield_planes(cohesion, friction_angle, dilatancy_angle, tensile_strength):
    """Normals, flow directions and offsets of the planes f = n s - k: (9, 3), (9, 3), (9,); angles in degrees.

    Six planes join two principal stresses, (s_i - s_j) + (s_i + s_j) sin(phi) = 2 c cos(phi), with the flow of the
    same form in psi; three cap one of them at the tensile strength with associated flow (Rankine).
    """
    phi, psi = np.radians(friction_angle), np.radians(dilatancy_angle)
    normals, flows = np.zeros((2, 9, 3))
    for row, (i, j) in enumerate(permutations(range(3), 2)):
        for planes, sine in ((normals, np.sin(phi)), (flows, np.sin(psi))):
            planes[row, i], planes[row, j] = 1 + sine, -(1 - sine)
    normals[6:] = flows[6:] = np.eye(3)
    return normals, flows, np.array([2 * cohesion * np.cos(phi)] * 6 + [tensile_strength] * 3)


def stress_rate(strain_rate, active, elastic, normals, flows):
    """Rate of stress with the planes `active` reached [Pa/s].

    Koiter (1953): sigma' = D (eps' - sum lambda_i m_i), lambda_i >= 0, n_i sigma' <= 0, one of both zero; the first
    set of at most three planes that fulfils it, the smallest first.

    Raises ArithmeticError: where no set does: the flow rule has no answer to this strain rate.
    """
    free = elastic @ strain_rate
    scale = np.abs(free).max()
    for count in range(min(len(active), 3) + 1):
        for chosen in combinations(active, count):
            rate = free
            if count:
                chosen = list(chosen)
                through = normals[chosen] @ elastic @ flows[chosen].T
                if np.linalg.cond(through) > 1e12:
                    continue
                multiplier = np.linalg.solve(through, normals[chosen] @ free)
                if multiplier.min() < 0:
                    continue
                rate = free - elastic @ flows[chosen].T @ multiplier
            if np.all(normals[list(active)] @ rate <= 1e-9 * scale):
                return rate
    raise ArithmeticError("no admissible stress rate")


def exact_path(stress, strain_rates, times, elastic, planes):
    """Stresses at the end of each straight piece of a strain path: (n_pieces, 3) [Pa].

    stress : (3,) float64, admissible at the start [Pa], tension positive;  strain_rates : (n_pieces, 3) float64 [1/s];
    times : (n_pieces,) durations [s];  elastic : (3, 3) float64;  planes : of `yield_planes`.
    """
    normals, flows, offsets = planes
    stress = np.array(stress, float)
    result = []
    for strain_rate, duration in zip(np.asarray(strain_rates, float), times, strict=True):
        left = float(duration)
        scale = np.abs(elastic @ strain_rate).max() * left + np.abs(stress).max()
        while left > 0:
            distance = offsets - normals @ stress
            active = np.flatnonzero(distance <= TOLERANCE * scale)
            rate = stress_rate(strain_rate, active, elastic, normals, flows)
            approach = normals @ rate
            approach[active] = 0.0
            with np.errstate(divide="ignore", invalid="ignore"):
                reach = np.where(approach > 0, distance / approach, np.inf)
            step = min(left, float(reach.min()))
            stress = stress + step * rate
            left -= step
        result.append(stress.copy())
    return np.array(result)
