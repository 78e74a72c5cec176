"""Commands of `gush` that show what a run came to: report, export, info."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from coupling.exit_codes import JsonPath, checked_json, failures, plain, write_json

Run = Annotated[Path, typer.Argument(help="Folder (or run.nc) of a run, also one that goes on.")]


def report_command(
    path: Annotated[Path, typer.Argument(help="Folder of a run (or its run.nc) or of a study, also one that goes on.")],
    out: Annotated[Path | None, typer.Option(help="The HTML file; report.html in the folder when left out.")] = None,
    model: Annotated[
        str | None, typer.Option(help="Lining model whose numbers lead; the run's own when left out.")
    ] = None,
    runs: Annotated[bool, typer.Option("--runs", help="Of a study: also write the page of every run.")] = False,
    json_path: JsonPath = None,
):
    """Write one HTML page about a run or a study: key numbers, charts with one slider, balances. Opens offline.

    JSON: `run` or `study` (path), `report` (path), `bytes`; `runs` (paths) with --runs.
    """
    with failures(), checked_json(json_path):
        from coupling.report.page import study_folder, write_report, write_run_reports
        from coupling.run_folder import RunRefused

        folder = study_folder(path)
        if runs and folder is None:
            raise RunRefused(f"--runs: '{path}' must be a study, it is a run; leave --runs out")
        of_runs = write_run_reports(folder) if runs else []
        page = write_report(path, out, model)
        data = {"run" if folder is None else "study": str(path), "report": str(page), "bytes": page.stat().st_size}
        if runs:
            data["runs"] = [str(file) for file in of_runs]
        _tell(data, json_path, [*of_runs, page])


def export_command(
    run: Run,
    kind: Annotated[str, typer.Option("--format", help="vtu or xdmf for ParaView, gif for an animation.")] = "vtu",
    out: Annotated[Path | None, typer.Option(help="Folder; fields in the run's folder when left out.")] = None,
    json_path: JsonPath = None,
):
    """Write points and mesh of a run over time as files for ParaView, or as an animation.

    JSON: `run`, `format`, `files` (paths to open).
    """
    with failures(), checked_json(json_path):
        from coupling.export import export

        files = export(run, kind, out)
        _tell({"run": str(run), "format": kind, "files": [str(path) for path in files]}, json_path, files)


def info_command(
    path: Annotated[Path, typer.Argument(help="Any file or folder.")],
    json_path: JsonPath = None,
):
    """Tell what a file or folder is: a run, a scene, pressures, a report, or none of these.

    JSON: keys of `coupling.info.describe`.
    """
    with failures(), checked_json(json_path):
        from coupling.info import describe

        data = describe(path)
        write_json(json_path, data)
        if str(json_path) != "-":
            console, table = Console(), Table("what", "")
            console.print(plain(f"{data['path']}: {data['kind']}"), highlight=False, soft_wrap=True, markup=False)
            if "bytes" in data:
                size = data["bytes"]
                table.add_row("size", f"{size} bytes" if size < 1e5 else f"{size / 1e6:.3g} MB")
            for name, value in data["facts"].items():
                shown = f"{value:.4g}" if isinstance(value, float) else plain(value)
                table.add_row(name.replace("[", "\\["), shown.replace("[", "\\["))
            for command in data["next"]:
                table.add_row("next", plain(command).replace("[", "\\["))
            console.print(table)


def _tell(data, json_path, files):
    write_json(json_path, data)
    if str(json_path) != "-":
        for path in files:
            Console().print(f"wrote {path}", highlight=False, soft_wrap=True, markup=False)
