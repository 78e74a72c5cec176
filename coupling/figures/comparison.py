"""Pictures of two lining models side by side, each a function of their responses."""

import matplotlib
import numpy as np
from matplotlib.lines import Line2D

from coupling.figures.picture import STYLE, Picture
from coupling.figures.polar import around_zero, at_time, closed_curve, crown_up, legend_below
from structure.response import FORCES, SHOWN

COLOURS, DASHES = ("0.25", "#c1272d"), ("-", (0, (4, 2)))
MOST_JOINTS_NAMED = 8
JOINTS = ("joint_opening", "joint_dislocation", "joint_rotation")


def forces_compared(responses):
    """N, Q and M around the ring, at the first and the last time, one curve a model.

    Parameters
    ----------
    responses : dict of xarray.Dataset
        Model name to response.
    """
    one = next(iter(responses.values()))
    times = [0, -1] if one.sizes["time"] > 1 else [0]
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.4, 3.0 * len(times) + 0.2), layout="constrained")
        axes = figure.subplots(len(times), 3, subplot_kw={"projection": "polar"}, squeeze=False)
        for row, time in zip(axes, times, strict=True):
            for axis, name in zip(row, FORCES, strict=True):
                _forces_panel(axis, responses, name, time)
                axis.set_title(f"{SHOWN[name].label}\n{at_time(one.isel(time=time))}", pad=10)
        legend_below(figure, axes[0, 0])
    return figure


def _forces_panel(axis, responses, name, time):
    crown_up(axis)
    curves = {model: SHOWN[name].scale * response[name].isel(time=time) for model, response in responses.items()}
    for (model, curve), colour, dash in zip(curves.items(), COLOURS, DASHES, strict=False):
        angle = np.radians(curve["theta"].values)
        axis.plot(*closed_curve(angle, curve.values), color=colour, ls=dash, lw=1.1, label=model)
    axis.plot(np.linspace(0, 2 * np.pi, 181), np.zeros(181), color="0.2", lw=0.6)
    around_zero(axis, *curves.values())


def joints_compared(responses):
    """Opening, dislocation and rotation of every joint over inflow mass (or time), one line style a model.

    Parameters
    ----------
    responses : dict of xarray.Dataset
        Model name to response.
    """
    one = next(iter(responses.values()))
    mass = "inflow_mass" in one
    abscissa = one["inflow_mass" if mass else "time"].values
    joints = one["joint"].values
    colours = matplotlib.colormaps["viridis"](np.linspace(0, 0.9, len(joints)))
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.4, 3.2), layout="constrained")
        axes = figure.subplots(1, 3)
        for axis, name in zip(axes, JOINTS, strict=True):
            for response, dash in zip(responses.values(), DASHES, strict=False):
                for k, colour in enumerate(colours):
                    marker = "o" if len(abscissa) == 1 else None
                    axis.plot(
                        abscissa,
                        SHOWN[name].scale * response[name].values[:, k],
                        color=colour,
                        ls=dash,
                        marker=marker,
                        ms=3,
                    )
            axis.set_title(SHOWN[name].label)
            axis.set_xlabel("inflow mass [kg/m]" if mass else "time [s]")
            axis.grid(True)
        handles = [
            Line2D([], [], color="0.2", ls=dash, label=model) for model, dash in zip(responses, DASHES, strict=False)
        ]
        shown = sorted({0, len(joints) - 1}) if len(joints) > MOST_JOINTS_NAMED else range(len(joints))
        handles += [Line2D([], [], color=colours[k], label=f"joint {joints[k]}") for k in shown]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure
