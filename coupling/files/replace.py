"""Files that are replaced as a whole or not at all, whatever stops the program or the machine."""

import contextlib
import os
from pathlib import Path


def synchronise(folder):
    """Make new, renamed and removed names in a folder last."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def replace_file(path, data):
    """Write bytes to a file beside `path`, make them last, and put it in the place of `path` in one go."""
    path = Path(path)
    beside = path.with_name(f"{path.name}.tmp")
    try:
        with open(beside, "wb") as file:
            for part in [data] if isinstance(data, bytes | memoryview) else data:
                file.write(part)
        put_in_place(beside, path)
    except OSError:
        with contextlib.suppress(OSError):
            beside.unlink()
        raise


def put_in_place(beside, path):
    """Make a new file last, and put it in the place of `path` in one go."""
    with open(beside, "rb") as file:
        os.fsync(file.fileno())
    os.replace(beside, path)
    synchronise(Path(path).parent)
