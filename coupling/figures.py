"""Pictures of a run, each a function of its datasets, in kPa, kN, mm and degrees.

Every function returns a `matplotlib.figure.Figure` that belongs to the caller; nothing touches pyplot's global state.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.patches import Annulus, Polygon
from matplotlib.ticker import MaxNLocator

from coupling.datasets import RunFileError, read_history, read_mesh, read_points, read_pressures, read_response
from coupling.picture import Picture

if TYPE_CHECKING:
    import xarray as xr

STYLE = {
    "font.size": 8,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "grid.linewidth": 0.4,
    "grid.color": "0.85",
    "lines.linewidth": 1.4,
    "figure.dpi": 100,
}
RESOLUTION = 200  # dots per inch of saved pictures
INITIAL, NOW, GATE, SECOND = "0.45", "#0b5394", "#c1272d", "#d98200"
CONCRETE = "0.82"
FIELD_COLOURS = ("viridis", "magma_r", "YlGnBu", "cividis")  # of displacement, strain, pore pressure, stress


def fields_around_tunnel(
    points: xr.Dataset,
    half_width: float | None = None,
    tops: dict[str, float] | None = None,
    tunnel: int | None = None,
) -> Picture:
    """Displacement, deviatoric strain, pore pressure, vertical effective stress (compression positive) on the points.

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
    """
    geometry = _Geometry(points)
    x0, y0, radius = geometry.centre if tunnel is None else geometry.centre_of(tunnel)
    half = 3.0 * radius if half_width is None else half_width
    data, fields = _fields(points, x0, y0, half)
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.2, 6.4), layout="constrained")
        axes = figure.subplots(2, 2, sharex=True, sharey=True)
        for axis, (title, values, colours, norm, extend) in zip(axes.flat, fields, strict=True):
            if norm is None:
                norm = Normalize(0.0, _top(values, extend) if tops is None else tops[title])
            drawn = _draw_points(axis, data, values, colours, norm)
            geometry.draw(axis, zorder=3)
            _frame(axis, x0, y0, half)
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
    x0, y0, radius = _Geometry(points).centre
    tops = {}
    for k in range(points.sizes["time"]):
        _, fields = _fields(points.isel(time=k), x0, y0, 3.0 * radius)
        for title, values, _, norm, extend in fields:
            if norm is None:
                tops[title] = max(tops.get(title, 0.0), _top(values, extend))
    return tops


def _fields(points, x0, y0, half):
    """Points in a view, and what is drawn of them: title, values, colour map, norm (None: from 0), open ends."""
    near = (np.abs(points["x"].values - x0) < 1.1 * half) & (np.abs(points["y"].values - y0) < 1.1 * half)
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
    geometry = _Geometry(mesh)
    corners = np.stack([mesh["x"].values, mesh["y"].values], axis=1)[mesh["element_nodes"].values]
    region = mesh["region"].values
    colours = np.array(["#e8d9b5", "#f2b8a8", "#d6e6f2", "#ffffff"])[region]
    x0, y0, radius = geometry.centre
    views = [(x0, y0, 1.6 * radius)]
    if geometry.gate is not None:
        gx, gy = geometry.at(geometry.gate["angle"], radius - 0.5 * geometry.thickness)
        views.append((gx, gy, 5 * geometry.gate["width"] if half_width is None else half_width))
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(3.6 * len(views), 3.5), layout="constrained")
        axes = np.atleast_1d(figure.subplots(1, len(views)))
        for axis, (x, y, half), line in zip(axes, views, (0.2, 0.4), strict=False):
            near = (np.abs(corners - [x, y]) < 2 * half).all(axis=(1, 2))
            axis.add_collection(
                PolyCollection(corners[near], facecolors=colours[near], edgecolors="0.35", linewidths=line)
            )
            geometry.draw(axis, zorder=0)
            _frame(axis, x, y, half)
            axis.set_xlabel("x [m]")
        axes[0].set_ylabel("y [m]")
        axes[0].set_title(f"{len(region)} triangles; around the tunnel")
        if len(views) > 1:
            axes[1].set_title("around the gate")
    return figure


def pressures_polar(pressures: xr.Dataset, time: int = -1, tunnel: int | None = None) -> Picture:
    """Soil and water pressure on the lining, initial against now.

    Parameters
    ----------
    pressures : xarray.Dataset
        `/lining` of a run.
    time : int
        Index of the record called "now".
    tunnel : int, optional
        Which one, when there are several; that of the gate when left out.
    """
    geometry = _Geometry(pressures)
    if "tunnel" in pressures.dims:
        pressures = pressures.isel(tunnel=geometry.tunnel if tunnel is None else tunnel)
    angle = np.radians(pressures["theta"].values)
    first, now = pressures.isel(time=0), pressures.isel(time=time)
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.2, 4.0), layout="constrained")
        axes = figure.subplots(1, 2, subplot_kw={"projection": "polar"})
        titles = {"soil_pressure": "effective soil pressure [kPa]", "water_pressure": "water pressure [kPa]"}
        for axis, (name, title) in zip(axes, titles.items(), strict=True):
            _crown_up(axis)
            axis.plot(*_closed(angle, first[name].values / 1e3), color=INITIAL, ls=(0, (4, 2)), lw=1.2, label="initial")
            axis.plot(*_closed(angle, now[name].values / 1e3), color=NOW, label=_moment(now))
            axis.set_ylim(0, 1.08 * max(first[name].max(), now[name].max()) / 1e3)
            _radial_ticks(axis, geometry)
            if tunnel is None or tunnel == geometry.tunnel:
                geometry.mark_gate(axis)
            axis.set_title(title, pad=12)
        _legend_below(figure, axes[0])
    return figure


def internal_forces(response: xr.Dataset, time: int = -1) -> Picture:
    """Axial force, shear force and bending moment around the ring, initial against now, with their extremes.

    Parameters
    ----------
    response : xarray.Dataset
        `/structure/<model>` of a run, or what `respond` returned.
    time : int
        Index of the record called "now".
    """
    angle = np.radians(response["theta"].values)
    first, now = response.isel(time=0), response.isel(time=time)
    panels = (
        ("axial_force", "axial force N [kN/m]"),
        ("shear_force", "shear force Q [kN/m]"),
        ("bending_moment", "bending moment M [kN m/m]"),
    )
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.4, 3.15), layout="constrained")
        axes = figure.subplots(1, 3, subplot_kw={"projection": "polar"})
        for axis, (name, title) in zip(axes, panels, strict=True):
            _crown_up(axis)
            start, end = first[name].values / 1e3, now[name].values / 1e3
            axis.plot(*_closed(angle, np.zeros_like(angle)), color="0.2", lw=0.8)
            axis.plot(*_closed(angle, start), color=INITIAL, ls=(0, (4, 2)), lw=1.1, label="initial")
            axis.plot(*_closed(angle, end), color=NOW, label=_moment(now))
            axis.fill_between(*_closed(angle, end), 0.0, color=NOW, alpha=0.12, lw=0)
            low, high = min(0.0, start.min(), end.min()), max(0.0, start.max(), end.max())
            margin = 0.08 * max(high - low, 1e-3)
            axis.set_ylim(low - margin * (low < 0), high + margin)
            if low < 0:
                # the middle stays free, so that the zero line is a circle wide enough to read along
                axis.set_rorigin(low - margin - 0.5 * (high - low))
            _radial_ticks(axis, None, 4)
            for value, at in ((end.max(), end.argmax()), (end.min(), end.argmin())):
                axis.plot(angle[at], value, "o", ms=2.8, color=NOW)
            axis.set_title(title, pad=10)
            axis.set_xlabel(
                f"max {end.max():.0f} at {np.degrees(angle[end.argmax()]):.4g}°,  "
                f"min {end.min():.0f} at {np.degrees(angle[end.argmin()]):.4g}°".replace("-", "\N{MINUS SIGN}"),
                labelpad=6,
            )
        _legend_below(figure, axes[0])
    return figure


def deformed_ring(response: xr.Dataset, time: int = -1) -> Picture:
    """The deformed ring, initial against now, exaggerated, with its joints and their rotations.

    Parameters
    ----------
    response : xarray.Dataset
        Response of a ring; its attribute `ring` gives the geometry.
    time : int
        Index of the record called "now".
    """
    ring = json.loads(response.attrs["ring"])
    outer, inner = ring["outer_diameter"] / 2, ring["inner_diameter"] / 2
    radius = 0.5 * (outer + inner)
    angle = np.radians(response["theta"].values)
    states = [response.isel(time=0), response.isel(time=time)]
    # relative to the mean motion: a ring that moves as a whole does not deform
    shapes = [_centred(angle, s["displacement_radial"].values, s["displacement_tangential"].values) for s in states]
    largest = max(float(np.hypot(*shape).max()) for shape in shapes)
    factor = _round_down(0.18 * radius / max(largest, 1e-12))
    joints = np.radians(response["joint_angle"].values) if response.sizes.get("joint") else np.array([])
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(4.6, 4.7), layout="constrained")
        axis = figure.subplots()
        axis.add_patch(Annulus((0, 0), outer, outer - inner, fc="0.92", ec="0.8", lw=0.5, zorder=0))
        styles = ({"color": INITIAL, "ls": (0, (4, 2)), "lw": 1.1, "label": "initial"}, {"color": NOW})
        styles[1]["label"] = _moment(states[1])
        for (radial, tangential), style in zip(shapes, styles, strict=True):
            x, y = _place(angle, radius, factor * radial, factor * tangential)
            for segment in _segments(angle, joints):
                axis.plot(x[segment], y[segment], **style)
                style = {**style, "label": None}
        radial, tangential = shapes[1]
        labels = _spread(joints)
        for k, joint in enumerate(joints):
            here = [np.interp(joint, angle, values, period=2 * np.pi) for values in (radial, tangential)]
            x, y = _place(joint, radius, factor * here[0], factor * here[1])
            axis.plot(x, y, "o", ms=5, mfc="white", mec=GATE, mew=1.2, zorder=5)
            rotation = 1e3 * float(states[1]["joint_rotation"][k])
            opening = 1e3 * float(states[1]["joint_opening"][k])
            axis.annotate(
                f"{k + 1}:  {rotation:+.2f} mrad\n{opening:+.2f} mm".replace("-", "\N{MINUS SIGN}"),
                (x, y),
                (0.6 * radius * np.sin(labels[k]), 0.66 * radius * np.cos(labels[k])),
                ha="center",
                va="center",
                fontsize=7,
                arrowprops={"arrowstyle": "-", "lw": 0.5, "color": "0.6", "shrinkB": 4},
            )
        axis.set_aspect("equal")
        axis.set_xlim(-1.4 * radius, 1.4 * radius)
        axis.set_ylim(-1.4 * radius, 1.4 * radius)
        axis.set_xlabel("x [m]")
        axis.set_ylabel("y from the axis [m]")
        axis.set_title(
            f"deformation, {factor:g} times enlarged (largest {1e3 * np.hypot(radial, tangential).max():.1f} mm)\n"
            "at the joints: rotation, and opening (+) or closing (\N{MINUS SIGN})"
        )
        _legend_below(figure, axis)
    return figure


def inflow(history: xr.Dataset) -> Picture:
    """Inflow mass, and areas of flow zone and disturbed zone, over time."""
    time = history["time"].values
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(4.6, 4.4), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True)
        upper.plot(time, history["inflow_mass"].values, color=NOW)
        upper.set_ylabel("inflow mass [kg/m]")
        lower.plot(time, history["flow_zone_area"].values, color=GATE, label="flow zone (> 50 mm)")
        lower.plot(time, history["disturbed_area"].values, color=SECOND, ls="--", label="disturbed (10 to 50 mm)")
        lower.set_ylabel("area [m²]")
        lower.set_xlabel("time since the gate opened [s]")
        lower.legend(loc="best")
        for axis in (upper, lower):
            axis.set_ylim(bottom=0)
            axis.set_xlim(0, max(float(time[-1]), 1e-9))
            axis.grid(True)
            axis.spines[["top", "right"]].set_visible(False)
        figure.align_ylabels()
    return figure


def draw_run(run: str | Path, folder: str | Path) -> list[Path]:
    """Draw every picture a run has data for, as PNG.

    Parameters
    ----------
    run : str or path
        Run folder or file.
    folder : str or path
        Where the pictures go; made when absent.

    Returns
    -------
    list of Path
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    sources = {
        "mesh": (mesh_near_gate, lambda: read_mesh(run)),
        "fields": (fields_around_tunnel, lambda: read_points(run, -1)),
        "pressures": (pressures_polar, lambda: read_pressures(run)),
        "internal_forces": (internal_forces, lambda: read_response(run)),
        "deformed_ring": (deformed_ring, lambda: read_response(run)),
        "inflow": (inflow, lambda: read_history(run)),
    }
    attributes = read_pressures(run).attrs
    lined = "tunnel_x" in attributes
    for tunnel in range(len(np.atleast_1d(attributes.get("tunnel_x", [])))):
        if tunnel != int(attributes.get("gate_tunnel", 0)):
            sources |= _of_tunnel(run, tunnel)
    written = []
    for name, (draw, read) in sources.items():
        if not lined and name != "inflow":
            continue
        try:
            dataset = read()
        except RunFileError:
            if name.startswith(("internal_forces", "deformed_ring", "fields")):
                continue  # a scene without a ring has no response, and one may keep no points
            raise
        path = folder / f"{name}.png"
        draw(dataset).savefig(path, dpi=RESOLUTION)
        written.append(path)
    return written


def _of_tunnel(run, tunnel):
    """Pictures of a tunnel without the gate: name to what draws and what reads it."""

    def pressures(dataset):
        return pressures_polar(dataset, tunnel=tunnel)

    def response():
        return read_response(run, tunnel=tunnel)

    def fields(points):
        return fields_around_tunnel(points, tunnel=tunnel)

    return {
        f"fields_tunnel_{tunnel}": (fields, lambda: read_points(run, -1)),
        f"pressures_tunnel_{tunnel}": (pressures, lambda: read_pressures(run)),
        f"internal_forces_tunnel_{tunnel}": (internal_forces, response),
        f"deformed_ring_tunnel_{tunnel}": (deformed_ring, response),
    }


class _Geometry:
    """Tunnels and gate from the attributes of a dataset, and how to draw them."""

    def __init__(self, dataset):
        attrs = dataset.attrs
        names = ("tunnel_x", "tunnel_axis_depth", "tunnel_outer_radius", "tunnel_inner_radius")
        missing = [name for name in names if name not in attrs]
        if missing:
            raise ValueError(f"dataset: attributes {', '.join(missing)} are needed; read it from a run")
        self.tunnels = list(zip(*(np.atleast_1d(attrs[name]) for name in names), strict=True))
        self.tunnel = int(attrs.get("gate_tunnel", 0))
        self.gate = None
        if "gate_angle" in attrs:
            self.gate = {"angle": float(attrs["gate_angle"]), "width": float(attrs["gate_width"])}

    @property
    def centre(self):
        """Axis (x, y) and outer radius of the gate's tunnel [m]."""
        return self.centre_of(self.tunnel)

    def centre_of(self, tunnel):
        """Axis (x, y) and outer radius of a tunnel [m]."""
        x, depth, outer, _ = self.tunnels[tunnel]
        return float(x), -float(depth), float(outer)

    @property
    def thickness(self):
        """Of the gate's tunnel [m]."""
        return float(self.tunnels[self.tunnel][2] - self.tunnels[self.tunnel][3])

    def at(self, theta, radius):
        """Position at an angle [degree] and radius [m] of the gate's tunnel."""
        x, y, _ = self.centre
        return x + radius * np.sin(np.radians(theta)), y + radius * np.cos(np.radians(theta))

    def draw(self, axis, zorder=1):
        """Lining in grey, with the gate."""
        for k, (x, depth, outer, inner) in enumerate(self.tunnels):
            style = {"fc": CONCRETE, "ec": "0.25", "lw": 0.6, "zorder": zorder}
            if self.gate is None or k != self.tunnel:
                axis.add_patch(Annulus((x, -depth), outer, outer - inner, **style))
                continue
            # the walls of the gate are parallel: its angle differs on the two faces
            faces = []
            for radius in (outer, inner):
                half = np.arcsin(self.gate["width"] / 2 / radius)
                angle = np.radians(self.gate["angle"]) + np.linspace(half, 2 * np.pi - half, 361)
                faces.append(np.stack([x + radius * np.sin(angle), -depth + radius * np.cos(angle)], axis=1))
            axis.add_patch(Polygon(np.concatenate([faces[0], faces[1][::-1]]), **style))

    def mark_gate(self, axis):
        """A red triangle at the gate on the rim of a polar diagram."""
        if self.gate is not None:
            axis.plot(
                np.radians(self.gate["angle"]), axis.get_ylim()[1], "v", color=GATE, ms=6, clip_on=False, label="gate"
            )


def _draw_points(axis, data, values, colours, norm):
    """Points as discs in data units, wide enough to close the gaps between elements, the smallest on top."""
    order = np.argsort(-data["volume"], kind="stable")
    size = 1.9 * np.sqrt(data["volume"][order])
    discs = EllipseCollection(
        size, size, np.zeros_like(size), units="xy", offsets=np.stack([data["x"], data["y"]], axis=1)[order],
        offset_transform=axis.transData, array=values[order], cmap=colours, norm=norm, linewidths=0, rasterized=True,
        zorder=2,
    )  # fmt: skip
    axis.add_collection(discs)
    return discs


def _frame(axis, x, y, half):
    axis.set_aspect("equal")
    axis.set_xlim(x - half, x + half)
    axis.set_ylim(y - half, y + half)
    for direction in (axis.xaxis, axis.yaxis):
        direction.set_major_locator(MaxNLocator(5, steps=(1, 2, 5, 10)))


def _crown_up(axis):
    axis.set_theta_zero_location("N")
    axis.set_theta_direction(-1)
    axis.set_thetagrids(np.arange(0, 360, 45))
    axis.tick_params(axis="x", pad=2)
    axis.grid(True)


def _radial_ticks(axis, geometry, count=5):
    """Few radial ticks, written along a ray away from the gate."""
    axis.yaxis.set_major_locator(MaxNLocator(count))
    away = 172.0 if geometry is None or geometry.gate is None else (geometry.gate["angle"] + 202.5) % 360
    axis.set_rlabel_position(away)
    axis.tick_params(axis="y", labelsize=6.5, colors="0.3")
    for label in axis.get_yticklabels():
        label.set_bbox({"fc": "white", "ec": "none", "alpha": 0.75, "pad": 0.4})


def _legend_below(figure, axis):
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))


def _closed(angle, values):
    return np.append(angle, angle[0] + 2 * np.pi), np.append(values, values[0])


def _moment(record):
    text = f"{float(record['time']):.3g} s"
    return text + (f", {float(record['inflow_mass']):.0f} kg/m" if "inflow_mass" in record else "")


def _round_down(value):
    """1, 2 or 5 times a power of ten, at most `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-12)))


def _centred(angle, radial, tangential):
    """Radial and tangential displacement without the mean displacement of the ring, (2, n) float64."""
    horizontal = np.mean(radial * np.sin(angle) + tangential * np.cos(angle))
    vertical = np.mean(radial * np.cos(angle) - tangential * np.sin(angle))
    return (
        radial - horizontal * np.sin(angle) - vertical * np.cos(angle),
        tangential - horizontal * np.cos(angle) + vertical * np.sin(angle),
    )


def _place(angle, radius, radial, tangential):
    return (
        (radius + radial) * np.sin(angle) + tangential * np.cos(angle),
        (radius + radial) * np.cos(angle) - tangential * np.sin(angle),
    )


def _spread(angles, least=1.15):
    """Angles moved apart in pairs until neighbours are `least` radians from each other."""
    moved = angles.copy()
    for k in range(len(angles)):
        after = (k + 1) % len(angles)
        lack = least - (angles[after] - angles[k]) % (2 * np.pi)
        if lack > 0 and len(angles) > 1:
            moved[k] -= 0.5 * lack
            moved[after] += 0.5 * lack
    return moved


def _segments(angle, joints):
    """Indices of the angles between one joint and the next; the whole closed ring without joints."""
    everything = np.arange(len(angle))
    if not len(joints):
        return [np.append(everything, 0)]
    number = np.searchsorted(joints, angle) % len(joints)
    result = []
    for k in range(len(joints)):
        mine = everything[number == k]
        if k == 0:
            mine = np.concatenate([mine[angle[mine] > joints[-1]], mine[angle[mine] <= joints[-1]]])
        result.append(mine)
    return result


__all__ = [
    "common_tops", "deformed_ring", "draw_run", "fields_around_tunnel", "inflow", "internal_forces", "mesh_near_gate",
    "pressures_polar",
]  # fmt: skip
