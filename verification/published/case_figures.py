"""Figures 19 to 23 of the published study: cases beside each other at one inflow mass, by gate, cover and soil."""

from __future__ import annotations

import matplotlib
import numpy as np

from coupling.figures import STYLE
from coupling.figures.picture import Picture
from coupling.figures.polar import closed_curve, crown_up, radial_ticks
from coupling.figures.ring import centred
from verification.published.lining_figures import JOINTS
from verification.published.sources import at_study_inflow

#: Group to the scenes in it, and what sets them apart: name of the coordinate, its text.
GROUPS = {
    "location of the gate": (("case-1", "case-2", "case-3", "case-4", "case-5"), "gate_angle", "gate at {:g}°"),
    "cover": (("case-9", "case-10", "case-3"), "cover", "cover {:g} m"),
    "soil": (("case-3", "case-6", "case-7", "case-8"), "soil", "{}"),
}


def pressure_ratios(study, inflow_mass):
    """Soil and water pressure over the initial ones, by groups of cases (figure 19).

    Parameters
    ----------
    study : xarray.Dataset
        Dataset of the study `table-2`.
    inflow_mass : float
        [kg/m]
    """
    now = at_study_inflow(study, inflow_mass)
    rows = {}
    for name, title in (("soil_pressure", "soil pressure"), ("water_pressure", "water pressure")):
        rows[f"{title} over the initial one [-]"] = (study["theta"].values, now[name] / study[name].isel(progress=0))
    return _polar(study, rows, f"at {inflow_mass:.0f} kg/m")


def additional_forces(study, inflow_mass, name, title, model="beam-spring"):
    """What the event adds to a force of the ring, by groups of cases (figures 20 and 21).

    name, title : variable of a response, and its title with the unit kN; otherwise as :func:`pressure_ratios`.
    """
    one = study.sel(model=model)
    added = (at_study_inflow(one, inflow_mass)[name] - one[name].isel(progress=0, drop=True)) / 1e3
    return _polar(study, {title: (study["theta"].values, added)}, f"at {inflow_mass:.0f} kg/m, {model}")


def deformation(study, inflow_mass, model="beam-spring"):
    """Additional deformation of the ring, without its motion as a whole, and its displacement (figure 22)."""
    one = study.sel(model=model)
    now, first = at_study_inflow(one, inflow_mass), one.isel(progress=0, drop=True)
    angle = np.radians(study["theta"].values)
    radial = 1e3 * (now["displacement_radial"] - first["displacement_radial"])
    tangential = 1e3 * (now["displacement_tangential"] - first["displacement_tangential"])
    shape = radial.copy(data=np.stack([
        centred(angle, r, t)[0] for r, t in zip(radial.values, tangential.values, strict=True)
    ]))  # fmt: skip
    figure = _polar(
        study, {"additional radial deformation [mm]": (study["theta"].values, shape)},
        f"at {inflow_mass:.0f} kg/m, {model}", extra_rows=1,
    )  # fmt: skip
    bars = {
        "convergence_horizontal": "horizontal",
        "convergence_vertical": "vertical",
        "settlement": "settlement",
    }
    with matplotlib.rc_context(STYLE):
        for column, (group, (names, _, _)) in enumerate(GROUPS.items()):
            axis = figure.add_subplot(2, len(GROUPS), len(GROUPS) + column + 1)
            values = [1e3 * (now[name] - first[name]) for name in bars]
            _bars(axis, study, group, names, values, list(bars.values()))
            if column == 0:
                axis.set_ylabel("additional convergence\nand settlement [mm]")
    return figure


def joint_deformation(study, inflow_mass, model="beam-spring"):
    """Opening, dislocation and rotation that the event adds to every joint, by groups of cases (figure 23)."""
    one = study.sel(model=model)
    now, first = at_study_inflow(one, inflow_mass), one.isel(progress=0, drop=True)
    joints = study["joint"].values
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.4, 6.0), layout="constrained")
        axes = figure.subplots(len(JOINTS), len(GROUPS), sharey="row")
        for row, (name, (title, scale)) in zip(axes, JOINTS.items(), strict=True):
            added = scale * (now[name] - first[name])
            for axis, (group, (names, _, _)) in zip(row, GROUPS.items(), strict=True):
                _bars(axis, study, group, names, [added.sel(joint=joint) for joint in joints], [str(j) for j in joints])
            row[0].set_ylabel(f"additional {title}")
        for axis, group in zip(axes[0], GROUPS, strict=True):
            axis.set_title(f"by {group}")
        for axis in axes[-1]:
            axis.set_xlabel("joint")
            axis.legend(fontsize=6, loc="upper center", bbox_to_anchor=(0.5, -0.28), ncols=2)
        figure.suptitle(f"at {inflow_mass:.0f} kg/m, {model}", fontsize=9)
    return figure


def _members(study, group):
    """Position in the study and label of every case of a group that it has."""
    names, coordinate, text = GROUPS[group]
    scenes = study["scene"].values.tolist()
    return [(scenes.index(n), text.format(study[coordinate].values[scenes.index(n)])) for n in names if n in scenes]


def _polar(study, rows, title, extra_rows=0):
    """One row of polar panels a quantity, one column a group; rows: title to (angles [degree], (case, angle) array)."""
    count = len(rows) + extra_rows
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.4, 2.9 * count + 0.3), layout="constrained")
        for r, (name, (theta, values)) in enumerate(rows.items()):
            angle, data = np.radians(theta), values.transpose("case", ...).values
            known = data[np.isfinite(data).all(axis=1)]
            low, high = min(0.0, known.min(initial=0.0)), known.max(initial=1e-9)
            for c, group in enumerate(GROUPS):
                axis = figure.add_subplot(count, len(GROUPS), r * len(GROUPS) + c + 1, projection="polar")
                crown_up(axis)
                for k, (case, label) in enumerate(_members(study, group)):
                    axis.plot(*closed_curve(angle, data[case]), color=f"C{k}", lw=1.1, label=label)
                if low < 0:
                    axis.plot(*closed_curve(angle, 0 * angle), color="0.2", lw=0.7)
                    axis.set_rorigin(low - 0.4 * (high - low))
                axis.set_ylim(low - 0.05 * (high - low) * (low < 0), high + 0.05 * (high - low))
                radial_ticks(axis, None, 4)
                if r == 0:
                    axis.set_title(f"by {group}", pad=8)
                if c == 0:
                    axis.set_ylabel(name, labelpad=28)
                if r == len(rows) - 1:
                    axis.legend(fontsize=6, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2)
        figure.suptitle(title, fontsize=9)
    return figure


def _bars(axis, study, group, names, values, labels):
    members = _members(study, group)
    width = 0.8 / max(len(members), 1)
    for k, (case, label) in enumerate(members):
        heights = [float(value.values[case]) for value in values]
        axis.bar(np.arange(len(values)) + (k - 0.5 * (len(members) - 1)) * width, heights, width, color=f"C{k}",
                 label=label)  # fmt: skip
    axis.axhline(0.0, color="0.2", lw=0.6)
    axis.set_xticks(range(len(labels)), labels)
    axis.grid(True, axis="y")
