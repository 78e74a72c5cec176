"""The outer face of a continuum ring: nodal forces of tractions on it, and what the soil springs feel of it."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.beam_geometry import _periodic_interpolation
from structure.continuum_mesh import EDGE_MEAN, ContinuumMesh
from structure.continuum_sections import column_means, edge_shapes
from structure.ring import Ring

#: Gauss points of a piece of the face: exact for linear traction times quadratic shares.
PIECE_POINTS, PIECE_WEIGHTS = np.polynomial.legendre.leggauss(2)
#: Longest piece [rad]: half the usual spacing of samples, whose kinks are then met or nearly so.
LONGEST_PIECE = np.radians(0.5)


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
    n_unknowns = 2 * mesh.n_lines * mesh.n_levels
    span = edges[:, 2] - edges[:, 0]
    pieces = int(np.ceil(span.max() / LONGEST_PIECE - 1e-6))
    place = ((np.arange(pieces)[:, None] + (PIECE_POINTS + 1) / 2) / pieces).ravel()
    weight = np.tile(PIECE_WEIGHTS / 2, pieces) / pieces
    angle = edges[:, :1] + span[:, None] * place
    samples, shares = _periodic_interpolation(theta, angle.ravel())
    outer = mesh.column_lines * mesh.n_levels + mesh.n_levels - 1
    # The pressure follows the circle's normal at its own angle, not at the node that takes a share of it.
    lean = angle[:, :, None] - edges[:, None, :]
    area = (ring.outer_radius * (mesh.column_share * span)[:, None] * weight)[:, :, None] * edge_shapes(place)
    parts = {
        "pressure": (-area * np.cos(lean), -area * np.sin(lean)),
        "shear": (-area * np.sin(lean), area * np.cos(lean)),
    }
    node = np.broadcast_to(outer[:, None, :], area.shape)
    operators = []
    for radial, tangential in parts.values():
        rows = np.concatenate([2 * node.ravel(), 2 * node.ravel() + 1])
        values = np.concatenate([radial.ravel(), tangential.ravel()])
        total = sparse.csr_array((n_unknowns, len(theta)))
        for sample, share in zip(samples, shares, strict=True):
            columns, shared = np.tile(np.repeat(sample, 3), 2), np.tile(np.repeat(share, 3), 2)
            total = total + sparse.coo_array((values * shared, (rows, columns)), shape=total.shape)
        operators.append(total.tocsr())
    return tuple(operators)


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
    outer = np.zeros(mesh.n_levels)
    outer[-1] = 1.0
    count = len(mesh.column_lines)
    unknowns = 2 * (mesh.column_lines * mesh.n_levels + mesh.n_levels - 1)
    rows = np.repeat(np.arange(count), 3)
    shape = (count, 2 * mesh.n_lines * mesh.n_levels)
    normal, tangential = (
        sparse.coo_array((np.tile(EDGE_MEAN, count), (rows, (unknowns + way).ravel())), shape=shape).tocsr()
        for way in (0, 1)
    )
    if ring.ground is not None and ring.ground.slip_at == "centre_line":
        tangential = column_means(mesh, EDGE_MEAN)[1]
    return sparse.vstack([normal, tangential]).tocsr(), np.tile(area, 2)
