"""Commands of `gush` for the published study: all of it, and its figures alone."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from coupling.exit_codes import FAILED, JsonPath, checked_json, failures, write_json

RUNS = Path("studies/published")


def published_command(
    out: Annotated[Path, typer.Option(help="Folder of the runs. What is there is not run again.")] = RUNS,
    page: Annotated[
        Path | None, typer.Option(help="Folder for study.md and its figures; that of the runs when left out.")
    ] = None,
    coarse: Annotated[bool, typer.Option("--coarse", help="A rehearsal on coarse meshes, to 100 kg/m.")] = False,
    page_only: Annotated[bool, typer.Option("--page-only", help="Run nothing: page and figures of what is there.")] = (
        False
    ),
    workers: Annotated[int | None, typer.Option(min=0, help="Processes; all cores when left out, 0: this one.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a running dask scheduler to use instead.")] = None,
    json_path: JsonPath = None,
):
    """The published study, whole: Table 2, twin tunnels, mirror image, sensitivity; page and figures. Rerun to resume.

    JSON: keys of `coupling.published.page.write_page`, and `studies`: keys of `coupling.studies.command.run_study`.
    """
    with failures(), checked_json(json_path):
        from coupling.published.page import write_page
        from coupling.published.run_all import run_all

        studies = [] if page_only else run_all(out, coarse, workers, scheduler, Console(stderr=True))
        data = write_page(out, page if page is not None else out) | {"studies": studies}
        write_json(json_path, data)
        if str(json_path) != "-":
            table = Table("statement", "published", "here", "agrees")
            for row in data["answers"]:
                verdict = {True: "yes", False: "[red]no[/red]", None: ""}[row["agrees"]]
                table.add_row(*(row[name].replace("[", "\\[") for name in ("statement", "published", "ours")), verdict)
            console = Console()
            console.print(table)
            if data["missing"]:
                console.print(f"not finished: {', '.join(data['missing'])}", highlight=False)
            console.print(f"page: {data['page']}", highlight=False, soft_wrap=True)
        if any(case["status"] == "failed" for one in studies for case in one["cases"]):
            raise typer.Exit(FAILED)


def figures_command(
    study: Annotated[Path, typer.Argument(help="Folder of a study with published cases, e.g. studies/table-2.")],
    out: Annotated[Path | None, typer.Option(help="Folder of the figures; STUDY/figures when left out.")] = None,
    json_path: JsonPath = None,
):
    """Draw the published figures of a study: 6 and 7 of twin tunnels, 9 to 17 of case 3, 19 to 23 of all cases.

    JSON: `figures`: number of the published figure to path.
    """
    with failures(), checked_json(json_path):
        from coupling.published.draw import draw_study

        figures = {number: str(path) for number, path in draw_study(study, out or study / "figures").items()}
        write_json(json_path, {"figures": figures})
        if str(json_path) != "-":
            for number, path in figures.items():
                Console().print(f"figure {number}: {path}", highlight=False, soft_wrap=True)
