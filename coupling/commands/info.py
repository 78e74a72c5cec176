"""The command `gush info`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from coupling.commands.exit_codes import JsonPath, answering, plain, say


def info_command(
    path: Annotated[Path, typer.Argument(help="Any file or folder.")],
    json_path: JsonPath = None,
):
    """Tell what a file or folder is: a run, a scene, pressures, a report, or none of these.

    JSON: keys of `coupling.commands.describe.describe`.
    """
    with answering(json_path) as answer:
        from coupling.commands.describe import describe

        data = describe(path)
        if answer(data):
            table = Table("what", "")
            say(plain(f"{data['path']}: {data['kind']}"))
            if "bytes" in data:
                size = data["bytes"]
                table.add_row("size", f"{size} bytes" if size < 1e5 else f"{size / 1e6:.3g} MB")
            for name, value in data["facts"].items():
                shown = f"{value:.4g}" if isinstance(value, float) else plain(value)
                table.add_row(name.replace("[", "\\["), shown.replace("[", "\\["))
            for command in data["next"]:
                table.add_row("next", plain(command).replace("[", "\\["))
            Console().print(table)
