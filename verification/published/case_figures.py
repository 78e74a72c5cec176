"""Figures 19 to 23 of the published study: cases beside each other at one inflow mass, by gate, cover and soil."""

from __future__ import annotations

import matplotlib
import numpy as np

from coupling.figures import STYLE
from coupling.figures.picture import Picture
from coupling.figures.ring import centred
from verification.published.lining_figures import JOINTS, rings

#: Group to the scenes in it, and what sets them apart: name of the coordinate, its text.
GROUPS = {
    "location of the gate": (("case-1", "case-2", "case-3", "case-4", "case-5"), "gate_angle", "gate at {:g}°"),
    "cover": (("case-9", "case-10", "case-3"), "cover", "cover {:g} m"),
    "soil": (("case-3", "case-6", "case-7", "case-8"), "soil", "{}"),
}
BARS = {"convergence_horizontal": "horizontal", "convergence_vertical": "vertical", "settlement": "settlement"}


def at_study_inflow(study, inflow_mass: float):
    """All cases of a study at one inflow mass, linear between the states that were kept.

    Parameters
    ----------
    study : xarray.Dataset
        Of :func:`coupling.study`.
    inflow_mass : float
        [kg/m]

    Returns
    -------
    xarray.Dataset
        Variables with `progress`, without it; NaN for cases that did not get there.
    """
    import xarray as xr

    dependent = study[[name for name in study.data_vars if "progress" in study[name].dims]]
    parts = []
    for case in study["case"].values:
        one = dependent.sel(case=case)
        mass = one["inflow_mass"].values
        share = (
            np.interp(inflow_mass, mass, one["progress"].values, right=np.nan) if np.isfinite(mass).all() else np.nan
        )
        if not np.isfinite(share):
            parts.append(one.isel(progress=0, drop=True) * np.nan)
            continue
        parts.append(one.drop_vars("inflow_mass").interp(progress=share, assume_sorted=True).drop_vars("progress"))
    result = xr.concat(parts, dim="case", coords="different", compat="equals", join="outer")
    for name in dependent.data_vars:
        result[name].attrs = dict(dependent[name].attrs)
    return result.assign_coords(inflow_mass=inflow_mass)


def pressure_ratios(study, inflow_mass):
    """Soil and water pressure over the initial ones, by groups of cases (figure 19), at an inflow mass [kg/m]."""
    now = at_study_inflow(study, inflow_mass)
    return _rings(study, {
        f"{title} pressure over the initial one [-]": now[name] / study[name].isel(progress=0)
        for name, title in (("soil_pressure", "soil"), ("water_pressure", "water"))
    })  # fmt: skip


def additional_forces(study, inflow_mass, name, title, model="beam-spring"):
    """What the event adds to a force of the ring, by groups of cases (figures 20 and 21); title with the unit kN."""
    one = study.sel(model=model)
    return _rings(study, {title: (at_study_inflow(one, inflow_mass)[name] - one[name].isel(progress=0, drop=True)) / 1e3})


def deformation(study, inflow_mass, model="beam-spring"):
    """Additional deformation of the ring, without its motion as a whole (figure 22)."""
    now, first = (at_study_inflow(study.sel(model=model), inflow_mass), study.sel(model=model).isel(progress=0, drop=True))
    angle = np.radians(study["theta"].values)
    moved = [1e3 * (now[name] - first[name]) for name in ("displacement_radial", "displacement_tangential")]
    shape = moved[0].copy(data=np.stack([
        centred(angle, radial, along)[0] for radial, along in zip(*(part.values for part in moved), strict=True)
    ]))  # fmt: skip
    return _rings(study, {"additional radial deformation [mm]": shape})


def displacement(study, inflow_mass, model="beam-spring"):
    """Additional convergence and settlement of the ring, by groups of cases (figure 22, second part)."""
    one = study.sel(model=model)
    added = 1e3 * (at_study_inflow(one, inflow_mass)[list(BARS)] - one[list(BARS)].isel(progress=0, drop=True))
    return _bars(study, {"convergence and\nsettlement [mm]": [added[name] for name in BARS]}, list(BARS.values()), "")


def joint_deformation(study, inflow_mass, model="beam-spring"):
    """Opening, dislocation and rotation that the event adds to every joint, by groups of cases (figure 23)."""
    one, joints = study.sel(model=model), study["joint"].values
    now, first = at_study_inflow(one, inflow_mass), one.isel(progress=0, drop=True)
    rows = {f"additional\n{title}": [scale * (now[name] - first[name]).sel(joint=joint) for joint in joints]
            for name, (title, scale) in JOINTS.items()}  # fmt: skip
    return _bars(study, rows, [str(joint) for joint in joints], "joint")


def _members(study, group):
    """Position in the study and label of every case of a group that it has."""
    names, coordinate, text = GROUPS[group]
    scenes = study["scene"].values.tolist()
    return [(scenes.index(n), text.format(study[coordinate].values[scenes.index(n)])) for n in names if n in scenes]


def _rings(study, rows):
    """One row of polar panels a quantity, title to (case, theta) array; one column a group."""
    panels = []
    for title, values in rows.items():
        data = values.transpose("case", ...).values
        for group in GROUPS:
            curves = [(label, data[case], {"color": f"C{k}", "lw": 1.2})
                      for k, (case, label) in enumerate(_members(study, group)) if np.isfinite(data[case]).all()]  # fmt: skip
            panels.append((title, curves or [("none got there", np.zeros(360), {"color": "0.7"})]))
    return rings(panels, len(GROUPS), heads=[f"by {group}" for group in GROUPS])


def _bars(study, rows, labels, what):
    """One row of bar charts a quantity, title to one (case,) array a label; one column a group."""
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(7.4, 1.8 * len(rows) + 0.9), layout="constrained")
        axes = np.atleast_2d(figure.subplots(len(rows), len(GROUPS), sharey="row", sharex=True))
        for line, (title, values) in zip(axes, rows.items(), strict=True):
            for axis, group in zip(line, GROUPS, strict=True):
                members = _members(study, group)
                width = 0.8 / max(len(members), 1)
                for k, (case, label) in enumerate(members):
                    place = np.arange(len(values)) + (k - 0.5 * (len(members) - 1)) * width
                    heights = [float(value.values[case]) for value in values]
                    axis.bar(place, heights, width, color=f"C{k}", label=label)
                axis.axhline(0.0, color="0.2", lw=0.6)
                axis.set_xticks(range(len(labels)), labels)
                axis.grid(True, axis="y")
            line[0].set_ylabel(title)
        for axis, group in zip(axes[0], GROUPS, strict=True):
            axis.set_title(f"by {group}")
        for axis in axes[-1]:
            axis.set_xlabel(what)
            axis.legend(fontsize=6.5, loc="upper center", bbox_to_anchor=(0.5, -0.3 if what else -0.15), ncols=2)
    return figure
