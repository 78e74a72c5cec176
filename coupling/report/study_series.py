"""What the slider of a study's page moves: curves around the ring and extremes of every case at its inflow masses."""

import numpy as np

from coupling.postprocess.extremes import extremes, ring_extremes
from coupling.report.packing import evenly, packed, packed_levels
from structure.response import FORCES, PRESSURES

OVER_MASS = ("time", "flow_zone_area", "disturbed_area")
BYTES_OF_CURVES = 5.2e6  # text of everything that has a value for each angle
BYTES_OF_VALUE = 8 / 3  # two bytes, as base64
ANGLE_STEPS = (1, 2, 3, 4)  # take every so many values around the ring before leaving out inflow masses
MOST_CASES, MOST_RECORDS, MOST_STOPS = 60, 121, 240


def budget(dataset, count):
    """How `count` cases of a study are thinned to fit into a page.

    Parameters
    ----------
    dataset : xarray.Dataset
        From :func:`coupling.read_study`, at most MOST_RECORDS inflow masses of it.
    count : int

    Returns
    -------
    int, (n,) int64
        Every how many values around the ring are taken, and at which of the inflow masses.
    """
    records = dataset.sizes["progress"]
    curves = (len(PRESSURES) + len(FORCES) * dataset.sizes.get("model", 0)) * dataset.sizes["theta"]
    most = BYTES_OF_CURVES / (BYTES_OF_VALUE * curves * max(count, 1))  # records of whole curves
    step = next((step for step in ANGLE_STEPS if most * step >= records), ANGLE_STEPS[-1])
    return step, evenly(records, max(2, int(most * step)))


def slider_stops(datasets, records):
    """Inflow masses that the slider stops at: all that any case has, ascending, (n,) float64 [kg/m]."""
    masses = np.concatenate([dataset["inflow_mass"].values[records] for dataset in datasets])
    masses = np.unique(np.round(masses, 9))
    masses = masses[np.isfinite(masses)]
    return masses[evenly(len(masses), MOST_STOPS)]


def case_series(dataset, extremes_of_models, step, records):
    """One case for the script.

    Parameters
    ----------
    dataset : xarray.Dataset
        The case, in memory.
    extremes_of_models : list of dict
        From :func:`ring_extremes_over_mass`, one for each lining model.
    step, records
        From :func:`budget`.

    Returns
    -------
    dict
        mass (n_progress,) [kg/m]; over_mass: time [s], areas [m2] (n_progress,); pressures: name to (n_records,
        n_angles); models: for each lining model forces: name to (n_records, n_angles), extremes: key of
        `RING_EXTREMES` to (n_progress,) and, where it is around the ring, KEY_angle [degree]; all SI.
    """
    kept = dataset.isel(progress=records)
    around = {name: kept[name].values[:, ::step] for name in PRESSURES}
    models = []
    for k, found in enumerate(extremes_of_models):
        model = kept.isel(model=k)
        models.append({
            "forces": {force: packed_levels(model[force].values[:, ::step]) for force in FORCES},
            "extremes": {key: packed(values) for key, values in found.items()},
        })  # fmt: skip
    return {
        "mass": packed(dataset["inflow_mass"].values),
        "over_mass": {name: packed(dataset[name].values) for name in OVER_MASS if name in dataset},
        "pressures": {name: packed_levels(values) for name, values in around.items()},
        "extremes": {key: packed(v.values) for key, v in extremes(dataset, PRESSURES).items() if key != "inflow_mass"},
        "models": models,
    }


def ring_extremes_over_mass(dataset):
    """Extremes of every lining model's answer to a case in memory, over inflow mass.

    returns list of dict, one a model: of :func:`coupling.postprocess.extremes.ring_extremes`.
    """
    return [ring_extremes(dataset.isel(model=k)) for k in range(dataset.sizes.get("model", 0))]
