"""Sides of the box: grains are held there; water too, or the ground beyond keeps its pressure and water passes."""

from itertools import pairwise

import numpy as np

from mpm.fields import SIDE_RECORD
from mpm.k0_procedure import initial_stress
from mpm.machine.compile import inline_kernel
from mpm.walls.contact import FIXED_X, FIXED_Y, MIRROR_X, OPEN_X, OPEN_Y, Pair


def sides_of(scene, mesh, mirror_line):
    """What holds the nodes on the sides of the box.

    Parameters
    ----------
    scene : mpm.scene.Scene
    mesh : mpm.mesh.Mesh
    mirror_line : (k,) int32
        Nodes on x = 0 of a half model.

    Returns
    -------
    fixed : (n_nodes,) int8
        Bits of `mpm.walls.contact`.
    sides : (n_nodes,) records of `mpm.fields.SIDE`
    """
    fixed, sides = np.zeros(len(mesh.nodes), np.int8), np.zeros(len(mesh.nodes), SIDE_RECORD)
    fixed[mesh.left] |= FIXED_X
    fixed[mesh.right] |= FIXED_X
    fixed[mesh.bottom] |= FIXED_X | FIXED_Y
    fixed[mirror_line] |= MIRROR_X
    if scene.water is not None and scene.water.sides == "held":
        if not len(mirror_line):
            _open(scene, mesh, mesh.left, "x", 1.0, sides)
        _open(scene, mesh, mesh.right, "x", -1.0, sides)
        _open(scene, mesh, mesh.bottom, "y", 1.0, sides)
        fixed[sides["area_x"] != 0] |= OPEN_X
        fixed[sides["area_y"] != 0] |= OPEN_X | OPEN_Y  # along the bottom, too
    return fixed, sides


def _open(scene, mesh, nodes, axis, inward, sides):
    """Let water pass the edges between some nodes, below the surface, against the pressure of the start.

    The push is exact where pressure is linear along an edge: inside, that of linear triangles is.
    """
    along = "y" if axis == "x" else "x"
    nodes = nodes[np.argsort(mesh.nodes[nodes, "xy".index(along)])]
    for a, b in pairwise(nodes):
        edge = mesh.nodes[[a, b]]
        if edge[:, 1].max() > 0.0:
            continue
        length = float(np.hypot(*(edge[1] - edge[0])))
        _, pressure = initial_stress(scene, -edge[:, 1])
        for node, own, other in ((a, pressure[0], pressure[1]), (b, pressure[1], pressure[0])):
            sides[f"area_{axis}"][node] += inward * length / 2
            sides[f"push_{axis}"][node] += inward * length * (2 * own + other) / 6


@inline_kernel
def past_held_grains(v, b, m, fixed):
    """Velocities of a node where water passes grains that are held; b : momenta without reactions, m : Masses."""
    lx = b.liquid_x / (m.liquid + m.drag) if fixed & OPEN_X else v.liquid_x
    ly = b.liquid_y / (m.liquid + m.drag) if fixed & OPEN_Y else v.liquid_y
    return Pair(v.solid_x, v.solid_y, lx, ly)


@inline_kernel
def constrained(v, fixed):
    """Velocities under the constraints of box and mirror line."""
    sx, sy, lx, ly = v
    if fixed & FIXED_X:
        sx = 0.0
        if not fixed & OPEN_X:
            lx = 0.0
    if fixed & FIXED_Y:
        sy = 0.0
        if not fixed & OPEN_Y:
            ly = 0.0
    return Pair(sx, sy, lx, ly)
