"""Soil laws with history against their closed forms: one piece of soil, strained step by step."""

import math
from types import SimpleNamespace

import numpy as np
from scipy.optimize import brentq

from mpm.laws.law import soil_law
from mpm.laws.stress import Strain, Stress
from verification.boxes import _SAND
from verification.problems.plasticity import timed
from verification.problems.problem import Problem, Result, register

CONFINEMENT = 1e5  # [Pa]
CLAY = {
    "model": "modified-cam-clay", "poissons_ratio": 0.25, "porosity": 0.55, "loose_porosity": 0.7,
    "compression_index": 0.2, "swelling_index": 0.03, "critical_state_friction_angle": 23.0,
    "overconsolidation_ratio": 1.0, "attraction": 10.0,
}  # fmt: skip


class Piece:
    """A piece of soil under an isotropic stress, and what its law makes of strains.

    settings : keys of the soil; those of a cohesionless sand where they are left out.
    """

    def __init__(self, **settings):
        law = soil_law(settings["model"])
        known = {key: value for key, value in (_SAND | settings).items() if key in law.model_fields}
        self.soil = law.model_validate(known | {"name": "piece", "top_depth": 0.0})
        self.constants = SimpleNamespace(**{"tension": math.inf} | self.soil.constants)
        self.stress = Stress(-CONFINEMENT, -CONFINEMENT, -CONFINEMENT, 0.0)
        names = ("stress_xx", "stress_yy", "stress_zz", "stress_xy", *(name for name, _, _ in self.soil.history))
        points = np.zeros(1, [(name, float) for name in names])
        for name in names[:3]:
            points[name] = -CONFINEMENT
        self.soil.initial_history(points)
        history = {name: float(points[name][0]) for name in names[4:]}
        self.point = SimpleNamespace(porosity=self.soil.porosity, **history)

    def strain(self, xx, yy, xy):
        """Strain by increments of a tensor in plane strain; returns the stress."""
        expansion = xx + yy
        strain = Strain(xx, yy, xy, 0.0, expansion, expansion, 1 / (1 + expansion), 0.0)
        self.point.porosity = 1 - (1 - self.point.porosity) * strain.shrunk
        self.stress, _ = self.soil.new_stress(self.stress, strain, self.point, self.constants, 1.0)
        return self.stress

    def strained(self, steps, xx=0.0, yy=0.0, xy=0.0):
        """Strain by a tensor in plane strain, in equal steps.

        Returns processor time [s], and after each step p, q [Pa], specific volume [-]: (steps,), stress: (steps, 4).
        """

        def path():
            for _ in range(steps):
                stress = self.strain(xx / steps, yy / steps, xy / steps)
                yield *self.invariants, 1 / (1 - self.point.porosity), stress

        found, seconds = timed(lambda: list(path()))
        return seconds, *map(np.array, zip(*found, strict=True))

    @property
    def invariants(self):
        """Mean pressure, from the attraction of clay, and deviatoric stress q [Pa]."""
        s = np.array(self.stress[:3])
        p = -s.mean()
        q = math.sqrt(1.5 * (np.sum((s + p) ** 2) + 2 * self.stress.xy**2))
        return p + getattr(self.constants, "attraction", 0.0), q


def oedometer(steps=200, strain=0.3, **settings):
    """Compress normally consolidated clay without lateral strain: ratio q / p and slope of v over ln p.

    Reference: elastic and plastic strain rates of a path of constant eta = q / p whose deviatoric strain is two thirds
    of its volume strain, eta kappa / (3 r) + 2 eta (lambda - kappa) / (M^2 - eta^2) = 2 lambda / 3 with r = G / K
    (Wood 1990, Soil behaviour and critical state soil mechanics, section 10.3); v falls by lambda ln p.
    """
    piece = Piece(**CLAY | settings)
    c, soil = piece.constants, piece.soil
    seconds, p, q, volume, _ = piece.strained(steps, yy=-strain)
    slope, kappa = c.critical_state_slope, c.swelling_index

    def miss(eta):
        elastic = eta * kappa / (3 * c.shear_over_bulk)
        return elastic + 2 * eta * c.plastic_index / (slope**2 - eta**2) - 2 / 3 * soil.compression_index

    eta, half = brentq(miss, 1e-6, slope - 1e-9), steps // 2
    found = (volume[half] - volume[-1]) / math.log(p[-1] / p[half])
    ratio = q[-1] / p[-1]
    error = max(abs(ratio / eta - 1), abs(found / soil.compression_index - 1))
    return Result(float(error), {"eta": float(ratio), "slope": float(found)}, steps, 1, seconds)


def undrained_shear(steps=100, strain=0.1, overconsolidation_ratio=1.0, **settings):
    """Shear clay at constant volume: its stress path, and its strength at the critical state.

    Reference: p = p_0 (M^2 / (M^2 + eta^2))^Lambda from an isotropic state on the yield surface, at last
    q = M p_e / 2^Lambda with Lambda = 1 - kappa / lambda and p_e = p_0 OCR^Lambda (Wood 1990, section 7.4); elastic at
    constant p before the yield surface is met.
    """
    piece = Piece(**CLAY | {"overconsolidation_ratio": overconsolidation_ratio} | settings)
    c, soil = piece.constants, piece.soil
    start, share = piece.invariants[0], 1 - c.swelling_index / soil.compression_index
    slope = c.critical_state_slope
    seconds, p, q, _, _ = piece.strained(steps, xy=strain)
    end = slope * start * overconsolidation_ratio**share * 0.5**share
    eta_of_yield = slope * math.sqrt(overconsolidation_ratio - 1)
    yields = np.maximum.accumulate(np.abs(p / start - 1)) > 1e-12  # elastic clay keeps p: from the first change on
    at_yield = start * ((slope**2 + eta_of_yield**2) / (slope**2 + (q / p) ** 2)) ** share
    path = np.abs(p / np.where(yields, at_yield, start) - 1).max()
    return Result(float(max(path, abs(q[-1] / end - 1))), {"strength": q[-1] / 2}, steps, 1, seconds)


def softening(steps=400, strain=0.02, **settings):
    """Shear soil without friction whose cohesion falls linearly: stress over the way to the residual strength.

    Reference: (s_x - s_y) / 2 = c(kappa), where shearing by e' adds 2/sqrt(3) of its plastic part to kappa: elastic
    2 G e' up to the peak, then a straight line of slope -h / (1 - h / (2 G)) with h = 2/sqrt(3) (c - c_r) / kappa_r,
    then the residual cohesion; derived from the flow rule at phi = psi = 0.
    """
    peak, residual, span = 20e3, 5e3, 0.01
    piece = Piece(**{
        "model": "softening-mohr-coulomb", "cohesion": peak, "friction_angle": 0.0, "residual_cohesion": residual,
        "residual_friction_angle": 0.0, "residual_dilatancy_angle": 0.0, "softening_strain": span,
    } | settings)  # fmt: skip
    shear = piece.constants.shear
    seconds, _, _, _, stress = piece.strained(steps, xx=strain, yy=-strain)
    sheared = strain * np.arange(1, steps + 1) / steps
    hardening = -2 / math.sqrt(3) * (peak - residual) / span
    beyond = np.maximum(sheared - peak / (2 * shear), 0.0)
    exact = np.minimum(
        2 * shear * sheared, np.maximum(peak + hardening / (1 + hardening / (2 * shear)) * beyond, residual)
    )
    found = (stress[:, 0] - stress[:, 1]) / 2
    return Result(float(np.abs(found - exact).max() / peak), {"residual": found[-1]}, steps, 1, seconds)


register(Problem(
    name="clay-oedometer", title="Modified Cam Clay in the oedometer",
    source="Wood (1990), Soil behaviour and critical state soil mechanics, section 10.3",
    norm="larger relative error of the ratio q / p and of the slope of v over ln p", solve=oedometer,
    fast={"steps": 200}, ladder={"steps": (25, 50, 100, 200, 400), "critical_state_friction_angle": (15.0, 23.0, 35.0)},
    limit=2e-3, why="first order in the step: the shear modulus is that of its beginning",
))  # fmt: skip
register(Problem(
    name="clay-undrained", title="Modified Cam Clay sheared at constant volume",
    source="Wood (1990), section 7.4: p = p_0 (M^2 / (M^2 + eta^2))^(1 - kappa / lambda)",
    norm="largest relative error of the pressure over the path, and of the strength", solve=undrained_shear,
    fast={"steps": 100}, ladder={"steps": (25, 50, 100, 400), "overconsolidation_ratio": (1.0, 1.5, 2.0, 4.0)},
    limit=2e-3, why="the path is exact to round-off; the strength is reached after infinite strain",
))  # fmt: skip
register(Problem(
    name="softening", title="cohesion that falls with plastic strain",
    source="elastic, softening and residual branch in closed form, of the flow rule at phi = psi = 0",
    norm="largest error of the shear stress over the peak cohesion", solve=softening,
    fast={"steps": 400}, ladder={"steps": (50, 100, 200, 400, 1600)},
    limit=0.02, why="first order in the step: strength is that of its beginning",
))  # fmt: skip
