"""Width of the cracks of a segment in service: EN 1992-1-1, 7.3.4, on the cracked elastic section."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from structure.segment import SegmentSection

#: k_t by how long the load acts: EN 1992-1-1, Eq. (7.9).
DURATION_FACTORS = {"short-term": 0.6, "long-term": 0.4}
BISECTIONS = 50


class Cracked(NamedTuple):
    """State of a cracked section.

    steel_stress : tension in the bars [Pa];  axis_depth : from the pressed face to where the strain is 0 [m], below 0
    where all of the section is in tension;  other_strain : least over largest tension of the faces [-], 0 in bending.
    """

    steel_stress: np.ndarray
    axis_depth: np.ndarray
    other_strain: np.ndarray


def crack_width(
    section: SegmentSection,
    thickness: float,
    axial_force: np.ndarray,
    bending_moment: np.ndarray,
    duration: Literal["short-term", "long-term"],
) -> np.ndarray:
    """w_k at the face with more tension [m]; 0 where the concrete does not crack.

    It cracks where |M|/(h^2/6) - N/h exceeds f_ctm, 7.1(2). Then, with c and phi of the bars in tension:

        w_k = s_r,max (eps_sm - eps_cm), Eq. (7.8);
        eps_sm - eps_cm = (sigma_s - k_t f_ctm/rho (1 + alpha_e rho))/E_s, at least 0.6 sigma_s/E_s, Eq. (7.9);
        s_r,max = 3.4 c + 0.8 k_2 0.425 phi/rho, Eq. (7.11), or 1.3 (h - x) where the bars are further apart than
        5 (c + phi/2), Eq. (7.14);
        rho = A_s/h_c,ef with h_c,ef the least of 2.5 (h - d), (h - x)/3 and h/2, 7.3.2(3);
        k_2 = 0.5 in bending, (eps_1 + eps_2)/(2 eps_1) where all is in tension, Eq. (7.13); alpha_e = E_s/E_cm.

    Steel stays elastic: a stress beyond f_yk says that the section is not in service.

    Parameters
    ----------
    section : SegmentSection
    thickness : float
        h [m].
    axial_force, bending_moment : (...) float64
        Of the serviceability state, N [N/m] and M [N m/m], signs of :mod:`structure.response`.
    duration : {"short-term", "long-term"}
        Of the load: k_t = 0.6 or 0.4.

    Returns
    -------
    (...) float64

    Source: EN 1992-1-1:2004, 7.1, 7.3.2, 7.3.4; high-bond bars, recommended k_3 and k_4.
    """
    axial, moment = np.broadcast_arrays(np.asarray(axial_force, float), np.asarray(bending_moment, float))
    width = np.zeros(axial.shape)
    cracks = 6 * np.abs(moment) / thickness**2 - axial / thickness > section.concrete_tensile_strength
    for tense, pressed, here in (("outer", "inner", cracks & (moment >= 0)), ("inner", "outer", cracks & (moment < 0))):
        if here.any():
            state = cracked_state(section, thickness, axial[here], np.abs(moment[here]), tense, pressed)
            width[here] = _width(section, thickness, state, tense, DURATION_FACTORS[duration])
    return width


def cracked_state(
    section: SegmentSection, thickness: float, axial_force: np.ndarray, moment: np.ndarray, tense: str, pressed: str
) -> Cracked:
    """Elastic state of concrete without tension and both layers of bars, the net section, under N and M.

    The strains of the two faces are turned from pure tension to an axis at the tense face until N/M is that asked for:
    their direction in the N-M plane turns one way, so bisection finds it.

    Parameters
    ----------
    axial_force, moment : (n,) float64
        N [N/m] and M >= 0 [N m/m].
    tense, pressed : {"outer", "inner"}
        The faces.
    """
    concrete, steel = section.concrete_modulus, section.steel_modulus
    bars = (
        (section.steel_area(pressed), section.bar_depth(pressed)),
        (section.steel_area(tense), thickness - section.bar_depth(tense)),
    )

    def forces(share):
        tension, compression = 1 - share, 2 * share - 1  # strains of the faces, to a factor
        curvature = (compression + tension) / thickness
        depth = np.maximum(compression, 0.0) / curvature
        block = concrete * depth * np.maximum(compression, 0.0) / 2
        axial, bending = block, block * (thickness / 2 - depth / 3)
        for area, at in bars:
            strain = compression - curvature * at
            force = area * strain * np.where(strain > 0, steel - concrete, steel)
            axial, bending = axial + force, bending + force * (thickness / 2 - at)
        return axial, bending, compression / curvature, curvature

    low, high = np.full(axial_force.shape, 1e-9), np.full(axial_force.shape, 1 - 1e-9)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        axial, bending, _, _ = forces(middle)
        below = moment * axial < axial_force * bending
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    axial, bending, depth, curvature = forces(low)
    factor = np.hypot(axial_force * thickness, moment) / np.hypot(axial * thickness, bending)
    stress = steel * factor * curvature * (bars[1][1] - depth)
    return Cracked(stress, depth, np.maximum(-depth, 0.0) / (thickness - depth))


def _width(section, thickness, state, tense, duration_factor):
    cover, diameter = getattr(section, f"cover_{tense}"), getattr(section, f"bar_diameter_{tense}")
    effective = np.minimum(min(2.5 * section.bar_depth(tense), thickness / 2), (thickness - state.axis_depth) / 3)
    share = section.steel_area(tense) / effective
    ratio = section.steel_modulus / section.concrete_modulus
    stiffened = duration_factor * section.concrete_tensile_strength / share * (1 + ratio * share)
    strain = np.maximum(state.steel_stress - stiffened, 0.6 * state.steel_stress) / section.steel_modulus
    if getattr(section, f"bar_spacing_{tense}") > 5 * (cover + diameter / 2):
        spacing = 1.3 * (thickness - state.axis_depth)
    else:
        spacing = 3.4 * cover + 0.8 * 0.5 * (1 + state.other_strain) * 0.425 * diameter / share
    return spacing * strain
