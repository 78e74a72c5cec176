"""What a run comes to: the check that governs, the largest forces of the event with place and time, the trough."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from coupling.datasets.geometry import has_tunnels, tunnel_list, tunnel_of, tunnels_beside
from coupling.datasets.tree import responses_of
from coupling.postprocess.settlement import surface_settlement, trough
from structure.passing import Place, utilisations
from structure.response import SHOWN

#: Quantities that are told of a ring, and what of each: the largest, the smallest, or the largest size with its sign.
TOLD = (
    ("axial_force", "max"), ("axial_force", "min"), ("shear_force", "size"), ("bending_moment", "max"),
    ("bending_moment", "min"), ("joint_opening", "max"), ("joint_dislocation", "size"), ("joint_rotation", "size"),
    ("convergence_vertical", "size"), ("convergence_horizontal", "size"), ("settlement", "size"),
)  # fmt: skip
WORDS = {"max": "largest", "min": "smallest", "size": "largest size"}


class Extreme(NamedTuple):
    """The extreme of a quantity of a ring over all records, SI.

    name : of the quantity;  kind : "max", "min" or "size";  value : float;  at : where and when, as in
    :func:`structure.utilisations`;  apart : what another lining model has there over all records less this one, the
    one that is furthest; None without one.
    """

    name: str
    kind: str
    value: float
    at: Place
    apart: float | None

    @property
    def label(self) -> str:
        """What it is, in words."""
        of = " of the ring" if self.name == "settlement" else ""
        return f"{SHOWN[self.name].name}{of}, {WORDS[self.kind]}"


class Answer(NamedTuple):
    """What a ring comes to by its leading lining model.

    model : its name;  others : of other models that are compared;  limits : of :func:`structure.utilisations`;
    governing : the name in it with the largest utilisation, None without limits;  forces : list of Extreme;
    moved : whether it has moved in the ground, whose response has the attribute `answered`.
    """

    model: str
    others: list[str]
    limits: dict[str, dict[str, Any]]
    governing: str | None
    forces: list[Extreme]
    moved: bool = False


def answers(tree: xr.DataTree) -> dict[int | None, Answer]:
    """Number of every tunnel on which a lining model has answered (None: that with the gate) to its answer."""
    found = {}
    for tunnel in (None, *tunnels_beside(tree["lining"])):
        answered = {model: one for model, one in responses_of(tree, tunnel).items() if one.sizes.get("time")}
        if answered:
            (model, *others), responses = answered, list(answered.values())
            limits = utilisations(responses[0])
            governing = max(limits, key=lambda name: limits[name]["largest"], default=None)
            moved = "answered" in responses[0].attrs
            found[tunnel] = Answer(model, others, limits, governing, largest_forces(responses), moved)
    return found


def largest_forces(responses: list[xr.Dataset]) -> list[Extreme]:
    """Extremes of `TOLD` of the first response over all records, and how far those of the others are from them."""
    first, found = responses[0], []
    for name, kind in TOLD:
        if name not in first or not first[name].size or not first[name].notnull().any():
            continue
        value, at = _extreme(first, name, kind)
        others = [_extreme(one, name, kind)[0] - value for one in responses[1:]
                  if name in one and one[name].notnull().any()]  # fmt: skip
        found.append(Extreme(name, kind, value, at, max(others, key=abs, default=None)))
    return found


def _extreme(response, name, kind):
    values = response[name]
    score = {"max": values, "min": -values, "size": abs(values)}[kind]
    there = response.isel(score.argmax(values.dims))
    known = [key for key in ("time", "inflow_mass", "theta", "joint") if key in there and not there[key].dims]
    return there[name].item(), {key: there[key].item() for key in known}


def settled(points: xr.Dataset) -> tuple[xr.DataArray, xr.Dataset] | None:
    """Settlement of the surface over the tunnel with the gate and its trough, None where the scene has no surface.

    points : `/points` of a run, all snapshots or one.  Returns as :func:`surface_settlement` and :func:`trough`, with
    volume_loss [-], the area of the trough over that of the tunnels, and width_over_depth [-], i over the depth of the
    axis (the K of O'Reilly and New 1982: 0.2 to 0.3 in sand, 0.4 to 0.5 in clay).
    """
    if (
        not {"x", "displacement_y"} <= set(points.data_vars)
        or not points.sizes.get("time", 1)
        or not has_tunnels(points)
    ):
        return None
    tunnel = tunnel_of(points)
    # cells of two points of the largest size, so that none at the surface is empty
    side = float(np.sqrt(np.nanmax(points["volume"].values)))
    top = float(np.nanmax(points["y"].values - points["displacement_y"].values))
    if top < -side:
        return None
    settlement = surface_settlement(points, spacing=max(1.0, 2 * side), depth=max(1.0, side))
    found = trough(settlement)
    area = sum(np.pi * one.outer**2 for one in tunnel_list(points))
    return settlement, found.assign(
        volume_loss=(found["volume"] / area).assign_attrs(units="1", long_name="area of the trough over the tunnels'"),
        width_over_depth=(found["width"] / -tunnel.y).assign_attrs(units="1", long_name="i over depth of the axis"),
    )
