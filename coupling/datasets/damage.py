"""What is wrong with a run file that cannot be used, in words."""

import contextlib
import os
from pathlib import Path

from coupling.files.own_content import ForeignContent
from coupling.refused import RunFileError


@contextlib.contextmanager
def damage_told(file, group=None, writing=False):
    """Turn what the libraries raise in a damaged file, or in one group of it, into a message.

    writing : bool, leave what is no damage as it is: a full disk, a missing right, a mistake of the program.
    """
    try:
        yield
    except RunFileError:
        raise
    except Exception as error:
        damaged = isinstance(error, OSError | RuntimeError | KeyError) and getattr(error, "errno", None) is None
        if writing and not damaged:
            raise
        raise RunFileError(_why_unreadable(Path(file), group, error)) from error


def _why_unreadable(file, group, error):
    # a library's message may quote what it met in the file
    said = "".join(c if c.isprintable() else "?" for c in str(error))[:200]
    try:
        size = os.path.getsize(file)
        with open(file, "rb") as stream:
            signature = stream.read(8)
    except OSError as reason:
        return f"run file '{file}': cannot be read: {reason.strerror}; check its permissions"
    if signature != b"\x89HDF\r\n\x1a\n":
        return f"run file '{file}': not a netCDF-4 file ({size} bytes); give the run.nc that `gush run` wrote"
    if isinstance(error, ForeignContent):
        return f"run file '{file}': must hold its own content, {error}; give the file that `gush run` wrote"
    if "truncated" in str(error) or "eof" in str(error).lower():
        return (
            f"run file '{file}': truncated, its end is missing ({size} bytes are left); copy it again or repeat the run"
        )
    if group is not None and ("group not found" in str(error).lower() or isinstance(error, KeyError)):
        return f"run file '{file}': has no group '/{group}'; " + (
            "run `gush respond` first" if group.startswith("structure") else "it is not a run file, or it is damaged"
        )
    return f"run file '{file}': damaged ({type(error).__name__}: {said}); copy it again or repeat the run"
