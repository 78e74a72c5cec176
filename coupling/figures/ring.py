"""Pictures of a lining: its pressures, its internal forces, its deformation."""

import json
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.patches import Annulus

from coupling.datasets.geometry import gate_of, gate_tunnel, joints_of, on_tunnel
from coupling.figures.picture import GATE, INITIAL, NOW, Picture, legend_outside, styled
from coupling.figures.polar import around_zero, at_time, closed_curve, crown_up, radial_ticks
from coupling.figures.tunnel import mark_gate, mark_joints
from coupling.postprocess.extremes import extremes
from coupling.postprocess.ring_shape import centred
from structure.response import FORCES, SHOWN


def pressures_polar(
    pressures: xr.Dataset, time: int = -1, tunnel: int | None = None, joints: Sequence[float] = ()
) -> Picture:
    """Soil and water pressure on the lining, initial against now.

    Parameters
    ----------
    pressures : xarray.Dataset
        `/lining` of a run.
    time : int
        Index of the record called "now".
    tunnel : int, optional
        Which one, when there are several; that of the gate when left out.
    joints : sequence of float
        Angles of the ring's joints [degree], marked.
    """
    pressures = on_tunnel(pressures, tunnel)
    angle = np.radians(pressures["theta"].values)
    first, now = pressures.isel(time=0), pressures.isel(time=time)
    with styled(7.2, 4.0) as figure:
        axes = figure.subplots(1, 2, subplot_kw={"projection": "polar"})
        for axis, name in zip(axes, ("soil_pressure", "water_pressure"), strict=True):
            crown_up(axis)
            axis.plot(
                *closed_curve(angle, first[name].values / 1e3), color=INITIAL, ls=(0, (4, 2)), lw=1.2, label="initial"
            )
            axis.plot(*closed_curve(angle, now[name].values / 1e3), color=NOW, label=at_time(now))
            axis.set_ylim(0, 1.08 * max(first[name].max(), now[name].max()) / 1e3)
            radial_ticks(axis, gate_of(pressures))
            if tunnel in (None, gate_tunnel(pressures)):
                mark_gate(axis, pressures)
            mark_joints(axis, joints)
            axis.set_title(SHOWN[name].label, pad=12)
        legend_outside(figure, axes[0])
    return figure


def internal_forces(response: xr.Dataset, time: int = -1) -> Picture:
    """Axial force, shear force and bending moment around the ring, initial against now, with their extremes.

    Parameters
    ----------
    response : xarray.Dataset
        `/structure/<model>` of a run, or what `respond` returned.
    time : int
        Index of the record called "now".
    """
    angle = np.radians(response["theta"].values)
    first, now = response.isel(time=0), response.isel(time=time)
    found = extremes(now)
    with styled(7.4, 3.15) as figure:
        axes = figure.subplots(1, 3, subplot_kw={"projection": "polar"})
        for axis, name in zip(axes, FORCES, strict=True):
            crown_up(axis)
            scale = SHOWN[name].scale
            start, end = scale * first[name].values, scale * now[name].values
            axis.plot(*closed_curve(angle, np.zeros_like(angle)), color="0.2", lw=0.8)
            axis.plot(*closed_curve(angle, start), color=INITIAL, ls=(0, (4, 2)), lw=1.1, label="initial")
            axis.plot(*closed_curve(angle, end), color=NOW, label=at_time(now))
            axis.fill_between(*closed_curve(angle, end), 0.0, color=NOW, alpha=0.12, lw=0)
            around_zero(axis, start, end)
            mark_joints(axis, joints_of(response))
            told = []
            for kind in ("max", "min"):
                value, at = scale * found[f"{name}_{kind}"].item(), found[f"{name}_{kind}_angle"].item()
                axis.plot(np.radians(at), value, "o", ms=2.8, color=NOW)
                told.append(f"{kind} {value:.0f} at {at:.4g}°".replace("-", "\N{MINUS SIGN}"))
            axis.set_title(SHOWN[name].label, pad=10)
            axis.set_xlabel(",  ".join(told), labelpad=6)
        legend_outside(figure, axes[0])
    return figure


def deformed_ring(response: xr.Dataset, time: int = -1) -> Picture:
    """The deformed ring, initial against now, exaggerated, with its joints and their rotations.

    Parameters
    ----------
    response : xarray.Dataset
        Response of a ring; its attribute `ring` gives the geometry.
    time : int
        Index of the record called "now".
    """
    ring = json.loads(response.attrs["ring"])
    outer, inner = ring["outer_diameter"] / 2, ring["inner_diameter"] / 2
    radius = 0.5 * (outer + inner)
    angle = np.radians(response["theta"].values)
    states = [response.isel(time=0), response.isel(time=time)]
    # relative to the mean motion: a ring that moves as a whole does not deform
    shapes = [centred(angle, s["displacement_radial"].values, s["displacement_tangential"].values) for s in states]
    largest = max(float(np.hypot(*shape).max()) for shape in shapes)
    factor = _round_down(0.18 * radius / max(largest, 1e-12))
    joints = np.radians(joints_of(response))
    with styled(4.6, 4.7) as figure:
        axis = figure.subplots()
        axis.add_patch(Annulus((0, 0), outer, outer - inner, fc="0.92", ec="0.8", lw=0.5, zorder=0))
        styles = ({"color": INITIAL, "ls": (0, (4, 2)), "lw": 1.1, "label": "initial"}, {"color": NOW})
        styles[1]["label"] = at_time(states[1])
        for (radial, tangential), style in zip(shapes, styles, strict=True):
            x, y = _place(angle, radius, factor * radial, factor * tangential)
            for segment in _segments(angle, joints):
                axis.plot(x[segment], y[segment], **style)
                style = {**style, "label": None}
        radial, tangential = shapes[1]
        labels = _spread(joints)
        for k, joint in enumerate(joints):
            here = [np.interp(joint, angle, values, period=2 * np.pi) for values in (radial, tangential)]
            x, y = _place(joint, radius, factor * here[0], factor * here[1])
            axis.plot(x, y, "o", ms=5, mfc="white", mec=GATE, mew=1.2, zorder=5)
            rotation = 1e3 * float(states[1]["joint_rotation"][k])
            opening = 1e3 * float(states[1]["joint_opening"][k])
            axis.annotate(
                f"{k + 1}:  {rotation:+.2f} mrad\n{opening:+.2f} mm".replace("-", "\N{MINUS SIGN}"),
                (x, y),
                (0.6 * radius * np.sin(labels[k]), 0.66 * radius * np.cos(labels[k])),
                ha="center",
                va="center",
                fontsize=7,
                arrowprops={"arrowstyle": "-", "lw": 0.5, "color": "0.6", "shrinkB": 4},
            )
        axis.set_aspect("equal")
        axis.set_xlim(-1.4 * radius, 1.4 * radius)
        axis.set_ylim(-1.4 * radius, 1.4 * radius)
        axis.set_xlabel("x [m]")
        axis.set_ylabel("y from the axis [m]")
        axis.set_title(
            f"deformation, {factor:g} times enlarged (largest {1e3 * np.hypot(radial, tangential).max():.1f} mm)\n"
            "at the joints: rotation, and opening (+) or closing (\N{MINUS SIGN})"
        )
        legend_outside(figure, axis)
    return figure


def _round_down(value):
    """1, 2 or 5 times a power of ten, at most `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-12)))


def _place(angle, radius, radial, tangential):
    return (
        (radius + radial) * np.sin(angle) + tangential * np.cos(angle),
        (radius + radial) * np.cos(angle) - tangential * np.sin(angle),
    )


def _spread(angles, least=1.15):
    """Angles moved apart in pairs until neighbours are `least` radians from each other."""
    moved = angles.copy()
    for k in range(len(angles)):
        after = (k + 1) % len(angles)
        lack = least - (angles[after] - angles[k]) % (2 * np.pi)
        if lack > 0 and len(angles) > 1:
            moved[k] -= 0.5 * lack
            moved[after] += 0.5 * lack
    return moved


def _segments(angle, joints):
    """Indices of the angles between one joint and the next; the whole closed ring without joints."""
    everything = np.arange(len(angle))
    if not len(joints):
        return [np.append(everything, 0)]
    number = np.searchsorted(joints, angle) % len(joints)
    result = []
    for k in range(len(joints)):
        mine = everything[number == k]
        if k == 0:
            mine = np.concatenate([mine[angle[mine] > joints[-1]], mine[angle[mine] <= joints[-1]]])
        result.append(mine)
    return result
