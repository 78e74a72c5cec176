"""The command line `gush`: its own commands, and those that packages join."""

from typing import Annotated

import typer

from coupling.commands.compare import compare_command
from coupling.commands.export import export_command
from coupling.commands.fit import fit_command
from coupling.commands.info import info_command
from coupling.commands.init import init_command
from coupling.commands.joined import JoinedCommands
from coupling.commands.misfit import misfit_command
from coupling.commands.plan import plan_command
from coupling.commands.report import report_command
from coupling.commands.rerun import rerun_command
from coupling.commands.respond import respond_command
from coupling.commands.run import run_command
from coupling.commands.scenes import scenes_command
from coupling.commands.schema import schema_command
from coupling.commands.study import study_command
from coupling.commands.watch import watch_command

app = typer.Typer(
    cls=JoinedCommands,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Water and soil gushing into a shield tunnel: two-phase MPM, lining pressures, forces in the ring.",
    epilog="Exit codes: 0 done, 1 rerun differs, 2 refused input, 3 run failed, 130 interrupted.",
)
app.command("run")(run_command)
app.command("watch")(watch_command)
app.command("rerun")(rerun_command)
app.command("plan")(plan_command)
app.command("respond")(respond_command)
app.command("compare")(compare_command)
app.command("misfit")(misfit_command)
app.command("scenes")(scenes_command)
app.command("init")(init_command)
app.command("schema")(schema_command)
app.command("report")(report_command)
app.command("export")(export_command)
app.command("info")(info_command)
app.command("study")(study_command)
app.command("fit")(fit_command)


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
