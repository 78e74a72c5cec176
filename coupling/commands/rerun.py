"""The command `gush rerun`."""

from pathlib import Path
from typing import Annotated

import typer

from coupling.commands.exit_codes import DIFFERENT, JsonPath, answering, say, warn
from coupling.commands.options import Quiet, Threads
from coupling.runs.progress_line import ProgressLine


def rerun_command(
    run: Annotated[Path, typer.Argument(help="Folder or run.nc of the run to repeat.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the repetition; runs/SCENE-rerun, numbered, when left out.")
    ] = None,
    threads: Threads = None,
    json_path: JsonPath = None,
    quiet: Quiet = False,
):
    """Repeat a run from what its file says and compare all records bit for bit; exit code 1 when they differ.

    JSON: keys of `coupling.runs.rerun.rerun`.
    """
    with answering(json_path) as answer:
        from coupling.runs.rerun import rerun

        with ProgressLine(quiet) as line:
            data = rerun(run, out, line, threads, warn)
        if answer(data) and not quiet:
            for row in data["differences"]:
                say(f"{row['variable']}: first at t {row['time']} s, by at most {row['largest']}")
            of = f" of {data['records_run']}" if data["records"] < data["records_run"] else ""
            verdict = "identical bit for bit" if data["identical"] else "different"
            say(f"{verdict}: {data['records']}{of} records of {run} and {data['rerun']}")
    if not data["identical"]:
        raise typer.Exit(DIFFERENT)
