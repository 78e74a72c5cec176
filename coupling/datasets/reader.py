"""Readers of run files, in memory: each takes a run's folder or file, or a run that is open (see `opened`)."""

from collections.abc import Sequence
from typing import Any

import xarray as xr
from numpy.typing import NDArray

from coupling.datasets.open_run import Run, opened
from coupling.datasets.schema import identifier, structure_group
from coupling.refused import RunFileError


def read_run(run: Run) -> xr.DataTree:
    """All groups of a run as an `xarray.DataTree`, in memory; groups as in :mod:`coupling.datasets`."""
    with opened(run) as file:
        groups = {"/".join(map(identifier, name.split("/"))): file.group(name) for name in file.names()}
        return xr.DataTree.from_dict({"/": file.group(None), **{f"/{name}": group for name, group in groups.items()}})


def read_group(run: Run, group: str | None, row: int | None = None) -> xr.Dataset:
    """One group of a run file, in memory, with complete records only; `row` picks one of them.

    `inflow_mass` is a coordinate along `time`. Bounds of cells stay in the file: their dimension would repeat every
    row of `to_dataframe`; ``ds.cf.add_bounds("theta")`` of cf_xarray gives them again.
    """
    with opened(run) as file:
        return file.group(group, row)


def stored_title(file: Run) -> str:
    """Title of a netCDF-4 file, by which its kind is known; empty where there is no such file or it has none."""
    try:
        return str(read_attributes(file).get("title", ""))
    except RunFileError:
        return ""


def read_attributes(run: Run) -> dict[str, Any]:
    """Root attributes of a run: provenance, scene text, status ('interrupted' also where its process was killed)."""
    return dict(read_group(run, None).attrs)


def read_pressures(run: Run) -> xr.Dataset:
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
    return read_group(run, "lining")


def read_history(run: Run) -> xr.Dataset:
    """Inflow, zones, balances and time step through time: `/history`, in memory."""
    return read_group(run, "history")


def read_points(run: Run, snapshot: int | None = None) -> xr.Dataset:
    """Snapshots of all points: `/points`, in memory; one of them when its number is given (-1: the last)."""
    return read_group(run, "points", snapshot)


def read_mesh(run: Run) -> xr.Dataset:
    """The mesh: `/mesh`, in memory."""
    return read_group(run, "mesh")


def read_response(run: Run, model: str = "beam-spring", tunnel: int | None = None) -> xr.Dataset:
    """The response of the lining of the tunnel with the gate, or of another `tunnel` by its number, in memory.

    It is at the angles of the pressures; what an earlier version stored between them is interpolated.
    """
    from structure.lining import at_whole_degrees

    group = structure_group(model, tunnel)
    with opened(run) as file:
        before = f"{group.partition('/')[0]}/{model}"  # as earlier versions called it
        return at_whole_degrees(file.group(before if before in file.names() else group))


def raw_groups(
    run: Run, groups: Sequence[str] = ("mesh", "history", "lining", "points")
) -> dict[str, dict[str, NDArray[Any]]]:
    """Arrays of a run file as they lie in it, complete records only: group to name to array.

    Raises
    ------
    RunFileError
        As :func:`read_pressures`.
    """
    with opened(run) as file:
        return {group: file.arrays(group) for group in groups}
