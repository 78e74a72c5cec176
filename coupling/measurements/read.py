"""Measurements from a table (CSV), a netCDF-4 file or a dataset; what is wrong in them is named by its line."""

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from pydantic import ValidationError

from coupling.datasets import opened
from coupling.measurements.measurement import Measurement
from coupling.measurements.quantities import QUANTITIES
from coupling.refused import Refused, did_you_mean
from structure.inputs import mistakes, shortened

COLUMNS = tuple(name for name in Measurement.model_fields if name != "line")
REQUIRED = ("quantity", "value", "unit", "error")
#: Dimensions of a dataset and the cells that they fill.
DIMENSIONS = {
    "time": "time", "inflow_mass": "inflow_mass", "theta": "place", "joint": "place", "x": "place", "depth": "depth",
    "tunnel": "tunnel",
}  # fmt: skip
#: Most mistakes that one message names.
MOST_TOLD = 20


def read_measurements(source: str | Path | xr.Dataset) -> tuple[Measurement, ...]:
    """Measurements, validated, in the units of :data:`coupling.measurements.QUANTITIES`.

    Parameters
    ----------
    source : path or xarray.Dataset
        A table: comma, semicolon or tab between cells, first line the names of the fields of `Measurement`, empty
        lines and those that begin with # passed over. Or a dataset, or its netCDF-4 file: variables named as the
        quantities, over `time` or `inflow_mass` and `theta`, `joint` or `x` (in the ground also `depth`), each with the
        attribute `units` and its error beside it as NAME_error, one that its values share as NAME_common_error; NaN is
        what was not measured; the attribute `change` = 1 marks changes since the gate opened, `sensor` names who
        measured.

    Raises
    ------
    Refused
        No such file, no text, no table, or no measurement in it; and every mistake with its line: rule, name, value,
        remedy.
    """
    if isinstance(source, xr.Dataset):
        who, rows = "measurements", _rows_of_dataset(source)
    elif _is_netcdf(Path(source)):
        who = f"measurements '{source}'"
        with opened(source) as file:
            rows = _rows_of_dataset(file.group(None))
    else:
        who, rows = f"measurements '{source}'", _rows_of_table(Path(source))
    found, wrong = [], []
    try:
        for line, cells in rows:
            try:
                found.append(Measurement.model_validate({**cells, "line": line}))
            except ValidationError as error:
                wrong += [f"{line}: {': '.join([*map(str, where), message])}" for where, message in
                          mistakes(error, Measurement, advice="no default: fill it in")]  # fmt: skip
    except _Unusable as problem:
        wrong.append(str(problem))
    if wrong:
        more = [f".. and {len(wrong) - MOST_TOLD} more"] if len(wrong) > MOST_TOLD else []
        head = f"{who}: {len(wrong)} mistake{'s' * (len(wrong) > 1)}:"
        raise Refused("\n  ".join([head, *wrong[:MOST_TOLD], *more]))
    if not found:
        raise Refused(f"{who}: must hold a measurement, got none; add a line for each")
    return tuple(found)


class _Unusable(Exception):
    """Where reading cannot go on."""


def _is_netcdf(path):
    try:
        with path.open("rb") as stream:
            return stream.read(8) == b"\x89HDF\r\n\x1a\n"
    except OSError as error:
        raise Refused(
            f"measurements '{path}': must be a readable file, got: {error.strerror}; give a CSV or netCDF-4 file"
        ) from None


def _rows_of_table(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Line and filled cells of every measurement of a CSV file."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        line = path.read_bytes()[: error.start].count(b"\n") + 1
        raise _Unusable(f"line {line}: must be UTF-8 text, got: {error.reason}; save the table as UTF-8") from None
    lines = text.splitlines()
    numbered = [(k, line) for k, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if not numbered:
        return
    delimiter = max(",;\t", key=numbered[0][1].count)
    heads: list[str] = []
    for number, line in numbered:
        try:
            (cells,) = csv.reader([line], delimiter=delimiter, strict=True, skipinitialspace=True)
        except csv.Error as problem:
            raise _Unusable(f"line {number}: must be cells of a table, got: {problem}; close the quotes") from None
        cells = [cell.strip() for cell in cells]
        if not heads:
            heads = _checked_heads(number, cells)
            continue
        if len(cells) > len(heads):
            raise _Unusable(
                f"line {number}: must have the {len(heads)} cells of the first line, got {len(cells)}; write decimal "
                'points, and put cells that hold the separator in "quotes"'
            )
        yield f"line {number}", {name: cell for name, cell in zip(heads, cells, strict=False) if cell}


def _checked_heads(number, heads):
    for name in heads:
        if name not in COLUMNS:
            raise _Unusable(f"line {number}: unknown column {shortened(name)}; {did_you_mean(name, COLUMNS)}")
    missing = [name for name in REQUIRED if name not in heads]
    if missing or len(set(heads)) < len(heads):
        twice = sorted({name for name in heads if heads.count(name) > 1})
        what = f"got none of {', '.join(missing)}" if missing else f"got {twice[0]} twice"
        raise _Unusable(f"line {number}: must name every column once, {', '.join(REQUIRED)} among them, {what}; "
                        "correct the first line")  # fmt: skip
    return heads


def _rows_of_dataset(dataset: xr.Dataset) -> Iterator[tuple[str, dict[str, Any]]]:
    """The same of a dataset; the line names variable and position."""
    for name in map(str, dataset.data_vars):
        if any(name.endswith(end) and name.removesuffix(end) in dataset for end in ("_error", "_common_error")):
            continue
        if name not in QUANTITIES:
            raise _Unusable(f"{name}: must be a quantity that a run has; {did_you_mean(name, QUANTITIES)}")
        yield from _rows_of_variable(dataset, name)


def _rows_of_variable(dataset, name):
    value, error = dataset[name], dataset.get(f"{name}_error")
    if error is None:
        raise _Unusable(f"{name}: must have its error beside it, got no {name}_error; add one standard deviation")
    shared = dataset.get(f"{name}_common_error", xr.zeros_like(error))
    units = {array.attrs.get("units", value.attrs.get("units")) for array in (value, error, shared)}
    if len(units) > 1 or None in units:
        got = ", ".join(sorted(map(str, units)))
        raise _Unusable(f"{name}: must have an attribute units, and its errors the same, got {got}; set them")
    value, error, shared = xr.broadcast(value, error, shared)
    unknown = [str(dim) for dim in value.dims if dim not in DIMENSIONS]
    if unknown:
        raise _Unusable(f"{name}: must be over {', '.join(DIMENSIONS)}, got {unknown[0]}; rename that dimension")
    coordinates = {str(key): each.broadcast_like(value).values.ravel() for key, each in value.coords.items()}
    if {"time", "inflow_mass"} <= coordinates.keys():  # of a run both are known: that which is a dimension counts
        coordinates.pop("time" if "inflow_mass" in value.dims else "inflow_mass")
    common = {"quantity": name, "unit": units.pop(), "change": bool(value.attrs.get("change", False))}
    common["sensor"] = value.attrs.get("sensor", name if shared.any() else "")
    for k in np.flatnonzero(np.isfinite(value.values.ravel())):
        cells = {DIMENSIONS[key]: column[k].item() for key, column in coordinates.items() if key in DIMENSIONS}
        numbers = {"value": value, "error": error, "common_error": shared}
        cells |= {key: array.values.ravel()[k].item() for key, array in numbers.items()}
        yield f"{name}, value {k + 1}", common | cells
