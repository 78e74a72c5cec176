"""A run file that is open for reading: all that is asked of it costs one opening, and a group is read once."""

import contextlib
import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.datasets.damage import damage_told, require_own_content
from coupling.datasets.group import read_group_at_once
from coupling.datasets.schema import AXES, INFLOW
from coupling.files.folder import RUN_FILE, how_to_go_on, in_use
from coupling.files.journal import readable
from coupling.refused import RunFileError


def run_file(path: str | Path) -> Path:
    """The run file for a run folder or a file; raises `RunFileError` when there is none."""
    path = Path(path)
    file = path / RUN_FILE if path.is_dir() else path
    if not file.is_file():
        what = f"{RUN_FILE} in it" if path.is_dir() else "such file or folder"
        raise RunFileError(f"run '{path}': there is no {what}; give the folder that `gush run` wrote")
    return file


class OpenRun:
    """A run file between opening and closing, see :func:`opened`.

    Parameters
    ----------
    path : path
        The file.
    content : h5py.File
        The same, open.
    """

    def __init__(self, path: Path, content: h5py.File):
        self.path, self._content = path, content
        self._read: dict[tuple[str | None, int | None], xr.Dataset] = {}

    def names(self) -> list[str]:
        """Names of the groups, responses by their lining models in their order."""
        with damage_told(self.path):
            answered = [name for name in self._content if name.startswith("structure")]
            names = [n for n, entry in self._content.items() if n not in answered and isinstance(entry, h5py.Group)]
        return names + [group for home in answered for group in self.models(home).values()]

    def models(self, home: str = "structure") -> dict[str, str]:
        """Names of the lining models that answered, in their order, and their groups."""
        from structure.models import in_order

        with damage_told(self.path):
            there = self._content[home] if home in self._content else {}
            models = {str(entry.attrs.get("model", key)): f"{home}/{key}" for key, entry in there.items()}
        return {model: models[model] for model in in_order(models)}

    def size(self, group: str, dimension: str) -> int | None:
        """Length of a dimension, None without the group."""
        with damage_told(self.path):
            return int(self._content[group][dimension].shape[0]) if group in self._content else None

    def group(self, name: str | None, row: int | None = None) -> xr.Dataset:
        """One group (None: the root), or one of its records, see :func:`coupling.datasets.read_group`."""
        if (name, row) not in self._read:
            with damage_told(self.path, name):
                self._read[name, row] = self._loaded(name, row)
        return self._read[name, row].copy()

    def arrays(self, name: str) -> dict[str, NDArray[Any]]:
        """Arrays of a group as they lie in the file, complete records only."""
        with damage_told(self.path):
            own = self._content[name] if name in self._content else {}
            complete = np.isfinite(own["time"][()]) if "time" in own else None
            # a scale without values stands for a dimension only
            own = {key: data for key, data in own.items() if b"not a netCDF" not in data.attrs.get("NAME", b"")}
            return {key: data[()][complete] if data.maxshape[:1] == (None,) else data[()] for key, data in own.items()}

    def _loaded(self, name, row):
        def complete(time):
            # a batch cut short by a kill has no time yet: it was written last; no run has records in its root
            rows = np.arange(len(time)) if name is None else np.flatnonzero(np.isfinite(time))
            if row is None:
                return rows
            if not len(rows):
                raise RunFileError(f"run file '{self.path}': group '{name}' has no complete record yet")
            return int(rows[row])

        dataset = read_group_at_once(self._content, name, complete)
        if "scene_sha256" in dataset.attrs:
            _check_scene(self.path, dataset.attrs)
        return _with_true_status(self.path, _as_used(dataset))


Run = str | Path | OpenRun


@contextlib.contextmanager
def opened(run: Run) -> Iterator[OpenRun]:
    """A run open for reading, complete also where a kill left its last change in the journal.

    run : path of a run's folder or file; or what this gave before, which stays open.

    Raises
    ------
    RunFileError
        Missing, not netCDF, truncated, or with content of other files.
    """
    if isinstance(run, OpenRun):
        yield run
        return
    file = run_file(run)
    with contextlib.ExitStack() as closing:
        with damage_told(file):
            shown = readable(file)
            if not isinstance(shown, Path):
                closing.enter_context(shown)
            content = closing.enter_context(h5py.File(shown, "r"))
            require_own_content(file, content)
        yield OpenRun(file, content)


def _as_used(dataset):
    """Coordinates as such, also of files of earlier versions, and no bounds of cells."""
    bounds = [variable.attrs.pop("bounds") for variable in dataset.coords.values() if "bounds" in variable.attrs]
    dataset = dataset.drop_vars([name for name in bounds if name in dataset])
    # not in the file, where CF asks a time axis for a date and space for latitudes; these are elapsed time and metres
    for name, axis in AXES.items():
        if name in dataset.coords:
            dataset[name].attrs["axis"] = axis
    if INFLOW in dataset and "time" in dataset.coords and dataset[INFLOW].dims == dataset["time"].dims:
        dataset = dataset.set_coords(INFLOW)
    return dataset


def _with_true_status(file, dataset):
    """The root's status, which a process that was killed could not correct any more."""
    if dataset.attrs.get("status") != "running" or in_use(file.parent):
        return dataset
    go_on = f"; continue with: {how_to_go_on(file.parent)}" if file.name == RUN_FILE else ""
    return dataset.assign_attrs(status="interrupted", status_message=f"its process is gone{go_on}")


def _check_scene(file, attributes):
    # texts are the one thing that HDF5 keeps without a checksum
    if hashlib.sha256(str(attributes.get("scene", "")).encode()).hexdigest() != attributes["scene_sha256"]:
        raise RunFileError(
            f"run file '{file}': damaged, its scene does not match scene_sha256; copy it again or repeat the run"
        )
