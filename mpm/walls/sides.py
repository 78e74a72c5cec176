"""Sides of the box, each condition a row of one table: grains are held there; water too, or it passes against the
pressure that the ground beyond keeps.

Kernels know no condition by its name: they read what holds a node, and what pushes its water (`mpm.fields.SIDE`).
"""

from itertools import pairwise

import numpy as np

from mpm.fields import FIXED_X, FIXED_Y, MIRROR_X, OPEN_X, OPEN_Y, SIDE_RECORD
from mpm.k0_procedure import initial_stress


def pressure_at_start(scene, depth):
    """Pore pressure of the undisturbed ground [Pa] at depths [m], (n,) float64."""
    return initial_stress(scene, depth)[1]


#: What `mpm.scene.Water.sides` may be: the pore pressure that the ground beyond left, right and bottom keeps, of scene
#: and depths, as of :func:`pressure_at_start`; None where no water passes.
SIDES = {"closed": None, "held": pressure_at_start}


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
        Bits of `mpm.fields`.
    sides : (n_nodes,) records of `mpm.fields.SIDE`
    """
    fixed, sides = np.zeros(len(mesh.nodes), np.int8), np.zeros(len(mesh.nodes), SIDE_RECORD)
    fixed[mesh.left] |= FIXED_X
    fixed[mesh.right] |= FIXED_X
    fixed[mesh.bottom] |= FIXED_X | FIXED_Y
    fixed[mirror_line] |= MIRROR_X
    if scene.water is not None and SIDES[scene.water.sides] is not None:
        if not len(mirror_line):
            _open(scene, mesh, mesh.left, "x", 1.0, sides)
        _open(scene, mesh, mesh.right, "x", -1.0, sides)
        _open(scene, mesh, mesh.bottom, "y", 1.0, sides)
        fixed[sides["area_x"] != 0] |= OPEN_X
        fixed[sides["area_y"] != 0] |= OPEN_X | OPEN_Y  # along the bottom, too
    return fixed, sides


def _open(scene, mesh, nodes, axis, inward, sides):
    """Let water pass the edges between some nodes, below the surface, against the pressure beyond.

    The push is exact where pressure is linear along an edge: inside, that of linear triangles is.
    """
    along = "y" if axis == "x" else "x"
    nodes = nodes[np.argsort(mesh.nodes[nodes, "xy".index(along)])]
    for a, b in pairwise(nodes):
        edge = mesh.nodes[[a, b]]
        if edge[:, 1].max() > 0.0:
            continue
        length = float(np.hypot(*(edge[1] - edge[0])))
        pressure = SIDES[scene.water.sides](scene, -edge[:, 1])
        for node, own, other in ((a, pressure[0], pressure[1]), (b, pressure[1], pressure[0])):
            sides[f"area_{axis}"][node] += inward * length / 2
            sides[f"push_{axis}"][node] += inward * length * (2 * own + other) / 6
