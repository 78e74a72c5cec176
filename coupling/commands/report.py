"""The command `gush report`."""

from pathlib import Path
from typing import Annotated

import typer

from coupling.commands.exit_codes import JsonPath, answering, say


def report_command(
    path: Annotated[Path, typer.Argument(help="Folder of a run (or its run.nc) or of a study, also one that goes on.")],
    out: Annotated[Path | None, typer.Option(help="The HTML file; report.html in the folder when left out.")] = None,
    model: Annotated[
        str | None, typer.Option(help="Lining model whose numbers lead; the run's own when left out.")
    ] = None,
    ladder: Annotated[
        Path | None,
        typer.Option(help="Of a run: SCENE-ladder.nc of `gush accuracy --scene`, for the error of the mesh."),
    ] = None,
    pdf: Annotated[
        bool, typer.Option("--pdf", help="Also print the page beside it as PDF; needs an installed Chromium or Chrome.")
    ] = False,
    runs: Annotated[bool, typer.Option("--runs", help="Of a study: also write the page of every run.")] = False,
    json_path: JsonPath = None,
):
    """Write one HTML page about a run or a study: the answer, charts with one slider, balances. Opens offline.

    JSON: `run` or `study` (path), `report` (path), `bytes`; `pdf` (path) with --pdf; `runs` (paths) with --runs.
    """
    with answering(json_path) as answer:
        from coupling.refused import Refused
        from coupling.report.page import study_folder, write_report, write_run_reports
        from coupling.report.pdf import find_browser, print_page

        folder = study_folder(path)
        if runs and folder is None:
            raise Refused(f"--runs: '{path}' must be a study, it is a run; leave --runs out")
        browser = find_browser() if pdf else None
        of_runs = write_run_reports(folder) if runs else []
        page = write_report(path, out, model, ladder)
        data = {"run" if folder is None else "study": str(path), "report": str(page), "bytes": page.stat().st_size}
        if browser is not None:
            data["pdf"] = str(print_page(page, browser))
        if runs:
            data["runs"] = [str(file) for file in of_runs]
        if answer(data):
            for file in [*of_runs, page, *([data["pdf"]] if pdf else [])]:
                say(f"wrote {file}")
