"""Speeds of the compression waves that limit the time step."""

import numpy as np


def fast_wave_speed(constrained_modulus, bulk_modulus_liquid, porosity, density_grains, density_liquid):
    """Speed of the fast compression wave of the undamped two-phase system [m/s].

    Parameters
    ----------
    constrained_modulus, bulk_modulus_liquid : float
        [Pa]
    porosity : float
        [-]
    density_grains, density_liquid : float
        [kg/m3]

    Notes
    -----
    Largest root of det(K - c^2 M) = 0 with, per unit volume, M = [[(1-n) rho_s, n rho_l], [0, rho_l]] and
    K = [[E + Q (1-n), Q n], [Q (1-n), Q n]], Q = K_w / n. Without drag this bounds the speed at any permeability.
    """
    n = porosity
    q = bulk_modulus_liquid / n
    mass = np.array([[(1 - n) * density_grains, n * density_liquid], [0.0, density_liquid]])
    stiffness = np.array([[constrained_modulus + q * (1 - n), q * n], [q * (1 - n), q * n]])
    return float(np.sqrt(np.max(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)))


def dry_wave_speed(constrained_modulus, porosity, density_grains):
    """Speed of the compression wave of a dry soil [m/s]; the looser, the lighter and the faster."""
    return float(np.sqrt(constrained_modulus / ((1 - porosity) * density_grains)))
