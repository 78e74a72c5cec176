"""How large elements are asked to be: by the box, the linings, the gate and the inside of its tunnel."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mpm.scene import Scene, Tunnel

if TYPE_CHECKING:
    from numpy.typing import NDArray


def element_size(scene: Scene, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Element size asked for at (x, y) [m]: the smallest of the scene's sizes, each growing with distance.

    Parameters
    ----------
    x, y : array
        Positions [m], any shape.
    """
    d = scene.discretisation
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    size, slope = np.full(np.broadcast(x, y).shape, d.element_size), scene.discretisation.growth
    for each in scene.tunnels:
        gap = np.abs(np.hypot(x - each.x, y + each.axis_depth) - each.outer_radius)
        size = np.minimum(size, d.element_size_lining + slope * gap)
    gate, tunnel = scene.gate, gate_tunnel(scene)
    if gate is None or tunnel is None:
        return size
    inside = np.hypot(x - tunnel.x, y + tunnel.axis_depth) < tunnel.inner_radius
    size = np.where(inside, np.minimum(size, d.element_size_interior), size)
    # Distance to the channel, from outer to inner face and from wall to wall.
    along, across = gate_axes(gate.angle)
    s = (x - tunnel.x) * along[0] + (y + tunnel.axis_depth) * along[1]
    t = (x - tunnel.x) * across[0] + (y + tunnel.axis_depth) * across[1]
    beside = np.maximum(np.abs(t) - gate.width / 2, 0.0)
    distance = np.hypot(s - np.clip(s, tunnel.inner_radius, tunnel.outer_radius), beside)
    return np.minimum(size, gate_size(scene) + slope * distance)


def gate_tunnel(scene: Scene) -> Tunnel | None:
    """The tunnel whose lining has the gate."""
    return None if scene.gate is None else scene.tunnels[scene.gate.tunnel]


def gate_size(scene: Scene) -> float:
    """Element size across the channel [m]."""
    assert scene.gate is not None
    return scene.gate.width / scene.discretisation.elements_across_gate


def headroom_height(scene: Scene) -> float:
    """Height of the empty mesh above the ground [m], one element unless given."""
    return scene.box.headroom or scene.discretisation.element_size


def gate_axes(angle: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Unit vectors (radial, outward) and (tangential, clockwise) at `angle` [deg]."""
    theta = math.radians(angle)
    return (math.sin(theta), math.cos(theta)), (math.cos(theta), -math.sin(theta))


def size_callback(scene: Scene, factor: float) -> Any:
    """`factor` times `element_size` for one point, in scalar arithmetic: gmsh asks some 10 000 times."""
    d, slope = scene.discretisation, scene.discretisation.growth
    rings = [(t.x, -t.axis_depth, t.outer_radius) for t in scene.tunnels]
    gate, tunnel = scene.gate, gate_tunnel(scene)

    def size(dim: int, tag: int, x: float, y: float, z: float, lc: float) -> float:
        result = d.element_size
        for xt, yt, radius in rings:
            gap = abs(math.hypot(x - xt, y - yt) - radius)
            result = min(result, d.element_size_lining + slope * gap)
        if gate is None or tunnel is None:
            return factor * result
        dx, dy = x - tunnel.x, y + tunnel.axis_depth
        if math.hypot(dx, dy) < tunnel.inner_radius:
            result = min(result, d.element_size_interior)
        s = dx * along[0] + dy * along[1]
        t = dx * across[0] + dy * across[1]
        beside = max(abs(t) - gate.width / 2, 0.0)
        distance = math.hypot(s - min(max(s, tunnel.inner_radius), tunnel.outer_radius), beside)
        return factor * min(result, at_gate + slope * distance)

    if gate is not None:
        along, across = gate_axes(gate.angle)
        at_gate = gate_size(scene)
    return size
