"""Arguments and options that several commands take."""

from pathlib import Path
from typing import Annotated

import typer

SceneName = Annotated[str, typer.Argument(help="A built-in scene (see `gush scenes`) or a TOML file.")]
SOURCE = "Folder or run.nc of a run, or a netCDF-4 file with pressures that follow the schema."
RingScene = Annotated[
    str | None, typer.Option("--scene", help="Scene whose ring is taken; that of the run when left out.")
]
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", help="Change one value of the scene: gate.angle=45, 'gate.width=20 cm'; may be repeated."),
]
Threads = Annotated[int | None, typer.Option(min=1, help="Threads; all cores when left out. Does not change results.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print errors only.")]
Run = Annotated[Path, typer.Argument(help="Folder (or run.nc) of a run, also one that goes on.")]
