"""Figures 6 and 9 to 12 of the published study: settlement, inflow and flow zone, fields and stresses in the ground.

Each is drawn of a :class:`verification.published.evidence.RunEvidence`.
"""

import matplotlib
import numpy as np
from matplotlib.colors import LogNorm, Normalize, TwoSlopeNorm
from matplotlib.tri import Triangulation

from coupling import postprocess
from coupling.datasets.geometry import tunnel_of
from coupling.figures import GATE, INITIAL, SECOND, STYLE, inflow
from coupling.figures.ground import FIELD_COLOURS, frame_view
from coupling.figures.picture import legend_outside, styled
from coupling.figures.tunnel import draw_linings
from coupling.postprocess.elements import cell_means

#: Displacements that bound the flow zone and the disturbed zone [mm].
ZONES = (50.0, 10.0)


def mass_colours(count):
    """Colours of a series of inflow masses, from light to dark blue."""
    return matplotlib.colormaps["Blues"](np.linspace(0.4, 1.0, count))


def settlement_troughs(run):
    """Figure 6: settlement of the ground surface at some inflow masses, with the width of each trough."""
    with styled(5.6, 3.2) as figure:
        axis = figure.subplots()
        for mass, colour in zip(run.masses, mass_colours(len(run.masses)), strict=True):
            now = postprocess.at_inflow(run.settlement, mass)["settlement"]
            width = float(postprocess.trough(now.expand_dims("time"))["width"][0])
            text = f"{mass:.0f} kg/m" + (f", i = {width:.1f} m" if np.isfinite(width) else "")
            axis.plot(now["x"], 1e3 * now, color=colour, label=text)
        axis.invert_yaxis()
        axis.set(xlabel="x [m]", ylabel="settlement [mm]")
        axis.grid(True)
        axis.legend(loc="best")
    return figure


def inflow_and_stages(run):
    """Figure 9: inflow mass and areas of both zones over time, with the three stages of the flow zone."""
    stages, time = postprocess.flow_zone_stages(run.history), run.history["time"].values
    nodes = [float(time[0]), *stages.bends, float(time[-1])]
    names = ("initial", "rapid", "stable") if stages.appear else ("first piece", "second", "third")
    figure = inflow(run.history)
    with matplotlib.rc_context(STYLE):
        upper, lower = figure.axes
        lower.plot(nodes, stages.areas, "o-", color="0.2", lw=0.8, ms=3, label="three straight pieces")
        lower.legend(loc="best")
        for axis in (upper, lower):
            for bend in stages.bends:
                axis.axvline(bend, color="0.6", lw=0.7, ls=":")
        for name, left, right in zip(names, nodes[:-1], nodes[1:], strict=True):
            upper.annotate(
                name, (0.5 * (left + right), 1.0), (0, 2), xycoords=("data", "axes fraction"),
                textcoords="offset points", ha="center", va="bottom", fontsize=7,
            )  # fmt: skip
    return figure


def fields_around(run):
    """Figure 10: displacement with the edges of both zones, deviatoric strain, pore pressure, vertical stress."""
    now = postprocess.at_inflow(run.fields, run.compared)
    panels = (
        ("displacement [mm]", 1e3 * now["displacement"].values, LogNorm(1.0, 1000.0), "both"),
        ("deviatoric strain [-]", now["deviatoric_strain"].values, LogNorm(1e-3, 1.0), "both"),
        ("pore pressure [kPa]", now["pore_pressure"].values / 1e3, Normalize(0.0, 400.0), "max"),
        ("vertical effective stress [kPa]", now["soil_stress_vertical"].values / 1e3, Normalize(0.0, 300.0), "max"),
    )
    with styled(7.2, 6.4) as figure:
        axes = figure.subplots(2, 2, sharex=True, sharey=True)
        for axis, (title, values, norm, extend), colours in zip(axes.flat, panels, FIELD_COLOURS, strict=True):
            drawn, triangles, nodal = _draw_field(axis, run.mesh, values, colours, norm)
            if title.startswith("displacement"):
                lines = axis.tricontour(triangles, nodal, levels=sorted(ZONES), colors=[SECOND, GATE], linewidths=1.0)
                axis.clabel(lines, fmt="%g mm", fontsize=6.5)
            bar = figure.colorbar(drawn, ax=axis, shrink=0.92, extend=extend, pad=0.02)
            bar.outline.set_linewidth(0.5)
            axis.set_title(title)
        _label(axes)
        figure.suptitle(f"{run.compared:.0f} kg/m", fontsize=9)
    return figure


def stress_variation_fields(run):
    """Figure 12: R_sigma (Eq. 10) of the vertical stress around the tunnel at the last inflow masses."""
    name, masses, fields = "soil_stress_vertical", run.masses[-2:], run.fields
    initial = fields[name].isel(time=0, drop=True)
    with styled(3.4 * len(masses) + 0.6, 3.5) as figure:
        axes = np.atleast_2d(figure.subplots(1, len(masses), sharey=True))
        for axis, mass in zip(axes[0], masses, strict=True):
            now = postprocess.at_inflow(fields[[name, "inflow_mass"]], mass)[name]
            ratio = postprocess.stress_variation(now, initial).values
            drawn, *_ = _draw_field(axis, run.mesh, ratio, "RdBu_r", TwoSlopeNorm(0.0, -1.0, 1.0))
            axis.set_title(f"{mass:.0f} kg/m")
        _label(axes)
        bar = figure.colorbar(drawn, ax=list(axes[0]), extend="max", shrink=0.9, pad=0.02)
        bar.set_label(f"R$_\\sigma$ of the {fields[name].attrs['long_name'].partition(',')[0]} [-]")
        bar.outline.set_linewidth(0.5)
    return figure


def _label(axes):
    for axis in axes[-1]:
        axis.set_xlabel("x [m]")
    for axis in axes[:, 0]:
        axis.set_ylabel("y [m]")


def _draw_field(axis, mesh, values, colours, norm):
    """The ground's element means, projected on its nodes, with linings and gate; triangles and nodal values too."""
    x0, y0, radius, _ = tunnel_of(mesh)
    nodes, count = mesh["element_nodes"].values, mesh.sizes["node"]
    shown = (mesh["region"].values == 0) & np.isfinite(values)
    area = postprocess.element_areas(mesh)[shown]
    corners = nodes[shown]
    nodal = np.nan_to_num(cell_means(corners.ravel(), np.repeat(area, 3), np.repeat(values[shown], 3), count))
    triangles = Triangulation(mesh["x"].values, mesh["y"].values, corners)
    clipped = np.clip(nodal, norm.vmin, None) if isinstance(norm, LogNorm) else nodal
    drawn = axis.tripcolor(triangles, clipped, cmap=colours, norm=norm, shading="gouraud", rasterized=True)
    draw_linings(axis, mesh, zorder=3)
    frame_view(axis, x0, y0, 3.5 * radius)
    return drawn, triangles, nodal


def stresses_along_axes(run):
    """Figure 11: soil stress across, and pore pressure along, both axes through the gate at some inflow masses."""
    panels = (
        (run.horizontal, "soil_stress_vertical", "vertical effective stress [kPa]"),
        (run.horizontal, "pore_pressure", "pore pressure [kPa]"),
        (run.vertical, "soil_stress_horizontal", "horizontal effective stress [kPa]"),
        (run.vertical, "pore_pressure", "pore pressure [kPa]"),
    )
    diameter = postprocess.gate_diameter(run.horizontal)
    with styled(7.2, 5.4) as figure:
        axes = figure.subplots(2, 2)
        for axis, (data, name, title) in zip(axes.flat, panels, strict=True):
            # the line breaks at the lining, not where a cell between two elements happens to hold no point
            known = data["distance"].values
            breaks = 0.5 * (known[1:] + known[:-1])[np.diff(known) > 0.4 * diameter]
            whole = data[[name, "inflow_mass"]].reindex(distance=np.sort(np.append(known, breaks)))
            place = whole["distance"] / diameter
            axis.plot(place, whole[name].isel(time=0) / 1e3, color=INITIAL, ls=(0, (4, 2)), lw=1.1, label="initial")
            for mass, colour in zip(run.masses, mass_colours(len(run.masses)), strict=True):
                now = postprocess.at_inflow(whole, mass)[name]
                axis.plot(place, now / 1e3, color=colour, label=f"{mass:.0f} kg/m")
            axis.axvline(0.0, color=GATE, lw=0.8, ls=":")
            axis.set(xlim=(max(-4.0, float(place.min())), min(4.0, float(place.max()))), ylabel=title)
            axis.set(xlabel=f"{data.attrs['direction']} distance from the gate over D")
            axis.grid(True)
        legend_outside(figure, axes[0, 0])
    return figure
