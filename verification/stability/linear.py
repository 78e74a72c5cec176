"""The critical time step over decades of every number it depends on: predicted against exact, as one dataset."""

import itertools
from dataclasses import asdict, fields

import numpy as np

from verification.stability.amplification import DEFAULT, Amplification, Column
from verification.stability.extremes import decades

POSITIONS = (
    *(("layout", points, 0) for points in (1, 3, 4, 6, 12, 25)),
    *((place, points, seed) for place in ("random", "edges", "vertices") for points in (1, 3, 12) for seed in (0, 1)),
)
WAYS = ("altitude", "spectral")
AHEAD = (DEFAULT.stress_damping, 0.0)
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
    for (place, points, seed), modulus, ahead in itertools.product(POSITIONS, (None, 8e7), AHEAD):
        column = Column(positions=place, points=points, seed=seed, bulk_modulus=modulus, stress_damping=ahead)
        yield "positions", column
    for modulus, stiffness, ahead in itertools.product((1e6, 8e7, 2.2e9), (1e5, 4e7, 1e10), AHEAD):
        column = Column(bulk_modulus=modulus, youngs_modulus=stiffness, stress_damping=ahead, drainage="undrained")
        yield "undrained", column
    shapes = [(aspect, skew, seed) for aspect in (0.3, 1.0, 3.0) for skew, seed in ((0.0, 0), (0.2, 0), (0.2, 1))]
    for (aspect, skew, seed), place, ahead in itertools.product(shapes, ("layout", "vertices"), AHEAD):
        yield "mesh", Column(aspect=aspect, skew=skew, seed=seed, positions=place, stress_damping=ahead)
    for ratio in (0.0, 0.2, 0.45, 0.49):
        for modulus in (None, 8e7):
            yield "Poisson", Column(poissons_ratio=ratio, bulk_modulus=modulus)
    for strength, rate in itertools.product((0.0, 0.2, 0.5, 1.0), (0.0, 10.0, 1e4)):
        yield "numerics", Column(pressure_filter=strength, pic_rate=rate)
    for ahead, conductivity in itertools.product((0.1, 1.0, 2.0), (1e-4, 1e-2, 1.0)):
        yield "numerics", Column(stress_damping=ahead, hydraulic_conductivity=conductivity)


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
    from threadpoolctl import threadpool_limits

    chosen = list(columns() if chosen is None else chosen)
    rows = []
    for number, (family, column) in enumerate(chosen):
        with threadpool_limits(1):  # matrices of some hundred rows: a second thread only waits
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
    for name in ("family", "positions", "drainage"):
        data[name] = ("configuration", np.array([row[name] for row in rows], dtype=object))
    text = (
        "critical time step of a column of the solver: predicted by the program, and exact by its amplification matrix"
    )
    return xr.Dataset(data, attrs={"title": text})
