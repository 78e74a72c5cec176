"""What a run came to, in a few numbers: the table and the JSON of `gush run` and `gush respond`."""

from typing import Any

import xarray as xr

from coupling.datasets import opened, read_attributes, read_history, read_pressures
from coupling.datasets.geometry import on_tunnel, tunnels_beside
from coupling.datasets.open_run import Run
from coupling.postprocess.extremes import JOINTS, extremes
from coupling.postprocess.quality import lining_equilibrium, quality, verdicts
from mpm.fields import CLAMPS
from structure.passing import utilisations
from structure.response import FORCES

PLACES = {"crown": 0, "right waist": 90, "invert": 180, "left waist": 270}


def summarise_run(run: Run) -> dict[str, Any]:
    """Numbers of a run for people and programs.

    Returns
    -------
    dict
        scene, status, status_message; records; time [s]; inflow_mass [kg/m]; flow_zone_area, disturbed_area [m2];
        steps; point_steps; mean_dt [s]; dt_limit; max_velocity [m/s]; grain_mass_error [-]: largest relative
        departure from the initial grain mass; wall_seconds, cpu_seconds, point_steps_per_cpu_second; clamps: updates
        at which each limit acted; quality, verdicts: as :func:`quality`; soil_pressure, water_pressure [Pa]:
        place to {initial, final}, of the tunnel with the gate; tunnels: number of any other to the same two and
        `response`, None.
    """
    with opened(run) as file:
        attributes, history, pressures = read_attributes(file), read_history(file), read_pressures(file)
    data = {
        "scene": attributes["scene_name"],
        "status": attributes["status"],
        "status_message": attributes["status_message"],
        "records": int(history.sizes["time"]),
    }
    for name in ("wall_seconds", "cpu_seconds"):
        if name in attributes:
            data[name] = float(attributes[name])
    if not data["records"]:
        return data | {"tunnels": {}}
    last, errors = history.isel(time=-1), quality(history)
    limits = history["dt_limit"].attrs["flag_meanings"].split()
    steps, simulated = int(last["steps"]), float(last["time"])
    data |= {
        "time": simulated,
        **{name: float(last[name]) for name in ("inflow_mass", "flow_zone_area", "disturbed_area", "max_velocity")},
        "steps": steps,
        "point_steps": int(last["point_steps"]),
        "point_steps_per_cpu_second": float(last["point_steps"]) / max(float(last["cpu_seconds"]), 1e-9),
        "mean_dt": simulated / steps if steps else float(last["dt"]),
        "dt_limit": limits[int(last["dt_limit"])],
        "clamps": {name: int(last[f"clamp_{name}"]) for name in CLAMPS},
        "grain_mass_error": errors["grain_mass_error"],
        "quality": errors,
        "verdicts": verdicts(errors),
        "tunnels": {},
    }
    if "soil_pressure" in pressures:
        for k in tunnels_beside(pressures):
            data["tunnels"][k] = _at_places(on_tunnel(pressures, k)) | {"response": None}
        data |= _at_places(on_tunnel(pressures))
    return data


def _at_places(pressures):
    """Pressures of one tunnel [Pa]: name to place to {initial, final}."""
    return {
        name: {
            place: {
                "initial": float(pressures[name].isel(time=0).sel(theta=theta)),
                "final": float(pressures[name].isel(time=-1).sel(theta=theta)),
            }
            for place, theta in PLACES.items()
        }
        for name in ("soil_pressure", "water_pressure")
    }


def summarise_response(response: xr.Dataset) -> dict[str, Any]:
    """Extreme internal forces and joint deformations, initial and final.

    Returns
    -------
    dict
        axial_force, shear_force [N/m], bending_moment [N m/m]: for "initial" and "final" max, max_theta, min, min_theta
        [degree]; joint_opening, joint_dislocation [m], joint_rotation [rad]: for "initial" and "final" the value of
        every joint; equilibrium_residual [-]: the largest, None of a lining that moved in the ground; utilisations: as
        of :func:`structure.utilisations`, empty without limits.
    """
    states = {"initial": response.isel(time=0), "final": response.isel(time=-1)}
    found = {state: extremes(record) for state, record in states.items()}
    keys = {"max": "max", "max_theta": "max_angle", "min": "min", "min_theta": "min_angle"}
    data = {
        name: {state: {key: one[f"{name}_{end}"].item() for key, end in keys.items()} for state, one in found.items()}
        for name in FORCES
    }
    for name in JOINTS:
        data[name] = {state: record[name].values.tolist() for state, record in states.items()}
    data["equilibrium_residual"] = lining_equilibrium(response)
    data["utilisations"] = utilisations(response)
    return data
