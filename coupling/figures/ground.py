"""Pictures of the ground: fields on the points around a tunnel, the mesh around the gate."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from coupling.datasets.geometry import gate_of, tunnel_of
from coupling.figures.picture import Picture, styled
from coupling.figures.tunnel import draw_linings
from coupling.postprocess.elements import cell_means, element_areas, element_of_points
from coupling.postprocess.heap import filled

FULL = 0.6  # of the area around an element that material fills where the element is drawn as a whole
FIELD_COLOURS = ("viridis", "magma_r", "YlGnBu", "cividis")  # of displacement, strain, pore pressure, stress


def fields_around_tunnel(
    points: xr.Dataset,
    half_width: float | None = None,
    tops: dict[str, float] | None = None,
    tunnel: int | None = None,
    mesh: xr.Dataset | None = None,
) -> Picture:
    """Displacement, deviatoric strain, pore pressure, vertical effective stress (compression positive).

    Elements show the mean of the points in them, which is as smooth as the computation is accurate; points whose
    element is not full, at the front of what flows, are drawn by themselves.

    Parameters
    ----------
    points : xarray.Dataset
        One time of `/points` (see :func:`coupling.datasets.read_points`).
    half_width : float, optional
        Half the width of the view [m]; three outer radii when left out.
    tops : dict, optional
        Title of a panel to the top of its colours, from :func:`common_tops`; that of this time when left out.
    tunnel : int, optional
        Which one, when there are several; that of the gate when left out.
    mesh : xarray.Dataset, optional
        `/mesh` of the run; without it all points are drawn as discs.
    """
    x0, y0, radius, _ = tunnel_of(points, tunnel)
    half = 3.0 * radius if half_width is None else half_width
    data, fields = _fields(points, x0, y0, half)
    full = None if mesh is None else _full_elements(data, mesh)
    with styled(7.2, 6.4) as figure:
        axes = figure.subplots(2, 2, sharex=True, sharey=True)
        for axis, (title, values, colours, norm, extend) in zip(axes.flat, fields, strict=True):
            if norm is None:
                norm = Normalize(0.0, _top(values, extend) if tops is None else tops[title])
            drawn = _draw_values(axis, data, np.maximum(values, norm.vmin), colours, norm, full)
            draw_linings(axis, points, zorder=3)
            frame_view(axis, x0, y0, half)
            bar = figure.colorbar(drawn, ax=axis, shrink=0.92, extend=extend, pad=0.02)
            bar.outline.set_linewidth(0.5)
            axis.set_title(title)
        for axis in axes[1]:
            axis.set_xlabel("x [m]")
        for axis in axes[:, 0]:
            axis.set_ylabel("y [m]")
        figure.suptitle(f"{float(points['time']):.3g} s after the gate opened", fontsize=9)
    return figure


def common_tops(points: xr.Dataset) -> dict[str, float]:
    """Top of the linear colour scales that suits all times: title of a panel to its value, for `fields_around_tunnel`.

    points : xarray.Dataset, `/points` of a run.
    """
    x0, y0, radius, _ = tunnel_of(points)
    tops = {}
    for k in range(points.sizes["time"]):
        _, fields = _fields(points.isel(time=k), x0, y0, 3.0 * radius)
        for title, values, _, norm, extend in fields:
            if norm is None:
                tops[title] = max(tops.get(title, 0.0), _top(values, extend))
    return tops


def _fields(points, x0, y0, half):
    """Points in a view, and what is drawn of them: title, values, colour map, norm (None: from 0), open ends."""
    near = (np.abs(points["x"].values - x0) < 1.2 * half) & (np.abs(points["y"].values - y0) < 1.2 * half)
    data = {name: points[name].values[near] for name in points.data_vars if points[name].dims == ("point",)}
    displacement = 1e3 * np.hypot(data["displacement_x"], data["displacement_y"])
    return data, (
        ("displacement [mm]", displacement, FIELD_COLOURS[0], LogNorm(1.0, 1000.0), "both"),
        ("deviatoric strain [-]", data["deviatoric_strain"], FIELD_COLOURS[1], LogNorm(1e-3, 1.0), "both"),
        # a negative value stands for water that is missing: it carries nothing
        ("pore pressure [kPa]", np.maximum(data["pore_pressure"], 0.0) / 1e3, FIELD_COLOURS[2], None, "neither"),
        ("vertical effective stress [kPa]", -data["stress_yy"] / 1e3, FIELD_COLOURS[3], None, "max"),
    )


def _top(values, extend):
    return max(float(np.nanmax(values) if extend == "neither" else np.nanpercentile(values, 99.5)), 1.0)


def mesh_near_gate(mesh: xr.Dataset, half_width: float | None = None) -> Picture:
    """The mesh around the gate, parts in different colours, with the whole tunnel beside it."""
    tunnel, gate = tunnel_of(mesh), gate_of(mesh)
    corners = np.stack([mesh["x"].values, mesh["y"].values], axis=1)[mesh["element_nodes"].values]
    region = mesh["region"].values
    colours = np.array(["#e8d9b5", "#f2b8a8", "#d6e6f2", "#ffffff"])[region]
    views = [(tunnel.x, tunnel.y, 1.6 * tunnel.outer)]
    if gate is not None:
        middle = tunnel.at(gate.angle, 0.5 * (tunnel.outer + tunnel.inner))
        views.append((*middle, 5 * gate.width if half_width is None else half_width))
    with styled(3.6 * len(views), 3.5) as figure:
        axes = np.atleast_1d(figure.subplots(1, len(views)))
        for axis, (x, y, half), line in zip(axes, views, (0.2, 0.4), strict=False):
            near = (np.abs(corners - [x, y]) < 2 * half).all(axis=(1, 2))
            axis.add_collection(
                PolyCollection(corners[near], facecolors=colours[near], edgecolors="0.35", linewidths=line)
            )
            draw_linings(axis, mesh, zorder=0)
            frame_view(axis, x, y, half)
            axis.set_xlabel("x [m]")
        axes[0].set_ylabel("y [m]")
        axes[0].set_title(f"{len(region)} triangles; around the tunnel")
        if len(views) > 1:
            axes[1].set_title("around the gate")
    return figure


class _Full(NamedTuple):
    """Elements that material fills: nodes (n, 3), corners (n, 3, 2) [m], in which of them each point lies, -1: none."""

    nodes: NDArray[np.int64]
    corners: NDArray[np.float64]
    of_point: NDArray[np.int64]


def _full_elements(data, mesh):
    """Elements in ground that is full: an element that few points happen to lie in is no hole among full ones."""
    place = xr.Dataset({name: ("point", data[name]) for name in ("x", "y")})
    element, areas, nodes = element_of_points(place, mesh), element_areas(mesh), mesh["element_nodes"].values
    inside = element >= 0
    full = filled(np.bincount(element[inside], data["volume"][inside], len(areas)), areas, nodes, FULL)
    number = np.where(full, np.cumsum(full) - 1, -1)
    corners = np.stack([mesh["x"].values[nodes[full]], mesh["y"].values[nodes[full]]], axis=2)
    return _Full(nodes[full], corners, np.where(inside, number[element], -1))


def _means(full, volume, values):
    """Means of the points in full elements; those without a point take that of their nodes."""
    means = cell_means(full.of_point, volume, values, len(full.nodes))
    nodes, known = full.nodes, np.repeat(np.isfinite(means), 3)
    at_nodes = cell_means(
        nodes.ravel()[known], np.ones(known.sum()), np.repeat(means, 3)[known], nodes.max(initial=0) + 1
    )
    around = np.ma.masked_invalid(at_nodes[nodes]).mean(axis=1)
    return np.where(np.isfinite(means), means, around.filled(np.nan))


def _draw_values(axis, data, values, colours, norm, full):
    """Means of full elements; other points as discs in data units, wider than their distance, the smallest on top."""
    style = {"cmap": colours, "norm": norm, "rasterized": True, "zorder": 2}
    shown = np.arange(len(values))
    if full is not None:
        means = _means(full, data["volume"], values)
        # an edge in the colour of its element leaves no hairline between two
        axis.add_collection(PolyCollection(full.corners, array=means, edgecolors="face", linewidths=0.25, **style))
        shown = np.flatnonzero(full.of_point < 0)
    order = shown[np.argsort(-data["volume"][shown], kind="stable")]
    size = 1.9 * np.sqrt(data["volume"][order])
    discs = EllipseCollection(
        size, size, np.zeros_like(size), units="xy", offsets=np.stack([data["x"], data["y"]], axis=1)[order],
        offset_transform=axis.transData, array=values[order], linewidths=0, **style,
    )  # fmt: skip
    axis.add_collection(discs)
    return discs


def frame_view(axis: Axes, x: float, y: float, half: float) -> None:
    """Show a square of a picture, its middle at (x, y) [m] `half` from it to every side, with few ticks."""
    axis.set_aspect("equal")
    axis.set_xlim(x - half, x + half)
    axis.set_ylim(y - half, y + half)
    for direction in (axis.xaxis, axis.yaxis):
        direction.set_major_locator(MaxNLocator(5, steps=(1, 2, 5, 10)))
