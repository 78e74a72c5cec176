"""Meshes without a tunnel: rectangles of crossed triangles, parts of them filled with soil."""

from types import SimpleNamespace

import numpy as np

from mpm.meshing import crossed

SOIL, EMPTY = 0, 3


def box_mesh(x, y, filled=None, fixed_bottom=True):
    """Rectangles of a grid, each cut by both diagonals, with the fields that :class:`mpm.Solver` reads of a mesh.

    Parameters
    ----------
    x, y : (n,), (m,) float64
        Grid lines, ascending [m]; the ground surface is y = 0. Left and right are smooth walls.
    filled : callable or None
        filled(x, y) of the elements' centres says which hold material at the start; None: those below y = 0.
    fixed_bottom : bool
        Bottom nodes are held in both directions; else only what the caller sets.

    Returns
    -------
    types.SimpleNamespace
        nodes, elements, region, boundary node lists; no lining, no gate.
    """
    x, y = np.asarray(x, float), np.asarray(y, float)
    columns, rows = len(x) - 1, len(y) - 1
    gx, gy = np.meshgrid(x, y)
    nodes = np.column_stack([gx.ravel(), gy.ravel()])
    j, i = np.divmod(np.arange(columns * rows), columns)
    a = j * (columns + 1) + i
    nodes, elements = crossed(nodes, np.column_stack([a, a + 1, a + columns + 2, a + columns + 1]))
    elements = elements.astype(np.int32)
    cx, cy = nodes[elements].mean(axis=1).T
    inside = cy < 0 if filled is None else np.asarray(filled(cx, cy), bool)
    none = np.zeros(0, np.int32)
    number = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    return SimpleNamespace(
        nodes=nodes, elements=elements, region=np.where(inside, SOIL, EMPTY).astype(np.int8),
        outer_nodes=(), outer_theta=(), opening_nodes=none, corner_nodes=none, wall_nodes=none, wall_side=none,
        inner_nodes=none, left=number[:, 0].astype(np.int32), right=number[:, -1].astype(np.int32),
        bottom=number[0].astype(np.int32) if fixed_bottom else none, top=number[-1].astype(np.int32),
    )  # fmt: skip


def annulus_mesh(radii, sectors):
    """Crossed quadrilaterals on a quarter annulus about the origin, y downward from 0, all filled; smooth on its axes.

    Parameters
    ----------
    radii : (n,) float64
        Ascending [m];  sectors : elements over the quarter.

    Returns
    -------
    types.SimpleNamespace
        As :func:`box_mesh`, and `inner`, `outer`: nodes on the two arcs. Only x = 0 is in a list that the solver holds;
        hold `on_axis` (y = 0) vertically.
    """
    radii = np.asarray(radii, float)
    rings = len(radii)
    mesh = box_mesh(np.linspace(0, 1, sectors + 1), np.arange(rings) - rings - 1.0, fixed_bottom=False)
    corners = mesh.nodes[: rings * (sectors + 1)]
    angle = np.pi / 2 * corners[:, 0]
    ring = np.round(corners[:, 1] - corners[0, 1]).astype(int)
    corners = np.column_stack([radii[ring] * np.sin(angle), -radii[ring] * np.cos(angle)])
    corners[np.abs(corners) < 1e-12 * radii[-1]] = 0.0
    # the map turns the sense of the corners
    mesh.nodes, elements = crossed(corners, mesh.elements[:, 0].reshape(-1, 4)[:, ::-1])
    mesh.elements = elements.astype(np.int32)
    mesh.inner = np.flatnonzero(ring == 0)
    mesh.outer = np.flatnonzero(ring == rings - 1)
    mesh.on_axis, mesh.right, mesh.top = mesh.right, mesh.right[:0], mesh.right[:0]
    return mesh
