"""Pressures of theory on the lining of a scene, as they are at first and while they fall at the gate."""

import numpy as np
import xarray as xr

from structure.theory import theoretical_pressures

GATE = 90.0  # degrees; pressures fall around it, gaussian 15 degrees wide


def theory_pressures(scene, k0=None, theta=None):
    """Geostatic and hydrostatic pressures of an `mpm.Scene`, with its K0 unless another is given, one time.

    theta : angles [degree]; every degree when left out.
    """
    tunnel, soil, water = scene.tunnels[0], scene.soils[0], scene.water
    buoyant = (1 - soil.porosity) * (soil.grain_density - water.density) * scene.gravity
    at_rest = soil.lateral_pressure_coefficient(buoyant * tunnel.axis_depth) if k0 is None else k0
    return theoretical_pressures(
        outer_diameter=tunnel.outer_diameter, cover=tunnel.cover, buoyant_unit_weight=buoyant,
        coefficient_at_rest=at_rest, water_unit_weight=water.density * scene.gravity, theta=theta,
    )  # fmt: skip


def falling_pressures(scene, n_times, share=0.9):
    """The same while they fall around the gate by up to a share, in so many times to 1000 kg/m."""
    base = theory_pressures(scene)
    near = np.exp(-(((base["theta"] - GATE) / 15) ** 2))
    fall = xr.DataArray(np.linspace(0, share, n_times), dims="time") * near
    loads = base.isel(time=0, drop=True).map(lambda part: (part * (1 - fall)).transpose("time", "theta"))
    loads = loads.assign_coords(time=("time", np.arange(n_times, dtype=float), {"units": "s"}))
    loads["inflow_mass"] = ("time", np.linspace(0, 1000, n_times), {"units": "kg/m"})
    return loads
