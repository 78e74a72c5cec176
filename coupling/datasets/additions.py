"""What is added to a run file that is there: attributes and responses; and datasets as files of their own."""

import contextlib
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import xarray as xr

from coupling.datasets.damage import damage_told
from coupling.datasets.schema import structure_group
from coupling.files.journal import changed, recover
from coupling.files.provenance import with_history
from coupling.files.replace import replaced

#: HDF5 format with checksums on its structure, read by netCDF-C too; those of the data are asked for by each variable.
CHECKED_FORMAT = ("v110", "v110")
#: Of a file that is open: groups and variables keep their order, which netCDF-C asks for.
CHECKED = {"libver": CHECKED_FORMAT, "track_order": True}


def write_attributes(path: str | Path, **attributes: Any) -> None:
    """Set root attributes of a run file."""
    with append_to(path) as (file, _):
        for name, value in attributes.items():
            file.attrs[name] = value


def write_response(
    path: str | Path, response: xr.Dataset, model: str = "beam-spring", tunnel: int | None = None
) -> None:
    """Write the response of a lining model to its :func:`structure_group`, in place of an earlier one, as a whole."""
    write_responses(path, {(model, tunnel): response})


def write_responses(
    path: str | Path, responses: Mapping[tuple[str, int | None], xr.Dataset], **attributes: Any
) -> None:
    """Write responses by lining model and tunnel, and root attributes with them, as a whole: all of them or none."""
    path = Path(path).resolve()
    recover(path)
    with replaced(path) as beside, damage_told(path, writing=True):
        shutil.copy(path, beside)
        with h5py.File(beside, "r+", locking=False, **CHECKED) as content:
            for (model, tunnel), response in responses.items():
                group = structure_group(model, tunnel)
                for name in (group, group.partition("/")[0] + f"/{model}"):  # the latter in files of earlier versions
                    if name in content:
                        del content[name]
                with h5netcdf.File(content, "r+") as file:
                    _dump(response.assign_attrs(model=model), file, group)
                    file.attrs["history"] = with_history(file.attrs.get("history", ""), f"/{group} computed")
                    file.attrs.update(attributes)


def write_dataset(path: str | Path, dataset: xr.Dataset) -> None:
    """Write a dataset with checksums into a file of its own."""
    with h5netcdf.File(path, "w", libver=CHECKED_FORMAT) as file:
        _dump(dataset, file, None)


def _dump(dataset, file, group):
    from xarray.backends import H5NetCDFStore

    # CF knows no missing coordinates, and a missing value is NaN here without being told
    encoding = {
        name: {"fletcher32": variable.ndim > 0 and variable.dtype.kind not in "OSU", "_FillValue": None}
        for name, variable in dataset.variables.items()
    }
    if "time" in dataset.coords:
        dataset = dataset.assign_coords(time=dataset["time"].copy())
        dataset["time"].attrs.pop("axis", None)
    place = file if group is None else file.create_group(group)
    dataset.dump_to_store(H5NetCDFStore(place, mode="a"), encoding=encoding)


@contextlib.contextmanager
def append_to(path: str | Path) -> Iterator[tuple[h5netcdf.File, h5py.File]]:
    """The run file, open for changes that happen as a whole, and the HDF5 file that it is, to read what it holds."""
    with (
        damage_told(path, writing=True),
        changed(path) as whole,
        h5py.File(whole, "r+", **CHECKED) as content,
        h5netcdf.File(content, "r+") as file,
    ):
        yield file, content
