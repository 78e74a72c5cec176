"""The largest and smallest values around a ring, and where they are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def extremes(
    dataset: xr.Dataset, names: Sequence[str] = ("axial_force", "shear_force", "bending_moment"), along: str = "theta"
) -> xr.Dataset:
    """Largest and smallest value of each quantity around the ring, with the angles where they are.

    Parameters
    ----------
    dataset : xarray.Dataset
        A response or pressures, with any other dimensions (time, case, model ..).
    names : sequence of str
        Variables with the dimension `along`.
    along : str
        "theta" [degree], or "joint" for joints.

    Returns
    -------
    xarray.Dataset
        For every name NAME_max, NAME_min in its unit, NAME_max_angle, NAME_min_angle: the value of `along` there; NaN
        where all values are.
    """
    import xarray as xr

    result = xr.Dataset(attrs=dataset.attrs)
    for name in names:
        if along not in dataset[name].dims:
            raise ValueError(f"extremes: {name} must have the dimension {along}, got {dataset[name].dims}")
        values, about = dataset[name], dataset[name].attrs
        known = values.notnull().all(along)
        for kind, pick in (("max", "largest"), ("min", "smallest")):
            extreme = getattr(values, kind)(along)
            place = getattr(values.fillna(-np.inf if kind == "max" else np.inf), f"arg{kind}")(along)
            angle = values[along].isel({along: place}).drop_vars(along)
            text = f"{pick} {about.get('long_name', name)}"
            result[f"{name}_{kind}"] = extreme.assign_attrs(units=about.get("units", "1"), long_name=text)
            result[f"{name}_{kind}_angle"] = angle.where(known).assign_attrs(
                units=dataset[along].attrs.get("units", "degree"), long_name=f"where the {text} is"
            )
    if "inflow_mass" in dataset:
        result["inflow_mass"] = dataset["inflow_mass"]
    return result
