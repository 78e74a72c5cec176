"""Figures 19 to 23 of the published study: cases beside each other at 1000 kg/m, by gate, cover and soil."""

import numpy as np

from coupling import postprocess
from coupling.figures.picture import styled
from coupling.postprocess.ring_shape import centred
from verification.published.lining_figures import JOINTS, rings

#: Group to the scenes in it, and what is said of a scene that sets it apart.
GROUPS = {
    "location of the gate": (tuple(f"case-{k}" for k in range(1, 6)), lambda s: f"gate at {s.gate.angle:g}°"),
    "cover": (("case-9", "case-10", "case-3"), lambda s: f"cover {s.tunnels[0].cover:g} m"),
    "soil": (("case-3", "case-6", "case-7", "case-8"), lambda s: s.soils[0].name),
}
MOVES = {"convergence_horizontal": "horizontal", "convergence_vertical": "vertical", "settlement": "settlement"}


def pressure_ratios(cases):
    """Soil and water pressure over the initial ones, by groups of cases (figure 19).

    cases : dict of str to RunEvidence, by scene; those that did not get to 1000 kg/m are shown where they ended.
    """
    return _rings(cases, {
        f"{what} pressure over the initial one [-]": lambda run, what=what: postprocess.pressure_ratio(
            run.of_gate, f"{what}_pressure", run.compared).values
        for what in ("soil", "water")
    })  # fmt: skip


def additional_axial_force(cases):
    """What the event adds to the axial force of the ring, by groups of cases (figure 20)."""
    return _rings(cases, {"additional axial force [kN/m]": lambda run: run.added["axial_force"].values / 1e3})


def additional_bending_moment(cases):
    """What the event adds to the bending moment of the ring, by groups of cases (figure 21)."""
    return _rings(cases, {"additional bending moment [kN m/m]": lambda run: run.added["bending_moment"].values / 1e3})


def deformation(cases):
    """Additional radial deformation of the ring, without its motion as a whole (figure 22)."""

    def shape(run):
        moved = (1e3 * run.added[f"displacement_{way}"].values for way in ("radial", "tangential"))
        return centred(np.radians(run.added["theta"].values), *moved)[0]

    return _rings(cases, {"additional radial deformation [mm]": shape})


def displacement(cases):
    """Additional convergence and settlement of the ring, by groups of cases (figure 22, second part)."""
    rows = {"convergence and\nsettlement [mm]": lambda run: [1e3 * float(run.added[name]) for name in MOVES]}
    return _bars(cases, rows, list(MOVES.values()), "")


def joint_deformation(cases):
    """Opening, dislocation and rotation that the event adds to every joint, by groups of cases (figure 23)."""
    rows = {f"additional\n{title}": lambda run, name=name, scale=scale: scale * run.added[name].values
            for name, (title, scale) in JOINTS.items()}  # fmt: skip
    joints = next(iter(cases.values())).added["joint"].values
    return _bars(cases, rows, [str(joint) for joint in joints], "joint")


def _members(cases, group):
    names, text = GROUPS[group]
    there = [(k, cases[name]) for k, name in enumerate(names) if name in cases]
    return [(text(run.scene), run, {"color": f"C{k}"}) for k, run in there]


def _rings(cases, rows):
    """One row of polar panels a quantity, title to function of a run; one column a group."""
    panels = [
        (title, [(label, values(run), style | {"lw": 1.2}) for label, run, style in _members(cases, group)])
        for title, values in rows.items() for group in GROUPS
    ]  # fmt: skip
    return rings(panels, len(GROUPS), heads=[f"by {group}" for group in GROUPS])


def _bars(cases, rows, labels, what):
    """One row of bar charts a quantity, title to function of a run; one column a group."""
    with styled(7.4, 1.8 * len(rows) + 0.9) as figure:
        axes = np.atleast_2d(figure.subplots(len(rows), len(GROUPS), sharey="row", sharex=True))
        for line, (title, values) in zip(axes, rows.items(), strict=True):
            for axis, group in zip(line, GROUPS, strict=True):
                members = _members(cases, group)
                width = 0.8 / max(len(members), 1)
                for k, (label, run, style) in enumerate(members):
                    place = np.arange(len(labels)) + (k - 0.5 * (len(members) - 1)) * width
                    axis.bar(place, values(run), width, label=label, **style)
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
