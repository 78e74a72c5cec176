"""Mohr-Coulomb plasticity: return mapping in principal stresses with edges, apex and tension cut-off.

Tension positive. Source: de Souza Neto, Peric & Owen (2008), Computational Methods for
Plasticity, Box 8.4-8.7; perfectly plastic, dilatancy angle psi <= friction angle phi.

With a relaxation time stress may be beyond the surface and decays to it: viscoplasticity of Duvaut & Lions (1972), Les
inequations en mecanique et en physique; backward Euler as Simo & Hughes (1998), Computational Inelasticity, Box 2.11.
"""

import numpy as np

from mpm.jit import inline_kernel, kernel


@kernel
def return_principal(s1, s2, s3, shear, bulk, c_cos, sin_phi, sin_psi, apex, tension):
    """Return ordered principal stresses to the Mohr-Coulomb surface.

    Parameters
    ----------
    s1, s2, s3 : float
        Trial principal effective stresses [Pa], s1 >= s2 >= s3, tension positive.
    shear, bulk : float
        Elastic moduli [Pa].
    c_cos, sin_phi, sin_psi : float
        c cos(phi) [Pa], sine of friction and dilatancy angle.
    apex : float
        c cot(phi) [Pa]; infinite for phi = 0.
    tension : float
        Tensile strength [Pa].

    Returns
    -------
    tuple of four floats
        The returned stresses, and 1.0 where the apex or the tension cut-off acted.
    """
    cut = 0.0
    f = (s1 - s3) + (s1 + s3) * sin_phi - 2.0 * c_cos
    if f > 0.0:
        sin2 = sin_phi * sin_psi
        a = 4.0 * shear * (1.0 + sin2 / 3.0) + 4.0 * bulk * sin2
        down = 2.0 * shear * (1.0 + sin_psi / 3.0) + 2.0 * bulk * sin_psi
        side = (4.0 * shear / 3.0 - 2.0 * bulk) * sin_psi
        up = 2.0 * shear * (1.0 - sin_psi / 3.0) - 2.0 * bulk * sin_psi
        g = f / a
        r1 = s1 - down * g
        r2 = s2 + side * g
        r3 = s3 + up * g
        if r1 < r2 or r2 < r3:
            if (1.0 - sin_psi) * s1 - 2.0 * s2 + (1.0 + sin_psi) * s3 > 0.0:  # right edge, s2 = s3
                f2 = (s1 - s2) + (s1 + s2) * sin_phi - 2.0 * c_cos
                b = 2.0 * shear * (1.0 + sin_phi + sin_psi - sin2 / 3.0) + 4.0 * bulk * sin2
                det = a * a - b * b
                g1 = (a * f - b * f2) / det
                g2 = (a * f2 - b * f) / det
                r1 = s1 - down * (g1 + g2)
                r2 = s2 + side * g1 + up * g2
                r3 = s3 + up * g1 + side * g2
            else:  # left edge, s1 = s2
                f2 = (s2 - s3) + (s2 + s3) * sin_phi - 2.0 * c_cos
                b = 2.0 * shear * (1.0 - sin_phi - sin_psi - sin2 / 3.0) + 4.0 * bulk * sin2
                det = a * a - b * b
                g1 = (a * f - b * f2) / det
                g2 = (a * f2 - b * f) / det
                r1 = s1 - down * g1 + side * g2
                r2 = s2 + side * g1 - down * g2
                r3 = s3 + up * (g1 + g2)
        scale = abs(s1) + abs(s3) + c_cos
        if r1 + r2 + r3 > 3.0 * apex or r1 < r2 - 1e-9 * scale or r2 < r3 - 1e-9 * scale:
            r1 = apex
            r2 = apex
            r3 = apex
            cut = 1.0
        s1, s2, s3 = r1, r2, r3
    if s1 > tension:
        # A crack opens along its normal: associated flow (Rankine), the others follow through Poisson's ratio. Lowering
        # s1 by more than s3 lowers f; all three at the tension leave f = 2 (tension sin(phi) - c cos(phi)) <= 0.
        cut = 1.0
        along = bulk + 4.0 * shear / 3.0
        across = bulk - 2.0 * shear / 3.0
        r2 = s2 - across / along * (s1 - tension)
        r3 = s3 - across / along * (s1 - tension)
        if r2 > tension:
            r2 = tension
            r3 = s3 - across / (along + across) * (s1 + s2 - 2.0 * tension)
        s1 = tension
        s2 = r2
        s3 = min(r3, tension)
    return s1, s2, s3, cut


@inline_kernel
def mohr_coulomb(
    sxx, syy, szz, sxy, shear, bulk, c_cos, sin_phi, sin_psi, apex, tension, relaxation_time=0.0, dt=1.0
):  # fmt: skip
    """Return a plane-strain trial stress to the Mohr-Coulomb surface.

    Stresses [Pa], tension positive; parameters as in `return_principal`. The principal
    directions of an isotropic law are those of the trial stress, so they are kept.

    relaxation_time, dt : float
        In which stress beyond the surface falls by 1/e, 0: at once; since the last stress [s].

    Returns
    -------
    tuple of five floats
        sxx, syy, szz, sxy [Pa] and the flag of apex or tension cut-off.
    """
    centre = 0.5 * (sxx + syy)
    half = 0.5 * (sxx - syy)
    radius = np.sqrt(half * half + sxy * sxy)
    pa = centre + radius
    pb = centre - radius
    high = max(pa, szz)
    low = min(pb, szz)
    cut = 0.0
    if (high - low) + (high + low) * sin_phi - 2.0 * c_cos > 0.0 or high > tension:
        if szz >= pa:
            r3z, ra, rb, cut = return_principal(szz, pa, pb, shear, bulk, c_cos, sin_phi, sin_psi, apex, tension)
        elif szz >= pb:
            ra, r3z, rb, cut = return_principal(pa, szz, pb, shear, bulk, c_cos, sin_phi, sin_psi, apex, tension)
        else:
            ra, rb, r3z, cut = return_principal(pa, pb, szz, shear, bulk, c_cos, sin_phi, sin_psi, apex, tension)
        if relaxation_time > 0.0:
            keep = relaxation_time / (relaxation_time + dt)
            ra += keep * (pa - ra)
            rb += keep * (pb - rb)
            r3z += keep * (szz - r3z)
        szz = r3z
        centre = 0.5 * (ra + rb)
        ratio = 0.5 * (ra - rb) / radius if radius > 0.0 else 0.0
        sxx = centre + half * ratio
        syy = centre - half * ratio
        sxy = sxy * ratio
    return sxx, syy, szz, sxy, cut
