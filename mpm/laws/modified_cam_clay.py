"""Modified Cam Clay: clay that gets denser and stronger under load, and softens where it was loaded more before.

Yield surface q^2 / M^2 + p (p - p_c) = 0 with p and p_c measured from the attraction, associated flow, and in the plane
of specific volume v and ln p lines of slope lambda (yielding) and kappa (elastic). Elastic bulk modulus v p / kappa
with a constant Poisson's ratio; M does not depend on the Lode angle. Backward Euler: the elastic law and the
hardening are integrated exactly over the plastic volume strain of a step, which two nested Newton iterations find.

Source: Roscoe & Burland (1968), On the generalised stress-strain behaviour of wet clay; Borja & Lee (1990), Cam-Clay
plasticity, part I: implicit integration of elasto-plastic constitutive relations.
"""

import math
from typing import Literal

from pydantic import Field, model_validator

from mpm.laws.soil import Soil
from mpm.laws.stress import Stress
from mpm.quantities import Angle, Pressure

MOST_ITERATIONS = 60
TOLERANCE = 1e-11  # of the yield function, over the product of the two pressures


def plastic_volume(multiplier, start, p_trial, p_c, elastic, plastic):
    """Plastic volume strain y = multiplier (2 p - p_c) of a plastic multiplier [1/Pa], compression positive.

    p = p_trial exp(-elastic y) and p_c = p_c exp(plastic y): y grows with what it is compared with, so there is one
    root. `start` is a guess. Returns y, p, p_c and the derivative of y by the multiplier.
    """
    y = start
    p = hardened = slope = 0.0
    for _ in range(MOST_ITERATIONS):
        p, hardened = p_trial * math.exp(-elastic * y), p_c * math.exp(plastic * y)
        slope = 1.0 + multiplier * (2.0 * elastic * p + plastic * hardened)
        change = (y - multiplier * (2.0 * p - hardened)) / slope
        y -= change
        if abs(change) < 1e-15 + 1e-13 * abs(y):
            break
    p, hardened = p_trial * math.exp(-elastic * y), p_c * math.exp(plastic * y)
    return y, p, hardened, (2.0 * p - hardened) / slope


def return_to_yield(p_trial, q_trial, p_c, shear, slope, elastic, plastic):
    """Return a trial stress beyond the yield surface to it.

    Parameters
    ----------
    p_trial, q_trial, p_c : float
        Mean pressure, deviatoric stress and preconsolidation pressure [Pa], compression positive, from the attraction.
    shear : float
        Shear modulus [Pa].
    slope : float
        M, the ratio q / p of the critical state.
    elastic, plastic : float
        v / kappa and v / (lambda - kappa).

    Returns
    -------
    p, q, p_c : float
    """
    low, high, multiplier, y = 0.0, math.inf, 0.0, 0.0
    p, q, hardened, by_multiplier = p_trial, q_trial, p_c, 2.0 * p_trial - p_c
    square, stiff = slope * slope, 6.0 * shear / (slope * slope)
    for _ in range(MOST_ITERATIONS):
        beyond = q * q / square + p * (p - hardened)
        if abs(beyond) < TOLERANCE * p_trial * max(p_trial, p_c):
            break
        if beyond > 0.0:
            low = multiplier
        else:
            high = multiplier
        derivative = -2.0 * q * q / square * stiff / (1.0 + stiff * multiplier)
        derivative -= (elastic * p * (2.0 * p - hardened) + plastic * p * hardened) * by_multiplier
        step = multiplier - beyond / derivative if derivative < 0.0 else 2.0 * multiplier + 1.0 / stiff
        if not low < step < high:
            step = 0.5 * (low + high) if high < math.inf else 2.0 * multiplier + 1.0 / stiff
        multiplier = step
        y, p, hardened, by_multiplier = plastic_volume(multiplier, y, p_trial, p_c, elastic, plastic)
        q = q_trial / (1.0 + stiff * multiplier)
    return p, q, hardened


class ModifiedCamClay(Soil):
    """Modified Cam Clay.

    Parameters
    ----------
    compression_index, swelling_index : float
        lambda and kappa, slopes of the specific volume over the natural logarithm of the mean pressure [-].
    critical_state_friction_angle : float
        In triaxial compression [deg]; M = 6 sin / (3 - sin).
    overconsolidation_ratio : float
        Size of the initial yield surface over that of one through the initial stress [-].
    attraction : float
        Tension that holds the grains together where nothing presses [Pa]: all pressures are measured from it. Keeps
        loose clay from having no stiffness at all; bonded clay has a larger one.
    """

    model: Literal["modified-cam-clay"]
    compression_index: float = Field(gt=0, le=2)
    swelling_index: float = Field(gt=0, le=1)
    critical_state_friction_angle: Angle = Field(gt=0, lt=60)
    overconsolidation_ratio: float = Field(ge=1, le=100)
    attraction: Pressure = Field(ge=10, le=1e6)

    history = (("preconsolidation_pressure", "Pa", "size of the yield surface on the axis of the mean pressure"),)
    helpers = (plastic_volume, return_to_yield)

    @model_validator(mode="after")
    def _check_indices(self):
        if self.swelling_index >= self.compression_index:
            raise ValueError(
                f"soil '{self.name}': swelling_index must be below compression_index ({self.compression_index:g}), got "
                f"{self.swelling_index:g}; clay swells by a fifth to a tenth of what it was compressed by"
            )
        return self

    @property
    def critical_state_slope(self) -> float:
        """M, the ratio q / p of the critical state [-]."""
        sine = math.sin(math.radians(self.critical_state_friction_angle))
        return 6 * sine / (3 - sine)

    @property
    def in_words(self):
        """Indices, critical state friction, overconsolidation."""
        indices = f"λ {self.compression_index:g}, κ {self.swelling_index:g}, ν {self.poissons_ratio:g}"
        angle = f"φ'cs {self.critical_state_friction_angle:g}°"
        return f"{indices}, {angle}, OCR {self.overconsolidation_ratio:g}, attraction {self.attraction / 1e3:g} kPa"

    @property
    def constants(self):
        """M, kappa, lambda - kappa, shear over bulk modulus, attraction."""
        nu = self.poissons_ratio
        return {
            "critical_state_slope": self.critical_state_slope,
            "swelling_index": self.swelling_index,
            "plastic_index": self.compression_index - self.swelling_index,
            "shear_over_bulk": 1.5 * (1 - 2 * nu) / (1 + nu),
            "attraction": self.attraction,
        }

    @property
    def limits(self):
        """Critical state friction angle in words."""
        return f"critical_state_friction_angle {self.critical_state_friction_angle:g} deg"

    @property
    def strength(self):
        """Cohesion [Pa] of the attraction, and friction angle of the critical state [deg]."""
        angle = self.critical_state_friction_angle
        return self.attraction * math.tan(math.radians(angle)), angle

    def youngs_modulus_at(self, vertical_stress):
        """Young's modulus [Pa] of the elastic law in the initial state under a vertical effective stress [Pa]."""
        k0 = self.lateral_pressure_coefficient(vertical_stress)
        pressure = vertical_stress * (1 + 2 * k0) / 3 + self.attraction
        return 3 * (1 - 2 * self.poissons_ratio) * pressure / ((1 - self.porosity) * self.swelling_index)

    def admissible_k0(self, vertical_stress):
        """Lowest and highest k0 in whose stress the ratio q / p is that of the critical state."""
        m = self.critical_state_slope
        return (3 - m) / (3 + 2 * m), (3 + m) / (3 - 2 * m) if m < 1.5 else math.inf

    def initial_history(self, points):
        """The yield surface through the initial stress, times the overconsolidation ratio."""
        xx, yy, zz, xy = (points[f"stress_{name}"] for name in ("xx", "yy", "zz", "xy"))
        p = -(xx + yy + zz) / 3 + self.attraction
        q2 = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * xy**2
        size = p + q2 / (self.critical_state_slope**2 * p)
        points["preconsolidation_pressure"] = self.overconsolidation_ratio * size

    @staticmethod
    def new_stress(stress, strain, point, soil, dt):
        """The stress after a strain; the preconsolidation pressure of the point follows. Never at a limit."""
        third = 1.0 / 3.0
        p = soil.attraction - (stress.xx + stress.yy + stress.zz) * third
        volume = strain.shrunk / (1.0 - point.porosity)  # specific, at the beginning of the step
        elastic, plastic = volume / soil.swelling_index, volume / soil.plastic_index
        p_trial = p * math.exp(-elastic * strain.expansion)
        bulk = (p - p_trial) / strain.expansion if abs(strain.expansion) > 1e-9 else elastic * p
        shear = soil.shear_over_bulk * bulk
        mean, held = strain.expansion * third, p - soil.attraction
        sxx = stress.xx + held + 2.0 * shear * (strain.xx - mean)
        syy = stress.yy + held + 2.0 * shear * (strain.yy - mean)
        szz = stress.zz + held - 2.0 * shear * mean
        sxy = stress.xy + 2.0 * shear * strain.xy
        q = math.sqrt(1.5 * (sxx * sxx + syy * syy + szz * szz + 2.0 * sxy * sxy))
        p_c, slope, share = point.preconsolidation_pressure, soil.critical_state_slope, 1.0
        if q * q > slope * slope * p_trial * (p_c - p_trial):
            p_trial, q_new, point.preconsolidation_pressure = return_to_yield(
                p_trial, q, p_c, shear, slope, elastic, plastic
            )
            share = q_new / q if q > 0.0 else 1.0
        held = soil.attraction - p_trial
        return Stress(held + share * sxx, held + share * syy, held + share * szz, share * sxy), False

    @staticmethod
    def moduli(point, soil):
        """Moduli at the preconsolidation pressure, which the mean pressure does not exceed [Pa]."""
        bulk = point.preconsolidation_pressure / ((1.0 - point.porosity) * soil.swelling_index)
        shear = soil.shear_over_bulk * bulk
        return bulk - 2.0 * shear / 3.0, shear
