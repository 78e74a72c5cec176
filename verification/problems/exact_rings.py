"""Exact answers for rings: internal forces and displacements in closed form.

Signs as in :mod:`structure.response`. Thin ring of centre-line radius R, inextensible and without shear deformation
unless said otherwise; here theta is in radians from the crown, clockwise.
"""

from typing import NamedTuple

import numpy as np


class RingForces(NamedTuple):
    """Internal forces per metre of tunnel: axial and shear force [N/m], bending moment [N m/m]."""

    axial_force: np.ndarray
    shear_force: np.ndarray
    bending_moment: np.ndarray


def uniform_pressure(pressure: float, radius: float, theta: np.ndarray) -> RingForces:
    """Forces under a uniform inward pressure [Pa]: N = p R, no moment.

    >>> float(uniform_pressure(1e5, 3.0, np.array([0.0])).axial_force[0])
    300000.0
    """
    zero = np.zeros_like(theta)
    return RingForces(zero + pressure * radius, zero, zero)


def radial_cos2(pressure: float, radius: float, theta: np.ndarray) -> RingForces:
    """Forces under an inward pressure p cos(2 theta): M = -p R^2/3 cos(2 theta), from equilibrium alone.

    >>> radial_cos2(3e3, 2.0, np.array([0.0])).bending_moment.item()
    -4000.0
    """
    return RingForces(
        -pressure * radius / 3 * np.cos(2 * theta),
        -2 / 3 * pressure * radius * np.sin(2 * theta),
        -pressure * radius**2 / 3 * np.cos(2 * theta),
    )


def radial_cos2_displacement(
    pressure: float,
    radius: float,
    bending_stiffness: float,
    axial_stiffness: float = np.inf,
    shear_stiffness: float = np.inf,
) -> float:
    """Outward displacement [m] at the crown under p cos(2 theta): -p R^4/(9 EI), and stretching and shear if asked for.

    Castigliano on the forces of :func:`radial_cos2`: every force adds (amplitude)^2/stiffness to the energy.
    """
    return -pressure * radius**2 / 9 * (radius**2 / bending_stiffness + 1 / axial_stiffness + 4 / shear_stiffness)


def thick_ring_uniform(
    pressure: float, inner_radius: float, outer_radius: float, radius: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Radial and hoop stress [Pa], tension positive, of a thick ring under a uniform outer pressure (Lamé)."""
    mean = -pressure * outer_radius**2 / (outer_radius**2 - inner_radius**2)
    return mean * (1 - inner_radius**2 / radius**2), mean * (1 + inner_radius**2 / radius**2)


class ThickRing(NamedTuple):
    """Plane-strain ring under p cos(2 theta) inward and t sin(2 theta) clockwise on its outer face.

    Airy's function (a r^2 + b r^4 + c r^-2 + d) cos(2 theta). Source: Michell (1899), as tabulated by Barber,
    Elasticity, Tables 8.1 and 9.1.
    """

    coefficients: np.ndarray
    shear_modulus: float
    poissons_ratio: float

    def stresses(self, radius, theta):
        """Radial, hoop and shear stress [Pa], tension positive."""
        a, b, c, d = self.coefficients
        cosine, sine = np.cos(2 * theta), np.sin(2 * theta)
        return (
            (-2 * a - 6 * c / radius**4 - 4 * d / radius**2) * cosine,
            (2 * a + 12 * b * radius**2 + 6 * c / radius**4) * cosine,
            (2 * a + 6 * b * radius**2 - 6 * c / radius**4 - 2 * d / radius**2) * sine,
        )

    def radial_displacement(self, radius, theta):
        """Outward displacement [m]."""
        a, b, c, d = self.coefficients
        kappa = 3 - 4 * self.poissons_ratio
        shape = -2 * a * radius + (kappa - 3) * b * radius**3 + 2 * c / radius**3 + (kappa + 1) * d / radius
        return shape * np.cos(2 * theta) / (2 * self.shear_modulus)


def thick_ring_cos2(
    pressure: float,
    shear: float,
    inner_radius: float,
    outer_radius: float,
    youngs_modulus: float,
    poissons_ratio: float,
) -> ThickRing:
    """Exact plane-strain ring under the second harmonic of pressure and shear; the inner face is free."""
    rows = [
        row
        for r in (outer_radius, inner_radius)
        for row in ([-2, 0, -6 / r**4, -4 / r**2], [2, 6 * r**2, -6 / r**4, -2 / r**2])
    ]
    coefficients = np.linalg.solve(np.array(rows), np.array([-pressure, shear, 0, 0]))
    return ThickRing(coefficients, youngs_modulus / (2 * (1 + poissons_ratio)), poissons_ratio)


def tangential_sin2(shear: float, radius: float, theta: np.ndarray) -> RingForces:
    """Forces under a shear t sin(2 theta) on the centre line, directed from crown and invert to the springline."""
    return RingForces(
        -2 / 3 * shear * radius * np.cos(2 * theta),
        -1 / 3 * shear * radius * np.sin(2 * theta),
        -shear * radius**2 / 6 * np.cos(2 * theta),
    )


def distributed_couple_sin2(couple: float, radius: float, theta: np.ndarray) -> RingForces:
    """Forces under a clockwise couple m sin(2 theta) [N m per metre of arc and of tunnel].

    No force acts, so dQ/dtheta = N and dN/dtheta = -Q leave no second harmonic in N and Q; dM/ds = -Q - m then gives
    M = m R/2 cos(2 theta). A shear t on the outer face, half a thickness d off the centre line, brings m = t d/2.
    """
    zero = np.zeros_like(theta)
    return RingForces(zero, zero, couple * radius / 2 * np.cos(2 * theta))


def winkler_cos2_displacement(
    pressure: float,
    shear: float,
    radius: float,
    bending_stiffness: float,
    normal_stiffness: float,
    tangential_stiffness: float,
    thickness: float = 0.0,
) -> float:
    """Outward displacement [m] at the crown in two-way linear springs [Pa/m] under p cos(2 theta) and t sin(2 theta).

    w = -(p + t/2)/(9 EI/R^4 + k_r + k_t/4). With a thickness, tractions and springs act on the outer face, half of it
    outside R: areas grow by 1 + thickness/(2 R), and the slip there is 1 - 3 thickness/(2 R) of the centre line's, for
    the section rotates by 3 w sin(2 theta)/(2 R) against a slip of -w sin(2 theta)/2.
    """
    area = 1 + thickness / (2 * radius)
    slip = 1 - 3 * thickness / (2 * radius)
    load = area * (pressure + slip * shear / 2)
    springs = area * (normal_stiffness + slip**2 * tangential_stiffness / 4)
    return -load / (9 * bending_stiffness / radius**4 + springs)


def self_weight_on_point_support(weight: float, radius: float, theta: np.ndarray) -> RingForces:
    """Forces in a ring of weight g [N/m2, per arc and tunnel length] standing on its invert, theta in [0, pi].

    M = -g R^2 (1 - cos(theta)/2 - theta sin(theta)): -g R^2/2 at the crown, -3/2 g R^2 at the invert.
    """
    return RingForces(
        weight * radius * (theta * np.sin(theta) - np.cos(theta) / 2),
        -weight * radius * (np.sin(theta) / 2 + theta * np.cos(theta)),
        -weight * radius**2 * (1 - np.cos(theta) / 2 - theta * np.sin(theta)),
    )


def opposite_point_loads(load: float, radius: float, theta: np.ndarray) -> RingForces:
    """Forces under two inward loads P [N/m] at crown and invert, theta in (0, pi): M = -P R/pi under the loads."""
    return RingForces(
        load / 2 * np.sin(theta),
        -load / 2 * np.cos(theta),
        load * radius * (np.sin(theta) / 2 - 1 / np.pi),
    )


def hinge_moments(
    rigid_moments: np.ndarray, rotational_stiffness: float, radius: float, bending_stiffness: float
) -> np.ndarray:
    """Moments at the n elastic hinges of a doubly symmetric ring under doubly symmetric load.

    M_j = M0_j + X, X = -sum(M0_j/k)/(2 pi R/EI + n/k), with M0 the ring's moments without hinges: the rotations
    must close.

    rigid_moments : (n,) float64 [N m/m];  rotational_stiffness : k [N m/rad/m].
    """
    release = np.sum(rigid_moments) / rotational_stiffness
    flexibility = 2 * np.pi * radius / bending_stiffness + len(rigid_moments) / rotational_stiffness
    return rigid_moments - release / flexibility


def einstein_schwartz_full_slip_moment(stress_ratio: float, poissons_ratio: float, flexibility_ratio: float) -> float:
    """Largest M/(P R^2) of a lining that slips freely in elastic ground, P the overburden stress.

    (1 - K)/2 3 (3 - 4 nu)/(F (1 - nu) + 3 (5 - 6 nu)), F = E R^3 (1 - nu_l^2)/(E_l I (1 - nu^2)).
    Source: Einstein & Schwartz (1979).
    """
    nu = poissons_ratio
    return (1 - stress_ratio) / 2 * 3 * (3 - 4 * nu) / (flexibility_ratio * (1 - nu) + 3 * (5 - 6 * nu))


def einstein_schwartz_no_slip_moment(
    stress_ratio: float, poissons_ratio: float, flexibility_ratio: float, compressibility_ratio: float
) -> float:
    """Largest M/(P R^2) of a lining bonded to elastic ground, P the overburden stress.

    (1 - K)/4 (1 - 2 a + 2 b), b = C (1 - nu)/(2 (C (1 - nu) + 4 nu - 6 beta - 3 beta C (1 - nu))), a = beta b,
    beta = ((6 + F) C (1 - nu) + 2 F nu)/(3 F + 3 C + 2 C F (1 - nu)); F as of full slip,
    C = E R (1 - nu_l^2)/(E_l A (1 - nu^2)). Source: Einstein & Schwartz (1979).
    """
    nu, f, c = poissons_ratio, flexibility_ratio, compressibility_ratio
    beta = ((6 + f) * c * (1 - nu) + 2 * f * nu) / (3 * f + 3 * c + 2 * c * f * (1 - nu))
    b = c * (1 - nu) / (2 * (c * (1 - nu) + 4 * nu - 6 * beta - 3 * beta * c * (1 - nu)))
    return (1 - stress_ratio) / 4 * (1 - 2 * beta * b + 2 * b)
