"""Pressures measured by eight cells, written by hand, into the ring: what a leak at the right waist adds."""

import tempfile
from pathlib import Path

import numpy as np
import xarray as xr

import coupling
import structure

theta = np.arange(0.0, 360.0, 45.0)  # degrees from the crown, clockwise
before = np.array([178, 150, 120, 180, 236, 180, 120, 150]) * 1e3  # Pa
after = np.array([194, 175, 0, 205, 247, 185, 116, 155]) * 1e3  # the third cell lies at the leak
water = np.array([196, 206, 229, 251, 261, 251, 229, 206]) * 1e3
pressures = xr.Dataset(
    {
        "soil_pressure": (("time", "theta"), [before, after], {"units": "Pa"}),
        "water_pressure": (("time", "theta"), [water, np.where(theta == 90.0, 0.0, water)], {"units": "Pa"}),
        "soil_shear": (("time", "theta"), np.zeros((2, 8)), {"units": "Pa"}),
    },
    coords={"time": ("time", [0.0, 3600.0], {"units": "s"}), "theta": ("theta", theta, {"units": "degree"})},
)
ring = coupling.load_scene("case-3").ring
response = structure.BeamSpringLining(ring).respond(pressures)
added = structure.additional(response).isel(time=-1)
print(f"equilibrium: {response.equilibrium_residual.max().item():.0e} of the loads")
print(f"moment before: {response.bending_moment.isel(time=0).max().item() / 1e3:.0f} kN m/m")
print(f"added at most: {added.bending_moment.max().item() / 1e3:.0f} kN m/m")
print("joint openings added [mm]:", (added.joint_opening.values * 1e3).round(2))

# As a file it goes through the command line: gush compare measured.nc
with tempfile.TemporaryDirectory() as folder:
    pressures.attrs["ring"] = ring.model_dump_json()
    pressures.to_netcdf(Path(folder) / "measured.nc", engine="h5netcdf")
    with xr.open_dataset(Path(folder) / "measured.nc", engine="h5netcdf", decode_timedelta=False) as stored:
        again = structure.BeamSpringLining(structure.Ring.model_validate_json(stored.attrs["ring"])).respond(stored)
print("from the file the same:", bool((again.bending_moment == response.bending_moment).all()))
