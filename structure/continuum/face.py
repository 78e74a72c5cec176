"""The outer face of a continuum ring: nodal forces of tractions on it, and what the soil springs feel of it."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.arcs import arc_pieces, sampled_operator
from structure.continuum.mesh import EDGE_MEAN, ContinuumMesh
from structure.continuum.sections import column_means, edge_shapes
from structure.ring import Ring


def traction_operator(ring: Ring, mesh: ContinuumMesh, theta: np.ndarray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Nodal forces of a pressure and of a clockwise shear on the outer face, sampled at angles `theta`.

    Parameters
    ----------
    theta : (n_theta,) float64
        [rad], ascending in [0, 2 pi).

    Returns
    -------
    pressure, shear : (n_unknowns, n_theta) sparse
        Forces [N/m] per Pa, traction linear between the samples. No force on the gate, and a hole's
        share of it is left out.
    """
    edges = mesh.column_angles()
    span = edges[:, 2] - edges[:, 0]
    column, angle, weight = arc_pieces(edges[:, 0], span, theta)
    outer = mesh.column_lines[column] * mesh.n_levels + mesh.n_levels - 1
    shapes = edge_shapes((angle - edges[column, 0]) / span[column])
    # The pressure follows the circle's normal at its own angle, not at the node that takes a share of it.
    lean = angle[:, None] - edges[column]
    inward = np.stack([-np.cos(lean), -np.sin(lean)], axis=2) * shapes[:, :, None]
    clockwise = np.stack([-np.sin(lean), np.cos(lean)], axis=2) * shapes[:, :, None]
    # Shares of a force at nodes on a circle turn like a force within it: the end nodes take the couple that is missing.
    half = span[column] / 2
    pair = np.stack([np.cos(half), np.sin(half), np.zeros_like(half), 0 * half, -np.cos(half), np.sin(half)], axis=1)
    pair = pair.reshape(-1, 3, 2) / (2 * np.sin(half))[:, None, None]
    inward -= inward[:, :, 1].sum(1)[:, None, None] * pair
    clockwise += (1 - clockwise[:, :, 1].sum(1))[:, None, None] * pair
    area = (ring.outer_radius * mesh.column_share[column] * weight)[:, None, None]
    unknown = 2 * outer[:, :, None] + np.arange(2)
    return tuple(sampled_operator(unknown, area * part, theta, angle, mesh.n_unknowns) for part in (inward, clockwise))


def spring_feelers(ring: Ring, mesh: ContinuumMesh) -> tuple[sparse.csr_array, np.ndarray]:
    """What the soil springs feel: one normal, then one tangential spring for every column.

    Returns
    -------
    feel : (2 n_columns, n_unknowns) sparse
        Mean displacement of a column's outer edge, outward and clockwise. With slip_at="centre_line" the tangential
        one is the mean over the whole section: its reaction then passes through the centre line and, as at a beam
        node, brings no couple.
    area : (2 n_columns,) float64
        Area of the outer face of each [m2/m]; a reaction [Pa] becomes the nodal forces -feel^T (area * reaction).
    """
    edges = mesh.column_angles()
    area = ring.outer_radius * mesh.column_share * (edges[:, 2] - edges[:, 0])
    outer = mesh.column_lines * mesh.n_levels + mesh.n_levels - 1
    normal, tangential = mesh.gathered(outer, EDGE_MEAN, 0.0), mesh.gathered(outer, 0.0, EDGE_MEAN)
    if ring.ground is not None and ring.ground.slip_at == "centre_line":
        tangential = column_means(mesh, EDGE_MEAN)[1]
    return sparse.vstack([normal, tangential]).tocsr(), np.tile(area, 2)
