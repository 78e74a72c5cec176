"""Commands of `gush` that measure the program or many scenes: accuracy, stability, study."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from coupling.exit_codes import FAILED, JsonPath, checked_json, complain, failures, write_json


def accuracy_command(
    problems: Annotated[list[str] | None, typer.Argument(help="Verification problems; all when left out.")] = None,
    scene: Annotated[
        str | None, typer.Option(help="Instead: a mesh ladder of this scene, at equal inflow mass.")
    ] = None,
    inflow_mass: Annotated[float, typer.Option(help="Last inflow mass of the mesh ladder [kg/m].")] = 1000.0,
    fast: Annotated[bool, typer.Option("--fast", help="Default settings only, no ladders.")] = False,
    out: Annotated[Path, typer.Option(help="Folder for the page, its data and pictures.")] = Path("accuracy"),
    json_path: JsonPath = None,
):
    """Error against processor time over mesh size, time step and numerical options; a page, data and pictures.

    JSON: see `coupling.accuracy.report.write`; with --scene `coupling.accuracy.ladder_report.write_ladder`.
    """
    with failures(), checked_json(json_path):
        from coupling.accuracy.command import problem_ladders, scene_ladder

        tell = Console(stderr=True).print
        if scene is not None:
            data = scene_ladder(scene, inflow_mass, out, tell)
        else:
            data = problem_ladders(problems or [], fast, out, tell)
        write_json(json_path, data)
        if str(json_path) != "-":
            console = Console()
            if scene is None:
                console.print(_accuracy_table(data))
            console.print(f"page: {data['page']}", highlight=False, soft_wrap=True)


def stability_command(
    case: Annotated[list[str] | None, typer.Argument(help="Extremes to run; * for any ending; all if none.")] = None,
    linear: Annotated[bool, typer.Option("--linear", help="Only the linear analysis of the time step.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for the page, its data and the map.")] = None,
    json_path: JsonPath = None,
):
    """Critical time step, predicted against exact, and runs at the edge of what a scene can ask for.

    JSON: keys of `coupling.stability.command.stability`. Exit code 3 when one of its `faults` is found.
    """
    with failures(), checked_json(json_path):
        from coupling.stability.command import stability, tables

        data = stability(case or [], linear, out, Console(stderr=True).print)
        write_json(json_path, data)
        if str(json_path) != "-":
            console = Console()
            for table in tables(data):
                console.print(table)
            for path in data["files"]:
                console.print(path, highlight=False, soft_wrap=True)
    if data["faults"]:
        complain("\n".join(data["faults"]), FAILED)


def study_command(
    study: Annotated[
        str, typer.Argument(help="A built-in study (table-2, sensitivity, permeability, mesh, backend) or a TOML file.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder; studies/NAME when left out. What is there is not rerun.")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=0, help="Processes; all cores when left out, 0: this one.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a running dask scheduler to use instead.")] = None,
    json_path: JsonPath = None,
):
    """Run many scenes that differ in some parameters, in parallel; one dataset of them all. Rerun to resume.

    JSON: `study`, `folder`, `data` (netCDF file), `cases`: list of {case, parameters, status, message, cpu_seconds [s],
    time [s]: of the last inflow mass reached}.
    """
    with failures(), checked_json(json_path):
        from coupling.studies.command import run_study

        data = run_study(study, out, workers, scheduler, Console(stderr=True))
        write_json(json_path, data)
        if str(json_path) != "-":
            console = Console()
            console.print(_study_table(data))
            console.print(f"data: {data['data']}", highlight=False, soft_wrap=True)
        if any(case["status"] == "failed" for case in data["cases"]):
            raise typer.Exit(FAILED)


def _accuracy_table(data):
    table = Table("problem", "error", "limit", "CPU s", "default over the best of what costs no more")
    for name, row in data["problems"].items():
        limit = f"{row['limit']:.2g}" if row["within"] else f"[red]{row['limit']:.2g} exceeded[/red]"
        table.add_row(name, f"{row['error']:.2e}", limit, f"{row['cpu_seconds']:.2f}", f"{row['excess']:.2f}")
    return table


def _study_table(data):
    names = list(data["cases"][0]["parameters"])
    table = Table("case", *names, "status", "CPU s", "time [s]".replace("[", "\\["), title=data["study"])
    for case in data["cases"]:
        values = [f"{v:.4g}" if isinstance(v, float) else str(v) for v in case["parameters"].values()]
        numbers = [f"{case['cpu_seconds']:.0f}", f"{case['time']:.3g}"] if case["status"] == "finished" else ["", ""]
        table.add_row(str(case["case"]), *values, case["message"] or case["status"], *numbers)
    return table
