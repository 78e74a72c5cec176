"""What single changes of a scene do to the inflow and to the ring at equal inflow mass: table and figure."""

from __future__ import annotations

import matplotlib
import numpy as np

from coupling.figures import NOW, STYLE
from coupling.figures.picture import Picture
from verification.published.sources import at_study_inflow

UNITS = {
    "inflow rate": "kg/m/s",
    "soil pressure, crown": "kPa",
    "soil pressure, invert": "kPa",
    "N largest": "kN/m",
    "|Q| largest": "kN/m",
    "M largest": "kN m/m",
    "M least": "kN m/m",
    "joint 2 rotation": "mrad",
}


def changes(study):
    """Inflow rate and response of every case at the largest inflow mass that all finished cases reached.

    Parameters
    ----------
    study : xarray.Dataset
        Of a one-at-a-time design; the first case is the scene as it is.

    Returns
    -------
    dict
        inflow_mass [kg/m]; units: name to unit; rows: list of dicts with change, and the value of every name. The
        rate is the mean from a tenth of that inflow mass on.
    """
    import json

    names = list(json.loads(study.attrs["study"])["parameters"])
    finished = study["status"].values == "finished"
    if not finished.any():
        return {"inflow_mass": np.nan, "units": UNITS, "rows": []}
    reached = np.where(np.isfinite(study["time"].values), study["inflow_mass"].values, 0.0).max(axis=1)[finished].min()
    now, early = at_study_inflow(study, float(reached)), at_study_inflow(study, 0.1 * float(reached))
    model = study["model"].values[0]
    rows = []
    for k in np.flatnonzero(finished):
        different = [name for name in names if _value(study, name, k) != _value(study, name, 0)]
        ring, pressures = now.isel(case=k).sel(model=model), now.isel(case=k)
        duration = float(now["time"][k]) - float(early["time"][k])
        values = (
            0.9 * reached / duration if duration > 0 else np.nan,
            float(pressures["soil_pressure"].sel(theta=0)) / 1e3,
            float(pressures["soil_pressure"].sel(theta=180)) / 1e3,
            float(ring["axial_force"].max()) / 1e3,
            float(np.abs(ring["shear_force"]).max()) / 1e3,
            float(ring["bending_moment"].max()) / 1e3,
            float(ring["bending_moment"].min()) / 1e3,
            float(ring["joint_rotation"].sel(joint=2)) * 1e3,
        )
        said = ", ".join(f"{name} = {_shown(_value(study, name, k))}" for name in different) or "as it is"
        rows.append({"change": said, **dict(zip(UNITS, values, strict=True))})
    return {"inflow_mass": float(reached), "units": UNITS, "rows": rows}


def sensitivity_figure(table):
    """Bars of the change of every quantity over its value in the scene as it is, one row a change.

    Parameters
    ----------
    table : dict
        Of :func:`changes`.
    """
    first, rows = table["rows"][0], table["rows"][1:]
    names = list(table["units"])
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(1.1 * len(names) + 3.0, 1.0 + 0.24 * max(len(rows), 1)), layout="constrained")
        panels = figure.subplots(1, len(names), sharey=True)
        place = np.arange(len(rows))[::-1]
        for axis, name in zip(panels, names, strict=True):
            axis.barh(place, [100 * (row[name] / first[name] - 1) for row in rows], color=NOW, height=0.6)
            axis.axvline(0.0, color="0.2", lw=0.6)
            axis.set_title(name.replace(", ", "\n"), fontsize=7)
            axis.set_xlabel("change [%]", fontsize=7)
            axis.grid(True, axis="x")
        panels[0].set_yticks(place, [row["change"] for row in rows], fontsize=6.5)
    return figure


def _value(study, name, case):
    return study[name.replace(".", "_")].values[case]


def _shown(value):
    return f"{value:g}" if isinstance(value, float | np.floating) else str(value)
