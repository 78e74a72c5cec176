"""Where the figures and the page get their datasets: the folders of studies, and the runs of their cases."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np


@cache
def published_numbers() -> dict:
    """The published numbers, from numbers.toml."""
    import tomllib

    text = (resources.files("verification") / "published" / "numbers.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


@dataclass(frozen=True)
class CaseRun:
    """A case of a study: its scene and the folder of its run."""

    scene: object
    folder: Path

    @property
    def last_mass(self) -> float:
        """Inflow mass at the end of the run, at most that of its stop criterion [kg/m]."""
        from coupling.datasets import read_history

        reached = float(read_history(self.folder)["inflow_mass"].max())
        stop = self.scene.stop.inflow_mass
        return reached if stop is None else min(stop, reached)


def case_runs(folder: str | Path) -> list[CaseRun | None]:
    """Runs of all cases of a study; None for those that are not finished.

    Raises
    ------
    coupling.studies.design.StudyError
        No study there.
    """
    from coupling.studies.case import RUN_FOLDER
    from coupling.studies.collect import stored_cases
    from coupling.studies.execute import case_file

    _, cases, _ = stored_cases(folder)
    files = [case_file(Path(folder), case) for case in cases]
    return [
        CaseRun(case.scene, file.parent / RUN_FOLDER) if file.is_file() else None
        for case, file in zip(cases, files, strict=True)
    ]


def run_of_scene(runs: list[CaseRun | None], name: str, angle: float | None = None) -> CaseRun | None:
    """The finished run of a scene by its name, and by the angle of its gate where that is given."""
    for run in runs:
        if run is not None and run.scene.name == name and (angle is None or run.scene.gate.angle == angle):
            return run
    return None


def at_study_inflow(study, inflow_mass: float):
    """All cases of a study at one inflow mass, linear between the states that were kept.

    Parameters
    ----------
    study : xarray.Dataset
        Of :func:`coupling.study`.
    inflow_mass : float
        [kg/m]

    Returns
    -------
    xarray.Dataset
        Variables with `progress`, without it; NaN for cases that did not get there.
    """
    import xarray as xr

    dependent = study[[name for name in study.data_vars if "progress" in study[name].dims]]
    parts = []
    for case in study["case"].values:
        one = dependent.sel(case=case)
        mass = one["inflow_mass"].values
        share = (
            np.interp(inflow_mass, mass, one["progress"].values, right=np.nan) if np.isfinite(mass).all() else np.nan
        )
        if not np.isfinite(share):
            parts.append(one.isel(progress=0, drop=True) * np.nan)
            continue
        parts.append(one.drop_vars("inflow_mass").interp(progress=share, assume_sorted=True).drop_vars("progress"))
    result = xr.concat(parts, dim="case", coords="different", compat="equals", join="outer")
    for name in dependent.data_vars:
        result[name].attrs = dict(dependent[name].attrs)
    return result.assign_coords(inflow_mass=inflow_mass)
