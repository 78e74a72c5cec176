"""Numbers of docs/fit-coverage.md: how often the bands of a fit hold the truth, runs left out in turn being the truths.

uv run python -m verification.reports fit-coverage [FOLDER]    # 128 runs of some seconds, kept in FOLDER; minutes
"""

import time as clock
from pathlib import Path

import numpy as np
from scipy.stats import binom, qmc

from coupling.fits.emulator import Emulator
from coupling.fits.ensemble import read_ensemble
from coupling.fits.fit import LEVELS, observe
from coupling.fits.posterior import Likelihood
from coupling.fits.prior import places_of, read_plan
from coupling.measurements.measurement import Measurement, error_covariance
from coupling.postprocess.extremes import shown_extreme
from coupling.studies.execute import study
from verification.pages import made_by, table
from verification.small_event import small_scene

BLOCKS = ("coverage", "emulators")
#: Runs that an emulator is made of; parts of all runs that are truths in turn.
SIZES, PARTS = (32, 64, 96), 4
#: Places over the prior whose weights make a posterior.
PLACES = 8192
#: Of each value, one standard deviation.
NOISE = 0.05
END = 0.3  # [s]
PLAN = {
    "samples": 128,
    "records": 13,
    "parameters": {
        "gate.angle": {"low": 60.0, "high": 120.0},
        "soils.0.hydraulic_conductivity": {"low": 3e-5, "high": 3e-4, "scale": "log"},
        "soils.0.k0": {"low": 0.45, "high": 0.8},
    },
}
#: Quantity, place, depth, whether it is the change since the gate opened, and the times [s].
MEASURED = (
    ("convergence_horizontal", None, None, True, (0.1, 0.2, 0.3)),
    ("convergence_vertical", None, None, True, (0.1, 0.2, 0.3)),
    ("total_pressure", 45.0, None, False, (0.0, 0.15, 0.3)),
    ("total_pressure", 135.0, None, False, (0.0, 0.15, 0.3)),
    ("total_stress_horizontal", 6.0, 20.0, False, (0.0, 0.15, 0.3)),
    ("total_stress_vertical", 6.0, 27.0, False, (0.0, 0.15, 0.3)),
    ("surface_settlement", 3.0, None, False, (0.2, 0.3)),
)
PREDICTED = ("inflow_mass", "axial_force_max", "bending_moment_max", "bending_moment_min")


def measurements(values, errors):
    """All measurements with such values and errors, in SI."""
    rows = [(name, place, depth, change, time) for name, place, depth, change, times in MEASURED for time in times]
    units = {"surface_settlement": "m", "convergence_horizontal": "m", "convergence_vertical": "m"}
    return tuple(
        Measurement(quantity=name, place=place, depth=depth, change=change, time=time, value=value, error=error,
                    unit=units.get(name, "Pa"), line=f"measurement {k}")
        for k, ((name, place, depth, change, time), value, error) in enumerate(zip(rows, values, errors, strict=True))
    )  # fmt: skip


def run_all(folder, plan):
    """The runs, as a study of one scene; returns their CPU time [s]."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = folder / "scene.toml"
    if not scene.exists():
        scene.write_text(small_scene(stop={"inflow_mass": 1e5, "time": END}).source, encoding="utf-8")
    dataset = study(plan.study(scene), folder / "ensemble", progress=print)
    return float(dataset["cpu_seconds"].sum())


def some_of(ensemble, rows):
    """An ensemble of some of the runs."""
    curves = {name: values[rows] for name, values in ensemble.curves.items()}
    return ensemble._replace(places=ensemble.places[rows], measured=ensemble.measured[rows], curves=curves)


class Fitted:
    """What a fit makes of some runs, at places that are the same for all truths."""

    def __init__(self, plan, ensemble):
        self.observed = observe(ensemble)
        shares = qmc.Sobol(len(plan.parameters), rng=np.random.default_rng(5)).random(PLACES)
        self.places = places_of(plan, shares)
        self.components = self.observed.emulator.components(self.places)
        rng = np.random.default_rng(plan.seed)
        last = {name: ensemble.curves[name][:, -1:] for name in PREDICTED}
        self.ends = {name: Emulator(ensemble.places, values, values.std(axis=0)).draws(self.places, rng)[:, 0]
                     for name, values in last.items()}  # fmt: skip

    def trial(self, truth, measured, ends, seed):
        """One hidden truth, measured with noise: of each parameter and prediction the share of the posterior below it.

        Returns a dict: below (d,), widths (d,) of the bands over those of the prior, region: whether the most probable
        region holds the truth, predicted: name to share, effective: number of effective places.
        """
        errors = NOISE * np.abs(measured)
        noisy = measured + errors * np.random.default_rng([7, seed]).normal(size=len(measured))
        given, emulator = measurements(noisy.tolist(), errors.tolist()), self.observed.emulator
        likelihood = Likelihood(emulator, noisy, error_covariance(given))
        logarithm = likelihood.logarithm_of(self.components)
        weights = np.exp(logarithm - logarithm.max())
        weights /= weights.sum()
        widths = [np.ptp(_quantiles(column, weights, LEVELS)) / np.ptp(LEVELS) for column in self.places.T]
        # the most probable region that holds 90 %: its density is above the tenth part of the posterior's
        least = _quantiles(logarithm, weights, [1 - np.ptp(LEVELS)])[0]
        return {
            "below": [float(weights @ (column < own)) for column, own in zip(self.places.T, truth, strict=True)],
            "widths": [float(width) for width in widths],
            "region": bool(likelihood.logarithm(truth[None])[0] >= least),
            "predicted": {name: float(weights @ (drawn < ends[name])) for name, drawn in self.ends.items()},
            "effective": float(1 / np.sum(weights**2)),
        }


def _quantiles(values, weights, shares):
    order = np.argsort(values)
    return np.interp(shares, np.cumsum(weights[order]), values[order])


def trials_of(plan, ensemble, size):
    """Every run once as the truth, of a fit of `size` of the runs of the other parts; list of :meth:`Fitted.trial`."""
    rng = np.random.default_rng(3)
    order, trials = rng.permutation(len(ensemble.places)), []
    for part in range(PARTS):
        truths = order[part::PARTS]
        others = rng.permutation(np.setdiff1d(order, truths))[:size]
        fitted = Fitted(plan, some_of(ensemble, others))
        for k in truths:
            ends = {name: ensemble.curves[name][k, -1] for name in PREDICTED}
            trials.append(fitted.trial(ensemble.places[k], ensemble.measured[k], ends, int(k)))
        print(f"{size} runs, part {part + 1} of {PARTS}", flush=True)
    return trials


def held(shares):
    """Whether 90 % bands hold a truth, by the share of the posterior below it."""
    return (np.asarray(shares) > LEVELS[0]) & (np.asarray(shares) < LEVELS[-1])


def coverage_rows(plan, found):
    """How many trials hold the truth: of each parameter, with the band's mean width, of all, of what is predicted."""

    def told(inside):
        return f"{sum(inside)} of {len(inside)} ({np.mean(inside):.0%})"

    rows = []
    for k, name in enumerate(plan.parameters):
        widths = (np.mean([trial["widths"][k] for trial in trials]) for trials in found)
        inside = ([held(trial["below"][k]) for trial in trials] for trials in found)
        rows.append((name, *(f"{told(one)}, {width:.0%} wide" for one, width in zip(inside, widths, strict=True))))
    rows.append(("most probable region of all", *(told([trial["region"] for trial in trials]) for trials in found)))
    for name in PREDICTED:
        inside = ([held(trial["predicted"][name]) for trial in trials] for trials in found)
        rows.append((f"predicted {shown_extreme(name)[0]}", *map(told, inside)))
    effective = ([trial["effective"] for trial in trials] for trials in found)
    rows.append(("effective places", *(f"{np.median(one):.0f}, {min(one):.0f} at least" for one in effective)))
    return rows


def blocks(folder="fit-coverage"):
    """Run, fit and count."""
    begin, plan = clock.perf_counter(), read_plan(PLAN)
    seconds = run_all(Path(folder), plan)
    given = measurements(*([1.0] * sum(len(row[-1]) for row in MEASURED),) * 2)
    ensemble = read_ensemble(plan, given, Path(folder) / "ensemble")
    found = [trials_of(plan, ensemble, size) for size in SIZES]
    emulator = observe(ensemble).emulator
    wall, runs = clock.perf_counter() - begin, len(ensemble.places)
    made = made_by("uv run python -m verification.reports fit-coverage")
    least, most = binom.interval(0.9, runs, np.ptp(LEVELS))
    cost = (f"{runs} runs of {seconds / runs:.1f} CPU seconds each, {ensemble.failed} failed; {wall / 60:.1f} minutes "
            f"for all that was not there yet. Of {runs} bands of 90 % that know themselves {least:.0f} to {most:.0f} "
            "hold the truth, nine times in ten.")  # fmt: skip
    checks = [
        (one.quantity, one.place_text, f"{one.time:g} s", f"{error:.3g} {one.unit}", f"{explained:.1%}", f"{own:.2f}")
        for one, error, explained, own in zip(given, *emulator.validation, strict=True)
    ]
    return {
        "made": f"{made} {cost}",
        "coverage": table(("90 % band of", *(f"{size} runs" for size in SIZES)), coverage_rows(plan, found)),
        "emulators": table(("measured", "where", "when", "error left out", "variance explained", "error over its own"),
                           checks),
    }  # fmt: skip
