"""Tables of the elements that the kernels read, and what lies across their edges."""

import numpy as np

from mpm.fields import GEOMETRY_RECORD


def element_geometry(mesh):
    """Gradients, first corner, area and smallest altitude of every element: (n_elements,) records."""
    c = mesh.nodes[mesh.elements]
    e1, e2 = c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]
    det = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    longest = np.max([np.linalg.norm(v, axis=1) for v in (e1, e2, e2 - e1)], axis=0)
    columns = [e2[:, 1] / det, -e2[:, 0] / det, -e1[:, 1] / det, e1[:, 0] / det, c[:, 0, 0], c[:, 0, 1], det / 2]
    return np.stack([*columns, det / longest], axis=1).view(GEOMETRY_RECORD)[:, 0]


def outflow_nodes(scene, mesh):
    """Nodes at the inner end of the channel where a sink takes material out; none for a resolved interior."""
    if scene.gate is None or scene.interior != "sink":
        return np.zeros(0, int)
    tunnel = scene.tunnels[scene.gate.tunnel]
    radius = np.hypot(mesh.nodes[:, 0] - tunnel.x, mesh.nodes[:, 1] + tunnel.axis_depth)
    return np.flatnonzero(radius < tunnel.inner_radius * (1 + 1e-9))


def element_neighbours(mesh, outflow):
    """Element across the edge opposite each corner: (n_elements, 3) int32; -1 at a wall, -2 at an outflow."""
    edges = {}
    neighbours = np.full((len(mesh.elements), 3), -1, np.int32)
    for e, corner in enumerate(mesh.elements.tolist()):
        for k in range(3):
            a, b = corner[(k + 1) % 3], corner[(k + 2) % 3]
            key = (a, b) if a < b else (b, a)
            other = edges.pop(key, None)
            if other is None:
                edges[key] = (e, k)
            else:
                neighbours[e, k] = other[0]
                neighbours[other] = e
    outflow = set(outflow.tolist())
    for (a, b), (e, k) in edges.items():
        if a in outflow and b in outflow:
            neighbours[e, k] = -2
    return neighbours
