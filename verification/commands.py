"""Commands of `gush` that measure the program or repeat the published study; heavy libraries load inside them."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from coupling.commands.exit_codes import FAILED, JsonPath, checked_json, complain, failures, write_json
from coupling.runs.progress_line import ProgressLine

PUBLISHED_RUNS = Path("studies/published")


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

    JSON: see `verification.accuracy.report.problem_ladders`; with --scene `verification.sensitivity.mesh.write_ladder`.
    """
    with failures(), checked_json(json_path):
        from verification.accuracy.report import problem_ladders
        from verification.sensitivity.mesh import scene_ladder

        tell = Console(stderr=True).print
        if scene is not None:
            data = scene_ladder(scene, inflow_mass, out, tell)
        else:
            data = problem_ladders(problems or [], fast, out, tell)
        table = Table("problem", "error", "limit", "CPU s", "default over the best of what costs no more")
        for name, row in data.get("problems", {}).items():
            limit = f"{row['limit']:.2g}" if row["within"] else f"[red]{row['limit']:.2g} exceeded[/red]"
            table.add_row(name, f"{row['error']:.2e}", limit, f"{row['cpu_seconds']:.2f}", f"{row['excess']:.2f}")
        _show(json_path, data, [table] * (scene is None), [f"page: {data['page']}"])


def bench_command(
    scene: Annotated[str, typer.Option(help="Scene whose step is measured.")] = "case-3",
    step: Annotated[bool, typer.Option("--step", help="Only the step beside the reference loop.")] = False,
    large: Annotated[bool, typer.Option("--large", help="Also three million points.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for the page, its data and figure.")] = None,
    json_path: JsonPath = None,
):
    """What steps, sizes, starts and runs at once cost, beside a plain reference loop and a copy of memory.

    JSON: step_points_per_second, reference_points_per_second, step_to_reference_ratio and the other keys of
    `verification.speed.command.bench`; `files`.
    """
    if step and out is not None:
        raise typer.BadParameter("--step measures too little for a page; leave out --step or --out")
    with failures(), checked_json(json_path):
        from coupling.scenes.scene import load_scene
        from verification.speed.command import bench
        from verification.speed.report import bench_page, facts, write

        page = None if out is None else bench_page(out)
        data = bench(load_scene(scene), step, large, Console(stderr=True).print)
        data["files"] = write(data, page) if page is not None else []
        table = Table("measured", "")
        for row in facts(data):
            table.add_row(*row)
        for row in (*data.get("configurations", ()), *data.get("sizes", ())):
            what = row.get("configuration", f"{row.get('points')} points in a box")
            table.add_row(f"{what}, million point-steps a CPU s", f"{row['points_per_second'] / 1e6:.2f}")
        for name, seconds in data["kernels"].items():
            table.add_row(f"kernel {name}, ns a point-step", f"{1e9 * seconds:.1f}")
        _show(json_path, data, [table], data["files"])


def stability_command(
    case: Annotated[list[str] | None, typer.Argument(help="Extremes to run; * for any ending; all if none.")] = None,
    linear: Annotated[bool, typer.Option("--linear", help="Only the linear analysis of the time step.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for the page, its data and the map.")] = None,
    json_path: JsonPath = None,
):
    """Critical time step, predicted against exact, and runs at the edge of what a scene can ask for.

    JSON: keys of `verification.stability.report.stability`. Exit code 3 when one of its `faults` is found.
    """
    with failures(), checked_json(json_path):
        from verification.stability.report import shown_tables, stability

        with ProgressLine() as line:
            data = stability(case or [], linear, out, Console(stderr=True).print, line.say)
        _show(json_path, data, shown_tables(data), data["files"])
    if data["faults"]:
        complain("\n".join(data["faults"]), FAILED)


def published_command(
    out: Annotated[Path, typer.Option(help="Folder of the runs. What is there is not run again.")] = PUBLISHED_RUNS,
    page: Annotated[
        Path | None, typer.Option(help="Folder for published.md and its figures; that of the runs when left out.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A look in ten minutes: the cases alone, coarse.")] = False,
    page_only: Annotated[bool, typer.Option("--page-only", help="Run nothing: page and figures of what is there.")] = (
        False
    ),
    workers: Annotated[int | None, typer.Option(min=0, help="Processes; all cores when left out, 0: this one.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a running dask scheduler to use instead.")] = None,
    json_path: JsonPath = None,
):
    """The published study, whole: its cases, other meshes, what it does not state; page and figures. Rerun to resume.

    JSON: keys of `verification.published.page.write_page`, and `studies`: keys of `coupling.studies.stored.run_study`.
    """
    with failures(), checked_json(json_path):
        from verification.published.page import write_page
        from verification.published.runs import run_all

        studies = [] if page_only else run_all(out, quick, workers, scheduler, Console(stderr=True))
        data = write_page(out, page if page is not None else out) | {"studies": studies}
        table = Table("statement", "published", "ours", "agrees")
        for row in data["answers"]:
            verdict = "[red]no[/red]" if row["agrees"] == "no" else row["agrees"]
            table.add_row(*(row[name].replace("[", "\\[") for name in ("statement", "published", "ours")), verdict)
        missing = [f"not finished: {', '.join(data['missing'])}"] if data["missing"] else []
        _show(json_path, data, [table], [*missing, f"page: {data['page']}"])
        if any(case["status"] == "failed" for one in studies for case in one["cases"]):
            raise typer.Exit(FAILED)


def figures_command(
    study: Annotated[Path, typer.Argument(help="Folder of a study with published cases, as published/cases.")],
    out: Annotated[Path | None, typer.Option(help="Folder of the figures; STUDY/figures when left out.")] = None,
    json_path: JsonPath = None,
):
    """Draw the published figures of a study: 6 and 7 of twin tunnels, 9 to 17 of case 3, 19 to 23 of all cases.

    JSON: `figures`: number of the published figure to path.
    """
    with failures(), checked_json(json_path):
        from verification.published.draw import draw_study

        figures = {number: str(path) for number, path in draw_study(study, out or study / "figures").items()}
        _show(json_path, {"figures": figures}, [], [f"figure {number}: {path}" for number, path in figures.items()])


def _show(json_path, data, tables, lines):
    """Write the JSON; unless that is what is printed, print tables and lines."""
    write_json(json_path, data)
    if str(json_path) != "-":
        console = Console()
        for table in tables:
            console.print(table)
        for line in lines:
            console.print(line, highlight=False, soft_wrap=True)
