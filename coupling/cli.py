"""The command line `gush`: its own commands, and those that packages join."""

from importlib import import_module
from typing import Annotated

import typer

from coupling.commands.joined import JoinedCommands

#: Commands in the order of the help: each a module of `coupling.commands` with a function NAME_command.
COMMANDS = (
    "run", "watch", "rerun", "plan", "respond", "compare", "misfit", "scenes", "init", "schema", "report", "export",
    "info", "study", "fit",
)  # fmt: skip

app = typer.Typer(
    cls=JoinedCommands,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Water and soil gushing into a shield tunnel: two-phase MPM, lining pressures, forces in the ring.",
    epilog="Exit codes: 0 done, 1 rerun differs, 2 refused input, 3 run failed, 130 interrupted.",
)
for name in COMMANDS:
    app.command(name)(getattr(import_module(f"coupling.commands.{name}"), f"{name}_command"))


def _tell_version(asked: bool):
    if asked:
        from importlib.metadata import version

        typer.echo(f"gush {version('gushing')}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="Show the version and exit.")
    ] = False,
):
    pass


def main():
    """Entry point of the command `gush`."""
    app()


if __name__ == "__main__":
    main()
