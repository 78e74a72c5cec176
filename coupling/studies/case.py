"""One case of a study: run, answered by the lining models, taken at fixed inflow masses; made to run anywhere."""

from pathlib import Path

import numpy as np

from coupling.studies.folder import CASE_FILE, RUN_FOLDER
from coupling.studies.progress import CaseProgress

#: Quantities over time that a case keeps besides pressures and response.
PROGRESS = ("time", "flow_zone_area", "disturbed_area", "suspended_fraction", "max_velocity")


def run_case(source: str, folder: str, backends: tuple[str, ...], records: int, threads: int = 1) -> str:
    """Run one scene and write its `case.nc`, at once where that exists; returns the path of the file.

    source : TOML of the complete scene;
    folder : the case's own; made when absent. What a killed run left there is continued where it can be;
    backends : tuple of str, lining models;
    records : number of inflow masses;
    threads : results do not depend on it.

    Raises mpm.RunFailed, structure.LiningFailure, coupling.refused.Refused: as :func:`coupling.run`; the study goes on
    without the case.
    """
    from coupling.datasets import read_history, read_pressures, write_dataset, write_responses
    from coupling.datasets.geometry import on_tunnel
    from coupling.files.folder import RUN_FILE
    from coupling.files.provenance import root_attributes
    from coupling.files.replace import replaced
    from coupling.refused import Refused
    from coupling.responses.respond import responses_on
    from coupling.runs.run import run
    from coupling.scenes.scene import parse_scene
    from structure.models import lining_model, model_name

    place = Path(folder)
    done = place / CASE_FILE
    if done.is_file():
        return str(done)
    scene = parse_scene(source, str(place))
    models = {model_name(backend): backend for backend in backends} if scene.ring is not None else {}
    for backend in models.values():
        lining_model(backend)(scene.ring)  # what it refuses is refused before the simulation
    place.mkdir(parents=True, exist_ok=True)
    run_folder = place / RUN_FOLDER
    report = CaseProgress(place)
    try:
        run(scene, run_folder, threads=threads, resume=True, progress=report)
    except Refused:
        # nothing there yet, or what is there began with other versions or has failed
        run(scene, run_folder, overwrite=True, threads=threads, progress=report)
    report({"stage": "respond"})
    pressures, history = read_pressures(run_folder), read_history(run_folder)
    answers, responses = {}, {}
    for name, backend in models.items():
        answers |= responses_on(scene, pressures, backend)
        responses[name] = answers[name, None]
    if answers:
        write_responses(run_folder / RUN_FILE, answers)
    last = scene.stop.inflow_mass or float(history["inflow_mass"].values[-1])
    result = at_inflow_masses(on_tunnel(pressures), history, responses, np.linspace(0.0, last, records))
    result.attrs = root_attributes(scene)
    with replaced(done) as beside:
        write_dataset(beside, result)
    report.end()
    return str(done)


def at_inflow_masses(pressures, history, responses, masses, along="inflow_mass"):
    """States of a run at fixed inflow masses, or times; NaN beyond what the run reached.

    pressures, history : xarray.Dataset, of the run, one tunnel;
    responses : dict of str to xarray.Dataset, by lining model;
    masses : (n,) float64 [kg/m], ascending from 0, the initial state; along "time" [s];
    along : {"inflow_mass", "time"}.

    Returns xarray.Dataset: pressures (progress, theta); time, zones and so on (progress); variables of the responses
    with a dimension `model`; of checks (model) NAME_largest [-] over all records and NAME_passing_mass, the inflow mass
    [kg/m] at which it first passes 1, NaN for never, NAME of :data:`structure.limits.UTILISATIONS`; `inflow_mass`
    (progress) [kg/m]; progress from 0 to 1 is the share of the last inflow mass, so that cases of different stops
    stack. cpu_seconds, quality numbers as scalars.
    """
    import xarray as xr

    from coupling.datasets import BALANCES
    from coupling.postprocess.at_inflow import crossing_times
    from coupling.postprocess.quality import quality
    from structure.limits import CHECK_VARIABLES

    reached = crossing_times(history[along].values, history["time"].values, masses)
    parts = [_at(pressures[["soil_pressure", "water_pressure", "soil_shear"]], reached)]
    parts.append(_at(history[[name for name in PROGRESS if name != "time" and name in history]], reached))
    if responses:
        plain = {name: response.drop_vars(CHECK_VARIABLES, errors="ignore") for name, response in responses.items()}
        keep = [name for name in next(iter(plain.values())).data_vars if name != "inflow_mass"]
        models = [_at(response[keep], reached).assign(_limits(responses[name])) for name, response in plain.items()]
        parts.append(xr.concat(models, dim=xr.IndexVariable("model", list(responses)), join="outer"))
    result = xr.merge(parts, compat="no_conflicts", join="outer")
    share = masses / max(masses[-1], 1e-300)
    mass = masses
    if along == "time":
        mass = _at(history.reset_coords("inflow_mass")[["inflow_mass"]], reached)["inflow_mass"].values
    result = result.assign_coords(
        progress=("progress", share, {"units": "1", "long_name": f"share of the last {along.replace('_', ' ')}"}),
        inflow_mass=("progress", mass, {"units": "kg/m", "long_name": "grains inside the tunnel"}),
    )
    about = {"units": "s", "long_name": "time since the gate opened"}
    result["time"] = ("progress", reached, about)
    used = float(history["cpu_seconds"].values[-1])
    result["cpu_seconds"] = ((), used, {"units": "s", "long_name": "processor time"})
    values = quality(history, next(iter(responses.values()), None)) if set(BALANCES) <= set(history) else {}
    for name, value in values.items():
        if name != "clamps":
            result[f"quality_{name}"] = ((), float(value), {"units": "1", "long_name": name.replace("_", " ")})
    return result


def _limits(response):
    """What a whole response makes of its limits, as variables of a case."""
    from structure.limits import UTILISATIONS
    from structure.passing import utilisations

    found = {}
    for name, one in utilisations(response).items():
        passing = np.nan if one["passes"] is None else one["passes"].get("inflow_mass", np.nan)
        what = UTILISATIONS[name]
        found[f"{name}_largest"] = ((), one["largest"], {"units": "1", "long_name": f"largest utilisation, {what}"})
        about = {"units": "kg/m", "long_name": f"inflow mass at which the utilisation passes 1, {what}"}
        found[f"{name}_passing_mass"] = ((), passing, about)
    return found


def _at(dataset, times):
    """A dataset at some times, NaN where the time is NaN, with the dimension `progress` in place of time."""
    import xarray as xr

    plain = dataset.drop_vars(set(dataset.coords) & {"inflow_mass"})
    return plain.interp(time=xr.DataArray(times, dims="progress"), assume_sorted=True).drop_vars("time")
