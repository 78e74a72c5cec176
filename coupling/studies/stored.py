"""What `gush study` does."""

from functools import partial

import numpy as np

from coupling.datasets import write_dataset
from coupling.files.replace import replaced
from coupling.studies.cases import cases
from coupling.studies.design import load_study
from coupling.studies.execute import study, study_folder
from coupling.studies.folder import DATA_FILE
from coupling.studies.limits import limits_of_case, limits_of_study
from coupling.studies.progress import StudyLine
from structure.models import model_name

#: Keys of a case's result.
RESULTS = ("cpu_seconds", "inflow_mass", "time", "axial_force", "bending_moment", "utilisations")


def run_study(name, out, workers, scheduler, console):
    """Run a study, store its dataset as study.nc, and return what the command shows.

    Returns a dict: study, folder, data: path of the dataset; model: the first lining model; cases: list of dicts with
    case, name, parameters, status, message, cpu_seconds [s], and at the last inflow mass reached: inflow_mass [kg/m],
    time [s], axial_force [N/m] and bending_moment [N m/m] of that model as {max, min}, None without a ring;
    utilisations of that model over the whole case, as :func:`coupling.studies.limits.limits_of_case`; limits: as
    :func:`coupling.studies.limits.limits_of_study`.
    """
    plan = load_study(name)
    folder = study_folder(name, plan, out)
    with StudyLine(console) as line:
        dataset = study(plan, folder, workers, scheduler, partial(console.print, highlight=False, soft_wrap=True), line)
    with replaced(folder / DATA_FILE) as beside:
        if dataset.chunks:  # of a large study, loaded piece by piece
            dataset.to_netcdf(beside, engine="h5netcdf")
        else:
            write_dataset(beside, dataset)
    rows = []
    for case in cases(plan):
        one = dataset.sel(case=case.index)
        status = str(one["status"].values)
        rows.append(
            {
                "case": case.index,
                "name": case.name,
                "parameters": case.parameters,
                "status": status,
                "message": str(one["message"].values),
                **(_result(one, plan.backends) if status == "finished" else dict.fromkeys(RESULTS)),
            }
        )
    return {
        "study": plan.name,
        "folder": str(folder),
        "data": str(folder / DATA_FILE),
        "model": model_name(plan.backends[0]) if plan.backends else None,
        "cases": rows,
        "limits": limits_of_study({row["case"]: row["utilisations"] for row in rows if row["utilisations"]}),
    }


def _result(one, backends):
    """What a finished case came to, at the last inflow mass that it reached."""
    reached = np.flatnonzero(np.isfinite(one["time"].values))
    last = one.isel(progress=reached[-1] if len(reached) else 0)
    found = {name: float(last[name]) for name in ("cpu_seconds", "inflow_mass", "time")}
    for name in ("axial_force", "bending_moment"):
        found[name] = None
        if name in last:
            values = last[name].sel(model=model_name(backends[0])) if "model" in last.dims else last[name]
            if np.isfinite(values).any():
                found[name] = {"max": float(values.max()), "min": float(values.min())}
    found["utilisations"] = limits_of_case(one, model_name(backends[0]) if backends and "model" in one.dims else None)
    return found
