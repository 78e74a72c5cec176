"""Tunnels and gate as a picture shows them."""

import numpy as np
from matplotlib.patches import Annulus, Polygon

from coupling.datasets.geometry import gate_of, tunnel_list
from coupling.figures.picture import CONCRETE, GATE


def draw_linings(axis, dataset, zorder=1):
    """Linings in grey, with the gate."""
    gate, style = gate_of(dataset), {"fc": CONCRETE, "ec": "0.25", "lw": 0.6, "zorder": zorder}
    for k, tunnel in enumerate(tunnel_list(dataset)):
        if gate is None or k != gate.tunnel:
            axis.add_patch(Annulus((tunnel.x, tunnel.y), tunnel.outer, tunnel.outer - tunnel.inner, **style))
            continue
        # the walls of the gate are parallel: its angle differs on the two faces
        faces = []
        for radius in (tunnel.outer, tunnel.inner):
            half = np.degrees(np.arcsin(gate.width / 2 / radius))
            faces.append(np.stack(tunnel.at(gate.angle + np.linspace(half, 360 - half, 361), radius), axis=1))
        axis.add_patch(Polygon(np.concatenate([faces[0], faces[1][::-1]]), **style))


def mark_gate(axis, dataset):
    """A red triangle at the gate on the rim of a polar diagram."""
    gate = gate_of(dataset)
    if gate is not None:
        axis.plot(np.radians(gate.angle), axis.get_ylim()[1], "v", color=GATE, ms=6, clip_on=False, label="gate")


def mark_joints(axis, angles):
    """Dotted lines with the joints' numbers in a polar diagram whose limits are set."""
    low, high = axis.get_ylim()
    for number, angle in enumerate(np.radians(angles), start=1):
        axis.plot([angle, angle], [low, high], color="0.35", lw=0.7, ls=(0, (1, 2)), zorder=1)
        place, box = (angle, low + 0.93 * (high - low)), {"fc": "white", "ec": "none", "alpha": 0.7, "pad": 0.3}
        axis.annotate(str(number), place, ha="center", va="center", fontsize=6, color="0.2", bbox=box)
