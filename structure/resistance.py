"""What concrete resists in shear and under the contact zone of a joint: EN 1992-1-1, 6.2.2 and 6.7.

Per metre of tunnel, signs of :mod:`structure.response`: N positive in compression, M positive with tension outside.
"""

from __future__ import annotations

import numpy as np

from structure.segment import SegmentSection


def shear_resistance(
    section: SegmentSection, thickness: float, axial_force: np.ndarray, bending_moment: np.ndarray
) -> np.ndarray:
    """V_Rd,c of a segment without shear reinforcement, never below 0 [N/m].

    With d from the pressed face to the bars in tension, rho_l = A_sl/d up to 0.02, k = 1 + sqrt(0.2 m/d) up to 2,
    sigma_cp = N_Ed/h up to 0.2 f_cd (tension counts against the segment), f_ck and stresses in MPa:

        V_Rd,c = (0.18/gamma_c k (100 rho_l f_ck)^(1/3) + 0.15 sigma_cp) d
        and at least (0.035 k^1.5 f_ck^0.5 + 0.15 sigma_cp) d.

    Parameters
    ----------
    section : SegmentSection
    thickness : float
        h [m].
    axial_force, bending_moment : (...) float64
        N_Ed [N/m] and M_Ed [N m/m]; the sign of M_Ed says which bars are in tension.

    Returns
    -------
    (...) float64

    Source: EN 1992-1-1:2004, 6.2.2(1), Eq. (6.2.a), (6.2.b), (6.3N), recommended values of C_Rd,c, v_min and k_1.
    """
    outside = np.asarray(bending_moment) >= 0
    depth = thickness - np.where(outside, section.bar_depth("outer"), section.bar_depth("inner"))
    area = np.where(outside, section.steel_area("outer"), section.steel_area("inner"))
    strength = section.concrete_strength / 1e6
    size = np.minimum(1 + np.sqrt(0.2 / depth), 2.0)
    steel = np.minimum(area / depth, 0.02)
    pressed = 0.15 * np.minimum(axial_force / thickness, 0.2 * section.concrete_design_strength)
    bars = 0.18 / section.concrete_partial_factor * size * np.cbrt(100 * steel * strength)
    least = 0.035 * size**1.5 * np.sqrt(strength)
    return np.maximum(1e6 * np.maximum(bars, least) + pressed, 0.0) * depth


def bearing_resistance(
    section: SegmentSection,
    thickness: float,
    contact_height: float,
    axial_force: np.ndarray,
    bending_moment: np.ndarray,
) -> np.ndarray:
    """F_Rdu of the concrete under the contact zone of a joint [N/m]; 0 where the force leaves the zone.

    The zone, as high as `contact_height` and in the middle of the thickness h, bears evenly over the height
    h_0 = contact_height - 2 e that is centred on the force, e = |M_Ed|/N_Ed. The force spreads across the thickness
    alone, over h_1 = 3 h_0 and no further than the nearer face lets it, h - 2 e:

        F_Rdu = A_c0 f_cd sqrt(A_c1/A_c0) = f_cd sqrt(h_0 h_1), at most 3 f_cd h_0.

    The tension across the force that comes with the spreading needs bars of its own, 6.7(4), which are not checked.

    Parameters
    ----------
    section : SegmentSection
    thickness, contact_height : float
        [m].
    axial_force, bending_moment : (...) float64
        N_Ed [N/m] and M_Ed [N m/m] in the joint; a joint in tension bears nothing and resists 0.

    Returns
    -------
    (...) float64

    Source: EN 1992-1-1:2004, 6.7(2), Eq. (6.63) and Fig. 6.29.
    """
    pressed = np.asarray(axial_force) > 0
    eccentricity = np.abs(bending_moment) / np.where(pressed, axial_force, np.inf)
    loaded = np.where(pressed, np.maximum(contact_height - 2 * eccentricity, 0.0), 0.0)
    spread = np.clip(thickness - 2 * eccentricity, 0.0, 3 * loaded)
    return section.concrete_design_strength * np.sqrt(loaded * spread)
