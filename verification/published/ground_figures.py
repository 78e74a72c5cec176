"""Figures 6, 9, 11 and 12 of the published study: settlement, inflow and flow zone, stresses in the ground."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.colors import TwoSlopeNorm

from coupling import postprocess
from coupling.datasets.geometry import tunnel_of
from coupling.figures import GATE, INITIAL, NOW, SECOND, STYLE
from coupling.figures.ground import frame_view
from coupling.figures.picture import Picture
from coupling.figures.tunnel import draw_linings


def mass_colours(count):
    """Colours of a series of inflow masses, from light to dark blue."""
    return matplotlib.colormaps["Blues"](np.linspace(0.4, 1.0, count))


def settlement_troughs(settlement, masses):
    """Settlement of the ground surface at some inflow masses, with the width of each trough.

    Parameters
    ----------
    settlement : xarray.Dataset
        settlement (time, x) [m] and inflow_mass (time) [kg/m].
    masses : sequence of float
        [kg/m]
    """
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(5.6, 3.2), layout="constrained")
        axis = figure.subplots()
        for mass, colour in zip(masses, mass_colours(len(masses)), strict=True):
            now = postprocess.at_inflow(settlement, mass)["settlement"]
            width = float(postprocess.trough(now.expand_dims("time"))["width"][0])
            text = f"{mass:.0f} kg/m" + (f", i = {width:.1f} m" if np.isfinite(width) else "")
            axis.plot(now["x"], 1e3 * now, color=colour, label=text)
        axis.invert_yaxis()
        axis.set_xlabel("x [m]")
        axis.set_ylabel("settlement [mm]")
        axis.grid(True)
        axis.legend(loc="best")
    return figure


def inflow_and_stages(history, stages):
    """Inflow mass and areas of both zones over time, with the three stages of the flow zone.

    Parameters
    ----------
    history : xarray.Dataset
    stages : coupling.postprocess.Stages
        Over time.
    """
    time = history["time"].values
    nodes = [float(time[0]), *stages.bends, float(time[-1])]
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(5.2, 4.6), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True)
        upper.plot(time, history["inflow_mass"], color=NOW)
        upper.set_ylabel("inflow mass [kg/m]")
        lower.plot(time, history["flow_zone_area"], color=GATE, label="flow zone (> 50 mm)")
        lower.plot(time, history["disturbed_area"], color=SECOND, ls="--", label="disturbed (10 to 50 mm)")
        lower.plot(nodes, stages.areas, "o-", color="0.2", lw=0.8, ms=3, label="three straight pieces")
        lower.set_ylabel("area [m²]")
        lower.set_xlabel("time since the gate opened [s]")
        lower.legend(loc="best")
        names = ("initial", "rapid", "stable") if stages.appear else ("first piece", "second", "third")
        for axis in (upper, lower):
            for bend in stages.bends:
                axis.axvline(bend, color="0.6", lw=0.7, ls=":")
            axis.set_ylim(bottom=0)
            axis.set_xlim(0, max(float(time[-1]), 1e-9))
            axis.grid(True)
        for name, left, right in zip(names, nodes[:-1], nodes[1:], strict=True):
            upper.annotate(
                name, (0.5 * (left + right), 1.0), (0, 2), xycoords=("data", "axes fraction"),
                textcoords="offset points", ha="center", va="bottom", fontsize=7,
            )  # fmt: skip
        figure.align_ylabels()
    return figure


def stresses_along_axes(horizontal, vertical, masses):
    """Soil stress across, and pore pressure along, both axes through the gate at some inflow masses.

    Parameters
    ----------
    horizontal, vertical : xarray.Dataset
        Of :func:`coupling.postprocess.profile`, with inflow_mass (time).
    masses : sequence of float
        [kg/m]
    """
    panels = (
        (horizontal, "soil_stress_vertical", "vertical effective stress [kPa]"),
        (horizontal, "pore_pressure", "pore pressure [kPa]"),
        (vertical, "soil_stress_horizontal", "horizontal effective stress [kPa]"),
        (vertical, "pore_pressure", "pore pressure [kPa]"),
    )
    diameter = postprocess.gate_diameter(horizontal)
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.2, 5.4), layout="constrained")
        axes = figure.subplots(2, 2)
        for axis, (data, name, title) in zip(axes.flat, panels, strict=True):
            # the line breaks at the lining, not where a cell between two elements happens to hold no point
            known = data["distance"].values
            breaks = 0.5 * (known[1:] + known[:-1])[np.diff(known) > 0.4 * diameter]
            whole = data[[name, "inflow_mass"]].reindex(distance=np.sort(np.append(known, breaks)))
            place = whole["distance"] / diameter
            axis.plot(place, whole[name].isel(time=0) / 1e3, color=INITIAL, ls=(0, (4, 2)), lw=1.1, label="initial")
            for mass, colour in zip(masses, mass_colours(len(masses)), strict=True):
                now = postprocess.at_inflow(whole, mass)[name]
                axis.plot(place, now / 1e3, color=colour, label=f"{mass:.0f} kg/m")
            axis.axvline(0.0, color=GATE, lw=0.8, ls=":")
            axis.set_xlim(max(-4.0, float(place.min())), min(4.0, float(place.max())))
            axis.set_ylabel(title)
            axis.set_xlabel(f"{data.attrs['direction']} distance from the gate over D")
            axis.grid(True)
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(masses) + 1)
    return figure


def stress_variation_fields(fields, mesh, masses, name="soil_stress_vertical"):
    """R_sigma (Eq. 10) around the tunnel at some inflow masses.

    Parameters
    ----------
    fields : xarray.Dataset
        Of :func:`coupling.postprocess.element_fields`, with inflow_mass (time).
    mesh : xarray.Dataset
    masses : sequence of float
        [kg/m]
    name : str
        Stress that varies.
    """
    x0, y0, radius, _ = tunnel_of(mesh)
    half = 4.0 * radius
    corners = mesh["element_nodes"].values
    ground = (mesh["region"] == 0).values
    initial = fields[name].isel(time=0, drop=True)
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(3.4 * len(masses) + 0.6, 3.5), layout="constrained")
        axes = np.atleast_1d(figure.subplots(1, len(masses), sharey=True))
        for axis, mass in zip(axes, masses, strict=True):
            now = postprocess.at_inflow(fields[[name, "inflow_mass"]], mass)[name]
            ratio = postprocess.stress_variation(now, initial).values
            shown = ground & np.isfinite(ratio)
            drawn = axis.tripcolor(
                mesh["x"].values, mesh["y"].values, corners[shown], facecolors=ratio[shown], cmap="RdBu_r",
                norm=TwoSlopeNorm(0.0, -1.0, 1.0), rasterized=True,
            )  # fmt: skip
            draw_linings(axis, mesh, zorder=3)
            frame_view(axis, x0, y0, half)
            axis.set_title(f"{mass:.0f} kg/m")
            axis.set_xlabel("x [m]")
        axes[0].set_ylabel("y [m]")
        bar = figure.colorbar(drawn, ax=list(axes), extend="max", shrink=0.9, pad=0.02)
        about = fields[name].attrs["long_name"].partition(",")[0]
        bar.set_label(f"R$_\\sigma$ of the {about} [-]")
        bar.outline.set_linewidth(0.5)
    return figure
