"""The critical time step over decades of every number it depends on: predicted against exact, as one dataset."""

import itertools
from dataclasses import asdict, fields

import numpy as np

from coupling.stability.amplification import Amplification, Column
from coupling.stability.extremes import decades

POSITIONS = (
    *(("layout", points, 0) for points in (1, 3, 4, 6, 12, 25)),
    *((place, points, seed) for place in ("random", "edges", "vertices") for points in (1, 3, 12) for seed in (0, 1)),
)
WAYS = ("altitude", "spectral")
UNITS = {
    "bulk_modulus": "Pa", "hydraulic_conductivity": "m/s", "youngs_modulus": "Pa", "size": "m", "pic_rate": "1/s",
    "altitude": "s", "spectral": "s", "actual": "s",
}  # fmt: skip


def columns():
    """(family, column) of every configuration of the map."""
    for modulus, stiffness in itertools.product([None, 1e6, *decades(1e7, 1e11), 2.2e9], decades(1e5, 1e10)):
        yield "moduli", Column(bulk_modulus=modulus, youngs_modulus=stiffness)
    for conductivity, size in itertools.product(decades(1e-12, 1e1), (1e-3, 1e-2, 1e-1, 1.0, 10.0)):
        yield "permeability", Column(hydraulic_conductivity=conductivity, size=size)
    for porosity, modulus, conductivity in itertools.product(
        (0.06, 0.2, 0.45, 0.7, 0.89), (8e7, 2.2e9), (1e-8, 1e-4, 1.0)
    ):
        for stiffness in (4e7, 1e10):
            yield (
                "porosity",
                Column(
                    porosity=porosity,
                    bulk_modulus=modulus,
                    hydraulic_conductivity=conductivity,
                    youngs_modulus=stiffness,
                ),
            )
    for (place, points, seed), modulus, smoothing in itertools.product(POSITIONS, (None, 8e7), (True, False)):
        yield (
            "positions",
            Column(positions=place, points=points, seed=seed, bulk_modulus=modulus, volumetric_smoothing=smoothing),
        )
    for (place, points, seed), modulus in itertools.product(POSITIONS, (None, 8e7)):
        yield "no remapping", Column(positions=place, points=points, seed=seed, bulk_modulus=modulus, remapping=False)
    for modulus, stiffness, smoothing in itertools.product((1e6, 8e7, 2.2e9), (1e5, 4e7, 1e10), (True, False)):
        yield (
            "undrained",
            Column(
                bulk_modulus=modulus, youngs_modulus=stiffness, volumetric_smoothing=smoothing, drainage="undrained"
            ),
        )
    shapes = [(aspect, skew, seed) for aspect in (0.3, 1.0, 3.0) for skew, seed in ((0.0, 0), (0.2, 0), (0.2, 1))]
    for (aspect, skew, seed), place, smoothing in itertools.product(shapes, ("layout", "vertices"), (True, False)):
        yield "mesh", Column(aspect=aspect, skew=skew, seed=seed, positions=place, volumetric_smoothing=smoothing)
    for ratio in (0.0, 0.2, 0.45, 0.49):
        for modulus in (None, 8e7):
            yield "Poisson", Column(poissons_ratio=ratio, bulk_modulus=modulus)
    for strength, rate in itertools.product((0.0, 0.2, 0.5, 1.0), (0.0, 10.0, 1e4)):
        yield "numerics", Column(pressure_filter=strength, pic_rate=rate)


def measure(column):
    """Both predicted and the actual critical time step [s], excess of the spectral radius at half of it, leak."""
    amplification = Amplification(column)
    actual = amplification.critical_time_step()
    return {
        "altitude": amplification.altitude,
        "spectral": amplification.spectral,
        "actual": actual,
        "excess": amplification.spectral_radius(0.5 * actual) - 1.0,
        "leak": amplification.leak,
    }


def critical_map(chosen=None, progress=None):
    """Predicted and actual critical time steps of all columns.

    Parameters
    ----------
    chosen : iterable of (str, Column) or None
        All of `columns` when None.
    progress : callable or None
        Called with (number done, number of all).

    Returns
    -------
    xarray.Dataset
        Dimension configuration; the fields of `Column`; family; altitude, spectral (predicted critical steps) and
        actual [s]; altitude_ratio, spectral_ratio: predicted / actual; excess of the spectral radius over 1 at half
        the actual step; leak [-].
    """
    import xarray as xr

    chosen = list(columns() if chosen is None else chosen)
    rows = []
    for number, (family, column) in enumerate(chosen):
        row = {"family": family, **asdict(column), **measure(column)}
        row["bulk_modulus"] = np.nan if column.bulk_modulus is None else column.bulk_modulus
        rows.append(row | {f"{way}_ratio": row[way] / row["actual"] for way in WAYS})
        if progress is not None:
            progress(number + 1, len(chosen))
    names = [
        "family",
        *(f.name for f in fields(Column)),
        *WAYS,
        "actual",
        *(f"{way}_ratio" for way in WAYS),
        "excess",
        "leak",
    ]
    data = {
        name: ("configuration", np.array([row[name] for row in rows]), {"units": UNITS.get(name, "1")})
        for name in names
        if name not in ("family", "positions", "drainage")
    }
    for name in ("volumetric_smoothing", "remapping"):
        data[name] = (data[name][0], data[name][1].astype(np.int8))
    for name in ("family", "positions", "drainage"):
        data[name] = ("configuration", np.array([row[name] for row in rows], dtype=object))
    text = (
        "critical time step of a column of the solver: predicted by the program, and exact by its amplification matrix"
    )
    return xr.Dataset(data, attrs={"title": text})
