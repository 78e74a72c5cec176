"""How far a run is from what was measured: residuals in errors, and chi square per measurement, by quantity."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import chi2

from coupling.datasets import opened, read_history
from coupling.datasets.open_run import Run
from coupling.files.provenance import origin, with_history
from coupling.measurements.measurement import Measurement
from coupling.measurements.quantities import QUANTITIES, computed
from coupling.measurements.read import read_measurements
from coupling.postprocess.inflow import by_inflow
from coupling.refused import Refused

TITLE = "misfit of a run and measurements"
#: A time that is past the last record by no more than this share of it is that of the record.
ROUNDING = 1e-9


def misfit(
    run: Run, measurements: str | Path | xr.Dataset | tuple[Measurement, ...], model: str | None = None
) -> xr.Dataset:
    """A run against what was measured.

    The run is taken linearly between its records, between angles and between places on the surface, at an inflow mass
    in the state of its first crossing. Errors are taken as independent of each other.

    Parameters
    ----------
    run : path or coupling.datasets.OpenRun
    measurements : path, xarray.Dataset or tuple of Measurement
        As of :func:`coupling.measurements.read_measurements`.
    model : str, optional
        Lining model whose answer is compared; left out: the run's own.

    Returns
    -------
    xarray.Dataset
        (measurement): measured, error, computed in `unit`; residual [-], computed less measured in errors; as
        coordinates name (of the quantity), unit, place (as text), time [s] and inflow_mass [kg/m] (NaN where not
        given), run_time [s] of the run's state, tunnel (-1: that with the gate), change, sensor, line.
        (quantity), worst first: count of the measurements that the run got to; chi_square [-], the mean of their
        squared residuals, 1 where the run is as far away as the errors say; mean_residual [-]; probability [-] of such
        a chi square or a larger one by the errors alone. Attributes count, chi_square, probability: the same of all;
        not_reached: the number of measurements that the run did not get to.

    Raises
    ------
    Refused
        A mistake in the measurements, by its line; a place, tunnel or quantity that the run does not have; or a run
        that ends before all of them.
    RunFileError
        The run cannot be read, or no lining model answered.
    """
    given = measurements if isinstance(measurements, tuple) else read_measurements(measurements)
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
        path = file.path
    if not np.isfinite(values).any():
        raise Refused(f"run '{path}': must get to one of the measurements, it ends before all of them; let it go on")
    dataset = _table(given, values, times)
    about = {"title": f"{TITLE}: {path}", "history": with_history("", "run held against measurements")}
    return _summed(dataset).assign_attrs(origin() | about, Conventions="CF-1.11")


def _times(given, history):
    """When each was measured by the run's clock [s], (n,) float64; NaN where the run did not get there."""
    over = by_inflow(history)
    masses, crossings = over["inflow_mass"].values, over["time"].values
    times = [
        one.time if one.time is not None else np.interp(one.inflow_mass, masses, crossings, right=np.nan)
        for one in given
    ]
    return np.array(times, float)


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
    where = field[kind].values.astype(float)
    for one in given:
        _check_place(one, kind, where)
    period = 360.0 if kind == "theta" else None
    states = now - np.where(change[:, None], first, 0.0)
    return np.array([np.interp(one.place, where, row, period=period) for one, row in zip(given, states, strict=True)])


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


def _table(given, values, times):
    """Measurements and what the run says of them, over `measurement`."""

    def column(attribute, missing=np.nan, **attributes):
        found = [getattr(one, attribute) for one in given]
        return "measurement", np.array([missing if each is None else each for each in found]), attributes

    measured, error = column("value", long_name="measured value"), column("error", long_name="one standard deviation")
    residual = (values - measured[1]) / error[1]
    return xr.Dataset(
        {
            "measured": measured,
            "error": error,
            "computed": ("measurement", values, {"long_name": "value of the run there; NaN: it did not get there"}),
            "residual": ("measurement", residual, {"units": "1", "long_name": "computed less measured, in errors"}),
        },
        coords={
            "name": column("quantity", long_name="quantity"),
            "unit": column("unit", long_name="unit of measured, error and computed"),
            "place": column("place_text"),
            "time": column("time", units="s", long_name="time since the gate opened, where it is given"),
            "inflow_mass": column("inflow_mass", units="kg/m", long_name="inflow mass, where it is given"),
            "run_time": ("measurement", times, {"units": "s", "long_name": "time of the run's state"}),
            "tunnel": column("tunnel", -1, long_name="number of the tunnel, -1: that with the gate"),
            "change": column("change", long_name="whether it is the change since the gate opened"),
            "sensor": column("sensor"),
            "line": column("line", long_name="where the measurement was read"),
        },
    )


def _summed(dataset):
    """The same with its sums by quantity, worst first, and of all."""
    names, residual = dataset["name"].values, dataset["residual"].values
    known = np.isfinite(residual)
    rows = {name: _sums(residual[known & (names == name)]) for name in dict.fromkeys(names[known].tolist())}
    order = sorted(rows, key=lambda name: -rows[name]["chi_square"])
    about = {
        "count": "measurements that the run got to",
        "chi_square": "mean of the squared residuals",
        "mean_residual": "mean of the residuals, in errors",
        "probability": "of such a chi square or a larger one by the errors alone",
    }
    for key, text in about.items():
        dataset[key] = ("quantity", np.array([rows[name][key] for name in order]), {"units": "1", "long_name": text})
    whole = _sums(residual[known])
    attributes = {key: whole[key] for key in ("count", "chi_square", "probability")}
    return dataset.assign_coords(quantity=np.array(order)).assign_attrs(attributes, not_reached=int((~known).sum()))


def _sums(residuals):
    square = float(residuals @ residuals)
    return {
        "count": len(residuals),
        "chi_square": square / len(residuals),
        "mean_residual": float(residuals.mean()),
        "probability": float(chi2.sf(square, len(residuals))),
    }
