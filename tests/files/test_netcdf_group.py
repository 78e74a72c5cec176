"""A group read at once is what xarray gives for it, also where a writer was stopped in the middle of a batch."""

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray as xr

import coupling
from coupling.datasets.group import read_group_at_once
from verification.synthetic_run import write_run


@pytest.fixture(scope="module")
def torn(tmp_path_factory):
    """A group whose variables have three, two and one rows, times last, and texts."""
    path = tmp_path_factory.mktemp("torn") / "torn.nc"
    with h5netcdf.File(path, "w") as file:
        group = file.create_group("inner")
        group.dimensions = {"time": None, "theta": 4, "corner": 3}
        group.attrs["title"] = "torn"
        pressure = group.create_variable("pressure", ("time", "theta"), "f4", fillvalue=np.float32(np.nan))
        count = group.create_variable("count", ("time",), "i8", fillvalue=-1)
        time = group.create_variable("time", ("time",), "f8", fillvalue=np.nan)
        angle = group.create_variable("theta", ("theta",), "f8")
        group.create_variable("names", ("theta",), h5py.string_dtype())[:] = np.array(list("abcd"), object)
        angle[:] = [0.0, 90.0, 180.0, 270.0]
        angle.attrs["units"] = "degree"
        count.attrs["coordinates"] = "names"
        group.resize_dimension("time", 3)
        pressure[:] = np.arange(12.0).reshape(3, 4)
        count[:2] = [5, 6]
        time[:1] = [0.5]
    return path


def test_a_torn_group_is_read_as_by_xarray(torn):
    mine = read_group_at_once(torn, "inner")
    with xr.open_dataset(torn, group="inner", engine="h5netcdf", decode_times=False) as theirs:
        xr.testing.assert_identical(mine, theirs.load())
    for name in ("pressure", "count", "time", "theta"):
        assert mine[name].dtype == theirs[name].dtype
    assert list(mine.variables) == list(theirs.variables)


@pytest.mark.parametrize("row", [0, 2])
def test_one_record_is_that_of_the_whole(torn, row):
    one = read_group_at_once(torn, "inner", lambda time: row)
    xr.testing.assert_identical(one, read_group_at_once(torn, "inner").isel(time=row))


@pytest.mark.slow
def test_every_group_of_a_run_is_read_as_by_xarray(tmp_path):
    run = write_run(tmp_path / "run.nc", times=(0.0, 0.5), models=("beam-spring",))
    tree = coupling.read_run(run)
    groups = [node.path for node in tree.subtree if node.has_data]
    assert {"/lining", "/history", "/points", "/mesh", "/structure/beam_spring"} == set(groups)
    for group in groups:
        with xr.open_dataset(run, group=group, engine="h5netcdf", decode_times=False) as theirs:
            xr.testing.assert_identical(read_group_at_once(run, group), theirs.load())


def test_dimensions_of_the_group_above_and_attributes_of_all_kinds_are_read_as_by_xarray(tmp_path):
    path = tmp_path / "kinds.nc"
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {"time": None, "joint": 2, "alone": 3}
        group = file.create_group("inner")
        group.create_variable("opening", ("time", "joint"), "f8", fillvalue=-9.0)
        group.create_variable("count", (), "i4")[...] = 7
        file.resize_dimension("time", 2)
        group["opening"][:] = [[1.0, 2.0], [3.0, -9.0]]
        kinds = {"one": np.array([2.5]), "two": np.array([1, 2]), "words": ["a", "b"], "word": ["a"], "none": ""}
        group.attrs.update(kinds)
        group["opening"].attrs.update({**kinds, "fixed": np.bytes_("metre")})
    for name in (None, "inner"):
        with xr.open_dataset(path, group=name, engine="h5netcdf", decode_times=False) as theirs:
            xr.testing.assert_identical(read_group_at_once(path, name), theirs.load())


def test_a_variable_without_dimensions_for_its_axes_is_refused(tmp_path):
    with h5py.File(tmp_path / "bare.nc", "w") as file:
        file["pressure"] = [1.0, 2.0]
    with pytest.raises(ValueError, match="pressure"):
        read_group_at_once(tmp_path / "bare.nc")
