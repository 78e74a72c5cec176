"""The command `gush rerun`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from coupling.commands.exit_codes import DIFFERENT, JsonPath, checked_json, failures, warn, write_json
from coupling.commands.options import Threads
from coupling.runs.progress_line import ProgressLine


def rerun_command(
    run: Annotated[Path, typer.Argument(help="Folder or run.nc of the run to repeat.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the repetition; runs/SCENE-rerun, numbered, when left out.")
    ] = None,
    threads: Threads = None,
    json_path: JsonPath = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print errors only.")] = False,
):
    """Repeat a run from what its file says and compare all records bit for bit; exit code 1 when they differ.

    JSON: keys of `coupling.runs.rerun.rerun`.
    """
    with failures(), checked_json(json_path):
        from coupling.runs.rerun import rerun

        with ProgressLine(quiet) as line:
            data = rerun(run, out, line, threads, warn)
        write_json(json_path, data)
        if not quiet and str(json_path) != "-":
            tell = Console().print
            for row in data["differences"]:
                tell(f"{row['variable']}: first at t {row['time']} s, by at most {row['largest']}", highlight=False)
            of = f" of {data['records_run']}" if data["records"] < data["records_run"] else ""
            verdict = "identical bit for bit" if data["identical"] else "different"
            tell(f"{verdict}: {data['records']}{of} records of {run} and {data['rerun']}", soft_wrap=True)
    if not data["identical"]:
        raise typer.Exit(DIFFERENT)
