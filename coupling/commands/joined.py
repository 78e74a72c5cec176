"""Commands of `gush` that installed packages bring: entry points of a group, each a function as typer takes it.

Their names are read when the command line is none of our own commands, and their modules are imported when one of them
is used or the help lists them.
"""

from functools import cached_property

import typer
from typer.core import TyperGroup

from coupling.commands.exit_codes import REFUSED, complain

ENTRY_POINTS = "gush.commands"


class JoinedCommands(TyperGroup):
    """A group of commands that others join; its own come first and keep their names."""

    @cached_property
    def _entries(self):
        from importlib.metadata import entry_points

        return [entry for entry in entry_points(group=ENTRY_POINTS) if entry.name not in self.commands]

    def list_commands(self, ctx):
        """All names: our own in their order, then those that joined."""
        return [*self.commands, *sorted({entry.name for entry in self._entries} - self.commands.keys())]

    def get_command(self, ctx, name):
        """Load a command of ours, or import one that joined; None where there is none."""
        if name in self.commands:
            return self.commands[name]
        for entry in self._entries:
            if entry.name == name:
                return _command(entry)
        for entry in self._entries:  # what is like a misspelt name is told from names that are known
            self.commands.setdefault(entry.name, _command(entry))
        return None


def _command(entry):
    """The command of an entry point; one whose module fails says so in the help, and when it is used."""
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    try:
        function = entry.load()
    except Exception as problem:  # of another package: it must not take the other commands with it
        function = _failed(entry, problem)
    app.command(entry.name)(function)
    return typer.main.get_command(app)


def _failed(entry, problem):
    message = f"gush {entry.name}: '{entry.value}' fails with {type(problem).__name__}: {problem}; correct or remove it"

    def failed():
        complain(message, REFUSED)

    failed.__doc__ = f"Not available: '{entry.value}' fails with {type(problem).__name__}."
    return failed
