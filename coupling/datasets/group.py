"""One group of a netCDF-4 file, in memory, as xarray gives it, with every length looked up once.

Whenever h5netcdf is asked for the length of an unlimited dimension it looks at all variables that have it, so that
opening a group of n variables through xarray takes n² look-ups: seconds for the history of a run. So it is asked here
for dimensions and attributes only, and values and their lengths are read by h5py.
"""

import contextlib

import h5netcdf
import h5py
import numpy as np
import xarray as xr

NO_COORDINATE = "_nc4_non_coord_"  # netCDF's prefix of a variable that is called as a dimension, but is not that one


def read_group_at_once(file, group=None, choose=None):
    """Variables, coordinates and attributes of one group.

    file : path, file object, or h5py.File that is open;
    group : str or None, None: the root;
    choose : callable or None, takes the values of `time` (n,) [s] and returns the indices that are read: an array, or
        one number, which drops the dimension. None: all. Called only where the group has `time`.

    Returns xarray.Dataset: decoded by CF but for times. Variables that end early on an unlimited dimension are
    continued by their fill value.

    Raises KeyError: no such group; OSError, RuntimeError, ValueError, AttributeError: from the libraries, for a damaged
    file.
    """
    variables, lengths = {}, {}
    opened = contextlib.nullcontext(file) if isinstance(file, h5py.File) else h5py.File(file, "r")
    with opened as content, h5netcdf.File(content, "r") as described:
        own = described[group] if group else described
        held = content[own.name]
        stored = {name: held.get(f"{NO_COORDINATE}{name}") or held[name] for name in own.variables}
        dimensions = {name: variable.dimensions for name, variable in own.variables.items()}
        for name, entry in stored.items():
            for dimension, length in zip(dimensions[name], entry.shape, strict=True):
                lengths[dimension] = max(lengths.get(dimension, 0), length)
        rows = None
        if choose is not None and dimensions.get("time") == ("time",):
            rows = choose(_padded(stored["time"], stored["time"][()], (lengths["time"],)))
        for name, variable in own.variables.items():
            variables[name] = _variable(stored[name], dimensions[name], dict(variable.attrs), lengths, rows)
        attributes = dict(own.attrs)
    dataset = xr.decode_cf(xr.Dataset(variables, attrs=attributes), decode_times=False)
    return dataset.set_coords("time") if isinstance(rows, int) else dataset


def _variable(stored, dimensions, attributes, lengths, rows):
    source = stored.asstr() if h5py.check_string_dtype(stored.dtype) else stored
    shape = tuple(lengths[dimension] for dimension in dimensions)
    if rows is None or dimensions[:1] != ("time",):
        return xr.Variable(dimensions, _padded(stored, source[()], shape), attributes)
    if isinstance(rows, int):
        # one record of many: the others are not read
        there = rows < stored.shape[0]
        values = np.asarray(source[rows]) if there else np.full(stored.shape[1:], stored.fillvalue, stored.dtype)
        return xr.Variable(dimensions[1:], _padded(stored, values, shape[1:]), attributes)
    return xr.Variable(dimensions, _padded(stored, source[()], shape)[rows], attributes)


def _padded(stored, values, shape):
    if np.shape(values) == shape:
        return values
    missing = [(0, whole - there) for whole, there in zip(shape, np.shape(values), strict=True)]
    return np.pad(values, missing, constant_values=stored.fillvalue)
