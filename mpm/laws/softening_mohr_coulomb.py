"""Mohr-Coulomb soil whose cohesion, friction and dilatancy change with plastic strain, from a peak to a residual.

Strength is linear in the accumulated equivalent plastic deviatoric strain and constant beyond `softening_strain`; it
may as well grow (hardening). The return to the surface is that of `mpm.laws.mohr_coulomb`, with the strength at the
beginning of the step. Softening ground fails in bands as wide as elements are small, unless a `relaxation_time` gives
them a width.

Source: Vermeer & de Borst (1984), Non-associated plasticity for soils, concrete and rock.
"""

import math
from typing import Literal

from pydantic import Field, model_validator

from mpm.laws.mohr_coulomb import MohrCoulomb, Strength, return_principal, return_to_surface
from mpm.laws.stress import elastic_trial
from mpm.quantities import Angle, Pressure


def strength_at(share, soil):
    """Strength at a share of the way from peak to residual [-]."""
    cohesion = soil.cohesion + share * soil.cohesion_change
    phi = soil.friction_angle + share * soil.friction_change
    sine = math.sin(phi)
    cosine = cohesion * math.cos(phi)
    apex = cosine / sine if sine > 0.0 else math.inf
    psi = soil.dilatancy_angle + share * soil.dilatancy_change
    return Strength(cosine, sine, math.sin(psi), apex, min(soil.tensile_strength, apex))


def plastic_strain(trial, stress, shear):
    """Equivalent plastic deviatoric strain of a return from a trial stress, sqrt(2/3 e:e) with e = (s' - s) / (2 G)."""
    xx, yy, zz, xy = trial.xx - stress.xx, trial.yy - stress.yy, trial.zz - stress.zz, trial.xy - stress.xy
    mean = (xx + yy + zz) / 3.0
    square = (xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2.0 * xy * xy
    return math.sqrt(2.0 / 3.0 * square) / (2.0 * shear)


class SofteningMohrCoulomb(MohrCoulomb):
    """Mohr-Coulomb soil that softens or hardens; keys of `MohrCoulomb` are those of the peak.

    Parameters
    ----------
    residual_cohesion, residual_friction_angle, residual_dilatancy_angle : float
        [Pa], [deg], [deg]
    softening_strain : float
        Equivalent plastic deviatoric strain from which on the strength is the residual one [-].
    """

    model: Literal["softening-mohr-coulomb"]
    residual_cohesion: Pressure = Field(ge=0, le=1e8)
    residual_friction_angle: Angle = Field(ge=0, lt=60)
    residual_dilatancy_angle: Angle = Field(ge=0, lt=60)
    softening_strain: float = Field(gt=1e-4, le=10)

    history = (("plastic_strain", "1", "accumulated equivalent plastic deviatoric strain"),)
    helpers = (elastic_trial, return_principal, return_to_surface, strength_at, plastic_strain)

    @model_validator(mode="after")
    def _check_residual(self):
        if self.residual_dilatancy_angle > self.residual_friction_angle:
            raise ValueError(
                f"soil '{self.name}': residual_dilatancy_angle {self.residual_dilatancy_angle:g} deg must not exceed "
                f"residual_friction_angle {self.residual_friction_angle:g} deg; the flow rule would create energy"
            )
        if self.residual_friction_angle == 0 and self.residual_cohesion == 0:
            raise ValueError(
                f"soil '{self.name}': residual_friction_angle and residual_cohesion must not both be 0, no strength at "
                "all; give one of them"
            )
        return self

    @property
    def in_words(self):
        """Elastic parameters, peak and residual strength."""
        angles = f"φ' {self.residual_friction_angle:g}°, ψ {self.residual_dilatancy_angle:g}°"
        residual = f"c' {self.residual_cohesion / 1e3:g} kPa, {angles}"
        return f"{super().in_words}, beyond a plastic strain of {self.softening_strain:g} {residual}"

    @property
    def constants(self):
        """Those of the peak, and what changes on the way to the residual strength (angles in radians)."""
        peak, residual = self.friction_angle, self.residual_friction_angle
        return super().constants | {
            "cohesion": self.cohesion,
            "cohesion_change": self.residual_cohesion - self.cohesion,
            "friction_angle": math.radians(peak),
            "friction_change": math.radians(residual - peak),
            "dilatancy_angle": math.radians(self.dilatancy_angle),
            "dilatancy_change": math.radians(self.residual_dilatancy_angle - self.dilatancy_angle),
            "tensile_strength": self.tensile_strength,
            "softening_strain": self.softening_strain,
        }

    @staticmethod
    def new_stress(stress, strain, point, soil, dt):
        """The stress after a strain, and whether the tip of the cone or the tensile strength acted."""
        trial = elastic_trial(stress, strain, soil.lame, soil.shear)
        strength = strength_at(min(point.plastic_strain / soil.softening_strain, 1.0), soil)
        keep = soil.relaxation_time / (soil.relaxation_time + dt) if soil.relaxation_time > 0.0 else 0.0
        stress, at_tip = return_to_surface(trial, soil.shear, soil.bulk, strength, keep)
        point.plastic_strain += plastic_strain(trial, stress, soil.shear)
        return stress, at_tip
