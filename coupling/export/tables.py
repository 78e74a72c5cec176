"""The numbers of a run as tables, CSV files or the sheets of one Excel file, in SI units named in their headings."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from coupling.datasets import read_run
from coupling.datasets.geometry import on_tunnel, tunnels_beside
from coupling.datasets.tree import responses_of
from coupling.postprocess.answer import answers, settled
from coupling.postprocess.extremes import ring_extremes
from coupling.refused import Refused
from structure.limits import UTILISATIONS
from structure.response import FORCES, PRESSURES, RESPONSE

EXCEL_FILE, LONGEST_SHEET = "tables.xlsx", 31
#: Names of the tables; of lining models with the model behind, of tunnels without the gate with _tunnel_ and number.
NAMES = ("answer", "limits", "history", "pressures*", "ring_*", "forces_*", "joints_*", "settlement", "trough")
AROUND = (*FORCES, "displacement_radial", "displacement_tangential")
JOINTS = tuple(name for name, (dims, _, _) in RESPONSE.items() if "joint" in dims)


def write_tables(run: Any, folder: Path, kind: str) -> list[Path]:
    """Write the tables of an open run as CSV files, or as the sheets of one Excel file.

    run : coupling.datasets.open_run.OpenRun;  kind : "csv" or "xlsx".  Raises Refused: Excel without openpyxl.
    """
    found = run_tables(read_run(run))
    if kind == "csv":
        written = [folder / f"{name}.csv" for name in found]
        for path, table in zip(written, found.values(), strict=True):
            table.to_csv(path, index=False)
        return written
    try:
        with pd.ExcelWriter(folder / EXCEL_FILE, engine="openpyxl") as book:
            for name, table in found.items():
                table.to_excel(book, sheet_name=name[:LONGEST_SHEET], index=False)
    except ImportError:
        raise Refused(
            "export --format xlsx: needs openpyxl, which is not installed; install gushing[excel], or take --format csv"
        ) from None
    return [folder / EXCEL_FILE]


def run_tables(tree: xr.DataTree) -> dict[str, pd.DataFrame]:
    """Name of a table to it.

    answer: extremes of the ring over all records, with place, time and the distance of other lining models; limits:
    utilisations; history: over time; pressures: around the lining at the first and the last record; for every lining
    model ring: extremes over time, forces: around the ring at the first and the last record, joints: over time;
    settlement: of the surface at the last snapshot, trough: over the snapshots. Tables without rows are left out.
    """
    lining, history = tree["lining"].to_dataset(), tree["history"].to_dataset()
    found = {"answer": _answer(tree), "limits": _limits(tree), "history": _over(history, ("time",))}
    for tunnel in (None, *tunnels_beside(lining)):
        end = "" if tunnel is None else f"_tunnel_{tunnel}"
        if "soil_pressure" in lining:
            found[f"pressures{end}"] = _ends(on_tunnel(lining, tunnel), PRESSURES)
        for model, response in responses_of(tree, tunnel).items():
            if response.sizes.get("time"):
                name = f"{model.replace('-', '_')}{end}"
                found[f"ring_{name}"] = _over(ring_extremes(response), ("time",))
                found[f"forces_{name}"] = _ends(response, AROUND)
                found[f"joints_{name}"] = _over(response[[n for n in JOINTS if n in response]], ("time", "joint"))
    surface = settled(tree["points"].to_dataset()) if "points" in tree.children else None
    if surface is not None:
        found["settlement"] = _over(surface[0].isel(time=[-1]).to_dataset(), ("time", "x"))
        found["trough"] = _over(surface[1], ("time",))
    return {name: table for name, table in found.items() if len(table)}


def _over(dataset, dims):
    """Variables over some dimensions, a row each place, units in the headings."""
    own = dataset[[name for name, one in dataset.data_vars.items() if set(one.dims) == set(dims)]]
    kept = [name for name, one in own.coords.items() if name in dims or (one.dims and set(one.dims) <= set(dims))]
    table = own.reset_coords([n for n in own.coords if n not in kept], drop=True).to_dataframe(dim_order=list(dims))
    table = table.reset_index() if len(own.data_vars) else table.iloc[:0]
    units = {name: own[name].attrs.get("units", "1") for name in own.variables}
    return table.rename(columns={name: name if unit == "1" else f"{name} [{unit}]" for name, unit in units.items()})


def _ends(dataset, names):
    """Quantities around the ring at the first and the last record."""
    ends = sorted({0, dataset.sizes["time"] - 1})
    return _over(dataset[[name for name in names if name in dataset]].isel(time=ends), ("time", "theta"))


def _place(at, prefix=""):
    units = {"time": "s", "inflow_mass": "kg/m", "theta": "degree"}
    keys = ("time", "inflow_mass", "theta", "joint")
    return {f"{prefix}{key}{f' [{units[key]}]' if key in units else ''}": (at or {}).get(key, np.nan) for key in keys}


def _answer(tree):
    return pd.DataFrame([
        {"tunnel": "with the gate" if tunnel is None else tunnel, "model": one.model, "quantity": extreme.name,
         "of it": extreme.kind, "unit": RESPONSE[extreme.name][1], "value": extreme.value, **_place(extreme.at),
         "other models less this": np.nan if extreme.apart is None else extreme.apart}
        for tunnel, one in answers(tree).items() for extreme in one.forces
    ])  # fmt: skip


def _limits(tree):
    return pd.DataFrame([
        {"tunnel": "with the gate" if tunnel is None else tunnel, "model": one.model, "limit": UTILISATIONS[name],
         "governing": name == one.governing, "largest utilisation": limit["largest"], **_place(limit["at"]),
         **_place(limit["passes"], "passes 1 at ")}
        for tunnel, one in answers(tree).items() for name, limit in one.limits.items()
    ])  # fmt: skip
