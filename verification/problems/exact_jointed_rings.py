"""A thin ring with elastic hinges in elastic ground under the stress before the tunnel, as Fourier series.

Harmonic n of the ground answers by Airy's functions r^m cos(n theta), m = n, n + 2, -n, 2 - n (Michell 1899). A hinge
that turns by phi is a curvature phi delta(s): the ring, stretched by e = (w + v')/R and bent by kappa = (v' - w'')/R^2,
carries M = EI (kappa - sum of phi delta), finite at the hinges, where M = k phi. Signs as in
:mod:`structure.response`; theta in radians from the crown, clockwise; plane strain.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

#: Highest harmonic: terms fall as the third power.
LAST = 400
#: Exponent of a harmonic that does not reach where the ground is held.
FAR = 20.0


class ElasticGround(NamedTuple):
    """Ground around a ring of radius R [m]: modulus [Pa], Poisson's ratio, and the radius where it is held [m]."""

    radius: float
    youngs_modulus: float
    poissons_ratio: float
    held_at: float = np.inf

    def stiffness(self, n: int) -> np.ndarray:
        """Tractions (outward cos, clockwise sin) that move its face by one, per area: (2, 2) [Pa/m]."""
        shear, kappa = self.youngs_modulus / (2 * (1 + self.poissons_ratio)), 3 - 4 * self.poissons_ratio
        size = self.radius

        def fields(m, r):
            power = (r / (self.held_at if m > 1 else size)) ** (m - 1)
            stress = np.array([m - n**2, n * (m - 1)]) * power / r
            moved = np.array([-m, n]) * power
            if m == n + 2:
                moved = np.array([kappa - 1 - n, kappa + 1 + n]) * power
            elif m == 2 - n:
                moved = np.array([kappa - 1 + n, n - 1 - kappa]) * power
            return stress, moved / (2 * shear)

        if n == 0:
            outside = 1 / self.held_at**2
            moved, strain = 1 / size - size * outside, -1 / size**2 - outside
            hoop = 1 / size**2 - outside
            nu = self.poissons_ratio
            stress = 2 * shear / (1 - 2 * nu) * ((1 - nu) * strain + nu * hoop)
            return np.array([[-stress / moved, 0.0], [0.0, 2 * shear / size]])
        far = n * np.log(self.held_at / size) > FAR
        modes = (-n, 2 - n) if far else (n, n + 2, -n, 2 - n)
        stress, moved = (np.stack(part, axis=1) for part in zip(*(fields(m, size) for m in modes), strict=True))
        free = np.eye(len(modes))
        if len(modes) == 4:
            there = np.stack([fields(m, self.held_at)[1] for m in modes], axis=1)
            free = np.linalg.svd(there)[2][2:].T
        return -stress @ free @ np.linalg.inv(moved @ free)


class HingedRing(NamedTuple):
    """A thin ring with elastic hinges.

    Radius of its centre line [m], axial and bending stiffness [N/m], [N m]; angles [rad] between crown and waist of
    hinges, each of which stands for four of a doubly symmetric ring; their rotational stiffness [N m/rad/m].
    """

    radius: float
    axial_stiffness: float
    bending_stiffness: float
    hinges: tuple[float, ...]
    rotational_stiffness: float


class Response(NamedTuple):
    """Bending moment [N m/m], outward displacement [m] at the angles asked for; rotations of the hinges [rad]."""

    bending_moment: np.ndarray
    displacement_radial: np.ndarray
    rotation: np.ndarray


def ring_in_ground(
    ring: HingedRing, ground: ElasticGround, vertical: float, horizontal: float, theta: np.ndarray, bonded: bool
) -> Response:
    """Response to the stress [Pa] that the ground would have without a tunnel, compression positive.

    Plane sections carry the ring's movement from its centre line to the face of the ground.
    """
    radius, bending, hinges = ring.radius, ring.bending_stiffness, np.asarray(ring.hinges)
    lever, area = (ground.radius - radius) / radius, ground.radius / radius
    mean, deviator = (vertical + horizontal) / 2, (vertical - horizontal) / 2
    # of moment and displacement at theta and of moment at the hinges: from the load, and per rotation of each hinge
    loaded, turned = np.zeros((3, len(theta))), np.zeros((2, len(theta), len(hinges)))
    at_hinges, by_hinges = np.zeros(len(hinges)), np.zeros((len(hinges), len(hinges)))
    for n in range(0, LAST + 1, 2):
        kinks = (2 if n == 0 else 4) / (np.pi * radius) * np.cos(n * hinges)
        stretch, bend = np.array([1.0, n]) / radius, np.array([n**2, n]) / radius**2
        around = ground.stiffness(n)
        load = {0: np.array([-mean, 0.0]), 2: np.array([-deviator, deviator])}.get(n, np.zeros(2))
        if not bonded:
            along = around[1] / around[1, 1]
            load = np.array([load[0] - load[1] * along[0], 0.0])
            around = np.array([[around[0, 0] - around[0, 1] * along[0], 0.0], [0.0, 0.0]])
        face = np.array([[1.0, 0.0], [n * lever, 1 + lever]])
        load, around = area * face.T @ load, area * face.T @ around @ face
        stiffness = ring.axial_stiffness * np.outer(stretch, stretch) + bending * np.outer(bend, bend) + around
        if n == 0:
            stiffness[1, 1] = 1.0
        moved, by_kink = np.linalg.solve(stiffness, np.stack([load, bending * bend], axis=1)).T
        moment, left = bending * bend @ moved, bending * (bend @ by_kink - 1)
        cosine, there = np.cos(n * theta), np.cos(n * hinges)
        loaded[0] += moment * cosine
        loaded[1] += moved[0] * cosine
        turned[0] += left * np.outer(cosine, kinks)
        turned[1] += by_kink[0] * np.outer(cosine, kinks)
        at_hinges += moment * there
        by_hinges += left * np.outer(there, kinks)
    rotation = np.linalg.solve(ring.rotational_stiffness * np.eye(len(hinges)) - by_hinges, at_hinges)
    return Response(loaded[0] + turned[0] @ rotation, loaded[1] + turned[1] @ rotation, rotation)
