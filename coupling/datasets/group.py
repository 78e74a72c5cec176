"""One group of a netCDF-4 file, in memory, as xarray gives it, with every length looked up once.

Whenever h5netcdf is asked for the length of an unlimited dimension it looks at all variables that have it, so that
opening a group of n variables through xarray takes n² look-ups: seconds for the history of a run. And each look-up is a
path through the file. So what netCDF writes into HDF5 is read here as it stands there, by h5py.
"""

import contextlib

import h5py
import numpy as np
import xarray as xr

NOT_A_VARIABLE = "This is a netCDF dimension but not a netCDF variable"  # as netCDF calls a scale without values
#: Attributes that carry the format itself.
OF_THE_FORMAT = frozenset((
    "REFERENCE_LIST", "CLASS", "DIMENSION_LIST", "NAME", "_Netcdf4Dimid", "_Netcdf4Coordinates", "_nc3_strict",
    "_NCProperties",
))  # fmt: skip


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
    variables = {}
    with _opened(file) as content:
        attributes, declared, lengths = _declared(content, group)
        for stored, dimensions, _ in declared.values():
            for dimension, length in zip(dimensions, stored.shape, strict=True):
                lengths[dimension] = max(lengths.get(dimension, 0), length)
        rows = None
        if choose is not None and "time" in declared and declared["time"][1] == ("time",):
            time = declared["time"][0]
            rows = choose(_padded(time, time[()], (lengths["time"],)))
        for name, (stored, dimensions, about) in declared.items():
            variables[name] = _variable(stored, dimensions, about, lengths, rows)
    dataset = xr.decode_cf(xr.Dataset(variables, attrs=attributes), decode_times=False)
    return dataset.set_coords("time") if isinstance(rows, int) else dataset


def _opened(file):
    return contextlib.nullcontext(file) if isinstance(file, h5py.File) else h5py.File(file, "r")


def _declared(file, group):
    """Attributes of a group, its variables with their dimensions and attributes, and lengths of its dimensions."""
    own = file[group or "/"]
    stored = {name: entry for name, entry in own.items() if isinstance(entry, h5py.Dataset)}
    about = {name: _attributes(entry) for name, entry in stored.items()}
    scales = [name for name, attributes in about.items() if attributes.get("CLASS") == b"DIMENSION_SCALE"]
    known = {stored[name].id: name for name in scales}
    numbered = {about[name].get("_Netcdf4Dimid"): name for name in scales}

    def scale_name(references):
        if not len(references):
            raise ValueError("a dimension without a scale")
        scale = h5py.h5r.dereference(references[-1], file.id)
        if scale not in known:  # of a group above
            known[scale] = h5py.h5i.get_name(scale).decode().rpartition("/")[2]
        return known[scale]

    def dimensions(name):
        attributes, count = about[name], stored[name].ndim
        if "DIMENSION_LIST" in attributes:
            return tuple(map(scale_name, attributes["DIMENSION_LIST"]))
        if name in scales:
            return (name,) if count == 1 else tuple(numbered[n] for n in attributes["_Netcdf4Coordinates"])
        if count:
            raise ValueError(f"variable '{name}' has no dimensions")
        return ()

    variables = {
        name: (stored[name], dimensions(name), _texts(attributes))
        for name, attributes in about.items()
        if NOT_A_VARIABLE not in str(attributes.get("NAME"))
    }
    return _texts(_attributes(own)), variables, {name: stored[name].shape[0] for name in scales}


def _attributes(entry):
    attributes = entry.attrs
    return {name: attributes[name] for name in attributes if name != "REFERENCE_LIST"}  # long, and of no use here


def _texts(attributes):
    return {name: _text(name, value) for name, value in attributes.items() if name not in OF_THE_FORMAT}


def _text(name, value):
    """As netCDF gives it: one value of a row of one, texts decoded."""
    if isinstance(value, h5py.Empty):
        return "" if value.dtype.kind == "S" else np.array([], value.dtype)
    if isinstance(value, np.ndarray):
        value = value[0] if len(value) == 1 else value.tolist() if value.dtype.kind in "SO" else value
    if name == "_FillValue":
        return value
    if isinstance(value, list):
        return [part.decode("utf-8") if isinstance(part, bytes) else part for part in value]
    return value.decode("utf-8") if isinstance(value, bytes) else value


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
