"""The critical time step over decades of every number it depends on: predicted against exact, as one dataset."""

import itertools
from dataclasses import asdict

import numpy as np

from verification.stability.amplification import DEFAULT, Amplification, Column

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


def decades(first, last):
    """Powers of ten, both exponents included."""
    return [10.0**k for k in range(first, last + 1)]


def columns():
    """(family, column) of every configuration of the map."""
    for modulus, stiffness in itertools.product([None, 1e6, *decades(7, 11), 2.2e9], decades(5, 10)):
        yield "moduli", Column(bulk_modulus=modulus, youngs_modulus=stiffness)
    for conductivity, size in itertools.product(decades(-12, 1), (1e-3, 1e-2, 1e-1, 1.0, 10.0)):
        yield "permeability", Column(hydraulic_conductivity=conductivity, size=size)
    ratios, others = (0.06, 0.2, 0.45, 0.7, 0.89), ((8e7, 2.2e9), (1e-8, 1e-4, 1.0), (4e7, 1e10))
    for porosity, modulus, conductivity, stiffness in itertools.product(ratios, *others):
        column = {"bulk_modulus": modulus, "hydraulic_conductivity": conductivity, "youngs_modulus": stiffness}
        yield "porosity", Column(porosity=porosity, **column)
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


def critical_map(chosen=None, progress=None):
    """Predicted and actual critical time steps of all columns.

    chosen : iterable of (str, Column) or None, all of `columns` when None;  progress : callable or None, called with
    (number done, number of all).

    Returns xarray.Dataset: dimension configuration; the fields of `Column`; family; altitude, spectral (predicted
    critical steps) and actual [s]; altitude_ratio, spectral_ratio: predicted / actual; excess of the spectral radius
    over 1 at half the actual step; leak [-].
    """
    import xarray as xr
    from threadpoolctl import threadpool_limits

    chosen = list(columns() if chosen is None else chosen)
    rows = []
    for number, (family, column) in enumerate(chosen):
        with threadpool_limits(1):  # matrices of some hundred rows: a second thread only waits
            amplification = Amplification(column)
            actual = amplification.critical_time_step()
            excess = amplification.spectral_radius(0.5 * actual) - 1.0
        row = {"family": family, **asdict(column), "altitude": amplification.altitude}
        row |= {"spectral": amplification.spectral, "actual": actual, "excess": excess, "leak": amplification.leak}
        row["bulk_modulus"] = np.nan if column.bulk_modulus is None else column.bulk_modulus
        rows.append(row | {f"{way}_ratio": row[way] / actual for way in WAYS})
        if progress is not None:
            progress(number + 1, len(chosen))
    data = {}
    for name in rows[0]:
        values = [row[name] for row in rows]
        about = () if isinstance(values[0], str) else ({"units": UNITS.get(name, "1")},)
        data[name] = ("configuration", np.array(values, dtype=object if isinstance(values[0], str) else None), *about)
    text = "critical time step of a column of the solver: predicted, and exact by its amplification matrix"
    return xr.Dataset(data, attrs={"title": text})
