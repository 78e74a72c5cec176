"""Exact answers of the linear two-phase equations in a column: standing waves, and consolidation with inertia."""

import numpy as np
from scipy.linalg import expm

NU, POROSITY = 0.3, 0.45
YOUNG, GRAINS, WATER, GRAVITY = 4e7, 2650.0, 1000.0, 9.81


def constrained_modulus(youngs_modulus=YOUNG, poissons_ratio=NU):
    """Stiffness of a column that can not widen [Pa]."""
    return youngs_modulus * (1 - poissons_ratio) / ((1 + poissons_ratio) * (1 - 2 * poissons_ratio))


def matrices(bulk_modulus, conductivity):
    """Mass, damping and stiffness of grains and water per volume: (2, 2) float64 each.

    M u'' + C u' + kappa^2 K u = 0 for a standing wave of wave number kappa. Source: Xie et al., Eqs. (1), (2), with
    dp/dt of Jassim et al. (2013).
    """
    n, q = POROSITY, bulk_modulus / POROSITY
    mass = np.array([[(1 - n) * GRAINS, n * WATER], [0.0, WATER]])
    drag = n * WATER * GRAVITY / conductivity
    damping = np.array([[0.0, 0.0], [-drag, drag]])
    stiffness = np.array([[constrained_modulus() + q * (1 - n), q * n], [q * (1 - n), q * n]])
    return mass, damping, stiffness


def exact_velocities(initial, kappa, times, bulk_modulus, conductivity):
    """Amplitudes of the velocities of grains and water of a standing wave, (n_times, 2), from rest positions."""
    mass, damping, stiffness = matrices(bulk_modulus, conductivity)
    inverse = np.linalg.inv(mass)
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-(kappa**2) * inverse @ stiffness, -inverse @ damping]])
    start = np.concatenate([np.zeros(2), initial])
    return np.array([(expm(system * t) @ start)[2:] for t in np.atleast_1d(times)])


def modes(bulk_modulus):
    """Speeds [m/s] and velocity ratios (grains, water) of the undamped slow and fast wave: (2,), (2, 2) rows."""
    mass, _, stiffness = matrices(bulk_modulus, 1.0)
    values, vectors = np.linalg.eig(np.linalg.solve(mass, stiffness))
    order = np.argsort(values.real)
    return np.sqrt(values.real[order]), vectors.real.T[order]


def terzaghi_series(depth, time_factor, terms=200):
    """Excess pressure over the initial one in a column of unit height, drained at its top; Terzaghi (1923)."""
    odd = 2 * np.arange(terms)[:, None] + 1
    decay = np.exp(-((odd * np.pi / 2) ** 2) * time_factor)
    return np.sum(4 / np.pi / odd * np.sin(odd * np.pi / 2 * depth) * decay, axis=0)


def consolidation_with_inertia(depth, time, bulk_modulus, conductivity, terms=100):
    """As `terzaghi_series`, of grains and water that have mass: waves run before they have drained.

    Mode by mode M u'' + C u' + kappa^2 K u = (0, kappa p_m), the initial excess p_m being carried by the water; the
    pressure is p_m less what the motion of both phases has taken out of the pores.
    """
    mass, damping, stiffness = matrices(bulk_modulus, conductivity)
    inverse, pressure = np.linalg.inv(mass), np.zeros_like(depth)
    for m in range(terms):
        kappa, share = (2 * m + 1) * np.pi / 2, 4 / np.pi / (2 * m + 1) * (-1) ** m
        system = np.zeros((5, 5))
        system[:2, 2:4] = np.eye(2)
        system[2:4, :2], system[2:4, 2:4] = -(kappa**2) * inverse @ stiffness, -inverse @ damping
        system[2:4, 4] = inverse @ [0.0, kappa * share]
        grains, water = (expm(system * time) @ [0.0, 0.0, 0.0, 0.0, 1.0])[:2]
        lost = bulk_modulus / POROSITY * kappa * ((1 - POROSITY) * grains + POROSITY * water)
        pressure += (share - lost) * np.cos(kappa * (1 - depth))
    return pressure
