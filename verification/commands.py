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

    JSON: see `verification.accuracy.report.write`; with --scene `verification.accuracy.ladder_report.write_ladder`.
    """
    with failures(), checked_json(json_path):
        from verification.accuracy.command import problem_ladders, scene_ladder

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
        from verification.speed.report import write

        data = bench(load_scene(scene), step, large, Console(stderr=True).print)
        data["files"] = write(data, out) if out is not None else []
        write_json(json_path, data)
        if str(json_path) != "-":
            console = Console()
            console.print(_bench_table(data))
            for path in data["files"]:
                console.print(path, highlight=False, soft_wrap=True)


def _bench_table(data):
    table = Table("measured", "", title=f"{data['scene']}, {data['points']} points, load {data['load'][0]:.1f}")
    for name, value in (
        ("two-phase step of this program", data["step_points_per_second"]),
        ("plain one-phase reference loop", data["reference_points_per_second"]),
        ("bound by memory, bytes as counted", data["roofline_points_per_second"]),
        *((row["configuration"], row["points_per_second"]) for row in data.get("configurations", ())),
        *((f"{row['points']} points in a box", row["points_per_second"]) for row in data.get("sizes", ())),
    ):
        table.add_row(name, f"{value / 1e6:.2f} M point-steps per CPU s")
    table.add_row("step over reference", f"{data['step_to_reference_ratio']:.2f}")
    for name, seconds in data["kernels"].items():
        table.add_row(f"kernel {name}", f"{1e9 * seconds:.1f} ns a point-step")
    table.add_row("memory", f"{data['bytes_per_point']:.0f} bytes a point")
    if "start" in data:
        table.add_row("cost over size", f"power {data['size_slope']:.2f}")
        table.add_row(
            f"{data['threads'][-1]['threads']} threads", f"{data['threads'][-1]['speed_up']:.2f} times as fast"
        )
        table.add_row("first step of gush run quick, warm", f"{data['first_step_wall_seconds']:.1f} s by the clock")
        table.add_row("compilation", f"{data['start']['compilation']:.1f} CPU s, once")
        share = data["throughput"]
        table.add_row(f"{share['runs']} runs at once", f"{share['share_of_ideal']:.2f} of the ideal throughput")
    return table


def stability_command(
    case: Annotated[list[str] | None, typer.Argument(help="Extremes to run; * for any ending; all if none.")] = None,
    linear: Annotated[bool, typer.Option("--linear", help="Only the linear analysis of the time step.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for the page, its data and the map.")] = None,
    json_path: JsonPath = None,
):
    """Critical time step, predicted against exact, and runs at the edge of what a scene can ask for.

    JSON: keys of `verification.stability.command.stability`. Exit code 3 when one of its `faults` is found.
    """
    with failures(), checked_json(json_path):
        from verification.stability.command import stability, tables

        with ProgressLine() as line:
            data = stability(case or [], linear, out, Console(stderr=True).print, line.say)
        write_json(json_path, data)
        if str(json_path) != "-":
            console = Console()
            for table in tables(data):
                console.print(table)
            for path in data["files"]:
                console.print(path, highlight=False, soft_wrap=True)
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
        write_json(json_path, data)
        if str(json_path) != "-":
            table = Table("statement", "published", "ours", "agrees")
            for row in data["answers"]:
                verdict = "[red]no[/red]" if row["agrees"] == "no" else row["agrees"]
                table.add_row(*(row[name].replace("[", "\\[") for name in ("statement", "published", "ours")), verdict)
            console = Console()
            console.print(table)
            if data["missing"]:
                console.print(f"not finished: {', '.join(data['missing'])}", highlight=False)
            console.print(f"page: {data['page']}", highlight=False, soft_wrap=True)
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
        write_json(json_path, {"figures": figures})
        if str(json_path) != "-":
            for number, path in figures.items():
                Console().print(f"figure {number}: {path}", highlight=False, soft_wrap=True)


def _accuracy_table(data):
    table = Table("problem", "error", "limit", "CPU s", "default over the best of what costs no more")
    for name, row in data["problems"].items():
        limit = f"{row['limit']:.2g}" if row["within"] else f"[red]{row['limit']:.2g} exceeded[/red]"
        table.add_row(name, f"{row['error']:.2e}", limit, f"{row['cpu_seconds']:.2f}", f"{row['excess']:.2f}")
    return table
