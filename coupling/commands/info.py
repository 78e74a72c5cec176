"""The command `gush info`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from coupling.commands.exit_codes import JsonPath, answering, plain, say
from coupling.commands.tables import table


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
            say(plain(f"{data['path']}: {data['kind']}"))
            size, rows = data.get("bytes"), []
            if size is not None:
                rows.append(("size", f"{size} bytes" if size < 1e5 else f"{size / 1e6:.3g} MB"))
            rows += [(name, f"{value:.4g}" if isinstance(value, float) else plain(value))
                     for name, value in data["facts"].items()]  # fmt: skip
            rows += [("next", plain(command)) for command in data["next"]]
            Console().print(table(("what", ""), [[cell.replace("[", "\\[") for cell in row] for row in rows]))
