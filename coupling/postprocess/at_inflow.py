"""States of a run at equal inflow mass, what they are over the initial state, and how evenly material flows in."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from structure import additional


def crossing_times(
    inflow_mass: NDArray[np.float64], time: NDArray[np.float64], masses: ArrayLike
) -> NDArray[np.float64]:
    """Times at which masses were first reached, linear between the records around them; NaN for those that were not.

    inflow_mass, time : of the records, (k,) [kg/m], [s];  masses : (n,) [kg/m].
    """
    masses, highest = np.asarray(masses, float), np.maximum.accumulate(inflow_mass)
    after = np.minimum(np.searchsorted(highest, masses * (1 - 1e-12)), len(time) - 1)
    before = np.maximum(after - 1, 0)
    width = highest[after] - highest[before]
    share = np.minimum((masses - highest[before]) / np.where(width > 0, width, 1.0), 1.0)
    times = time[before] + share * (time[after] - time[before])
    return np.where(masses <= highest[-1] * (1 + 1e-12), times, np.nan)


def at_inflow(dataset: xr.Dataset, inflow_mass: float) -> xr.Dataset:
    """State at an inflow mass, linear between the records around its first crossing.

    Parameters
    ----------
    dataset : xarray.Dataset
        With `inflow_mass` (time) [kg/m]: pressures, history or response.
    inflow_mass : float
        [kg/m]

    Returns
    -------
    xarray.Dataset
        Without time dimension; `time` as a scalar coordinate.

    Raises
    ------
    ValueError
        When the run did not get there.

    Examples
    --------
    >>> import xarray as xr
    >>> run = xr.Dataset({"inflow_mass": ("time", [0.0, 40.0])}, coords={"time": [0.0, 2.0]})
    >>> at_inflow(run, 10.0).time.item()
    0.5
    """
    mass, times = dataset["inflow_mass"].values, dataset["time"].values
    (time,) = crossing_times(mass, times, [inflow_mass])
    if np.isnan(time):
        raise ValueError(
            f"inflow_mass: {inflow_mass:g} kg/m was not reached, the run ends at {mass[-1]:.4g} kg/m; ask for less"
        )
    return dataset.isel(time=0) if time == times[0] else dataset.interp(time=time, assume_sorted=True)


def by_inflow(dataset: xr.Dataset) -> xr.Dataset:
    """The records over inflow mass instead of time, for selection and interpolation: unique, strictly increasing.

    Of records with the same inflow mass, or less than an earlier one had, the first stays: of the zeros before
    anything has come in, that is the initial state.

    Parameters
    ----------
    dataset : xarray.Dataset
        With `inflow_mass` (time) [kg/m]: pressures, history, response, or the whole of a tree's group.

    Returns
    -------
    xarray.Dataset
        With the dimension `inflow_mass` in place of `time`, which is a coordinate along it.

    Examples
    --------
    >>> import xarray as xr
    >>> mass = [0.0, 0.0, 0.0, 30.0, 29.0, 60.0]
    >>> run = xr.Dataset({"inflow_mass": ("time", mass)}, coords={"time": [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]})
    >>> by_inflow(run).sel(inflow_mass=50.0, method="nearest").time.item()
    5.0
    """
    mass = dataset["inflow_mass"].values
    before = np.maximum.accumulate(np.concatenate([[-np.inf], mass[:-1]]))
    rising = np.flatnonzero(mass > before)
    return dataset.isel(time=rising).set_coords("inflow_mass").swap_dims(time="inflow_mass")


def with_inflow(dataset: xr.Dataset, history: xr.Dataset) -> xr.Dataset:
    """A dataset over time with the inflow mass of the history at its times, so that :func:`at_inflow` takes it.

    Parameters
    ----------
    dataset : xarray.Dataset
        On times of its own, for instance of snapshots.
    history : xarray.Dataset
        With `inflow_mass` (time) [kg/m].
    """
    mass = np.interp(dataset["time"].values, history["time"].values, history["inflow_mass"].values)
    return dataset.assign_coords(inflow_mass=("time", mass, dict(history["inflow_mass"].attrs)))


def pressure_ratio(pressures: xr.Dataset, name: str, inflow_mass: float) -> xr.DataArray:
    """Pressure on the lining at an inflow mass over the initial one, at every angle.

    Parameters
    ----------
    pressures : xarray.Dataset
        With `inflow_mass` (time) [kg/m].
    name : str
        "soil_pressure" or "water_pressure".
    inflow_mass : float
        [kg/m]

    Returns
    -------
    xarray.DataArray
        (theta) [-]

    Raises
    ------
    ValueError
        When the run did not get there.
    """
    now = at_inflow(pressures[[name, "inflow_mass"]], inflow_mass)[name].drop_vars("inflow_mass", errors="ignore")
    ratio = now / pressures[name].isel(time=0, drop=True)
    about = pressures[name].attrs.get("long_name", name)
    return ratio.rename(name).assign_attrs(units="1", long_name=f"{about}, over the initial one")


def additional_at_inflow(response: xr.Dataset, inflow_mass: float) -> xr.Dataset:
    """What the event has added to the ring's forces and displacements at an inflow mass.

    Parameters
    ----------
    response : xarray.Dataset
        Of a lining model, the initial state first, with `inflow_mass` (time) [kg/m].
    inflow_mass : float
        [kg/m]

    Returns
    -------
    xarray.Dataset
        Variables of :func:`structure.additional` without time.

    Raises
    ------
    ValueError
        When the run did not get there.
    """
    return at_inflow(additional(response), inflow_mass)


def ratio_to_initial(pressures: xr.Dataset, name: str, inflow_mass: float, angles: Sequence[float]) -> float:
    """Mean of a pressure over some angles at an inflow mass, over the same mean of the initial state [-].

    angles : sequence of float, degrees from the crown, clockwise; cells of the theta grid nearest to them.
    """
    field = pressures[name].sel(theta=np.asarray(angles, float) % 360, method="nearest").mean("theta")
    now = at_inflow(field.to_dataset().assign(inflow_mass=pressures["inflow_mass"]), inflow_mass)[name]
    return float(now) / float(field.isel(time=0))


def inflow_linearity(history: xr.Dataset, first: float, last: float) -> tuple[float, float]:
    """Straight-line fit of inflow mass over time between two inflow masses [kg/m].

    Returns
    -------
    rate : float
        [kg/m/s]
    r_squared : float
        Coefficient of determination.
    """
    mass = history["inflow_mass"].values
    inside = (mass >= first) & (mass <= last)
    if inside.sum() < 3:
        raise ValueError(
            f"inflow_mass: only {inside.sum()} records between {first:g} and {last:g} kg/m; record more often"
        )
    time, mass = history["time"].values[inside], mass[inside]
    slope, offset = np.polyfit(time, mass, 1)
    left = mass - slope * time - offset
    return float(slope), float(1 - left @ left / np.sum((mass - mass.mean()) ** 2))
