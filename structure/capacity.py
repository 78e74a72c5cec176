"""Capacity of a reinforced concrete segment under axial force and bending: EN 1992-1-1, parabola-rectangle diagram.

Strains here are positive in compression; N and M have the signs of :mod:`structure.response`, so M > 0 compresses the
inner face.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from structure.segment import SegmentSection

#: Gauss points over each part of the section with a smooth stress; the parabola needs two, other exponents a few.
GAUSS_POINTS = 12


class Capacity(NamedTuple):
    """Boundary of the forces a section carries, a closed polygon around zero: N [N/m] and M [N m/m]."""

    axial_force: np.ndarray
    bending_moment: np.ndarray


def resultants(
    section: SegmentSection, thickness: float, strain_outer: np.ndarray, strain_inner: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """N [N/m] and M [N m/m] about the centre line of plane strain states.

    The concrete that bars displace is left out (net section). Gauss quadrature between the depths where the strain is 0
    and eps_c2, where the stress has its kinks.

    Parameters
    ----------
    thickness : float
        [m].
    strain_outer, strain_inner : (n,) float64
        Strain at each face [-], compression positive.
    """
    outer, inner = (np.asarray(strain, dtype=float)[:, None] for strain in (strain_outer, strain_inner))
    slope = inner - outer
    with np.errstate(divide="ignore", invalid="ignore"):
        kinks = np.concatenate([-outer / slope, (section.concrete_peak_strain - outer) / slope], axis=1)
    kinks = np.clip(np.where(slope == 0, 0.0, kinks), 0.0, 1.0)
    ends = np.zeros((len(outer), 1))
    cuts = np.sort(np.concatenate([ends, kinks, ends + 1], axis=1), axis=1)
    place, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    length = np.diff(cuts, axis=1)[:, :, None]
    depth = (cuts[:, :-1, None] + length * (place + 1) / 2).reshape(len(outer), -1)
    stress = section.concrete_stress(outer + slope * depth)
    force = stress * (length * weight / 2).reshape(len(outer), -1) * thickness
    axial = force.sum(1)
    # depth from the outer face: what presses on the inner half bends with tension outside
    moment = (force * (depth - 0.5)).sum(1) * thickness
    bars = (
        (section.steel_area("outer"), section.bar_depth("outer")),
        (section.steel_area("inner"), thickness - section.bar_depth("inner")),
    )
    for area, at in bars:
        strain = (outer + slope * at / thickness)[:, 0]
        bar_force = area * (section.steel_stress(strain) - section.concrete_stress(strain))
        axial = axial + bar_force
        moment = moment + bar_force * (at - thickness / 2)
    return axial, moment


def ultimate_strains(section: SegmentSection, thickness: float, bar_depth: float, count: int):
    """Strains of the pressed and of the other face at failure, from pure compression to pure tension.

    EN 1992-1-1, Fig. 6.1: pivot C (eps_c2 at the depth (1 - eps_c2/eps_cu2) h), then B (eps_cu2 at the face), then A
    (eps_ud in the steel of the other face, `bar_depth` from it).
    """
    peak, limit, steel = section.concrete_peak_strain, section.concrete_strain_limit, section.steel_strain_limit
    arm = 1 - bar_depth / thickness
    pivot = 1 - peak / limit
    other_c = np.linspace(peak, 0.0, count)
    pressed_c = (peak - other_c * pivot) / (1 - pivot)
    # states crowd where the neutral axis is still deep; the balanced one, where the steel yields, is a corner
    other_b = -(np.geomspace(1.0, 1 + ((limit + steel) / arm - limit) / limit, 2 * count) - 1)[1:] * limit
    balanced = limit - (limit + section.steel_design_strength / section.steel_modulus) / arm
    other_b = np.sort(np.append(other_b, balanced))[::-1]
    pressed_b = np.full_like(other_b, limit)
    pressed_a = np.concatenate([np.linspace(limit, 0, count)[1:], -np.geomspace(1e-3, 1, count) * steel])
    other_a = pressed_a - (steel + pressed_a) / arm
    return np.concatenate([pressed_c, pressed_b, pressed_a]), np.concatenate([other_c, other_b, other_a])


def interaction(section: SegmentSection, thickness: float, count: int = 100) -> Capacity:
    """M-N interaction diagram of a section: a polygon of about 10 `count` ultimate states, from pure compression on.

    The corners lie on the exact curve, so the polygon is inside it but for a slight hollow near pure tension. First the
    half that presses the inner face (M > 0), down to pure tension, then the other half back up.
    """
    section.check_thickness(thickness)
    pressed, other = ultimate_strains(section, thickness, section.bar_depth("outer"), count)
    positive = resultants(section, thickness, strain_outer=other, strain_inner=pressed)
    pressed, other = ultimate_strains(section, thickness, section.bar_depth("inner"), count)
    negative = resultants(section, thickness, strain_outer=pressed, strain_inner=other)
    return Capacity(*(np.concatenate([down, up[-2:0:-1]]) for down, up in zip(positive, negative, strict=True)))


def radial_utilisation(capacity: Capacity, axial_force: np.ndarray, bending_moment: np.ndarray) -> np.ndarray:
    """How far N and M are on their way from zero to the boundary, growing in proportion, (...) float64; 1 on it."""
    scale = np.array([np.ptp(capacity.axial_force), np.ptp(capacity.bending_moment)])
    corners = np.stack(capacity, axis=1) / scale
    # states in which all steel yields in tension coincide
    angle, first = np.unique(np.arctan2(corners[:, 1], corners[:, 0]), return_index=True)
    corners = corners[first]
    point = np.stack(np.broadcast_arrays(axial_force, bending_moment), axis=-1) / scale
    after = np.searchsorted(angle, np.arctan2(point[..., 1], point[..., 0])) % len(angle)
    start, edge = corners[after - 1], corners[after] - corners[after - 1]
    return _cross(point, edge) / _cross(start, edge)


def _cross(one, other):
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]


def moment_utilisation(capacity: Capacity, axial_force: np.ndarray, bending_moment: np.ndarray) -> np.ndarray:
    """M over the moment that the section carries at the same N, (...) float64; infinite where it does not carry N."""
    turn = int(np.argmin(capacity.axial_force))
    halves = (np.arange(turn + 1), np.append(0, np.arange(len(capacity.axial_force) - 1, turn - 1, -1)))
    resisted = []
    for half in halves:
        axial, moment = capacity.axial_force[half], capacity.bending_moment[half]
        # unequal steel lets N rise a little on the way from pure compression: those corners are left out
        falling = np.append(True, axial[1:] < np.minimum.accumulate(axial)[:-1])
        axial, moment = axial[falling][::-1], moment[falling][::-1]
        resisted.append(np.interp(axial_force, axial, moment, left=0.0, right=0.0))
    resistance = np.where(bending_moment >= 0, resisted[0], -resisted[1])
    inside = (axial_force > capacity.axial_force.min()) & (axial_force < capacity.axial_force.max()) & (resistance > 0)
    return np.where(inside, np.abs(bending_moment) / np.where(inside, resistance, 1.0), np.inf)
