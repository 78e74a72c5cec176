"""Rings of any joints and springs under random loads in balance, and what a lining model makes of them."""

import re

import numpy as np
import xarray as xr

from structure import Bolts, Ground, LiningFailure, Neighbour, Ring
from structure.lining import THETA

RADIUS = 3.3
LINING = dict(outer_diameter=6.6, inner_diameter=5.9, concrete_modulus=34.5e9, concrete_poissons_ratio=0.2)
ORDINARY = dict(joint_rotational_stiffness=5e8, joint_normal_stiffness=6e8, joint_shear_stiffness=8e7)
#: What each kind of soil spring is called with.
SPRINGS = {
    "none": None,
    "radial, pressing only": dict(tangential_springs=False),
    "radial, two-way": dict(tangential_springs=False, two_way=True),
    "hyperbolic": {},
    "linear": dict(law="linear"),
    "at the centre line": dict(slip_at="centre_line"),
}
#: How the joint that moves most moves, and the stiffness that it lacks.
WAYS = {"turns": "joint_rotational_stiffness", "slides": "joint_shear_stiffness",
        "opens or closes": "joint_normal_stiffness"}  # fmt: skip
#: Stiffness [N/m2, N m/rad/m] of a joint that does not show.
STIFF = 1e11


def random_angles(rng):
    """3 to 12 joints at least 4 degrees apart."""
    count = rng.integers(3, 13)
    while True:
        angles = np.sort(rng.uniform(0, 360, count))
        if np.diff(angles, append=angles[0] + 360).min() > 4:
            return tuple(angles)


def random_ring(rng, springs):
    def stiffness(low, high, none):
        return 0.0 if rng.random() < none else 10 ** rng.uniform(low, high)

    ground = None
    if springs is not None:
        ground = Ground(
            youngs_modulus=10 ** rng.uniform(6.5, 8.3),
            poissons_ratio=rng.uniform(0, 0.45),
            cohesion=rng.choice([0.0, 10 ** rng.uniform(3, 5)]),
            friction_angle=rng.choice([0.0, rng.uniform(5, 45)]),
            vertical_stress=2e5,
            horizontal_stress=rng.uniform(0.3, 1.2) * 2e5,
            **springs,
        )
    return Ring(
        **LINING,
        concrete_unit_weight=rng.choice([0.0, 25e3]),
        joint_angles=random_angles(rng),
        joint_rotational_stiffness=stiffness(6.5, 10, 0.15),
        joint_normal_stiffness=stiffness(7, 11, 0.05),
        joint_shear_stiffness=stiffness(7, 10, 0.05),
        ground=ground,
        balance_uplift=True,
    )


def integral(theta, values, factor):
    """Of values at angles [rad], linear between them, times a function of the angle: 8 Gauss points between samples."""
    length = np.diff(theta, append=theta[0] + 2 * np.pi)
    points, weights = np.polynomial.legendre.leggauss(8)
    share = (points + 1) / 2
    between = values[:, None] * (1 - share) + np.roll(values, -1)[:, None] * share
    return (length[:, None] * weights / 2 * between * factor(theta[:, None] + length[:, None] * share)).sum()


def sums(theta, pressure, shear):
    """Force to the right and up, and torque over the radius, over the radius [Pa]."""
    one = np.ones_like
    return np.array(
        [
            integral(theta, shear, np.cos) - integral(theta, pressure, np.sin),
            -integral(theta, shear, np.sin) - integral(theta, pressure, np.cos),
            integral(theta, shear, one),
        ]
    )


def random_balanced_loads(rng):
    """Pressures and shear of random harmonics at random angles, without resultants."""
    count = int(rng.integers(24, 400))
    # one angle in each of `count` equal parts, anywhere in it or at its beginning: no gap that is refused
    within = rng.uniform(0, 1, count) if rng.random() < 0.5 else 0.0
    degrees = (np.arange(count) + within) * 360 / count
    theta = np.radians(degrees)
    mean = rng.uniform(1e5, 5e5)
    size = rng.uniform(0, 0.15) * mean

    def harmonics(first):
        return sum(size / k * rng.normal() * np.cos(k * theta + rng.uniform(0, 2 * np.pi)) for k in range(first, 7))

    traction = np.stack([mean + harmonics(2), 0.3 * harmonics(1)])
    zero = np.zeros_like(theta)
    basis = np.array([(np.sin(theta), zero), (np.cos(theta), zero), (zero, zero + 1)])
    of_basis = np.stack([sums(theta, *each) for each in basis], axis=1)
    traction -= np.tensordot(np.linalg.solve(of_basis, sums(theta, *traction)), basis, 1)
    return loads_of(degrees, *traction)


def loads_of(degrees, pressure, shear):
    parts = {"soil_pressure": 0.6 * pressure, "water_pressure": 0.4 * pressure, "soil_shear": shear}
    return xr.Dataset(
        {name: (("time", "theta"), values[None]) for name, values in parts.items()},
        coords={"time": [0.0], "theta": degrees},
    )


def growing_load(rng, steps=3):
    """Four waves of pressure and a shear that ovalises, grown in steps, on a ring of case 3: joints gape and slide."""
    around = np.radians(THETA)
    waves = sum(rng.uniform(-2.5e5, 2.5e5) / n * np.cos(n * around - rng.uniform(0, 6.3)) for n in range(2, 6))
    shear = 1.5e4 * np.sin(2 * around - rng.uniform(0, 6.3))
    time = np.arange(1, steps + 1) / steps
    pressure = 3.9e5 * (1 + 0.15 * rng.uniform()) + time[:, None] * waves
    parts = {"soil_pressure": pressure, "water_pressure": 0 * pressure, "soil_shear": time[:, None] * shear}
    return xr.Dataset({name: (("time", "theta"), part) for name, part in parts.items()}, {"time": time, "theta": THETA})


def extreme_ring(rng, ground):
    """A ring of 3 to 8 joints that gape, slide or touch point by point, with bolts, leaning faces or a neighbour:
    stiffnesses from 1e3 to 1e15, friction 0 to 1, slack 0 to 5 mm."""
    count = int(rng.integers(3, 9))
    gaps = rng.uniform(20, 60, count)
    angles = np.sort((np.cumsum(gaps * 360 / gaps.sum()) + rng.uniform(0, 360)) % 360)
    face = rng.random() < 0.4
    stiffnesses = ("joint_normal_stiffness", "joint_shear_stiffness", "joint_rotational_stiffness")
    values = {name: 10 ** rng.uniform(3, 15) for name in stiffnesses[: 2 if face else 3]}
    values |= {"joint_friction_coefficient": tuple(rng.uniform(0, 1, count)), "joint_contact_only": rng.random() < 0.7}
    if face or rng.random() < 0.6:
        values |= {"joint_contact": "face" if face else "section", "joint_contact_height": rng.uniform(0.1, 0.35)}
    if rng.random() < 0.6:
        values["joint_bolts"] = tuple(
            Bolts(
                offset=rng.uniform(-0.1, 0.1),
                length=0.4,
                stiffness=10 ** rng.uniform(6, 10),
                slack=rng.uniform(0, 5e-3),
            )
            for _ in range(count)
        )
    if rng.random() < 0.3:
        values["joint_inclinations"] = tuple(rng.uniform(-10, 10, count))
    if rng.random() < 0.2:
        coupling = {f"{way}_stiffness": 10 ** rng.uniform(6, 10) for way in ("radial", "tangential")}
        values["neighbour"] = Neighbour(rotation=rng.uniform(5, 30), ring_width=1.5, **coupling)
    return Ring(**LINING, concrete_unit_weight=25e3, joint_angles=tuple(angles), ground=ground, **values)


def outcome(model, ring, loads):
    """The response, or the reason of the refusal in words."""
    try:
        return model(ring).respond(loads).isel(time=0)
    except LiningFailure as refusal:
        return str(refusal)


def reason(model, ring, loads, refusal):
    """What a refusal blames, in a few words, and whether that is so.

    Joints are rightly blamed where they lack the stiffness that the refusal names, or where the ring is solved once
    they have it. What breaks down names no joint.
    """
    way = re.search(rf"degrees\) ({'|'.join(WAYS)}) most freely", refusal)
    blamed = [WAYS[way[1]]] if way else [*WAYS.values()] if "joints" in refusal else []
    moves = way[1] if way else "gives way"
    if any(getattr(ring, name) == 0 for name in blamed):
        return f"a joint without stiffness {moves}", True
    stiffer = ring.model_copy(update=dict.fromkeys(blamed, STIFF))
    return f"a soft joint {moves}", bool(blamed) and not isinstance(outcome(model, stiffer, loads), str)
