"""The largest and smallest values around a ring, and where they are."""

from collections.abc import Sequence

import xarray as xr

from structure.limits import UTILISATIONS
from structure.response import FORCES, SHOWN


def extremes(dataset: xr.Dataset, names: Sequence[str] = FORCES, along: str = "theta") -> xr.Dataset:
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
    result = xr.Dataset(attrs=dataset.attrs)
    for name in names:
        if along not in dataset[name].dims:
            raise ValueError(f"extremes: {name} must have the dimension {along}, got {dataset[name].dims}")
        values, about, angle = dataset[name], dataset[name].attrs, dataset[along].attrs.get("units", "degree")
        for kind, pick, largest, where in (
            ("max", "largest", values.max(along), values.idxmax(along)),
            ("min", "smallest", values.min(along), values.idxmin(along)),
        ):
            text = f"{pick} {about.get('long_name', name)}"
            told = {"units": about.get("units", "1"), "long_name": text}
            result[f"{name}_{kind}"] = (largest.dims, largest.values, told)
            told = {"units": angle, "long_name": f"where the {text} is"}
            result[f"{name}_{kind}_angle"] = (where.dims, where.values, told)
    result = result.assign_coords({name: c for name, c in dataset.coords.items() if along not in c.dims})
    if "inflow_mass" in dataset:
        result["inflow_mass"] = dataset["inflow_mass"]
    return result


#: Extremes of a ring that are told: NAME_max and NAME_min around it, of its joints, and what has one value.
RING_EXTREMES = (
    *(f"{name}_{kind}" for name in FORCES for kind in ("max", "min")),
    "joint_opening_max", "joint_rotation_max", "convergence_horizontal", "convergence_vertical",
)  # fmt: skip
JOINTS = ("joint_opening", "joint_dislocation", "joint_rotation")


def ring_extremes(response: xr.Dataset) -> xr.Dataset:
    """What is told of a ring at each record.

    Parameters
    ----------
    response : xarray.Dataset
        Over time or another dimension.

    Returns
    -------
    xarray.Dataset
        Over that dimension, as far as the response has them: those of `RING_EXTREMES`, joint_dislocation_max and
        settlement, NAME_angle of forces, and the largest of each utilisation. Of dislocation and rotation it is the
        largest size.
    """
    found = extremes(response)
    for name in JOINTS if response.sizes.get("joint") else ():
        sizes = response[name] if name == "joint_opening" else abs(response[name])
        found[f"{name}_max"] = sizes.max("joint", keep_attrs=True)
    for name in ("convergence_horizontal", "convergence_vertical", "settlement", *UTILISATIONS):
        if name in response:
            found[name] = response[name].max(
                [d for d in ("theta", "joint") if d in response[name].dims], keep_attrs=True
            )
    return found


def shown_extreme(key: str) -> tuple[str, str, float]:
    """How people are shown one of :func:`ring_extremes`, or the inflow mass beside it: label, unit, factor to it."""
    if key == "inflow_mass":
        return "inflow mass", "kg/m", 1.0
    if key in UTILISATIONS:
        return f"utilisation, {UTILISATIONS[key]}", "-", 1.0
    if key in SHOWN:
        return SHOWN[key].name, SHOWN[key].unit, SHOWN[key].scale
    name, _, kind = key.rpartition("_")
    pick = "largest size" if name in JOINTS[1:] else {"max": "largest", "min": "smallest"}[kind]
    return f"{SHOWN[name].name}, {pick}", SHOWN[name].unit, SHOWN[name].scale
