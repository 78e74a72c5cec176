"""Commands of `gush` that measure the program or repeat the published study; heavy libraries load inside them."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markdown import Markdown

from coupling.commands.exit_codes import FAILED, JsonPath, answering, complain, say
from coupling.commands.options import Scheduler, Workers
from coupling.commands.tables import table
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
    with answering(json_path) as answer:
        from verification.accuracy.report import problem_ladders
        from verification.pages import rendered
        from verification.sensitivity.mesh import scene_ladder

        tell = Console(stderr=True).print
        if scene is not None:
            data = scene_ladder(scene, inflow_mass, out, tell)
        else:
            data = problem_ladders(problems or [], fast, out, tell)
        if answer(data):
            if scene is None:
                _show(rendered("accuracy", problems=data["problems"]))
            say(f"page: {data['page']}")


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
    with answering(json_path) as answer:
        from coupling.scenes.scene import load_scene
        from verification.pages import rendered, templated_page
        from verification.speed.command import bench
        from verification.speed.report import write

        page = None if out is None else templated_page(out, "performance")
        data = bench(load_scene(scene), step, large, Console(stderr=True).print)
        data["files"] = write(data, page) if page is not None else []
        if answer(data):
            _show(rendered("performance", **data))
            _say_all(data["files"])


def stability_command(
    case: Annotated[list[str] | None, typer.Argument(help="Extremes to run; * for any ending; all if none.")] = None,
    linear: Annotated[bool, typer.Option("--linear", help="Only the linear analysis of the time step.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for the page, its data and the map.")] = None,
    json_path: JsonPath = None,
):
    """Critical time step, predicted against exact, and runs at the edge of what a scene can ask for.

    JSON: keys of `verification.stability.report.stability`. Exit code 3 when one of its `faults` is found.
    """
    with answering(json_path) as answer:
        from verification.pages import rendered
        from verification.stability.report import stability

        with ProgressLine() as line:
            data = stability(case or [], linear, out, Console(stderr=True).print, line.say)
        if answer(data):
            _show(rendered("stability", **data | {"extremes": []}))
            rows = ((one["name"], one["verdict"], f"{one['seconds']:.1f}", one["reason"]) for one in data["extremes"])
            Console().print(table(("case", "verdict", "s", "reason"), rows))
            _say_all(data["files"])
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
    workers: Workers = None,
    scheduler: Scheduler = None,
    json_path: JsonPath = None,
):
    """The published study, whole: its cases, other meshes, what it does not state; page and figures. Rerun to resume.

    JSON: keys of `verification.published.page.write_page`, and `studies`: keys of `coupling.studies.stored.run_study`.
    """
    with answering(json_path) as answer:
        from verification.published.page import write_page
        from verification.published.runs import run_all

        studies = [] if page_only else run_all(out, quick, workers, scheduler, Console(stderr=True))
        data = write_page(out, page if page is not None else out) | {"studies": studies}
        if answer(data):
            heads = ("statement", "published", "ours")
            rows = ((*(row[name].replace("[", "\\[") for name in heads), row["agrees"].replace("no", "[red]no[/red]"))
                    for row in data["answers"])  # fmt: skip
            Console().print(table((*heads, "agrees"), rows))
            _say_all([f"not finished: {', '.join(data['missing'])}"] * bool(data["missing"]))
            say(f"page: {data['page']}")
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
    with answering(json_path) as answer:
        from verification.published.draw import draw_study

        figures = {number: str(path) for number, path in draw_study(study, out or study / "figures").items()}
        if answer({"figures": figures}):
            _say_all(f"figure {number}: {path}" for number, path in figures.items())


def _show(blocks):
    """Blocks of a page, in the terminal; in a file as wide as their tables are."""
    console = Console() if Console().is_terminal else Console(width=120)
    for text in blocks.values():
        console.print(Markdown(text))


def _say_all(lines):
    for line in lines:
        say(line)
