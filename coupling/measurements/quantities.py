"""What can be measured: the quantities, where a run holds them, and what names a place of each."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import xarray as xr

from coupling.datasets import opened, read_history, read_mesh, read_points, read_pressures, read_response
from coupling.datasets.geometry import gate_tunnel, on_tunnel
from coupling.datasets.open_run import OpenRun, Run
from coupling.postprocess.elements import element_fields
from coupling.postprocess.settlement import surface_settlement
from coupling.refused import Refused
from structure.response import PRESSURES, RESPONSE, SHOWN, Shown

NO_POINTS = "needs snapshots of the points, the run kept none; repeat it with output.points = true"
GROUND = 0  # region of the mesh
WAYS = ("vertical", "horizontal")


class Measurable(NamedTuple):
    """A quantity that can be measured.

    read : callable
        Takes an open run, lining model and tunnel; gives the run's values (time[, place]).
    place : str or None
        Dimension that names the place: "theta" [degree], "joint" (number), "x" [m] or "ground", x [m] and depth.
    unit : str
        As pint reads it.
    of_tunnel : bool
        Whether there is one for each tunnel.
    shown : structure.response.Shown
    """

    read: Callable[[OpenRun, str | None, int | None], xr.DataArray]
    place: str | None
    unit: str
    of_tunnel: bool
    shown: Shown


def _of_ring(name):
    def read(run, model, tunnel):
        known = run.models()
        if model is not None and known and model not in known:
            raise Refused(f"--model: must be one that answered the run, got {model!r}; there are {', '.join(known)}")
        leading = model or next(iter(known), "beam-spring")
        return read_response(run, leading, tunnel)[name]

    dimensions, unit, _ = RESPONSE[name]
    return Measurable(read, next(iter(dimensions[1:]), None), unit, True, SHOWN[name])


def _of_lining(*names, shown):
    def read(run, _, tunnel):
        pressures = on_tunnel(read_pressures(run), tunnel)
        return sum(pressures[name] for name in names)

    return Measurable(read, "theta", "Pa", True, shown)


def _of_ground(*names, shown):
    def read(run, *_):
        if run.size("points", "time") is None:
            raise Refused(f"{shown.name}: {NO_POINTS}")
        mesh = read_mesh(run)
        fields = element_fields(read_points(run), mesh)
        values = sum(fields[name] for name in names)
        ground = (mesh["region"].values == GROUND) & np.isfinite(values.values).all(axis=0)
        width, depth = (float(mesh["x"].min()), float(mesh["x"].max())), -float(mesh["y"].min())
        return values.isel(element=ground).assign_attrs(mesh.attrs, width=width, depth=depth)

    return Measurable(read, "ground", "Pa", False, shown)


def _inflow(run, *_):
    history = read_history(run)
    return history["inflow_mass"].reset_coords(drop=True)


def _settlement(run, *_):
    if run.size("points", "time") is None:
        raise Refused(f"surface_settlement: {NO_POINTS}")
    settlement = surface_settlement(read_points(run))
    return settlement.dropna("x", how="all")


#: In the ground: name, how people are shown it, and the quantities of the elements that it is the sum of.
STRESSES = {
    "pore_pressure": ("pore pressure", ("pore_pressure",)),
    **{f"soil_stress_{way}": (f"{way} effective stress", (f"soil_stress_{way}",)) for way in WAYS},
    **{f"total_stress_{way}": (f"{way} total stress", (f"soil_stress_{way}", "pore_pressure")) for way in WAYS},
}

#: By the name that a table of measurements gives them.
QUANTITIES: dict[str, Measurable] = {
    **{name: _of_ring(name) for name in RESPONSE if name in SHOWN},
    **{name: _of_lining(name, shown=SHOWN[name]) for name in PRESSURES},
    "total_pressure": _of_lining(
        "soil_pressure", "water_pressure", shown=Shown("total pressure", "soil and water pressure", "kPa", 1e-3)
    ),
    "inflow_mass": Measurable(_inflow, None, "kg/m", False, Shown("inflow", "inflow mass", "kg/m", 1.0)),
    **{
        name: _of_ground(*parts, shown=Shown(text, f"{text} in the ground", "kPa", 1e-3))
        for name, (text, parts) in STRESSES.items()
    },
    "surface_settlement": Measurable(
        _settlement, "x", "m", False, Shown("settlement", "settlement of the ground surface", "mm", 1e3)
    ),
}


def computed(run: Run, quantity: str, model: str | None = None, tunnel: int | None = None) -> xr.DataArray:
    """A measurable quantity as the run has it, (time[, theta, joint or x]) in the unit of :data:`QUANTITIES`.

    model : str or None, lining model that answered; None: the leading one.  tunnel : int or None, None: the one with
    the gate.

    Raises Refused, RunFileError: the run has no such tunnel or model, or nothing of that quantity.
    """
    with opened(run) as file:
        pressures = read_pressures(file)
        there = pressures.sizes.get("tunnel", 1)
        if QUANTITIES[quantity].of_tunnel and "soil_pressure" not in pressures:
            raise Refused(f"{quantity}: needs a tunnel, the run has none; leave the line out")
        if tunnel is not None and tunnel >= there:
            raise Refused(f"tunnel: must be one of the run's {there}, counted from 0, got {tunnel}; correct it")
        return QUANTITIES[quantity].read(file, model, None if tunnel == gate_tunnel(pressures) else tunnel)
