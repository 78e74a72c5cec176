"""Numbers of docs/fit-coverage.md: how often the bands of a fit hold the truth, by 20 true runs and noise upon them.

uv run python -m verification.reports.fit [FOLDER]    # runs of some seconds each; half an hour on two cores at most
"""

import sys
import time as clock
from pathlib import Path

import numpy as np

from coupling.fits.ensemble import read_ensemble
from coupling.fits.fit import LEVELS, infer, observe
from coupling.fits.prediction import curve_emulators, predicted, shown
from coupling.fits.prior import places_of, read_plan, values_of
from coupling.measurements.measurement import Measurement
from coupling.studies.execute import study
from verification.pages import DOCS, docs_page, made_by, table, write_data
from verification.small_event import small_scene

TRIALS = 20
#: Of each value, one standard deviation.
NOISE = 0.05
END = 0.3  # [s]
PLAN = {
    "samples": 64,
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


def run_all(folder):
    """The ensemble's runs and the true ones, all as studies of one scene; truths are drawn from the priors."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = folder / "scene.toml"
    scene.write_text(small_scene(stop={"inflow_mass": 1e5, "time": END}).source, encoding="utf-8")
    plan = read_plan(PLAN)
    truths = values_of(plan, np.random.default_rng(1).random((TRIALS, len(plan.parameters))))
    columns = dict(zip(plan.parameters, truths.T.tolist(), strict=True))
    hidden = {"name": "truth", "scene": str(scene), "design": "list", "parameters": columns, "records": plan.records}
    seconds = {}
    for name, what in (("ensemble", plan.study(scene)), ("truth", hidden)):
        dataset = study(what, folder / name, progress=print)
        seconds[name] = float(dataset["cpu_seconds"].sum())
    return plan, truths, seconds


def trial(plan, observed, emulators, truth, measured, curves, time, seed):
    """One hidden truth: measured with noise, fitted, and which bands hold it."""
    errors = NOISE * np.abs(measured)
    noisy = measured + errors * np.random.default_rng([7, seed]).normal(size=len(measured))
    found, likelihood = infer(plan, measurements(noisy.tolist(), errors.tolist()), observed)
    draws, where = values_of(plan, found.shares), places_of(plan, found.shares)
    low, high = np.quantile(draws, [LEVELS[0], LEVELS[-1]], axis=0)
    own = np.column_stack([p.place(v) for p, v in zip(plan.parameters.values(), truth[:, None], strict=True)])
    # the most probable region that holds 90 %: its density is above the tenth part of the draws'
    region = likelihood.logarithm(own)[0] >= np.quantile(likelihood.logarithm(where), 0.1)
    bands = predicted(plan, time, emulators, {"posterior": where}, LEVELS).isel(knowledge=0, time=-1)
    ends = {name: bands[name].values[[0, -1]] for name in PREDICTED}
    return {
        "truth": truth.tolist(),
        "low": low.tolist(),
        "high": high.tolist(),
        "share_below": (draws < truth).mean(axis=0).tolist(),
        "inside": ((low <= truth) & (truth <= high)).tolist(),
        "region": bool(region),
        "predicted": {name: bool(a <= curves[name][-1] <= b) for name, (a, b) in ends.items()},
        "accepted": found.accepted,
        "different": found.different,
    }


def coverage_rows(plan, trials):
    """How many trials hold the truth: of each parameter, of all of them, of what is predicted; and widths of bands."""
    rows = []
    for k, (name, prior) in enumerate(plan.parameters.items()):
        widths = [prior.place(one["high"][k]) - prior.place(one["low"][k]) for one in trials]
        held = sum(one["inside"][k] for one in trials)
        rows.append((name, f"{held} of {TRIALS}", f"{np.mean(widths) / 0.9:.0%}"))
    rows.append(("most probable region of all", f"{sum(one['region'] for one in trials)} of {TRIALS}", ""))
    rows += [(f"predicted {shown(name)[0]}", f"{sum(one['predicted'][name] for one in trials)} of {TRIALS}", "")
             for name in PREDICTED]  # fmt: skip
    return rows


def trial_rows(trials):
    """Truth and band of every trial."""
    rows = []
    for number, one in enumerate(trials, start=1):
        columns = zip(*(one[key] for key in ("low", "truth", "high", "inside")), strict=True)
        cells = (
            f"{truth:.3g} in {low:.3g} .. {high:.3g}" if inside else f"**{truth:.3g}** not in {low:.3g} .. {high:.3g}"
            for low, truth, high, inside in columns
        )
        rows.append((number, *cells))
    return rows


def main(folder="fit-coverage"):
    """Run, fit and write the page."""
    begin = clock.perf_counter()
    page = docs_page("fit-coverage", "made", "coverage", "trials", "emulators")
    plan, truths, seconds = run_all(Path(folder))
    given = measurements(*([1.0] * sum(len(row[-1]) for row in MEASURED),) * 2)
    ensemble, true = (read_ensemble(plan, given, Path(folder) / name) for name in ("ensemble", "truth"))
    observed, emulators = observe(ensemble), curve_emulators(ensemble)
    trials = []
    for k in range(TRIALS):
        curves = {name: np.interp(ensemble.time, true.time, values[k]) for name, values in true.curves.items()}
        trials.append(trial(plan, observed, emulators, truths[k], true.measured[k], curves, ensemble.time, k))
    wall = clock.perf_counter() - begin
    made = made_by("python -m verification.reports.fit")
    cost = (f"{len(ensemble.places)} runs and {TRIALS} true ones of {seconds['ensemble'] / len(ensemble.places):.1f} "
            f"CPU seconds each, {ensemble.failed} failed; {wall / 60:.1f} minutes for all of it.")  # fmt: skip
    rows = coverage_rows(plan, trials)
    checks = [
        (one.quantity, one.place_text, f"{one.time:g} s", f"{error:.3g} {one.unit}", f"{explained:.1%}", f"{own:.2f}")
        for one, error, explained, own in zip(given, *observed.emulator.validation, strict=True)
    ]
    heads = ("measured", "where", "when", "error left out", "variance explained", "error over its own")
    page.fill({
        "made": f"{made} {cost}",
        "coverage": table(("90 % band of", "holds the truth", "mean width of the band over the prior's"), rows),
        "trials": table(("trial", *plan.parameters), trial_rows(trials)),
        "emulators": table(heads, checks),
    })  # fmt: skip
    data = {"made": made, "wall_seconds": wall, "cpu_seconds": seconds, "trials": trials}
    write_data(DOCS / "fit-coverage.json", data)
    print("\n".join(table(("band of", "holds", "width"), rows)), cost, sep="\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
