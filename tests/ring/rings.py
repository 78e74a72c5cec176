"""Rings and pressures that the tests share: an ordinary ring, that of case 3 (Xie, Zhang & Zhou), loads at rest and on.

Values are written out here and not taken from a scene, so that a changed scene changes no test.
"""

import numpy as np
import xarray as xr

from structure import Ground, Ring, theory

JOINTS = (8.0, 73.0, 138.0, 222.0, 287.0, 352.0)
FORCES = ("axial_force", "shear_force", "bending_moment")
#: Of the ground of case 3 [N/m3], [-], and its effective vertical stress at the axis [Pa].
BUOYANT_UNIT_WEIGHT = 0.55 * (2650 - 1000) * 9.81
K0 = 0.3 / 0.7
VERTICAL = 23.3 * BUOYANT_UNIT_WEIGHT


def ground(**changes):
    values = dict(
        youngs_modulus=40e6,
        poissons_ratio=0.3,
        cohesion=0.0,
        friction_angle=25.0,
        vertical_stress=2.07e5,
        horizontal_stress=8.9e4,
    )
    return Ground(**(values | changes))


def ring(**changes):
    values = dict(
        outer_diameter=6.6,
        inner_diameter=5.9,
        concrete_modulus=34.5e9,
        concrete_poissons_ratio=0.2,
        concrete_unit_weight=25e3,
        joint_angles=JOINTS,
        joint_rotational_stiffness=5e8,
        joint_normal_stiffness=6e8,
        joint_shear_stiffness=8e7,
        ground=ground(),
    )
    return Ring(**(values | changes))


def pressures(n_times=1):
    """Theory pressures, falling around 90 degrees as time goes on."""
    base = theory.theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8900.0, coefficient_at_rest=3 / 7
    )
    times = np.arange(n_times, dtype=float)
    fall = xr.DataArray(np.linspace(0, 0.9, n_times), dims="time") * np.exp(-(((base["theta"] - 90) / 15) ** 2))
    moved = {
        name: (base[name].isel(time=0, drop=True) * (1 - fall)).transpose("time", "theta") for name in base.data_vars
    }
    return xr.Dataset(moved).assign_coords(time=times)


def case_3_ground(**changes):
    at_rest = dict(vertical_stress=VERTICAL, horizontal_stress=K0 * VERTICAL, slip_at="centre_line")
    return ground(**(at_rest | changes))


def case_3_ring(**changes):
    return ring(**(dict(ground=case_3_ground(), balance_uplift=True) | changes))


def case_3_pressures(factor=1.0, where=None):
    """Initial pressures of case 3 from theory, times a factor, zero where told."""
    loads = theory.theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=BUOYANT_UNIT_WEIGHT, coefficient_at_rest=K0
    )
    loads = loads.map(lambda variable: variable * factor, keep_attrs=True)
    return loads if where is None else loads.where(where(loads["theta"]), 0.0)


def tractions(radial, shear=None, step=1.0):
    """Pressures of one time from functions of theta [rad]."""
    degrees = np.arange(0.0, 360.0, step)
    angle = np.radians(degrees)
    zero = np.zeros_like(angle)
    fields = dict(soil_pressure=radial(angle) + zero, water_pressure=zero, soil_shear=shear(angle) if shear else zero)
    return xr.Dataset(
        {name: (("time", "theta"), values[None]) for name, values in fields.items()},
        coords={"time": [0.0], "theta": degrees},
    )


def mirrored(dataset):
    swapped = dataset.assign_coords(theta=(360 - dataset["theta"]) % 360).sortby("theta")
    return swapped.assign(soil_shear=-swapped["soil_shear"])


def largest(values):
    return float(np.nanmax(np.abs(values)))
