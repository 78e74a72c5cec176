"""Readers of run files, in memory, with clear errors."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from coupling.datasets.damage import why_unreadable
from coupling.datasets.group import read_group_at_once
from coupling.datasets.schema import AXES, INFLOW, identifier, structure_group
from coupling.files.folder import RUN_FILE, how_to_go_on, in_use
from coupling.files.journal import readable
from coupling.files.own_content import require_own_content
from coupling.refused import RunFileError

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray


def run_file(path: str | Path) -> Path:
    """The run file for a run folder or a file; raises `RunFileError` when there is none."""
    path = Path(path)
    file = path / "run.nc" if path.is_dir() else path
    if not file.is_file():
        raise RunFileError(f"run '{path}': there is no {'run.nc in it' if path.is_dir() else 'such file or folder'}; "
                           "give the folder that `gush run` wrote")  # fmt: skip
    return file


def read_run(path: str | Path) -> xr.DataTree:
    """All groups of a run as an `xarray.DataTree`, in memory; groups as in the module's description."""
    import xarray as xr

    file = run_file(path)
    try:
        names = _group_names(file)
    except Exception as error:
        raise RunFileError(why_unreadable(file, None, error)) from error
    shown = {name: "/".join(map(identifier, name.split("/"))) for name in names}
    return xr.DataTree.from_dict({"/": _read(file, None), **{f"/{shown[name]}": _read(file, name) for name in names}})


def _group_names(file):
    import h5netcdf

    from structure.models import in_order

    with _shown(file) as shown, h5netcdf.File(shown, "r") as content:
        answered = [name for name in content.groups if name.startswith("structure")]
        names = [name for name in content.groups if name not in answered]
        for name in answered:
            models = {str(group.attrs.get("model", key)): key for key, group in content[name].groups.items()}
            names += [f"{name}/{models[model]}" for model in in_order(models)]
        return names


def stored_title(path: str | Path) -> str:
    """Title of a netCDF-4 file, by which its kind is known; empty where there is no such file or it has none."""
    try:
        return str(_read(Path(path), None).attrs.get("title", ""))
    except RunFileError:
        return ""


def read_attributes(path: str | Path) -> dict[str, Any]:
    """Root attributes of a run: provenance, scene text, status ('interrupted' also where its process was killed)."""
    return dict(_read(run_file(path), None).attrs)


def read_pressures(path: str | Path) -> xr.Dataset:
    """Pressures on the lining through time: `/lining`, in memory.

    Returns
    -------
    xarray.Dataset
        soil_pressure, water_pressure, soil_shear and spreads (time, [tunnel,] theta) [Pa]; inflow_mass [kg/m],
        flow_zone_area and disturbed_area [m2] on time.

    Raises
    ------
    RunFileError
        When the file is missing, not netCDF, truncated, or not a run.
    """
    return read_group(path, "lining")


def read_history(path: str | Path) -> xr.Dataset:
    """Inflow, zones, balances and time step through time: `/history`, in memory."""
    return read_group(path, "history")


def read_points(path: str | Path, snapshot: int | None = None) -> xr.Dataset:
    """Snapshots of all points: `/points`, in memory; one of them when its number is given (-1: the last)."""
    return read_group(path, "points", snapshot)


def raw_groups(
    path: str | Path, groups: Sequence[str] = ("mesh", "history", "lining", "points")
) -> dict[str, dict[str, NDArray[Any]]]:
    """Arrays of a run file as they lie in it, complete records only: group to name to array.

    Raises
    ------
    RunFileError
        As :func:`read_pressures`.
    """
    import h5py

    file, arrays = run_file(path), {}
    try:
        with _shown(file) as shown, h5py.File(shown, "r") as content:
            for group in groups:
                own = content[group] if group in content else {}
                complete = np.isfinite(own["time"][()]) if "time" in own else None
                # a scale without values stands for a dimension only
                own = {name: data for name, data in own.items() if b"not a netCDF" not in data.attrs.get("NAME", b"")}
                arrays[group] = {
                    name: data[()][complete] if data.maxshape[:1] == (None,) else data[()] for name, data in own.items()
                }
    except Exception as error:
        raise RunFileError(why_unreadable(file, None, error)) from error
    return arrays


def read_mesh(path: str | Path) -> xr.Dataset:
    """The mesh: `/mesh`, in memory."""
    return read_group(path, "mesh")


def read_response(path: str | Path, model: str = "beam-spring", tunnel: int | None = None) -> xr.Dataset:
    """The response of the lining of the tunnel with the gate, or of another `tunnel` by its number, in memory.

    It is at the angles of the pressures; what an earlier version stored between them is interpolated.
    """
    from structure.lining import at_whole_degrees

    group, file = structure_group(model, tunnel), run_file(path)
    with contextlib.suppress(Exception):  # what cannot be read is told below
        before = f"{group.partition('/')[0]}/{model}"
        group = before if before in _group_names(file) else group
    return at_whole_degrees(read_group(file, group))


def read_group(path: str | Path, group: str | None, row: int | None = None) -> xr.Dataset:
    """One group of a run file, in memory, with complete records only; `row` picks one of them.

    `inflow_mass` is a coordinate along `time`. Bounds of cells stay in the file: their dimension would repeat every
    row of `to_dataframe`; ``ds.cf.add_bounds("theta")`` of cf_xarray gives them again.
    """
    return _read(run_file(path), group, row)


def _read(file, group, row=None):
    def complete(time):
        # a batch cut short by a kill has no time yet: it was written last; no run has records in its root
        rows = np.arange(len(time)) if group is None else np.flatnonzero(np.isfinite(time))
        if row is None:
            return rows
        if not len(rows):
            raise RunFileError(f"run file '{file}': group '{group}' has no complete record yet")
        return int(rows[row])

    try:
        with _shown(file) as shown:
            dataset = read_group_at_once(shown, group, complete)
        if "scene_sha256" in dataset.attrs:
            _check_scene(file, dataset.attrs)
        return _with_true_status(file, _as_used(dataset))
    except RunFileError:
        raise
    except Exception as error:
        raise RunFileError(why_unreadable(file, group, error)) from error


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


@contextlib.contextmanager
def _shown(file):
    """The file, complete also where a kill left its last change in the journal."""
    shown = readable(file)
    try:
        require_own_content(shown)
        if not isinstance(shown, Path):
            shown.seek(0)
        yield shown
    finally:
        if not isinstance(shown, Path):
            shown.close()
