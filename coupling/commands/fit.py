"""The command `gush fit`."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from coupling.commands.exit_codes import JsonPath, answering, say, warn
from coupling.commands.options import SceneName, Scheduler, Workers
from coupling.commands.own_folder import claim
from coupling.commands.tables import table

DATA, FIGURE = "fit.nc", "fit.png"
#: Below such a probability of the closest draw the scene does not explain the measurements.
IMPROBABLE = 0.01
#: Of the range of a uniform prior: a band that comes so close to its end may go on beyond.
NEAR_END = 0.02


def fit_command(
    scene: SceneName,
    measurements: Annotated[Path, typer.Argument(help="As of `gush misfit`: CSV table, or netCDF-4 file.")],
    priors: Annotated[Path, typer.Option(help="TOML file: what is fitted, between which bounds, by how many runs.")],
    out: Annotated[Path | None, typer.Option(help="Folder; fits/SCENE when left out. Its runs are not rerun.")] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json_path: JsonPath = None,
):
    """Fit parameters of a scene to measurements, and predict forces, utilisations and inflow in bands. Rerun to resume.

    JSON: `scene`, `measurements`, `runs`, `failed`, `count`, `not_reached`, `chi_square`, `probability` (of the closest
    draw); `parameters`, `predictions` (at `time` [s]): name to unit, prior and posterior, each low, median, high
    (90 %); `limits`: name to share_passing, passing_time [s] (null: not by then); `emulators`: quantity to error,
    explained, standardised (of runs left out); `sensitivity`: quantity to parameter to first_order, total_order;
    `data`, `figure`.
    """
    with answering(json_path) as answer:
        from coupling.datasets import write_dataset
        from coupling.figures import RESOLUTION
        from coupling.figures.fit import fit_bands
        from coupling.fits.fit import TITLE, fit
        from coupling.fits.summary import drawn, summary
        from coupling.postprocess.extremes import shown_extreme
        from coupling.studies.progress import StudyLine

        folder = Path("fits") / Path(scene).stem if out is None else out
        claim(folder, (folder / DATA, folder / FIGURE), DATA, TITLE)
        console = Console(stderr=True)
        with StudyLine(console) as line:
            tell = partial(console.print, highlight=False, soft_wrap=True)
            found = fit(scene, measurements, priors, folder, workers, scheduler, tell, line)
        write_dataset(folder / DATA, found)
        fit_bands(found, drawn(found), shown_extreme).savefig(folder / FIGURE, dpi=RESOLUTION)
        data = {"scene": scene, "measurements": str(measurements), **summary(found),
                "data": str(folder / DATA), "figure": str(folder / FIGURE)}  # fmt: skip
        _tell_doubts(data)
        if answer(data):
            Console().print(*_tables(data), sep="\n")
            say(f"chi square per measurement {data['chi_square']:.3g} at the closest draw; 1: as far as the errors say")
            say(f"results in {folder}")


def _tell_doubts(data):
    """What makes the answer doubtful."""
    if data["failed"]:
        warn(f"{data['failed']} runs failed; the emulators know nothing of their surroundings")
    if data["not_reached"]:
        warn(f"{data['not_reached']} measurements are later than the end of most runs; they do not count")
    if data["probability"] < IMPROBABLE:
        warn(
            f"no draw explains the measurements: chi square {data['chi_square']:.3g} each at the closest one; widen "
            "the priors, free other parameters, or look at the errors of the worst measurements in fit.nc"
        )
    for name, one in data["parameters"].items():
        reach = NEAR_END * (one["range"]["high"] - one["range"]["low"])
        near = [end for end, sign in (("low", 1), ("high", -1))
                if sign * (one["posterior"][end] - one["range"][end]) < reach]  # fmt: skip
        if len(near) == 1:
            warn(f"{name}: its band reaches the {near[0]} end of the prior, {one['range'][near[0]]:.4g}; widen it")


def _tables(data):
    heads = ("before", "5 %", "median", "95 %", "unit")
    parameters = ((name, *_cells(one, 1.0)) for name, one in data["parameters"].items())
    yield table(("parameter", *heads), parameters, f"{data['scene']} after {data['measurements']}, {data['runs']} runs")
    bands = ((one["label"], *_cells(one, one["scale"])) for one in data["predictions"].values())
    yield table(("at the last time", *heads), bands, f"what follows, at {data['time']:.3g} s")
    if data["limits"]:
        limits = ((one["label"], f"{one['share_passing']:.0%}", *map(_passing, one["passing_time"].values()))
                  for one in data["limits"].values())  # fmt: skip
        yield table(("limit", "passed by then", "at the earliest (5 %)", "median", "at the latest (95 %)"), limits)
    emulators = (
        (name.replace("_", " "), f"{one['scale'] * one['error']:.3g} {one['unit']}", f"{one['explained']:.1%}",
         f"{one['standardised']:.2f}") for name, one in data["emulators"].items()
    )  # fmt: skip
    heads = ("emulator", "error", "variance explained", "error over its own")
    yield table(heads, emulators, "cross-validation: each run left out in turn")
    names = list(data["parameters"])
    sensitivity = (
        (data["predictions"][quantity]["label"],
         *(f"{one[name]['first_order']:.2f}, {one[name]['total_order']:.2f}" for name in names))
        for quantity, one in data["sensitivity"].items()
    )  # fmt: skip
    heads = ("share of variance alone, with others", *names)
    yield table(heads, sensitivity, "which parameter decides, at the last time")


def _passing(time):
    return f"{time:.3g} s" if time != float("inf") else "later or never"


def _cells(one, scale):
    before, after = one["prior"], one["posterior"]
    middle = (f"{scale * after[end]:.4g}" for end in ("low", "median", "high"))
    return f"{scale * before['low']:.4g} to {scale * before['high']:.4g}", *middle, one["unit"]
