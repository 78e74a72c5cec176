"""Tunnels and gate as a picture shows them."""

from __future__ import annotations

import numpy as np
from matplotlib.patches import Annulus, Polygon

from coupling.figures.picture import CONCRETE, GATE


class Geometry:
    """Tunnels and gate from the attributes of a dataset, and how to draw them."""

    def __init__(self, dataset):
        attrs = dataset.attrs
        names = ("tunnel_x", "tunnel_axis_depth", "tunnel_outer_radius", "tunnel_inner_radius")
        missing = [name for name in names if name not in attrs]
        if missing:
            raise ValueError(f"dataset: attributes {', '.join(missing)} are needed; read it from a run")
        self.tunnels = list(zip(*(np.atleast_1d(attrs[name]) for name in names), strict=True))
        self.tunnel = int(attrs.get("gate_tunnel", 0))
        self.gate = None
        if "gate_angle" in attrs:
            self.gate = {"angle": float(attrs["gate_angle"]), "width": float(attrs["gate_width"])}

    @property
    def centre(self):
        """Axis (x, y) and outer radius of the gate's tunnel [m]."""
        return self.centre_of(self.tunnel)

    def centre_of(self, tunnel):
        """Axis (x, y) and outer radius of a tunnel [m]."""
        x, depth, outer, _ = self.tunnels[tunnel]
        return float(x), -float(depth), float(outer)

    @property
    def thickness(self):
        """Of the gate's tunnel [m]."""
        return float(self.tunnels[self.tunnel][2] - self.tunnels[self.tunnel][3])

    def at(self, theta, radius):
        """Position at an angle [degree] and radius [m] of the gate's tunnel."""
        x, y, _ = self.centre
        return x + radius * np.sin(np.radians(theta)), y + radius * np.cos(np.radians(theta))

    def draw(self, axis, zorder=1):
        """Lining in grey, with the gate."""
        for k, (x, depth, outer, inner) in enumerate(self.tunnels):
            style = {"fc": CONCRETE, "ec": "0.25", "lw": 0.6, "zorder": zorder}
            if self.gate is None or k != self.tunnel:
                axis.add_patch(Annulus((x, -depth), outer, outer - inner, **style))
                continue
            # the walls of the gate are parallel: its angle differs on the two faces
            faces = []
            for radius in (outer, inner):
                half = np.arcsin(self.gate["width"] / 2 / radius)
                angle = np.radians(self.gate["angle"]) + np.linspace(half, 2 * np.pi - half, 361)
                faces.append(np.stack([x + radius * np.sin(angle), -depth + radius * np.cos(angle)], axis=1))
            axis.add_patch(Polygon(np.concatenate([faces[0], faces[1][::-1]]), **style))

    def mark_gate(self, axis):
        """A red triangle at the gate on the rim of a polar diagram."""
        if self.gate is not None:
            axis.plot(
                np.radians(self.gate["angle"]), axis.get_ylim()[1], "v", color=GATE, ms=6, clip_on=False, label="gate"
            )
