"""What `gush study` does."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np


def run_study(name, out, workers, scheduler, console):
    """Run a study, store its dataset as study.nc, and return what the command shows.

    Returns
    -------
    dict
        study, folder, data: path of the dataset; cases: list of dicts with case, parameters, status, message,
        cpu_seconds [s], time [s] of the last inflow mass reached.
    """
    from coupling.studies.design import cases, load_study
    from coupling.studies.execute import DATA_FILE, study
    from coupling.studies.progress import StudyLine

    plan = load_study(name)
    folder = Path(out) if out is not None else Path("studies") / plan.name
    with StudyLine(console) as line:
        dataset = study(plan, folder, workers, scheduler, partial(console.print, highlight=False, soft_wrap=True), line)
    waiting = folder / f"{DATA_FILE}.new"
    dataset.to_netcdf(waiting, engine="h5netcdf")
    waiting.replace(folder / DATA_FILE)
    rows = []
    for case in cases(plan):
        one = dataset.sel(case=case.index)
        finished = str(one["status"].values) == "finished"
        rows.append(
            {
                "case": case.index,
                "parameters": case.parameters,
                "status": str(one["status"].values),
                "message": str(one["message"].values),
                "cpu_seconds": float(one["cpu_seconds"]) if finished else None,
                "time": float(np.nanmax(one["time"].values)) if finished else None,
            }
        )
    return {"study": plan.name, "folder": str(folder), "data": str(folder / DATA_FILE), "cases": rows}
