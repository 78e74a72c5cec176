"""What follows from parameters: bands over time, times to limits, and which parameter decides."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import sobol_indices, uniform

from coupling.fits.emulator import SMALLEST_SPREAD, Emulator
from coupling.fits.ensemble import Ensemble
from coupling.fits.prior import FitPlan, places_of
from coupling.postprocess.extremes import RING_EXTREMES, shown_extreme
from structure.limits import UTILISATIONS
from structure.passing import passing_times
from structure.response import RESPONSE

Array = NDArray[np.float64]

#: Draws of the Sobol indices, a power of two.
SOBOL_DRAWS = 512


def curve_emulators(ensemble: Ensemble) -> dict[str, Emulator]:
    """An emulator of every quantity over time, each time counting as much as another."""
    found = {}
    for name, curves in ensemble.curves.items():
        spread = float(np.sqrt(curves.var(axis=0).mean()))
        varies = spread > SMALLEST_SPREAD * float(abs(curves).max())
        found[name] = Emulator(ensemble.places, curves, np.full(curves.shape[1], spread if varies else 1.0))
    return found


def predicted(
    plan: FitPlan, time: Array, emulators: dict[str, Emulator], places: dict[str, Array], levels: Sequence[float]
) -> xr.Dataset:
    """Bands of all quantities of the runs over time.

    time : (k,) float64 [s];  emulators : of :func:`curve_emulators`;  places : what is known, "prior" or "posterior",
    to draws of the parameters (p, d), as an :class:`Emulator` takes them;  levels : sequence of float.

    Returns: the variables of :func:`coupling.fits.fit.fit` that have a dimension time or limit.
    """
    rng = np.random.default_rng(plan.seed)
    result = xr.Dataset(
        coords={
            "knowledge": list(places),
            "level": ("level", list(levels), {"units": "1", "long_name": "share below"}),
            "time": ("time", time, {"units": "s", "long_name": "time since the gate opened"}),
        }
    )
    passing: dict[str, list[Array]] = {}
    for name, emulator in emulators.items():
        drawn = {key: emulator.draws(each, rng) for key, each in places.items()}
        bands = np.array([np.quantile(each, levels, axis=0).T for each in drawn.values()])
        about = {"units": units(name), "long_name": shown_extreme(name)[0]}
        result[name] = (("knowledge", "time", "level"), bands, about)
        for key in emulator.validation._fields:
            result[f"{name}_{key}"] = ("time", getattr(emulator.validation, key))
        if name in UTILISATIONS:
            passing[name] = [passing_times(each.T, time) for each in drawn.values()]
    if passing:
        about = {"units": "s", "long_name": "time at which the utilisation passes 1, infinite: not by the last time"}
        times = np.array(
            [[np.quantile(each, levels, method="inverted_cdf") for each in drawn] for drawn in passing.values()]
        )  # between a time and never is never
        result["passing_time"] = (("limit", "knowledge", "level"), times, about)
        shares = [[np.isfinite(each).mean() for each in one] for one in passing.values()]
        result["share_passing"] = (("limit", "knowledge"), np.array(shares), {"units": "1"})
        result = result.assign_coords(limit=list(passing))
    return result


def sobol(plan: FitPlan, emulators: dict[str, Emulator]) -> xr.Dataset:
    """Sobol indices of all quantities that vary, at the last time, parameters distributed as before measuring.

    Returns: first_order, total_order (quantity, parameter) [-].

    Source: Saltelli et al. (2010), by scipy.stats.sobol_indices.
    """
    emulators = {name: emulator for name, emulator in emulators.items() if len(emulator.basis)}
    shape = len(emulators), len(plan.parameters)
    found = {key: np.zeros(shape) for key in ("first_order", "total_order")}

    def last(shares):
        where = places_of(plan, shares.T)
        return np.array([each.outputs(each.components(where)[0])[:, -1] for each in emulators.values()])

    if emulators:
        rng = np.random.default_rng(plan.seed)
        indices = sobol_indices(func=last, n=SOBOL_DRAWS, dists=[uniform()] * shape[1], rng=rng)
        found = {key: np.reshape(getattr(indices, key), shape) for key in found}
    coords = {"quantity": list(emulators), "parameter": list(plan.parameters)}
    return xr.Dataset({key: (tuple(coords), part, {"units": "1"}) for key, part in found.items()}, coords)


def units(name: str) -> str:
    """Units of a predicted quantity in the dataset."""
    if name not in RING_EXTREMES:
        return "kg/m" if name == "inflow_mass" else "1"
    return RESPONSE[name if name in RESPONSE else name.rpartition("_")[0]][1]
