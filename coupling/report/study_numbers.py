"""What every case of a study came to: key numbers with error estimates, balances, warnings, why it failed."""

import numpy as np

from coupling.postprocess.extremes import RING_EXTREMES, shown_extreme
from coupling.postprocess.quality import ERRORS, poor_errors
from coupling.report.numbers import (
    DIFFERENCE,
    THEORY_LIMIT,
    Number,
    ground_slips,
    initial_theory,
)

#: Columns of the table of cases that are the case's own; those of the ring follow.
INFLOW_NUMBERS = (
    ("inflow_mass", "inflow mass", "kg/m"),
    ("time", "time to it", "s"),
    ("flow_zone_area", "flow zone", "m²"),
    ("disturbed_area", "disturbed zone", "m²"),
)
NOT_RUN = "not run yet; repeat `gush study`"


def last_record(dataset):
    """Number of the last inflow mass that a case reached, None where it holds no record."""
    reached = np.flatnonzero(np.isfinite(dataset["time"].values)) if "time" in dataset else []
    return int(reached[-1]) if len(reached) else None


def case_numbers(dataset, models):
    """Key numbers of one case at the last inflow mass that it reached, beside those of the start.

    Parameters
    ----------
    dataset : xarray.Dataset
        The case, in memory.
    models : list of dict
        From :func:`coupling.report.study_series.ring_extremes_over_mass`, one for each lining model.

    Returns
    -------
    list of coupling.report.numbers.Number
        Of the first lining model; their error is the largest difference from the other models at the same state.
    """
    end = last_record(dataset)
    if end is None:
        return []
    numbers = [
        Number(name, label, unit, 1.0, None, _finite(dataset[name].values[end]), None, "")
        for name, label, unit in INFLOW_NUMBERS
        if name in dataset.variables
    ]
    for key in RING_EXTREMES if models else ():
        values = [model[key] for model in models if key in model]
        if not values:
            continue
        others = [abs(other[end] - values[0][end]) for other in values[1:]]
        error = _finite(max(others)) if others else None
        numbers.append(
            Number(key, *shown_extreme(key), _finite(values[0][0]), _finite(values[0][end]), error, DIFFERENCE)
        )
    return numbers


def balances(dataset):
    """What a case conserves: names of `coupling.postprocess.quality` to their values, where the case holds them."""
    names = {name: f"quality_{name}" for name in ERRORS}
    return {name: float(dataset[v]) for name, v in names.items() if v in dataset and np.isfinite(dataset[v])}


def case_warnings(dataset, scene):
    """What a reader must know before believing a case: list of str.

    dataset : xarray.Dataset, the case, in memory;  scene : coupling.Scene.
    """
    end, found = last_record(dataset), []
    if end is None:
        return ["It holds no record."]
    masses = dataset["inflow_mass"].values
    if end < len(masses) - 1:
        found.append(f"It ended at {masses[end]:.4g} of {masses[-1]:.4g} kg/m.")
    found += [f"Outside what is expected: {text}." for text in poor_errors(balances(dataset))]
    theory = initial_theory(scene, dataset["theta"].values)
    for name, label in (("soil_pressure", "soil"), ("water_pressure", "water")) if theory is not None else ():
        expected = theory[name].isel(time=0).values
        worst, mean = float(np.abs(dataset[name].isel(progress=0).values - expected).max()), float(expected.mean())
        slips = name == "soil_pressure" and ground_slips(scene)
        if mean > 0 and worst > THEORY_LIMIT * mean and not slips:
            found.append(
                f"Outside what is expected: initial {label} pressure against theory, largest difference at any angle: "
                f"{worst / 1e3:.2g} kPa, {100 * worst / mean:.2g} % of the mean."
            )
    return found


def run_facts(folder):
    """What the files of a case's run say: status, status_message, wall_seconds, revision; {} without a readable run."""
    from coupling.datasets import RunFileError, read_attributes
    from coupling.files.folder import RUN_FILE

    if not (folder / RUN_FILE).is_file():
        return {}
    try:
        attributes = read_attributes(folder)
    except RunFileError as error:
        return {"status_message": str(error)}
    return {name: attributes[name] for name in ("status", "status_message", "wall_seconds") if name in attributes}


def _finite(value):
    return float(value) if np.isfinite(value) else None
