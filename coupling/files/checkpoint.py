"""Checkpoints of a run: one HDF5 file each, checked by a hash over its bytes, the last two kept.

A file starts with a line of text, ``gush checkpoint 1 sha256 HEX``, in an HDF5 user block of 512 bytes; the hash is
that of all bytes behind it, so that damage is found before the HDF5 library reads any of it.
"""

import hashlib
import io
import json
from pathlib import Path

import h5py
import numpy as np

from coupling.files.replace import replace_file

KEPT = 2
BLOCK = 512
TITLE = "gush checkpoint 1 sha256 "
PATTERN = "checkpoint-*.h5"


class CheckpointDamaged(ValueError):
    """A checkpoint whose bytes are not those that were written."""


def write_checkpoint(folder, state, about):
    """Write the state of a simulation; nothing older is given up before it lies safely on the disk.

    folder : path;  state : dict of str to array, float, int, bool or str, from :meth:`mpm.Simulation.state`;
    about : dict, what JSON can hold: how to recognise the run, and how far its files are.

    Returns path: ``checkpoint-STEPS.h5``.
    """
    image = io.BytesIO()
    with h5py.File(image, "w", userblock_size=BLOCK) as file:
        file.attrs["about"] = json.dumps(about)
        for name, value in state.items():
            if isinstance(value, np.ndarray):
                file.create_dataset(name, data=value)
            else:
                file.attrs[name] = value
    body = image.getbuffer()[BLOCK:]
    title = f"{TITLE}{hashlib.sha256(body).hexdigest()}\n".encode().ljust(BLOCK, b"\0")
    path = Path(folder) / f"checkpoint-{int(state['step_count']):010d}.h5"
    replace_file(path, title, body)
    for old in checkpoints(folder)[KEPT:]:
        old.unlink(missing_ok=True)
    return path


def checkpoints(folder):
    """Paths of the checkpoints in a folder, the last one first."""
    return sorted(Path(folder).glob(PATTERN), reverse=True)


def read_checkpoint(path):
    """State and `about` of a checkpoint.

    Raises CheckpointDamaged: truncated, changed, or no checkpoint at all.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise CheckpointDamaged(f"checkpoint '{path}': cannot be read: {error.strerror}") from error
    title = content[:BLOCK].rstrip(b"\0").decode(errors="replace")
    if not title.startswith(TITLE):
        raise CheckpointDamaged(f"checkpoint '{path}': damaged, its first line is not that of a checkpoint")
    if hashlib.sha256(memoryview(content)[BLOCK:]).hexdigest() != title.removeprefix(TITLE).strip():
        raise CheckpointDamaged(f"checkpoint '{path}': damaged, its content does not match its checksum")
    with h5py.File(io.BytesIO(content), "r") as file:
        state = {name: dataset[()] for name, dataset in file.items()} | dict(file.attrs)
    return state, json.loads(state.pop("about"))


def last_checkpoint(folder, records, warn):
    """The last checkpoint of a folder that is whole and fits to the run file; damaged ones are set aside.

    folder : path;  records : int, records in the run file: a checkpoint that builds on more of them is of no use;
    warn : callable, called with a message about each one left out.

    Returns state, about : dict or None, None where there is none.
    """
    for path in checkpoints(folder):
        try:
            state, about = read_checkpoint(path)
        except CheckpointDamaged as damage:
            warn(f"{damage}; it is set aside and the one before it used")
            path.rename(path.with_name(f"{path.name}.damaged"))
            continue
        if about["records"] <= records:
            return state, about
        warn(f"checkpoint '{path}': follows {about['records']} records, the run file holds {records}; not used")
        path.rename(path.with_name(f"{path.name}.unused"))
    return None, None


def remove_checkpoints(folder):
    """Take all checkpoints of a folder away, half-written and damaged ones included."""
    for path in Path(folder).glob(f"{PATTERN}*"):
        path.unlink(missing_ok=True)
