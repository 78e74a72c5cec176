"""What checks come to: the largest utilisation of each, and where and when it first passes 1."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from structure.limits import UTILISATIONS

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

Place = dict[str, float]


def utilisations(checked: xr.Dataset) -> dict[str, dict[str, Any]]:
    """The largest value of every utilisation, and where and when it first passes 1.

    Between records utilisation and inflow mass are taken as linear in time, at each place by itself; from a record to
    one where it is infinite it passes at the former.

    Parameters
    ----------
    checked : xarray.Dataset
        Of :func:`structure.check`.

    Returns
    -------
    dict
        Utilisation, a name of :data:`structure.limits.UTILISATIONS`, to: largest [-], infinite (null in JSON) where
        nothing of the kind is carried; at: where and when that is; passes: where and when it first exceeds 1, None for
        never. A place and time holds time [s], inflow_mass [kg/m] where it is known, and theta [degree] or joint
        (number) where the utilisation has them. Empty for a plain response.
    """
    return {name: _utilisation(checked, name) for name in UTILISATIONS if name in checked}


def _utilisation(checked, name):
    around = [dim for dim in checked[name].dims if dim != "time"]
    values = checked[name].transpose("time", *around).values
    values = np.where(np.isnan(values), 0.0, values).reshape(len(values), -1)
    places = checked[around[0]].values if around else None

    def told(time: float, place: int) -> Place:
        found = {"time": time}
        if "inflow_mass" in checked:
            found["inflow_mass"] = float(np.interp(time, checked["time"].values, checked["inflow_mass"].values))
        return found if places is None else found | {around[0]: places[place].item()}

    record, place = np.unravel_index(int(np.argmax(values)), values.shape)
    first = passing_times(values, checked["time"].values)
    earliest = int(np.argmin(first))
    return {
        "largest": float(values[record, place]),
        "at": told(float(checked["time"].values[record]), place),
        "passes": told(float(first[earliest]), earliest) if np.isfinite(first[earliest]) else None,
    }


def passing_times(values: NDArray[np.float64], time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Time at which each column of (n_time, n) values first exceeds 1, (n,) float64; infinite for never."""
    beyond = values > 1
    after = np.argmax(beyond, axis=0)
    before, columns = np.maximum(after - 1, 0), np.arange(values.shape[1])
    low, high = values[before, columns], values[after, columns]
    low = np.where(beyond[0], 0.0, low)
    share = np.where(beyond[0], 0.0, (1 - low) / np.where(high > low, high - low, 1.0))
    return np.where(beyond.any(axis=0), time[before] + share * (time[after] - time[before]), np.inf)
