"""Figures 7 and 13 to 17 of the published study: pressures on the lining and what the ring answers, over the event.

Each is drawn of a :class:`verification.published.evidence.RunEvidence`.
"""

import numpy as np

from coupling import postprocess
from coupling.datasets.geometry import gate_of
from coupling.figures import GATE, INITIAL, NOW, deformed_ring
from coupling.figures.picture import legend_outside, styled
from coupling.figures.polar import around_zero, closed_curve, crown_up, radial_ticks
from structure.response import FORCES, SHOWN
from verification.published.evidence import initial_theory
from verification.published.ground_figures import mass_colours

PRESSURES = {"soil_pressure": "soil pressure", "water_pressure": "water pressure"}
JOINTS = {
    name: (SHOWN[name].label, SHOWN[name].scale) for name in ("joint_opening", "joint_dislocation", "joint_rotation")
}


def rings(panels, columns, gate=None, joints=(), heads=()):
    """Polar diagrams beside and below each other, the crown up.

    panels : list of (title, curves), curves: list of (label, (n,) values at whole degrees, keys of a line);
    columns : int, panels beside each other; every column has the legend of its lowest panel below it, or all the same
        one;
    gate : float, optional, angle of a red mark on the rim [degree];
    joints : sequence of float, angles of grey marks [degree];
    heads : sequence of str, titles of the columns; those of the panels then stand beside the rows.
    """
    count = -(-len(panels) // columns)
    height = (2.4 if heads else 3.0) * count + 1.1 * bool(heads)
    # legends below columns are more than the constrained layout finds room for
    with styled(7.4, height, None if heads else "constrained") as figure:
        if heads:
            figure.subplots_adjust(0.1, 0.8 / height, 0.98, 1 - 0.4 / height, wspace=0.45, hspace=0.3)
        axes = figure.subplots(count, columns, subplot_kw={"projection": "polar"}, squeeze=False)
        for axis, (title, curves) in zip(axes.flat, panels, strict=True):
            crown_up(axis)
            for label, values, style in curves:
                axis.plot(*closed_curve(np.radians(np.arange(len(values))), values), label=label, **style)
            around_zero(axis, *(values[np.isfinite(values)] for _, values, _ in curves))
            if axis.get_ylim()[0] < 0:
                axis.plot(*closed_curve(np.radians(np.arange(360)), np.zeros(360)), color="0.2", lw=0.8)
            radial_ticks(axis, None, 4)
            rim = axis.get_ylim()[1]
            axis.plot(np.radians(joints), np.full(len(joints), rim), "s", color="0.5", ms=3, clip_on=False, zorder=5)
            if gate is not None:
                axis.plot(np.radians(gate), rim, "v", color=GATE, ms=6, clip_on=False, zorder=6)
            if heads:
                axis.set_ylabel(title if axis in axes[:, 0] else "", labelpad=28)
            else:
                axis.set_title(title, pad=12)
        for axis, head in zip(axes[0], heads, strict=False):
            axis.set_title(head, pad=12)
        below = axes[-1] if heads else axes[-1][:1]
        for axis in below:
            if heads:
                axis.legend(fontsize=6.5, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2)
            else:
                legend_outside(figure, axis)
    return figure


def _states(dataset, masses):
    """Initial state and those at some inflow masses: (label, dataset, keys of a line)."""
    states = [("initial", dataset.isel(time=0), {"color": INITIAL, "ls": (0, (4, 2)), "lw": 1.1})]
    colours = mass_colours(len(masses))
    return states + [(f"{m:.0f} kg/m", postprocess.at_inflow(dataset, m), {"color": c})
                     for m, c in zip(masses, colours, strict=True)]  # fmt: skip


def initial_pressures(run):
    """Figure 7: initial soil and water pressure on every tunnel's lining against the theoretical ones."""
    first = (run.at_rest if run.at_rest is not None else run.pressures).isel(time=0)
    theory = [initial_theory(run.scene, tunnel) for tunnel in run.scene.tunnels]
    tunnels = [first] if "tunnel" not in first.dims else [first.isel(tunnel=k) for k in range(first.sizes["tunnel"])]
    with styled(3.5 * len(tunnels), 3.2) as figure:
        axes = np.atleast_1d(figure.subplots(1, len(tunnels), sharey=True))
        for k, (axis, ours, theirs) in enumerate(zip(axes, tunnels, theory, strict=True)):
            for (name, title), colour in zip(PRESSURES.items(), ("#8a5a00", NOW), strict=True):
                axis.plot(ours["theta"], ours[name] / 1e3, color=colour, label=f"{title}, computed")
                axis.plot(theirs["theta"], theirs[name] / 1e3, color="k", lw=0.9, ls="--", label=f"{title}, theory")
            axis.set(xlabel="angle from the crown, clockwise [°]", xticks=np.arange(0, 361, 90), xlim=(0, 360))
            axis.set(ylim=(0, None), title=f"tunnel {k}" if len(tunnels) > 1 else "")
            axis.grid(True)
        axes[0].set_ylabel("pressure [kPa]")
        legend_outside(figure, axes[0], columns=2)
    return figure


def pressures_by_inflow(run):
    """Figure 13: soil and water pressure around the lining, initial and at some inflow masses."""
    states = _states(run.of_gate, run.masses)
    panels = [
        (f"{title} [kPa]", [(label, state[name].values / 1e3, style) for label, state, style in states])
        for name, title in PRESSURES.items()
    ]
    return rings(panels, 2, gate_of(run.of_gate).angle, run.ring["joint_angle"].values)


def pressure_ratios_by_inflow(run):
    """Figure 14: soil and water pressure over the initial one at some inflow masses."""
    states = _states(run.of_gate, run.masses)
    panels = [
        (f"{title} over the initial one [-]",
         [(label, state[name].values / states[0][1][name].values, style) for label, state, style in states])
        for name, title in PRESSURES.items()
    ]  # fmt: skip
    return rings(panels, 2, gate_of(run.of_gate).angle, run.ring["joint_angle"].values)


def forces_by_inflow(run):
    """Figure 15: N, Q and M around the ring, initial and at some inflow masses."""
    states = _states(run.ring, run.masses)
    panels = [
        (SHOWN[name].label, [(label, SHOWN[name].scale * state[name].values, style) for label, state, style in states])
        for name in FORCES
    ]
    return rings(panels, 3, run.scene.gate.angle, run.ring["joint_angle"].values)


def deformation(run):
    """Figure 15, second part: the deformed ring."""
    return deformed_ring(run.ring, int(np.abs(run.ring["inflow_mass"].values - run.compared).argmin()))


def extremes_over_inflow(run):
    """Figure 16: largest and smallest N, Q and M over inflow mass, one line style a lining model."""
    styles = {"_max": ("largest", NOW), "_min": ("smallest", "#c1272d")}
    curves = []
    for name in FORCES:
        lines = []
        for (model, response), dashes in zip(run.responses.items(), ("-", "--", ":", "-."), strict=False):
            found = postprocess.extremes(response)
            lines += [(f"{word}, {model}", response["inflow_mass"], found[name + end] * SHOWN[name].scale,
                       {"color": colour, "ls": dashes}) for end, (word, colour) in styles.items()]  # fmt: skip
        curves.append((SHOWN[name].label, lines))
    return _over_inflow(curves)


def joints_over_inflow(run):
    """Figure 17: opening, dislocation and rotation of every joint over inflow mass."""
    response, mass = run.ring, run.ring["inflow_mass"]
    return _over_inflow([
        (title, [(f"joint {joint}", mass, scale * response[name].sel(joint=joint), {"color": f"C{k}"})
                 for k, joint in enumerate(response["joint"].values)])
        for name, (title, scale) in JOINTS.items()
    ])  # fmt: skip


def _over_inflow(panels):
    """Panels beside each other over inflow mass: (title, list of (label, mass, values, keys of a line))."""
    with styled(7.4, 2.8) as figure:
        axes = figure.subplots(1, len(panels))
        for axis, (title, lines) in zip(axes, panels, strict=True):
            for label, mass, values, style in lines:
                axis.plot(mass, values, label=label, **style)
            axis.set(xlabel="inflow mass [kg/m]", ylabel=title)
            axis.grid(True)
        legend_outside(figure, axes[0])
    return figure
