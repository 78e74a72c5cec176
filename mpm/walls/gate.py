"""The gate of a lining: its corners, the walls of its channel, and what opens and shuts it."""

import math

import numpy as np

from mpm.fields import FIXED_X, FIXED_Y


def along_gate(scene):
    """Unit vector along the outer face at the gate, clockwise: normal to the channel's walls."""
    angle = math.radians(scene.gate.angle)
    return np.array([math.cos(angle), -math.sin(angle)])


def corner_normals(scene, mesh):
    """Normal into the ground of each corner while the gate is open, by node: there it bounds the channel.

    The corner at the smaller angle bounds it from below in angle.
    """
    if scene.gate is None:
        return {}
    sides = zip(mesh.corner_nodes.tolist(), mesh.corner_side.tolist(), strict=True)
    return {i: side * along_gate(scene) for i, side in sides}


def channel_nodes(scene, mesh):
    """Nodes of the channel's walls and of the inner face beside it, and their normals into what flows: (k,), (k, 2)."""
    tunnel = scene.tunnels[scene.gate.tunnel]
    inward = np.array([tunnel.x, -tunnel.axis_depth]) - mesh.nodes[mesh.inner_nodes]
    walls = np.multiply.outer(mesh.wall_side, along_gate(scene))
    normals = np.concatenate([walls, inward / np.linalg.norm(inward, axis=1)[:, None]])
    return np.concatenate([mesh.wall_nodes, mesh.inner_nodes]), normals


def open_corners(scene, mesh, fixed):
    """Let the corners of an open gate stand still where the scene holds them: changes `fixed` (n_nodes,)."""
    if scene.gate is not None and scene.gate.corners == "held":
        fixed[mesh.corner_nodes] |= FIXED_X | FIXED_Y


def shut_corners(mesh, fixed):
    """Let them move with the lining again."""
    fixed[mesh.corner_nodes] &= ~(FIXED_X | FIXED_Y)
