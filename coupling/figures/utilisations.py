"""Pictures of checks: the ring's forces in the M-N diagram of its section, and every utilisation over time."""

import json

import matplotlib
import numpy as np
from matplotlib.colors import Normalize

from coupling.figures.picture import GATE, INITIAL, styled
from structure.limits import UTILISATIONS
from structure.response import SHOWN

#: Told apart also without colour: five colours of Okabe and Ito, then the same with dashes.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "0.15")
DASHES = ("-", (0, (5, 2)), (0, (1, 1.5)))
RECORDS = 6  # clouds of points drawn in the diagram, the first and the last among them


def checks(checked):
    """M-N diagram with the points of the ring through time, and utilisations over time or over inflow mass.

    Parameters
    ----------
    checked : xarray.Dataset
        What :func:`structure.check` returned. Without a limit of the section only the utilisations are drawn.
    """
    if "largest_utilisation" not in checked:
        raise ValueError("checks: the dataset must come from structure.check(response, limits), got a plain response")
    with_section = "section_utilisation" in checked
    with styled(7.4 if with_section else 4.2, 3.6) as figure:
        axes = np.atleast_1d(figure.subplots(1, 2 if with_section else 1))
        if with_section:
            _diagram(figure, axes[0], checked)
        _over_time(figure, axes[-1], checked, 3 if with_section else 1)
    return figure


def _diagram(figure, axis, checked):
    shown = {name: SHOWN[name] for name in ("bending_moment", "axial_force")}
    boundary = [one.scale * checked[f"capacity_{name}"].values for name, one in shown.items()]
    axis.fill(*boundary, color="0.94", lw=0)
    axis.plot(*boundary, color="0.2", lw=1.2)
    time = checked["time"].values
    chosen = np.unique(np.linspace(0, len(time) - 1, min(RECORDS, len(time))).round().astype(int))
    colours, norm = matplotlib.colormaps["viridis_r"], Normalize(time[0], max(time[-1], time[0] + 1e-9))
    for record in chosen[::-1]:  # earlier states, usually the closer ones, on top
        state = checked.isel(time=int(record))
        axis.scatter(
            *(one.scale * state[f"design_{name}"].values for name, one in shown.items()),
            s=7,
            color=colours(norm(time[record])),
            lw=0,
            zorder=3,
        )
    worst = checked["section_utilisation"].isel(checked["section_utilisation"].argmax(("time", "theta")))
    state = checked.sel(time=worst["time"], theta=worst["theta"])
    place = [one.scale * state[f"design_{name}"].item() for name, one in shown.items()]
    axis.plot(*place, "o", ms=7, mfc="none", mec=GATE, mew=1.2, zorder=4)
    axis.set_title(
        f"largest utilisation {worst.item():.2f} at {worst['theta'].item():.4g}°, {worst['time'].item():.3g} s\n"
        f"({json.loads(checked.attrs['limits'])['capacity']['utilisation'].replace('_', ' ')})"
    )
    if len(chosen) > 1:
        bar = figure.colorbar(matplotlib.cm.ScalarMappable(norm, colours), ax=axis, shrink=0.9, pad=0.02)
        bar.set_label("time since the gate opened [s]")
        bar.outline.set_linewidth(0.5)
    # thin rings use the lower corner of their diagram: the view ends at three times their axial force
    top = min(
        boundary[1].max(), 3.0 * max(shown["axial_force"].scale * checked["design_axial_force"].max().item(), 0.0)
    )
    axis.set_ylim(1.1 * min(boundary[1].min(), place[1]), max(1.1 * top, 0.1 * boundary[1].max()))
    axis.axhline(0, color="0.6", lw=0.5)
    axis.axvline(0, color="0.6", lw=0.5)
    axis.set_xlabel(f"design {shown['bending_moment'].label}")
    axis.set_ylabel(f"design {shown['axial_force'].label}, compression positive")


def _over_time(figure, axis, checked, columns):
    over_mass = "inflow_mass" in checked and checked["inflow_mass"].values[-1] > 0
    along = checked["inflow_mass" if over_mass else "time"].values
    top = 1.0
    names = [name for name in UTILISATIONS if name in checked]
    for k, name in enumerate(names):
        largest = checked[name].max([d for d in checked[name].dims if d != "time"]).values
        largest = np.where(np.isfinite(largest), largest, np.nan)  # what nothing carries has no place on an axis
        style = {"color": COLOURS[k % len(COLOURS)], "ls": DASHES[k // len(COLOURS) % len(DASHES)]}
        axis.plot(along, largest, marker="o" if len(along) == 1 else None, label=UTILISATIONS[name], **style)
        top = max(top, np.nanmax(largest, initial=0.0))
    axis.axhline(1.0, color=GATE, lw=1.0, ls=(0, (4, 2)))
    axis.annotate("limit", (0.01, 1.0), xycoords=("axes fraction", "data"), va="bottom", color=GATE, fontsize=7)
    axis.set_ylim(0, 1.12 * top)
    if len(along) > 1:
        axis.set_xlim(along[0], along[-1])
    axis.set_xlabel("inflow mass [kg/m]" if over_mass else "time since the gate opened [s]")
    axis.set_ylabel("largest utilisation [-]")
    axis.grid(True, color="0.88")
    axis.spines[["top", "right"]].set_visible(False)
    axis.tick_params(colors=INITIAL, labelcolor="0.1")
    figure.legend(loc="outside lower center", ncols=min(len(names), columns), fontsize=7)
