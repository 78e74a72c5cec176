"""Diagrams around a ring, the crown up: axes, ticks, legend, closed curves."""

import numpy as np
from matplotlib.ticker import MaxNLocator


def crown_up(axis):
    axis.set_theta_zero_location("N")
    axis.set_theta_direction(-1)
    axis.set_thetagrids(np.arange(0, 360, 45))
    axis.tick_params(axis="x", pad=2)
    axis.grid(True)


def radial_ticks(axis, gate, count=5):
    """Few radial ticks, written along a ray away from the gate."""
    axis.yaxis.set_major_locator(MaxNLocator(count))
    away = 172.0 if gate is None else (gate.angle + 202.5) % 360
    axis.set_rlabel_position(away)
    axis.tick_params(axis="y", labelsize=6.5, colors="0.3")
    for label in axis.get_yticklabels():
        label.set_bbox({"fc": "white", "ec": "none", "alpha": 0.75, "pad": 0.4})


def around_zero(axis, *curves):
    """Let the axis hold curves of both signs and their zero line, a circle wide enough to read along."""
    low, high = (float(pick([0.0, *(pick(curve) for curve in curves)])) for pick in (np.min, np.max))
    margin = 0.08 * max(high - low, 1e-3)
    axis.set_ylim(low - margin * (low < 0), high + margin)
    if low < 0:
        axis.set_rorigin(low - margin - 0.5 * (high - low))
    radial_ticks(axis, None, 4)


def closed_curve(angle, values):
    return np.append(angle, angle[0] + 2 * np.pi), np.append(values, values[0])


def at_time(record):
    text = f"{float(record['time']):.3g} s"
    return text + (f", {float(record['inflow_mass']):.0f} kg/m" if "inflow_mass" in record else "")
