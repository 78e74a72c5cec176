"""Arguments and options that several commands take."""

import glob
import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer


def completed(room: str) -> Callable[[str], list[str]]:
    """Completion of a name that a room of `coupling` has built in, or of a path."""

    def complete(incomplete: str) -> list[str]:
        from coupling.scenes.layers import ready_names

        paths = (f"{path}/" if os.path.isdir(path) else path for path in glob.glob(f"{glob.escape(incomplete)}*"))
        return [*(name for name in ready_names(room) if name.startswith(incomplete)), *sorted(paths)]

    return complete


SceneName = Annotated[
    str,
    typer.Argument(help="A built-in scene (see `gush scenes`) or a TOML file.", autocompletion=completed("scenes")),
]
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
Workers = Annotated[int | None, typer.Option(min=0, help="Processes; all cores when left out, 0: this one.")]
Scheduler = Annotated[str | None, typer.Option(help="Address of a running dask scheduler to use instead.")]
