"""Runs that were made apart, beside each other as the cases of a study are: at equal inflow mass, or at equal time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from coupling.datasets import opened, read_attributes, read_history, read_pressures, read_response
from coupling.datasets.geometry import on_tunnel
from coupling.files.provenance import made_here
from coupling.refused import Refused
from coupling.responses.comparison import largest_difference
from coupling.scenes.scene import parse_scene
from coupling.studies.case import at_inflow_masses
from coupling.studies.cases import Case
from structure.response import PRESSURES, RESPONSE, SHOWN, Shown

TITLE = "runs side by side"
#: Quantities of progress and how they are shown; the rest is in `structure.response.SHOWN`.
PROGRESS = {
    "time": Shown("time", "time since the gate opened", "s", 1.0),
    "inflow_mass": Shown("inflow", "inflow mass", "kg/m", 1.0),
    "flow_zone_area": Shown("flow zone", "area of the flow zone", "m²", 1.0),
    "disturbed_area": Shown("disturbed zone", "area of the disturbed zone", "m²", 1.0),
}
COMPARED = {**PROGRESS, **{name: SHOWN[name] for name in (*PRESSURES, *RESPONSE) if name in SHOWN}}

#: Lining model of runs that no model has answered in common.
EACH_ITS_OWN = "each run its own"


class SideBySide(NamedTuple):
    """Runs beside each other.

    cases : list of coupling.studies.cases.Case, one a run, named after its folder;  files : list of path;
    states : list of xarray.Dataset, each as of :func:`coupling.studies.case.at_inflow_masses`;  along : "inflow_mass"
    or "time";  rows : list of dict, largest differences of every other run to the first: `run`, its name, and the keys
    of a row of :class:`coupling.responses.comparison.Comparison`.
    """

    cases: list[Case]
    files: list[Path]
    states: list[xr.Dataset]
    along: str
    rows: list[dict[str, Any]]

    def dataset(self) -> xr.Dataset:
        """All states in one dataset, with the dimension `run` in front."""
        names = xr.IndexVariable("run", [case.parameters["run"] for case in self.cases])
        states = [one.reset_coords("inflow_mass") for one in self.states]
        whole = xr.concat(
            states, dim=names, join="outer", data_vars="all", coords="minimal", compat="override",
            combine_attrs="drop_conflicts",
        )  # fmt: skip
        return whole.assign_attrs(made_here(f"{TITLE}: {', '.join(names.values)}", "runs compared"))


def side_by_side(runs: Sequence[str | Path], along: str = "inflow_mass", records: int = 41) -> SideBySide:
    """Runs at equal inflow mass, or at equal time, as far as all of them got, and how they differ from the first.

    Parameters
    ----------
    runs : sequence of path
        Folders or files, at least two.
    along : {"inflow_mass", "time"}
    records : int
        Number of states, the initial one among them.

    Raises
    ------
    Refused
        Fewer than two, the same one twice, another `along`, a run without a record or a tunnel, or one that did
        not get beyond the initial state.
    RunFileError, SceneError
        A run, or the scene in it, cannot be read.
    """
    if along not in ("inflow_mass", "time"):
        raise Refused(f"along: must be 'inflow_mass' or 'time', got {along!r}; choose one of these")
    if len(runs) < 2:
        raise Refused(f"runs: at least two must be given to compare, got {len(runs)}; name another")
    read = [_read(run) for run in runs]
    files = [one["file"] for one in read]
    twice = next((file for k, file in enumerate(files) if any(file.samefile(other) for other in files[:k])), None)
    if twice is not None:
        raise Refused(f"runs: must differ, got '{twice}' twice; name another")
    ends = [float(one["history"][along].max()) for one in read]
    if min(ends) <= 0:
        still = files[int(np.argmin(ends))]
        other = "; let it go on, or compare along time" if along == "inflow_mass" else "; let it go on"
        raise Refused(f"run '{still}': must get beyond the initial state to be compared, it did not{other}")
    common = [model for model in read[0]["responses"] if all(model in one["responses"] for one in read)]
    if not common and all(one["responses"] for one in read):
        common = [EACH_ITS_OWN]
        for one in read:
            one["responses"] = {EACH_ITS_OWN: next(iter(one["responses"].values()))}
    at = np.linspace(0.0, min(ends), records)
    states = []
    for one in read:
        answers = {model: one["responses"][model] for model in common}
        found = at_inflow_masses(one["pressures"], one["history"], answers, at, along)
        states.append(found.assign_attrs(one["attributes"]))
    names = _names(files)
    cases = [Case(k, {"run": name}, {"run": name}, one["scene"], str(one["file"]))
             for k, (name, one) in enumerate(zip(names, read, strict=True))]  # fmt: skip
    rows = [{"run": name, **row} for name, other in zip(names[1:], states[1:], strict=True)
            for row in _differences(states[0], other, along)]  # fmt: skip
    return SideBySide(cases, files, states, along, rows)


def _read(run):
    """What is compared of one run: its gate's tunnel."""
    with opened(run) as file:
        history, attributes = read_history(file), read_attributes(file)
        if not history.sizes["time"]:
            raise Refused(f"run '{file.path}': must hold a record to compare, it has none; wait for the first one")
        pressures = on_tunnel(read_pressures(file))
        if "soil_pressure" not in pressures:
            raise Refused(f"run '{file.path}': must have a tunnel to be compared, it has none; leave it out")
        return {
            "file": file.path,
            "history": history,
            "pressures": pressures,
            "responses": {model: read_response(file, model) for model in file.models()},
            "attributes": attributes,
            "scene": parse_scene(attributes["scene"], str(file.path)),
        }


def _names(files):
    """Names of the runs' folders, with those above them where these are the same."""
    folders = [file.absolute().parent if file.name == "run.nc" else file.absolute() for file in files]
    for parts in range(1, max(len(folder.parts) for folder in folders) + 1):
        names = ["/".join(folder.parts[-parts:]) for folder in folders]
        if len(set(names)) == len(names):
            return names
    return [str(file) for file in files]


def _differences(first, second, along):
    """Rows of all quantities that both have, by the leading model."""
    first, second = (_leading(states).reset_coords("inflow_mass") for states in (first, second))
    rows = []
    for name, shown in COMPARED.items():
        if name == along or name not in first or name not in second:
            continue
        one, other = (states[name].transpose("progress", ...) for states in (first, second))
        if "joint" in one.dims:  # rings of other segments have other joints
            one, other = xr.align(one, other, join="inner")
        difference = other - one
        if difference.size and difference.notnull().any():
            reference = first.sel(joint=difference["joint"]) if "joint" in difference.dims else first
            rows.append(largest_difference(name, difference, reference, shown))
    return rows


def _leading(states):
    return states.isel(model=0, drop=True) if "model" in states.dims else states
