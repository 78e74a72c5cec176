"""How far a run is from what was measured: residuals in errors, and chi square per measurement, by quantity."""

from pathlib import Path

import numpy as np
import xarray as xr
from scipy.linalg import solve_triangular
from scipy.stats import chi2

from coupling.datasets import opened
from coupling.datasets.open_run import Run
from coupling.files.provenance import made_here
from coupling.measurements.measurement import Measurement, error_covariance
from coupling.measurements.read import read_measurements
from coupling.measurements.taken import at_measurements
from coupling.refused import Refused

TITLE = "misfit of a run and measurements"


def misfit(
    run: Run, measurements: str | Path | xr.Dataset | tuple[Measurement, ...], model: str | None = None
) -> xr.Dataset:
    """A run against what was measured.

    The run is taken as :func:`coupling.measurements.at_measurements` does. Errors are normal and independent of each
    other, but for the `common_error` of measurements of one sensor and quantity.

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
        (measurement): measured, error, common_error, computed in `unit`; residual [-], computed less measured in
        errors (both errors together, root of the sum of squares); as
        coordinates name (of the quantity), unit, place (as text), time [s] and inflow_mass [kg/m] (NaN where not
        given), run_time [s] of the run's state, tunnel (-1: that with the gate), change, sensor, line.
        (quantity), worst first: count of the measurements that the run got to; chi_square [-] per measurement, the
        mean of their squared residuals where errors are independent, else d C^-1 d / count with the differences d and
        the errors' covariance C, 1 where the run is as far away as the errors say; mean_residual [-]; probability [-]
        of such a chi square or a larger one by the errors alone. Attributes count, chi_square, probability: the same
        of all; not_reached: the number of measurements that the run did not get to.

    Raises
    ------
    Refused
        A mistake in the measurements, by its line; a place, tunnel or quantity that the run does not have; or a run
        that ends before all of them.
    RunFileError
        The run cannot be read, or no lining model answered.
    """
    given = measurements if isinstance(measurements, tuple) else read_measurements(measurements)
    with opened(run) as file:
        values, times = at_measurements(file, given, model)
        path = file.path
    if not np.isfinite(values).any():
        raise Refused(f"run '{path}': must get to one of the measurements, it ends before all of them; let it go on")
    dataset = misfit_table(given, values, times)
    whitened = _whitened(given, dataset["name"].values, values - dataset["measured"].values)
    return _summed(dataset, whitened).assign_attrs(made_here(f"{TITLE}: {path}", "run held against measurements"))


def misfit_table(given, values, times):
    """Measurements and what the run says of them, over `measurement`."""

    def column(attribute, missing=np.nan, **attributes):
        found = [getattr(one, attribute) for one in given]
        return "measurement", np.array([missing if each is None else each for each in found]), attributes

    measured, error = column("value", long_name="measured value"), column("error", long_name="one standard deviation")
    common = column("common_error", long_name="one standard deviation of what all of its sensor and quantity share")
    residual = (values - measured[1]) / np.hypot(error[1], common[1])
    return xr.Dataset(
        {
            "measured": measured,
            "error": error,
            "common_error": common,
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


def _whitened(given, names, differences):
    """Differences as independent numbers of variance 1, quantity by quantity; NaN where they are."""
    result = np.full(len(given), np.nan)
    for name in set(names):
        own = np.flatnonzero(np.isfinite(differences) & (names == name))
        factor = np.linalg.cholesky(error_covariance([given[k] for k in own]))
        result[own] = solve_triangular(factor, differences[own], lower=True)
    return result


def _summed(dataset, whitened):
    """The same with its sums by quantity, worst first, and of all."""
    names, residual = dataset["name"].values, dataset["residual"].values
    known = np.isfinite(residual)

    def sums(which):
        square, count = float(whitened[which] @ whitened[which]), int(which.sum())
        return {"count": count, "chi_square": square / count, "mean_residual": float(residual[which].mean()),
                "probability": float(chi2.sf(square, count))}  # fmt: skip

    rows = {name: sums(known & (names == name)) for name in dict.fromkeys(names[known].tolist())}
    order = sorted(rows, key=lambda name: -rows[name]["chi_square"])
    about = {
        "count": "measurements that the run got to",
        "chi_square": "squared differences over the variance of the errors, per measurement",
        "mean_residual": "mean of the residuals, in errors",
        "probability": "of such a chi square or a larger one by the errors alone",
    }
    for key, text in about.items():
        dataset[key] = ("quantity", np.array([rows[name][key] for name in order]), {"units": "1", "long_name": text})
    whole = sums(known)
    attributes = {key: whole[key] for key in ("count", "chi_square", "probability")}
    return dataset.assign_coords(quantity=np.array(order)).assign_attrs(attributes, not_reached=int((~known).sum()))
