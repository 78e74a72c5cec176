"""The runs of a fit: what each gives where something was measured, and what follows from it over time."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.datasets import opened, read_history, read_response
from coupling.fits.prior import FitPlan
from coupling.measurements import at_measurements
from coupling.measurements.measurement import Measurement
from coupling.postprocess.extremes import RING_EXTREMES, ring_extremes
from coupling.refused import Refused
from coupling.studies.collect import stored_cases
from coupling.studies.folder import RUN_FOLDER, case_file
from structure.limits import UTILISATIONS
from structure.models import model_name

Array = NDArray[np.float64]

#: Fewest runs a parameter, and one more, of which an emulator is made.
FEWEST_A_PARAMETER = 4


class Ensemble(NamedTuple):
    """Runs over the space of the parameters.

    places : (n, d) float64, parameters of each run from 0 to 1 over their ranges;  measured : (n, m) float64, what the
    run gives where something was measured, NaN where it did not get;  time : (k,) float64 [s];  curves : quantity to
    (n, k) float64, of `coupling.postprocess.extremes.RING_EXTREMES`, `structure.limits.UTILISATIONS` and
    "inflow_mass";  failed : int, runs without a result.
    """

    places: Array
    measured: Array
    time: Array
    curves: dict[str, Array]
    failed: int


def read_ensemble(plan: FitPlan, given: tuple[Measurement, ...], folder: Path) -> Ensemble:
    """What the finished runs of a fit's study hold; curves end where the shortest run does.

    Raises Refused: too few runs are finished; a place, tunnel or quantity that the runs do not have.
    """
    _, cases, _ = stored_cases(folder)
    done = [case for case in cases if case_file(folder, case).is_file()]
    fewest = FEWEST_A_PARAMETER * (len(plan.parameters) + 1)
    if len(done) < fewest:
        raise Refused(
            f"fit: at least {fewest} runs must be finished for {len(plan.parameters)} parameters, got {len(done)} of "
            f"{len(cases)}; see `gush study {folder}` for what failed, or raise samples"
        )
    model = model_name(plan.backends[0]) if plan.backends else None
    measured, curves = [], []
    for case in done:
        with opened(case_file(folder, case).parent / RUN_FOLDER) as run:
            measured.append(at_measurements(run, given, model if model in run.models() else None)[0])
            curves.append(_curves(run, model))
    places = np.array(
        [[prior.place(case.parameters[name]) for name, prior in plan.parameters.items()] for case in done]
    )
    time = np.linspace(0.0, min(float(one["time"].values[-1]) for one in curves), plan.records)
    names = [name for name in curves[0].data_vars if all(name in one for one in curves)]
    taken = {name: np.array([np.interp(time, one["time"], one[name]) for one in curves]) for name in names}
    taken = {name: values for name, values in taken.items() if np.isfinite(values).all()}
    return Ensemble(places, np.array(measured), time, taken, len(cases) - len(done))


def _curves(run, model):
    """What follows over time in one run: inflow, extremes and utilisations of the ring."""
    history = read_history(run)
    time = history["time"].values
    found = {"inflow_mass": np.maximum.accumulate(history["inflow_mass"].values)}
    if model in run.models():
        ring = ring_extremes(read_response(run, model))
        ring = ring.assign({name: ring[name].fillna(0.0) for name in UTILISATIONS if name in ring})
        told = (key for key in (*RING_EXTREMES, *UTILISATIONS) if key in ring)
        found |= {key: np.interp(time, ring["time"], ring[key]) for key in told}
    return xr.Dataset({name: ("time", values) for name, values in found.items()}, coords={"time": time})
