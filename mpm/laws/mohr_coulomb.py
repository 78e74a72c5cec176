"""Mohr-Coulomb plasticity: return mapping in principal stresses with edges, apex and tension cut-off.

Tension positive. Source: de Souza Neto, Peric & Owen (2008), Computational Methods for
Plasticity, Box 8.4-8.7; perfectly plastic, dilatancy angle psi <= friction angle phi.

With a relaxation time stress may be beyond the surface and decays to it: viscoplasticity of Duvaut & Lions (1972), Les
inequations en mecanique et en physique; backward Euler as Simo & Hughes (1998), Computational Inelasticity, Box 2.11.
"""

import math
from typing import Literal, NamedTuple

from pydantic import model_validator

from mpm.laws.elastic import Elastic
from mpm.laws.stress import Stress, elastic_trial


class Strength(NamedTuple):
    """Where Mohr-Coulomb soil yields, and how it flows."""

    c_cos: float  # c cos(phi) [Pa]
    sin_phi: float  # of the friction angle
    sin_psi: float  # of the dilatancy angle
    apex: float  # c cot(phi) [Pa]; infinite for phi = 0
    tension: float  # tensile strength, not above the apex [Pa]


def return_principal(s1, s2, s3, shear, bulk, strength):
    """Return ordered principal stresses to the Mohr-Coulomb surface.

    Parameters
    ----------
    s1, s2, s3 : float
        Trial principal effective stresses [Pa], s1 >= s2 >= s3, tension positive.
    shear, bulk : float
        Elastic moduli [Pa].
    strength : Strength

    Returns
    -------
    tuple of three floats and a truth value
        The returned stresses, and whether the apex or the tension cut-off acted.
    """
    c_cos, sin_phi, sin_psi, apex, tension = strength
    cut = False
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
            cut = True
        s1, s2, s3 = r1, r2, r3
    if s1 > tension:
        # A crack opens along its normal: associated flow (Rankine), the others follow through Poisson's ratio. Lowering
        # s1 by more than s3 lowers f; all three at the tension leave f = 2 (tension sin(phi) - c cos(phi)) <= 0.
        cut = True
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


def return_to_surface(trial, shear, bulk, strength, keep):
    """Return a plane-strain trial stress to the Mohr-Coulomb surface.

    The principal directions of an isotropic law are those of the trial stress, so they are kept.

    Parameters
    ----------
    trial : Stress
    shear, bulk, strength : as in `return_principal`
    keep : float
        Share of the stress beyond the surface that stays [-].

    Returns
    -------
    Stress, and whether the apex or the tension cut-off acted.
    """
    sxx, syy, szz, sxy = trial
    centre = 0.5 * (sxx + syy)
    half = 0.5 * (sxx - syy)
    radius = math.sqrt(half * half + sxy * sxy)
    pa = centre + radius
    pb = centre - radius
    high = max(pa, szz)
    low = min(pb, szz)
    cut = False
    if (high - low) + (high + low) * strength.sin_phi - 2.0 * strength.c_cos > 0.0 or high > strength.tension:
        if szz >= pa:
            r3z, ra, rb, cut = return_principal(szz, pa, pb, shear, bulk, strength)
        elif szz >= pb:
            ra, r3z, rb, cut = return_principal(pa, szz, pb, shear, bulk, strength)
        else:
            ra, rb, r3z, cut = return_principal(pa, pb, szz, shear, bulk, strength)
        if keep > 0.0:
            ra += keep * (pa - ra)
            rb += keep * (pb - rb)
            r3z += keep * (szz - r3z)
        szz = r3z
        centre = 0.5 * (ra + rb)
        ratio = 0.5 * (ra - rb) / radius if radius > 0.0 else 0.0
        sxx = centre + half * ratio
        syy = centre - half * ratio
        sxy = sxy * ratio
    return Stress(sxx, syy, szz, sxy), cut


class MohrCoulomb(Elastic):
    """Linear elastic, perfectly plastic soil.

    Parameters
    ----------
    youngs_modulus, cohesion, friction_angle, dilatancy_angle, tensile_strength : float
        [Pa], [Pa], [deg], [deg], [Pa]
    relaxation_time : float
        In which stress beyond the strength falls by 1/e [s] (Duvaut & Lions 1972); 0: at once, perfectly plastic. Where
        soil shears at a rate e' it bears 2 G e' times this time more, and slip lines get a width. Not in the drained
        initial state.
    """

    model: Literal["mohr-coulomb"]

    helpers = (elastic_trial, return_principal, return_to_surface)

    @model_validator(mode="after")
    def _check_strength(self):
        if self.friction_angle == 0 and self.cohesion == 0:
            raise ValueError(
                f"soil '{self.name}': friction_angle and cohesion must not both be 0, no strength at all; give one "
                "of them"
            )
        return self

    @property
    def constants(self):
        """Elastic moduli, strength, relaxation time."""
        phi = math.radians(self.friction_angle)
        apex = self.cohesion / math.tan(phi) if phi > 0 else math.inf
        elastic = super().constants
        return elastic | {
            "bulk": elastic["lame"] + 2 * elastic["shear"] / 3,
            "c_cos": self.cohesion * math.cos(phi),
            "sin_phi": math.sin(phi),
            "sin_psi": math.sin(math.radians(self.dilatancy_angle)),
            "apex": apex,
            "tension": min(self.tensile_strength, apex),
            "relaxation_time": self.relaxation_time,
        }

    @property
    def in_words(self):
        """Elastic parameters and strength."""
        strength = f"c' {self.cohesion / 1e3:g} kPa, φ' {self.friction_angle:g}°, ψ {self.dilatancy_angle:g}°"
        return f"{super().in_words}, {strength}"

    @property
    def limits(self):
        """Friction angle and cohesion in words."""
        return f"friction_angle {self.friction_angle:g} deg and cohesion {self.cohesion:g} Pa"

    def admissible_k0(self, vertical_stress):
        """Active and passive coefficient under vertical effective stresses [Pa]; all where nothing presses."""
        cohesive = 2 * self.cohesion * math.cos(math.radians(self.friction_angle))
        sine = math.sin(math.radians(self.friction_angle))
        if not isinstance(vertical_stress, int | float):
            import numpy as np  # reading a scene needs none

            share = cohesive / np.where(vertical_stress > 0, vertical_stress, np.nan) if cohesive > 0 else 0.0
        elif cohesive > 0 and vertical_stress <= 0:
            return -math.inf, math.inf
        else:
            share = cohesive / vertical_stress if cohesive > 0 else 0.0
        return (1 - sine - share) / (1 + sine), (1 + sine + share) / (1 - sine)

    @staticmethod
    def new_stress(stress, strain, point, soil, dt):
        """The stress after a strain, and whether the tip of the cone or the tensile strength acted."""
        trial = elastic_trial(stress, strain, soil.lame, soil.shear)
        strength = Strength(soil.c_cos, soil.sin_phi, soil.sin_psi, soil.apex, soil.tension)
        keep = soil.relaxation_time / (soil.relaxation_time + dt) if soil.relaxation_time > 0.0 else 0.0
        return return_to_surface(trial, soil.shear, soil.bulk, strength, keep)
