"""All cases of a study in one dataset."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from coupling.datasets.group import read_group_at_once
from coupling.files.provenance import made_here
from coupling.scenes.scene import unit_of
from coupling.studies.cases import Case, cases
from coupling.studies.design import Study, StudyError, stored_study
from coupling.studies.folder import STATUS_FILE, case_file
from structure.lining import at_whole_degrees

#: Studies whose cases take less than this on the disk are held in memory.
MOST_BYTES_IN_MEMORY = 5e8


def collect(plan: Study, cases: list[Case], folder: Path, failures: dict[str, str]) -> xr.Dataset:
    """The cases' datasets along a dimension `case`; a large study is loaded when used.

    Returns: variables of :func:`coupling.studies.case.at_inflow_masses` with `case` in front, NaN in failed cases;
    parameters as coordinates (case) in SI under their dotted names with `_` for `.`, and `case_name`; `status` (case)
    "finished" or "failed", `message` (case). Attributes: `study`, its definition as JSON with the seed; `failed`, their
    number; source, revision, versions.

    Raises coupling.studies.design.StudyError: the file of a case is damaged.
    """
    there = [case for case in cases if case_file(folder, case).is_file()]
    files = [case_file(folder, case) for case in there]
    small = sum(file.stat().st_size for file in files) < MOST_BYTES_IN_MEMORY
    parts = [read_case(file, small) for file in files]
    result = xr.Dataset(coords={"case": np.array([], int)})
    if parts:
        result = xr.concat(
            parts, dim=xr.IndexVariable("case", [case.index for case in there]), join="outer", data_vars="all",
            coords=["inflow_mass"], compat="override", combine_attrs="drop_conflicts",
        )  # fmt: skip
    result = result.reindex(case=[case.index for case in cases])
    result["case"].attrs = {"units": "1", "long_name": "number of the case"}
    names = np.array([case.name for case in cases], dtype=str)
    result = result.assign_coords(case_name=("case", names, {"long_name": "what the case changes"}))
    for name in plan.parameters:
        values = _column([case.parameters[name] for case in cases])
        about = {"long_name": name} | ({"units": units_of(name)} if values.dtype.kind in "fiu" else {})
        result = result.assign_coords({name.replace(".", "_"): ("case", values, about)})
    if "scene" in plan.parameters:
        result = result.assign_coords(_of_scenes(cases))
    done = np.array([case in there for case in cases])
    result["status"] = ("case", np.where(done, "finished", "failed"))
    result["message"] = ("case", np.array([failures.get(case.key, "") for case in cases], dtype=str))
    result.attrs = {
        **made_here(f"study {plan.name}", "cases collected"),
        "study": json.dumps(plan.model_dump(mode="json")),
        "failed": int((~done).sum()),
    }
    return result


def units_of(name: str) -> str:
    """Units of a parameter as datasets spell them."""
    return (unit_of(name) or "1").replace("**", "^").replace("*", " ")


def _column(values):
    """Values of a parameter as an array of numbers, of truth values, or of texts."""
    there = [value for value in values if value is not None]
    if there and all(isinstance(value, int | float) and not isinstance(value, bool) for value in there):
        return np.array([np.nan if value is None else value for value in values])
    if all(isinstance(value, bool) for value in values):
        return np.array(values)
    return np.array(["none" if value is None else str(value) for value in values])


def read_case(file: Path, in_memory: bool = True) -> xr.Dataset:
    """The dataset of a case; one that is not in memory is loaded when used.

    Raises coupling.studies.design.StudyError: the file is damaged.
    """
    try:
        if in_memory:
            case = read_group_at_once(file)
        else:
            case = xr.open_dataset(file, engine="h5netcdf", chunks={}, decode_timedelta=False)
        return at_whole_degrees(case, "theta_ring")  # as earlier versions called the angles of the ring
    except (OSError, RuntimeError, ValueError, KeyError, AttributeError) as error:
        raise StudyError(
            f"case '{file}': damaged ({type(error).__name__}); delete this file and repeat `gush study`"
        ) from None


def _of_scenes(cases):
    """Coordinates that tell scenes apart where the scene itself is a parameter."""
    soils = [case.scene.soils[0] for case in cases]
    tunnels = [case.scene.tunnels[:1] for case in cases]
    gates = [case.scene.gate for case in cases]
    columns = {
        "gate_angle": ([np.nan if gate is None else gate.angle for gate in gates], "degree", "angle of the gate"),
        "cover": ([t[0].cover if t else np.nan for t in tunnels], "m", "cover of the first tunnel"),
        "soil": ([soil.name for soil in soils], "1", "uppermost soil"),
        "cohesion": ([soil.strength[0] for soil in soils], "Pa", "its cohesion"),
        "friction_angle": ([soil.strength[1] for soil in soils], "degree", "its friction angle"),
        "youngs_modulus": ([soil.youngs_modulus_at(1e5) for soil in soils], "Pa", "its Young's modulus, under 100 kPa"),
    }
    return {
        name: ("case", np.array(values), {"units": units, "long_name": text})
        for name, (values, units, text) in columns.items()
    }


def stored_cases(folder: str | Path) -> tuple[Study, list[Case], dict[str, str]]:
    """Definition, cases and failures of a study that ran earlier, also by an earlier version of the program.

    Raises coupling.studies.design.StudyError: no study there, or its files are damaged.
    """
    folder = Path(folder)
    plan = stored_study(folder)
    found = cases(plan)
    try:
        text = (folder / STATUS_FILE).read_text(encoding="utf-8") if (folder / STATUS_FILE).is_file() else "{}"
        entries = {key: (e["parameters"], e["status"], str(e["message"])) for key, e in json.loads(text).items()}
    except (ValueError, AttributeError, TypeError, KeyError):
        raise StudyError(
            f"study folder '{folder}': {STATUS_FILE} must be what `gush study` wrote, it is damaged; delete it and "
            "repeat the command"
        ) from None
    # the keys that the cases had when they ran: the sources may have changed since
    if [parameters for parameters, _, _ in entries.values()] == [case.parameters for case in found]:
        found = [replace(case, key=key) for case, key in zip(found, entries, strict=True)]
    return plan, found, {key: message for key, (_, status, message) in entries.items() if status == "failed"}


def read_study(folder: str | Path) -> xr.Dataset:
    """The dataset of a study that ran earlier.

    Parameters
    ----------
    folder : str or path
        As given to :func:`coupling.study`.

    Raises
    ------
    coupling.studies.design.StudyError
        No study there.
    """
    plan, found, failures = stored_cases(folder)
    return collect(plan, found, Path(folder), failures)
