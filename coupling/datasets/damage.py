"""What is wrong with a run file that cannot be used, in words; content of other files is refused before it is read."""

import contextlib
import os
from pathlib import Path

import h5py

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
    if "truncated" in str(error) or "eof" in str(error).lower():
        return (
            f"run file '{file}': truncated, its end is missing ({size} bytes are left); copy it again or repeat the run"
        )
    if group is not None and ("group not found" in str(error).lower() or isinstance(error, KeyError)):
        return f"run file '{file}': has no group '/{group}'; " + (
            "run `gush respond` first" if group.startswith("structure") else "it is not a run file, or it is damaged"
        )
    return f"run file '{file}': damaged ({type(error).__name__}: {said}); copy it again or repeat the run"


def require_own_content(file, group):
    """Refuse external links, external storage and virtual datasets; a damaged file raises what the library raises.

    file : path, for the message;  group : h5py.File or h5py.Group, open; nothing of it has been read yet.

    Raises RunFileError; OSError, KeyError, RuntimeError, ValueError: from the library.
    """
    for name in group:
        link = group.get(name, getlink=True)
        entry = group[name] if isinstance(link, h5py.HardLink) else None
        foreign = ""
        if isinstance(link, h5py.ExternalLink):
            foreign = f"'{group.name}/{name}' is a link into the file '{link.filename}'"
        elif isinstance(link, h5py.SoftLink):
            foreign = f"'{group.name}/{name}' is a link to '{link.path}'"  # nothing here writes one
        elif isinstance(entry, h5py.Group):
            require_own_content(file, entry)
        elif isinstance(entry, h5py.Dataset) and (entry.external or entry.is_virtual):
            foreign = f"'{entry.name}' has its values in other files"
        if foreign:
            raise RunFileError(
                f"run file '{file}': must hold its own content, {foreign}; give the file that `gush run` wrote"
            )
