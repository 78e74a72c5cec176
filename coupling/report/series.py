"""What the slider moves: pressures, ring forces, joints and histories at the frames of a page."""

import json

import numpy as np

from coupling.datasets import RunFileError
from coupling.datasets.geometry import tunnels_beside
from coupling.datasets.tree import match_times, model_names
from coupling.report.packing import BASE64, evenly, packed
from structure.response import FORCES, PRESSURES

RING_FIELDS = (*FORCES, "displacement_radial", "displacement_tangential")
JOINT_FIELDS = (
    "joint_axial_force", "joint_shear_force", "joint_bending_moment",
    "joint_opening", "joint_dislocation", "joint_rotation",
)  # fmt: skip
BYTES_OF_FRAMES = 3.5e6  # base64 text of everything that has a value for each angle
MOST_FRAMES, MOST_RECORDS = 240, 1000
NOT_DRAWN = ("inflow_mass", "dt_limit")


def choose_frames(run):
    """Records of `/lining` (of `/history` without a lining) that the slider stops at, within the budget of bytes.

    run : xarray.DataTree;  returns (n,) int64.
    """
    lining = run["lining"].to_dataset()
    fields = len(PRESSURES) * lining.sizes.get("tunnel", 1)
    fields += len(RING_FIELDS) * sum(len(model_names(run, tunnel)) for tunnel in (None, *tunnels_beside(run["lining"])))
    bytes_each = 4 * BASE64 * fields * 360
    return evenly(lining.sizes["time"], min(MOST_FRAMES, int(BYTES_OF_FRAMES / bytes_each)))


def lining_series(run, frames):
    """Pressures at the frames: {theta, tunnels: list of name to packed (n_frames, n_theta) [Pa]}, or None."""
    lining = run["lining"].to_dataset()
    if "soil_pressure" not in lining:
        return None
    records = lining.isel(time=frames)
    tunnels = [records.isel(tunnel=k) for k in range(records.sizes["tunnel"])] if "tunnel" in lining.dims else [records]
    return {
        "theta": lining["theta"].values.tolist(),
        "tunnels": [{name: packed(tunnel[name].values) for name in PRESSURES} for tunnel in tunnels],
    }


def model_series(name, response, times):
    """Response of one lining model at the times of the frames; NaN where it has no record.

    Parameters
    ----------
    name : str
    response : xarray.Dataset
        A group of `/structure`.
    times : (n_frames,) float64
        [s]

    Returns
    -------
    dict
        name, theta [degree], joint_angle [degree], outer_radius and inner_radius [m], fields (n_frames, n_theta),
        joints (n_frames, n_joints), series (n_frames,): name to packed, SI.
    """
    rows, present = match_times(response["time"].values, times)
    try:
        ring = json.loads(response.attrs.get("ring", "{}"))
    except ValueError as error:
        raise RunFileError(
            f"run file: damaged, the attribute 'ring' of a response must be JSON, got: {error}; run `gush respond`"
        ) from None

    def at_frames(variable):
        values = variable.transpose("time", ...).values[rows].astype(float)
        values[~present] = np.nan
        return packed(values)

    def packed_all(names):
        return {name: at_frames(response[name]) for name in names if name in response}

    on_time = [n for n in response.data_vars if response[n].dims == ("time",) and n not in NOT_DRAWN]
    return {
        "name": name,
        "theta": response["theta"].values.tolist(),
        "joint_angle": response["joint_angle"].values.tolist() if "joint_angle" in response.coords else [],
        "outer_radius": ring.get("outer_diameter", 2.0) / 2,
        "inner_radius": ring.get("inner_diameter", 1.8) / 2,
        "fields": packed_all(RING_FIELDS),
        "joints": packed_all(JOINT_FIELDS) if response.sizes.get("joint") else {},
        "series": {
            n: {"units": response[n].attrs.get("units", ""), "label": response[n].attrs.get("long_name", n),
                **at_frames(response[n])} for n in on_time
        },
    }  # fmt: skip


def history_series(run):
    """Every variable of `/history` over time: {time, series: {name: {units, label, packed ..}}}."""
    history = run["history"].to_dataset()
    kept = history.isel(time=evenly(history.sizes["time"], MOST_RECORDS))
    return {
        "time": packed(kept["time"].values),
        "series": {
            name: {
                "units": variable.attrs.get("units", ""),
                "label": variable.attrs.get("long_name", name),
                **packed(variable.values),
            }
            for name, variable in {**kept.data_vars, **kept.coords}.items()
            if name != "time" and variable.dims == ("time",) and name != "dt_limit"
        },
    }
