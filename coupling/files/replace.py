"""Files that are replaced as a whole or not at all, whatever stops the program or the machine."""

import contextlib
import os
from pathlib import Path


@contextlib.contextmanager
def replaced(path, lasting=True):
    """Yield the path of a new file beside `path`, which takes its place in one go when the block ends.

    An exception inside leaves `path` as it was, and nothing beside it. `lasting`: also safe from a power cut.
    """
    path = Path(path)
    beside = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        yield beside
        if lasting:
            with open(beside, "rb") as file:
                os.fsync(file.fileno())
        os.replace(beside, path)
        if lasting:
            synchronise(path.parent)
    finally:
        with contextlib.suppress(OSError):
            beside.unlink()


def replace_file(path, *parts, lasting=True):
    """Put a file of these bytes or texts in the place of `path`, see :func:`replaced`."""
    with replaced(path, lasting) as beside:
        with open(beside, "wb") as file:
            for part in parts:
                file.write(part.encode() if isinstance(part, str) else part)


def synchronise(folder):
    """Make new, renamed and removed names in a folder last."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
