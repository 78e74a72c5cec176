"""What is added to a run file that is there: attributes and responses; and datasets as files of their own."""

from __future__ import annotations

import contextlib
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coupling.datasets.damage import damage_named
from coupling.datasets.schema import structure_group
from coupling.files.journal import changed, recover
from coupling.files.provenance import with_history
from coupling.files.replace import put_in_place

if TYPE_CHECKING:
    from collections.abc import Iterator

    import h5netcdf
    import xarray as xr


#: HDF5 format with checksums on its structure, read by netCDF-C too; those of the data are asked for by each variable.
CHECKED_FORMAT = ("v110", "v110")


def write_attributes(path: str | Path, **attributes: Any) -> None:
    """Set root attributes of a run file."""
    with append_to(path) as file:
        for name, value in attributes.items():
            file.attrs[name] = value


def write_response(
    path: str | Path, response: xr.Dataset, model: str = "beam-spring", tunnel: int | None = None
) -> None:
    """Write the response of a lining model to its :func:`structure_group`, in place of an earlier one, as a whole."""
    import h5py

    group = structure_group(model, tunnel)
    response = response.assign_attrs(model=model)
    path = Path(path).resolve()
    recover(path)
    beside = path.with_name(f"{path.name}.tmp")
    try:
        shutil.copy(path, beside)
        with damage_named(path):
            with h5py.File(beside, "a", locking=False, libver=CHECKED_FORMAT) as file:
                for name in (group, group.partition("/")[0] + f"/{model}"):  # the latter in files of earlier versions
                    if name in file:
                        del file[name]
            write_dataset(beside, response, group)
        put_in_place(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def write_dataset(path: str | Path, dataset: xr.Dataset, group: str | None = None) -> None:
    """Write a dataset with checksums: into a new file, or as a group more into one whose history gets a line."""
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    mode, options = "w" if group is None else "a", {"driver_kwds": {"libver": CHECKED_FORMAT}}
    # CF knows no missing coordinates, and a missing value is NaN here without being told
    encoding = {
        name: {"fletcher32": variable.ndim > 0, "_FillValue": None} for name, variable in dataset.variables.items()
    }
    if "time" in dataset.coords:
        dataset = dataset.assign_coords(time=dataset["time"].copy())
        dataset["time"].attrs.pop("axis", None)
    with H5NetCDFStore.open(path, mode=mode, group=group, **options) as store:
        dataset.dump_to_store(store, encoding=encoding)
    if group is not None:
        with h5netcdf.File(path, "r+", libver=CHECKED_FORMAT) as file:
            file.attrs["history"] = with_history(file.attrs.get("history", ""), f"/{group} computed")


@contextlib.contextmanager
def append_to(path: str | Path) -> Iterator[h5netcdf.File]:
    """The run file, open for changes that happen as a whole."""
    import h5netcdf

    with damage_named(path), changed(path) as whole, h5netcdf.File(whole, "r+", libver=CHECKED_FORMAT) as file:
        yield file
