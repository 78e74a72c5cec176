"""What the command line says when something goes wrong, and its JSON output.

Exit codes: 0 done, 1 rerun differs, 2 refused input, 3 run failed, 130 interrupted.
"""

import contextlib
import json
import math
import sys
import warnings
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from coupling.refused import Refused

DIFFERENT, REFUSED, FAILED, INTERRUPTED = 1, 2, 3, 130
JsonPath = Annotated[Path | None, typer.Option("--json", help="Also write the result as JSON; - prints it.")]


def exit_code(error):
    """2 for refused input, 3 for a failed run, None for what is a mistake of the program."""
    from mpm.mesh import MeshError
    from mpm.solver import RunFailed
    from structure import InputError, LiningFailure

    if isinstance(error, InputError | MeshError | MemoryError):
        return REFUSED
    if isinstance(error, RunFailed | LiningFailure):
        return FAILED
    # what reaches here as OSError is a full disk or a missing right, found while writing
    return FAILED if isinstance(error, OSError) else None


@contextlib.contextmanager
def answering(json_path):
    """A command from its checks to its result: what goes wrong becomes a message and an exit code.

    Gives a function that takes the result, writes it as JSON where that is asked for, and says whether to print it for
    people, too.
    """

    def answer(data):
        write_json(json_path, data)
        return str(json_path) != "-"

    try:
        check_json(json_path)
        with told_warnings():
            yield answer
    except KeyboardInterrupt as interrupt:
        by = f" by {interrupt}" if str(interrupt) else ""
        complain("\n".join([f"interrupted{by}", *getattr(interrupt, "__notes__", ())]), INTERRUPTED)
    except (ValueError, RuntimeError, MemoryError, OSError) as error:
        code = exit_code(error)
        if code is None:
            raise
        complain("\n".join([str(error) or "not enough memory", *getattr(error, "__notes__", ())]), code)


def check_json(path):
    """Refuse a --json path before the work instead of after it."""
    if path is None or str(path) == "-":
        return
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise Refused(f"--json '{path}': must be a file in an existing folder; choose another path")
    if path.exists():
        with path.open("rb") as file:
            if file.read(1) not in (b"{", b""):
                raise Refused(f"--json '{path}': exists and is not JSON; choose another path")


def write_json(path, data):
    """Write a result as JSON to a file, to standard output for "-", nowhere for None."""
    if path is None:
        return
    text = json.dumps(finite(data), indent=2, allow_nan=False) + "\n"
    if str(path) == "-":
        sys.stdout.write(text)
    else:
        path.write_text(text, encoding="utf-8")


def finite(value):
    """A result with null for what is no finite number: JSON has no other word for it."""
    if isinstance(value, dict):
        return {key: finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def plain(text):
    """A text without characters that steer a terminal: names in it may come from a file of unknown origin."""
    return "".join(c if c.isprintable() or c in "\n\t" else f"\\x{ord(c):02x}" for c in str(text))


def complain(message, code):
    """Print a message to standard error and leave with an exit code."""
    Console(stderr=True).print(plain(message), style="red", markup=False, highlight=False, soft_wrap=True)
    raise typer.Exit(code)


@contextlib.contextmanager
def told_warnings():
    """Print what Python warns of in the block as the program's own warnings, each once."""
    told = set()

    def show(message, *_, **__):
        if str(message) not in told:
            told.add(str(message))
            warn(message)

    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = show
        yield


def warn(message):
    """Print a warning to standard error."""
    text = plain(f"warning: {message}")
    Console(stderr=True).print(text, style="yellow", markup=False, highlight=False, soft_wrap=True)


def say(text):
    """Print a line of a result."""
    Console().print(text, highlight=False, soft_wrap=True, markup=False)
