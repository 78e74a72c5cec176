"""Pictures of lining models side by side, each a function of their responses."""

import matplotlib
import numpy as np
from matplotlib.lines import Line2D

from coupling.datasets.geometry import joints_of
from coupling.figures.picture import legend_outside, styled
from coupling.figures.polar import around_zero, at_time, closed_curve, crown_up
from coupling.figures.tunnel import mark_joints
from structure.response import FORCES, SHOWN

COLOURS, DASHES = ("0.25", "#c1272d"), ("-", (0, (4, 2)))
MOST_JOINTS_NAMED = 8
JOINTS = ("joint_opening", "joint_dislocation", "joint_rotation")


def forces_compared(responses):
    """N, Q and M around the ring at the first and the last time, one curve a model, and how far others are apart.

    Parameters
    ----------
    responses : dict of xarray.Dataset
        Model name to response.
    """
    one = next(iter(responses.values()))
    times = [0, -1] if one.sizes["time"] > 1 else [0]
    with styled(7.4, 3.0 * len(times) + 2.2) as figure:
        grid = figure.add_gridspec(len(times) + 1, 3, height_ratios=[*[3.0] * len(times), 1.8])
        for row, time in enumerate(times):
            for column, name in enumerate(FORCES):
                axis = figure.add_subplot(grid[row, column], projection="polar")
                _forces_panel(axis, responses, name, time)
                axis.set_title(f"{SHOWN[name].label}\n{at_time(one.isel(time=time))}", pad=10)
        legend_outside(figure, figure.axes[0])
        for column, name in enumerate(FORCES):
            _differences_panel(figure.add_subplot(grid[-1, column]), responses, name, times)
    return figure


def _differences_panel(axis, responses, name, times):
    """How far the others are from the first over the angle, at the first time in grey, at the last in colour."""
    (first_name, first), *others = responses.items()
    for other_name, other in others:
        apart = SHOWN[name].scale * (other[name] - first[name])
        for time, colour in zip(times, ("0.6", COLOURS[1])[-len(times) :], strict=True):
            axis.plot(apart["theta"], apart.isel(time=time), color=colour, lw=1.0, label=at_time(first.isel(time=time)))
        axis.set_title(f"{SHOWN[name].short} of {other_name}\nless {first_name} [{SHOWN[name].unit}]")
    for angle in joints_of(first):
        axis.axvline(angle, color="0.35", lw=0.6, ls=(0, (1, 2)))
    axis.set_xlim(0, 360)
    axis.set_xticks(range(0, 361, 90))
    axis.set_xlabel("angle from the crown [°]")
    axis.axhline(0, color="0.2", lw=0.5)
    axis.grid(True)
    axis.legend(fontsize=6, loc="best")


def _forces_panel(axis, responses, name, time):
    crown_up(axis)
    curves = {model: SHOWN[name].scale * response[name].isel(time=time) for model, response in responses.items()}
    for (model, curve), colour, dash in zip(curves.items(), COLOURS, DASHES, strict=False):
        angle = np.radians(curve["theta"].values)
        axis.plot(*closed_curve(angle, curve.values), color=colour, ls=dash, lw=1.1, label=model)
    axis.plot(np.linspace(0, 2 * np.pi, 181), np.zeros(181), color="0.2", lw=0.6)
    around_zero(axis, *curves.values())
    mark_joints(axis, joints_of(next(iter(responses.values()))))


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
    with styled(7.4, 3.2) as figure:
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
