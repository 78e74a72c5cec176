"""A run's values where and when something was measured."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

from coupling.datasets import opened, read_history
from coupling.datasets.geometry import has_tunnels, tunnel_list
from coupling.datasets.open_run import Run
from coupling.measurements.measurement import Measurement
from coupling.measurements.quantities import QUANTITIES, computed
from coupling.postprocess.at_inflow import crossing_times
from coupling.refused import Refused

#: A time that is past the last record by no more than this share of it is that of the record.
ROUNDING = 1e-9


def at_measurements(
    run: Run, given: tuple[Measurement, ...], model: str | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Values of a run where and when something was measured.

    The run is taken linearly between its records, between angles and between places on the surface or in the ground,
    at an inflow mass in the state of its first crossing.

    Parameters
    ----------
    run : path or coupling.datasets.OpenRun
    given : tuple of Measurement
    model : str, optional
        Lining model whose answer is taken; left out: the run's own.

    Returns
    -------
    values : (n,) float64
        In the unit of each quantity; NaN where the run did not get there.
    times : (n,) float64
        Time of the run's state [s].

    Raises
    ------
    Refused
        A place, tunnel or quantity that the run does not have, by the measurement's line.
    RunFileError
        The run cannot be read, or no lining model answered.
    """
    values = np.full(len(given), np.nan)
    with opened(run) as file:
        times = _times(given, read_history(file))
        for name, tunnel in dict.fromkeys((one.quantity, one.tunnel) for one in given):
            places = [k for k, one in enumerate(given) if (one.quantity, one.tunnel) == (name, tunnel)]
            try:
                field = computed(file, name, model, tunnel)
            except Refused as problem:
                raise Refused(f"{given[places[0]].line}: {problem}") from None
            values[places] = _taken(field, [given[k] for k in places], times[places])
    return values, times


def _times(given, history):
    """When each was measured by the run's clock [s], (n,) float64; NaN where the run did not get there."""
    masses = np.array([one.inflow_mass for one in given], float)
    crossings = crossing_times(history["inflow_mass"].values, history["time"].values, masses)
    return np.where(np.isnan(masses), np.array([one.time for one in given], float), crossings)


def _taken(field: xr.DataArray, given: list[Measurement], times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values of a field (time[, place]) where and when each was measured."""
    kind = QUANTITIES[given[0].quantity].place
    field = field.transpose("time", ...)
    stored, values = field["time"].values, field.values
    times = np.where(np.isclose(times, stored[-1], rtol=ROUNDING, atol=0.0), stored[-1], times)
    now = _rows(values, np.interp(times, stored, np.arange(len(stored)), left=np.nan, right=np.nan))
    first = np.broadcast_to(values[0], now.shape)
    change = np.array([one.change for one in given])
    if kind is None:
        return now - np.where(change, first, 0.0)
    states = now - np.where(change[:, None], first, 0.0)
    if kind == "ground":
        return _in_ground(field, given, states)
    where = field[kind].values.astype(float)
    for one in given:
        _check_place(one, kind, where)
    period = 360.0 if kind == "theta" else None
    return np.array([np.interp(one.place, where, row, period=period) for one, row in zip(given, states, strict=True)])


def _in_ground(field, given, states):
    """States (n, element) each at its own place: linear between the elements' centres, the nearest one beyond them."""
    centres = np.column_stack([field["x"].values, field["y"].values])
    for one in given:
        low, high, depth = *field.attrs["width"], field.attrs["depth"]
        inside = low <= one.place <= high and one.depth <= depth
        linings = tunnel_list(field) if has_tunnels(field) else []
        if not inside or any(lining.distance(one.place, -one.depth) < lining.outer for lining in linings):
            raise Refused(
                f"{one.line}: place and depth: must lie in the ground, outside of the linings, x from {low:g} to "
                f"{high:g} m and at most {depth:g} m deep, got {one.place_text}; correct them, or leave the line out"
            )
    places = np.array([(one.place, -one.depth) for one in given])
    linear, nearest = (kind(centres, states.T)(places) for kind in (LinearNDInterpolator, NearestNDInterpolator))
    return np.where(np.isfinite(linear), linear, nearest).diagonal()


def _check_place(one, kind, where):
    """Refuse a place that the run does not have; all angles are there."""
    if kind == "joint" and one.place not in where:
        there = ", ".join(f"{each:g}" for each in where) or "none"
        raise Refused(f"{one.line}: place: must be one of the ring's joints ({there}), got {one.place:g}; correct it")
    if kind == "x" and not where[0] <= one.place <= where[-1]:
        raise Refused(
            f"{one.line}: place: must lie on the ground, from {where[0]:g} to {where[-1]:g} m, got {one.place:g} m; "
            "correct it, or leave the line out"
        )


def _rows(values, positions):
    """Rows of an array at positions between them; NaN where the position is."""
    known = np.isfinite(positions)
    positions = np.where(known, positions, 0.0)
    low = np.floor(positions).astype(int)
    share, high = positions - low, np.minimum(low + 1, len(values) - 1)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    rows = values[low] * (1 - share) + values[high] * share
    rows[~known] = np.nan
    return rows
