"""One group of a netCDF-4 file, in memory, as xarray gives it, with every length looked up once.

Whenever h5netcdf is asked for the length of an unlimited dimension it looks at all variables that have it, so that
opening a group of n variables through xarray takes n² look-ups: seconds for the history of a run.
"""

import contextlib

import h5netcdf
import h5py
import numpy as np
import xarray as xr


def read_group_at_once(file, group=None, choose=None):
    """Variables, coordinates and attributes of one group.

    Parameters
    ----------
    file : path, file object, or h5py.File that is open
    group : str or None
        None: the root.
    choose : callable or None
        Takes the values of `time` (n,) [s] and returns the indices that are read: an array, or one number, which drops
        the dimension. None: all. Called only where the group has `time`.

    Returns
    -------
    xarray.Dataset
        Decoded by CF but for times. Variables that end early on an unlimited dimension are continued by their fill
        value.

    Raises KeyError: no such group; OSError, RuntimeError, ValueError, AttributeError: from the libraries, for a damaged
    file.
    """
    variables = {}
    with _opened(file) as content:
        attributes, declared, lengths = _declared(content, group)
        stored = content[group or "/"]
        for name, (dimensions, _) in declared.items():
            for dimension, length in zip(dimensions, stored[name].shape, strict=True):
                lengths[dimension] = max(lengths.get(dimension, 0), length)
        rows = None
        if choose is not None and declared.get("time", ((), {}))[0] == ("time",):
            rows = choose(_padded(stored["time"], stored["time"][()], (lengths["time"],)))
        for name, (dimensions, about) in declared.items():
            variables[name] = _variable(stored[name], dimensions, about, lengths, rows)
    dataset = xr.decode_cf(xr.Dataset(variables, attrs=attributes), decode_times=False)
    return dataset.set_coords("time") if isinstance(rows, int) else dataset


def _opened(file):
    return contextlib.nullcontext(file) if isinstance(file, h5py.File) else h5py.File(file, "r")


def _declared(file, group):
    """Attributes of a group, its variables with their dimensions and attributes, and lengths of its dimensions."""
    with h5netcdf.File(file, "r") as content:
        own = content if group is None else content[group]
        variables = {name: (v.dimensions, _texts(v.attrs)) for name, v in own.variables.items()}
        return _texts(own.attrs), variables, {name: len(d) for name, d in own.dimensions.items()}


def _texts(attributes):
    return {
        name: value.decode("utf-8") if isinstance(value, bytes) and name != "_FillValue" else value
        for name, value in attributes.items()
    }


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
