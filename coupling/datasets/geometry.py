"""Tunnels and gate of a run, as attributes of its datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from mpm.scene import Scene as MpmScene


def geometry_attributes(scene: MpmScene) -> dict[str, Any]:
    """Tunnels and gate as attributes [m, degree], for figures that read datasets only."""
    attributes = {}
    if scene.tunnels:
        attributes |= {
            "tunnel_x": np.array([t.x for t in scene.tunnels]),
            "tunnel_axis_depth": np.array([t.axis_depth for t in scene.tunnels]),
            "tunnel_outer_radius": np.array([t.outer_radius for t in scene.tunnels]),
            "tunnel_inner_radius": np.array([t.inner_radius for t in scene.tunnels]),
        }
    if scene.gate is not None:
        attributes |= {
            "gate_tunnel": np.int64(scene.gate.tunnel),
            "gate_angle": float(scene.gate.angle),
            "gate_width": float(scene.gate.width),
        }
    return attributes
