"""Figures 7 and 13 to 17 of the published study: pressures on the lining and what the ring answers, over the event."""

from __future__ import annotations

import matplotlib
import numpy as np

from coupling import postprocess
from coupling.datasets.geometry import gate_of
from coupling.figures import INITIAL, NOW, STYLE
from coupling.figures.picture import Picture
from coupling.figures.polar import around_zero, closed_curve, crown_up, legend_below, radial_ticks
from coupling.figures.tunnel import mark_gate
from structure.response import FORCES, SHOWN
from verification.published.ground_figures import mass_colours

PRESSURES = {"soil_pressure": "soil pressure", "water_pressure": "water pressure"}
JOINTS = {
    name: (SHOWN[name].label, SHOWN[name].scale) for name in ("joint_opening", "joint_dislocation", "joint_rotation")
}


def initial_pressures(pressures, theory):
    """Initial soil and water pressure on every tunnel's lining against the theoretical ones.

    Parameters
    ----------
    pressures : xarray.Dataset
        `/lining` of a run, the initial state first.
    theory : sequence of xarray.Dataset
        soil_pressure, water_pressure (theta) [Pa], one a tunnel.
    """
    first = pressures.isel(time=0)
    tunnels = [first] if "tunnel" not in first.dims else [first.isel(tunnel=k) for k in range(first.sizes["tunnel"])]
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(3.5 * len(tunnels), 3.2), layout="constrained")
        axes = np.atleast_1d(figure.subplots(1, len(tunnels), sharey=True))
        for k, (axis, ours, theirs) in enumerate(zip(axes, tunnels, theory, strict=True)):
            for (name, title), colour in zip(PRESSURES.items(), ("#8a5a00", NOW), strict=True):
                axis.plot(ours["theta"], ours[name] / 1e3, color=colour, label=f"{title}, computed")
                axis.plot(theirs["theta"], theirs[name] / 1e3, color="k", lw=0.9, ls="--", label=f"{title}, theory")
            axis.set_xlabel("angle from the crown, clockwise [°]")
            axis.set_xticks(np.arange(0, 361, 90))
            axis.set_xlim(0, 360)
            axis.set_ylim(bottom=0)
            axis.grid(True)
            if len(tunnels) > 1:
                axis.set_title(f"tunnel {k}")
        axes[0].set_ylabel("pressure [kPa]")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def pressures_by_inflow(pressures, masses):
    """Soil and water pressure around the lining, initial and at some inflow masses.

    Parameters
    ----------
    pressures : xarray.Dataset
        One tunnel.
    masses : sequence of float
        [kg/m]
    """
    states = [("initial", pressures.isel(time=0))]
    states += [(f"{mass:.0f} kg/m", postprocess.at_inflow(pressures, mass)) for mass in masses]
    panels = {name: (f"{title} [kPa]", [state[name] / 1e3 for _, state in states]) for name, title in PRESSURES.items()}
    return _rings(pressures, panels, [label for label, _ in states])


def pressure_ratios_by_inflow(pressures, masses):
    """Soil and water pressure over the initial one at some inflow masses; as :func:`pressures_by_inflow`."""
    panels = {}
    for name, title in PRESSURES.items():
        initial = pressures[name].isel(time=0)
        ratios = [postprocess.pressure_ratio(pressures, name, mass) for mass in masses]
        panels[name] = (f"{title} over the initial one [-]", [initial / initial, *ratios])
    return _rings(pressures, panels, ["initial", *(f"{mass:.0f} kg/m" for mass in masses)])


def _rings(pressures, panels, labels):
    angle = np.radians(pressures["theta"].values)
    colours = [INITIAL, *mass_colours(len(labels) - 1)]
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.2, 4.0), layout="constrained")
        axes = figure.subplots(1, 2, subplot_kw={"projection": "polar"})
        for axis, (title, rows) in zip(axes, panels.values(), strict=True):
            crown_up(axis)
            for k, (label, row) in enumerate(zip(labels, rows, strict=True)):
                dashes = {"ls": (0, (4, 2)), "lw": 1.1} if k == 0 else {}
                axis.plot(*closed_curve(angle, row.values), color=colours[k], label=label, **dashes)
            axis.set_ylim(0, 1.05 * max(float(row.max()) for row in rows))
            radial_ticks(axis, gate_of(pressures))
            mark_gate(axis, pressures)
            axis.set_title(title, pad=12)
        legend_below(figure, axes[0])
    return figure


def forces_by_inflow(response, masses):
    """N, Q and M around the ring, initial and at some inflow masses.

    Parameters
    ----------
    response : xarray.Dataset
        With inflow_mass (time) [kg/m].
    masses : sequence of float
        [kg/m]
    """
    angle = np.radians(response["theta"].values)
    states = [("initial", response.isel(time=0))]
    states += [(f"{mass:.0f} kg/m", postprocess.at_inflow(response, mass)) for mass in masses]
    colours = [INITIAL, *mass_colours(len(masses))]
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.4, 3.2), layout="constrained")
        axes = figure.subplots(1, 3, subplot_kw={"projection": "polar"})
        for axis, name in zip(axes, FORCES, strict=True):
            crown_up(axis)
            axis.plot(*closed_curve(angle, 0 * angle), color="0.2", lw=0.8)
            values = [SHOWN[name].scale * state[name].values for _, state in states]
            for k, ((label, _), row) in enumerate(zip(states, values, strict=True)):
                dashes = {"ls": (0, (4, 2)), "lw": 1.1} if k == 0 else {}
                axis.plot(*closed_curve(angle, row), color=colours[k], label=label, **dashes)
            around_zero(axis, *values)
            axis.set_title(SHOWN[name].label, pad=10)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def extremes_over_inflow(responses):
    """Largest and smallest N, Q and M over inflow mass, one line style a lining model.

    Parameters
    ----------
    responses : dict of str to xarray.Dataset
        By lining model.
    """
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.4, 2.8), layout="constrained")
        axes = figure.subplots(1, 3)
        for (model, response), style in zip(responses.items(), ("-", "--", ":", "-."), strict=False):
            found = postprocess.extremes(response)
            mass = response["inflow_mass"]
            for axis, name in zip(axes, FORCES, strict=True):
                axis.plot(mass, SHOWN[name].scale * found[f"{name}_max"], style, color=NOW, label=f"largest, {model}")
                axis.plot(
                    mass, SHOWN[name].scale * found[f"{name}_min"], style, color="#c1272d", label=f"smallest, {model}"
                )
                axis.set_ylabel(SHOWN[name].label)
                axis.set_xlabel("inflow mass [kg/m]")
                axis.grid(True)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def joints_over_inflow(response):
    """Opening, dislocation and rotation of every joint over inflow mass, response of one lining model."""
    mass = response["inflow_mass"]
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.4, 2.8), layout="constrained")
        axes = figure.subplots(1, 3)
        for axis, (name, (title, scale)) in zip(axes, JOINTS.items(), strict=True):
            for k, joint in enumerate(response["joint"].values):
                axis.plot(mass, scale * response[name].sel(joint=joint), color=f"C{k}", label=f"joint {joint}")
            axis.set_ylabel(title)
            axis.set_xlabel("inflow mass [kg/m]")
            axis.grid(True)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure
