"""Return mapping against the definition: the closest admissible stress under the plastic potential."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize

from mpm.laws.mohr_coulomb import Strength, return_principal

E, NU = 4e7, 0.3
G, K = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))


def return_ordered(trial, c, phi, psi, tension=math.inf):
    phi, psi = math.radians(phi), math.radians(psi)
    apex = c / math.tan(phi) if phi > 0 else math.inf
    strength = Strength(c * math.cos(phi), math.sin(phi), math.sin(psi), apex, min(tension, apex))
    return return_principal(*trial, G, K, strength)


def yield_value(s, c, phi):
    phi = math.radians(phi)
    return (max(s) - min(s)) + (max(s) + min(s)) * math.sin(phi) - 2 * c * math.cos(phi)


def closest_point(trial, c, phi):
    """Associated flow: the admissible stress nearest to the trial one in the elastic energy norm (slow, by SLSQP)."""
    compliance = np.array([[1, -NU, -NU], [-NU, 1, -NU], [-NU, -NU, 1]])
    scale = np.abs(trial).max()
    t = np.asarray(trial) / scale
    s, k = math.sin(math.radians(phi)), 2 * c / scale * math.cos(math.radians(phi))
    planes = [
        {"type": "ineq", "fun": lambda x, i=i, j=j: k - (x[i] - x[j]) - (x[i] + x[j]) * s}
        for i in range(3)
        for j in range(3)
        if i != j
    ]
    best = minimize(
        lambda x: (x - t) @ compliance @ (x - t), np.full(3, t.min()), constraints=planes, method="SLSQP",
        options={"ftol": 1e-15, "maxiter": 500},
    )  # fmt: skip
    assert best.success
    return best.x * scale


TRIALS = {
    "elastic": (-100e3, -120e3, -140e3),
    "main plane": (-20e3, -100e3, -300e3),
    "right edge": (-10e3, -290e3, -300e3),
    "left edge": (-20e3, -22e3, -300e3),
    "apex": (60e3, 50e3, 40e3),
    "apex from shear": (120e3, 20e3, -30e3),
}


@pytest.mark.parametrize("cohesion", [0.0, 5e3])
@pytest.mark.parametrize("trial", TRIALS.values(), ids=TRIALS.keys())
def test_associated_return_is_the_closest_point(trial, cohesion):
    got = np.array(return_ordered(trial, cohesion, 25, 25)[:3])
    # 2e-6 of the trial stress: the optimiser's own accuracy
    assert got == pytest.approx(closest_point(trial, cohesion, 25), abs=2e-6 * np.abs(trial).max() + 1.0)


@pytest.mark.parametrize("psi", [0, 10, 25])
def test_returned_stress_is_admissible_and_ordered(psi):
    rng = np.random.default_rng(1)
    for trial in -np.sort(-rng.normal(-50e3, 150e3, (500, 3)), axis=1):
        got = return_ordered(trial, 3e3, 25, psi)[:3]
        assert yield_value(got, 3e3, 25) <= 1e-6 * np.abs(trial).max()  # round-off of the edge solve
        assert got[0] >= got[1] - 1e-3 and got[1] >= got[2] - 1e-3  # Pa, round-off


def test_without_dilatancy_the_mean_stress_is_kept():
    for trial in ((-20e3, -100e3, -300e3), (-10e3, -290e3, -300e3), (-20e3, -22e3, -300e3)):
        got = return_ordered(trial, 0.0, 25, 0)[:3]
        assert sum(got) == pytest.approx(sum(trial), rel=1e-12)


def test_tension_cut_off_caps_the_largest_stress():
    got = return_ordered((4e3, -10e3, -20e3), 20e3, 25, 0, tension=1e3)
    assert got[0] == 1e3 and got[3] is True
    assert yield_value(got[:3], 20e3, 25) <= 0
