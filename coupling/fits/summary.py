"""A fit in numbers: what the command shows and gives as JSON."""

from typing import Any

import numpy as np
import xarray as xr

from coupling.measurements import QUANTITIES
from coupling.postprocess.extremes import shown_extreme
from structure.limits import UTILISATIONS

#: Of the attributes of a fit.
NUMBERS = ("runs", "failed", "count", "chi_square", "probability")
ENDS = {"low": 0, "median": 2, "high": -1}
#: Predicted quantities that are drawn besides utilisations.
DRAWN = ("inflow_mass", "axial_force_max", "bending_moment_max", "bending_moment_min", "convergence_vertical")


def drawn(found: xr.Dataset) -> list[str]:
    """Quantities of a fit that its picture shows."""
    return [name for name in (*UTILISATIONS, *DRAWN) if name in found]


def predictions(found: xr.Dataset) -> list[str]:
    """Quantities of a fit over time."""
    return [str(name) for name in found.data_vars if found[name].dims == ("knowledge", "time", "level")]


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Numbers of a dataset of :func:`coupling.fits.fit.fit`, at its last time; keys as of `gush fit --json`."""
    last = found.isel(time=-1)
    quantities = predictions(found)
    data: dict[str, Any] = {name: found.attrs[name] for name in NUMBERS}
    data |= {"not_reached": found.sizes["measurement"] - data["count"], "time": float(last["time"])}
    data["parameters"] = {
        name: {"unit": str(one["unit_of_parameter"].values), **_bands(one["parameter_value"]),
               "range": {key: float(one[f"range_{key}"]) for key in ("low", "high")}}
        for name, one in ((name, found.sel(parameter=name)) for name in found["parameter"].values.tolist())
    }  # fmt: skip
    data["predictions"] = {}
    for name in quantities:
        label, unit, scale = shown_extreme(name)
        data["predictions"][name] = {"label": label, "unit": unit, "scale": scale, **_bands(last[name])}
    data["limits"] = {}
    for name in found["limit"].values.tolist() if "limit" in found.dims else ():
        one = found.sel(limit=name, knowledge="posterior")
        times = {key: float(one["passing_time"][end]) for key, end in ENDS.items()}
        data["limits"][name] = {"label": UTILISATIONS[name], "share_passing": float(one["share_passing"]),
                                "passing_time": times}  # fmt: skip
    data["emulators"] = _emulators(found)
    data["sensitivity"] = {
        quantity: {name: {key: float(found[key].sel(quantity=quantity, parameter=name))
                          for key in ("first_order", "total_order")} for name in data["parameters"]}
        for quantity in found["quantity"].values.tolist()
    }  # fmt: skip
    return data


def _bands(values):
    return {key: {name: float(values.sel(knowledge=key)[end]) for name, end in ENDS.items()}
            for key in ("prior", "posterior")}  # fmt: skip


def _emulators(found):
    """Cross-validation by measured quantity, worst measurement of each, and by predicted quantity at its worst time."""
    rows = {}
    for name in dict.fromkeys(found["name"].values.tolist()):
        own = found.isel(measurement=np.flatnonzero(found["name"].values == name))
        label, columns = f"measured {name}", {key: own[f"measured_{key}"].values for key in _WORST}
        rows[label] = (QUANTITIES[name].shown.unit, QUANTITIES[name].shown.scale, columns)
    for name in predictions(found):
        _, unit, scale = shown_extreme(name)
        rows[name] = (unit, scale, {key: found[f"{name}_{key}"].values for key in _WORST})
    return {
        name: {"unit": unit, "scale": scale, **{key: float(worst(columns[key])) for key, worst in _WORST.items()}}
        for name, (unit, scale, columns) in rows.items() if np.isfinite(columns["error"]).any()
    }  # fmt: skip


_WORST = {"error": np.nanmax, "explained": np.nanmin, "standardised": np.nanmax}
