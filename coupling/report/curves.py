"""What the slider of a page moves: curves around a ring at some records, and what has one value over all records.

A run and a case of a study come in the same form, a dataset over `progress`, `model` and `theta`, as
:func:`coupling.studies.case.at_inflow_masses` gives it; each becomes one entry of the page.
"""

import numpy as np
import xarray as xr

from coupling.datasets.geometry import on_tunnel
from coupling.datasets.tree import match_times, responses_of
from coupling.postprocess.extremes import extremes, ring_extremes
from coupling.postprocess.ring_shape import centred
from coupling.report.packing import evenly, levels
from structure.limits import CHECK_VARIABLES, UTILISATIONS
from structure.lining import at_whole_degrees
from structure.response import FORCES, PRESSURES

MOTION = ("displacement_radial",)
JOINTS = ("joint_axial_force", "joint_shear_force", "joint_bending_moment", "joint_opening", "joint_dislocation",
          "joint_rotation")  # fmt: skip
BYTES_OF_CURVES = 1.4e6  # of everything that has a value for each angle, before it is compressed
BYTES_OF_VALUE = 2
ANGLE_STEPS = (1, 2, 3, 4)  # take every so many values around the ring before leaving out records
MOST_STOPS = 240
MOST_IN_DETAIL = 4  # entries of a page that show displacements and joints, too


def run_states(run, tunnel, records):
    """States of a tunnel of a run at some records.

    run : xarray.DataTree;  tunnel : int or None, None: that with the gate;  records : (n,) int, of `/history`.

    Returns xarray.Dataset: pressures (progress, theta), histories (progress), responses (progress, model, theta or
    joint), NaN where a model has no record; time [s] and inflow_mass [kg/m] (progress).
    """
    history = run["history"].to_dataset().isel(time=records)
    parts, times = [history[[n for n in history.data_vars if history[n].dims == ("time",)]]], history["time"].values
    lining = run["lining"].to_dataset()
    if "soil_pressure" in lining:
        rows, _ = match_times(lining["time"].values, times)
        parts.append(on_tunnel(lining[list(PRESSURES)].isel(time=rows), tunnel))
    answers = []
    for name, response in responses_of(run, tunnel).items():
        rows, present = match_times(response["time"].values, times)
        if present.any():
            left = {"inflow_mass", *CHECK_VARIABLES} - UTILISATIONS.keys()
            answer = at_whole_degrees(response).drop_vars(left, errors="ignore").isel(time=rows)
            answer = answer.assign_coords(time=times).where(xr.DataArray(present, dims="time"))
            answers.append(answer.expand_dims(model=[name]))
    if answers:
        parts.append(xr.concat(answers, dim="model", join="outer", combine_attrs="override", data_vars="all"))
    plain = [part.drop_vars(["time", "inflow_mass", "theta_bnds"], errors="ignore").drop_attrs() for part in parts]
    states = xr.merge(plain, compat="override", join="outer").rename(time="progress")
    mass = history["inflow_mass"].values
    return shape_of_ring(states.assign(time=("progress", times)).assign_coords(inflow_mass=("progress", mass)))


def shape_of_ring(states):
    """The states with the radial displacement of the ring's shape alone: what moves as a whole does not deform."""
    if "displacement_radial" not in states:
        return states
    radial, tangential = (states[f"displacement_{way}"].transpose(..., "theta") for way in ("radial", "tangential"))
    shape, _ = centred(np.radians(states["theta"].values), radial.values, tangential.values)
    return states.assign(displacement_radial=radial.copy(data=shape))


def budget(states, count, most, detail):
    """How `count` entries of a page are thinned to fit into it.

    states : xarray.Dataset, of one of them;  count, most : int, entries; records of each at most;  detail : bool,
    whether they show displacements, too.

    Returns int, (n,) int64: every how many values around the ring are taken, and at which of the records.
    """
    records, of_model = states.sizes["progress"], len(FORCES) + len(MOTION) * detail
    curves = (len(PRESSURES) + of_model * states.sizes.get("model", 0)) * states.sizes.get("theta", 1)
    affordable = BYTES_OF_CURVES / (BYTES_OF_VALUE * curves * max(count, 1))  # records of whole curves
    step = next((step for step in ANGLE_STEPS if affordable * step >= min(records, most)), ANGLE_STEPS[-1])
    return step, evenly(records, max(2, min(most, int(affordable * step))))


def slider_stops(entries, records, along="inflow_mass"):
    """Inflow masses [kg/m] or times [s] that the slider stops at: all that any entry has, ascending, (n,) float64."""
    places = np.unique(np.round(np.concatenate([states[along].values[records] for states in entries]), 9))
    places = places[np.isfinite(places)]
    return places[evenly(len(places), MOST_STOPS)]


def rows_at(states, records, stops, along="inflow_mass"):
    """Row of the curves at every stop of the slider: that of the nearest place, -1 beyond what was reached."""
    places = states[along].values
    reached = int(np.flatnonzero(np.isfinite(states["time"].values))[-1])  # time is unknown beyond
    rows = np.array([int(np.argmin(np.abs(places[records] - stop))) for stop in stops])
    beyond = (stops > places[reached] * (1 + 1e-6)) & (records[rows] >= reached) | (records[rows] > reached)
    return np.where(beyond, -1, rows)


def entry(states, answers, records, step, detail):
    """One run, tunnel or case as the page draws it.

    states : xarray.Dataset, from :func:`run_states` or of a case, in memory;
    answers : list of dict, from :func:`ring_series`, one for each lining model;
    records, step : from :func:`budget`;
    detail : bool, whether displacements and joints are kept.

    Returns a dict: records: of the curves' rows; series: name to (n_progress,); curves: name to levels (n_records,
    n_angles); joint_angle [degree]; models: list of {name, series, curves, joints: name to (n_records, n_joints)}; all
    SI.
    """
    kept, series = states.isel(progress=records), [n for n in states.data_vars if states[n].dims == ("progress",)]
    pressures = [name for name in PRESSURES if name in states]
    of_pressures = extremes(states, pressures) if pressures else {}
    models = []
    for k, found in enumerate(answers):
        model = kept.isel(model=k)
        around = [name for name in (*FORCES, *(MOTION if detail else ())) if name in model]
        joints = [name for name in JOINTS if detail and model.sizes.get("joint") and name in model]
        models.append({
            "name": str(model["model"].item()),
            "series": found,
            "curves": {name: levels(model[name].transpose("progress", ...).values[:, ::step]) for name in around},
            "joints": {name: model[name].transpose("progress", ...).values for name in joints},
        })  # fmt: skip
    return {
        "records": records.tolist(),
        "series": {"inflow_mass": states["inflow_mass"].values, **{name: states[name].values for name in series},
                   **{key: of_pressures[key].values for key in getattr(of_pressures, "data_vars", ())}},
        "curves": {name: levels(kept[name].values[:, ::step]) for name in pressures},
        "joint_angle": states["joint_angle"].values.tolist() if "joint_angle" in states.coords else [],
        "models": models,
    }  # fmt: skip


def ring_series(states):
    """What has one value at each record of every lining model's answer: list of dict, name to (n_progress,)."""
    found = []
    for k in range(states.sizes.get("model", 0)):
        model = states.isel(model=k)
        shape = [name for name in MOTION if name in model]
        series = ring_extremes(model).merge(extremes(model, shape)).drop_vars("inflow_mass")
        series = series.where(np.isfinite(series))  # a chart has no infinity
        found.append({key: values.values for key, values in series.data_vars.items()})
    return found
