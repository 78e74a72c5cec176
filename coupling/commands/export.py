"""The command `gush export`."""

from pathlib import Path
from typing import Annotated

import typer

from coupling.commands.exit_codes import JsonPath, answering, say
from coupling.commands.options import Run


def export_command(
    run: Run,
    kind: Annotated[
        str,
        typer.Option(
            "--format",
            help="vtu, xdmf for ParaView; gif, an animation; csv, xlsx, tables; png, svg, pdf, pictures.",
        ),
    ] = "vtu",
    out: Annotated[
        Path | None, typer.Option(help="Folder; fields, tables or figures in the run's folder when left out.")
    ] = None,
    json_path: JsonPath = None,
):
    """Write a run for other programs: fields over time for ParaView, an animation, tables, or pictures.

    JSON: `run`, `format`, `files` (paths to open).
    """
    with answering(json_path) as answer:
        from coupling.export import export

        files = export(run, kind, out)
        if answer({"run": str(run), "format": kind, "files": [str(path) for path in files]}):
            for path in files:
                say(f"wrote {path}")
