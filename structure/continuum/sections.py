"""Axial force, shear force, bending moment and displacement of whole sections of a continuum ring.

Stresses are integrated across the thickness at the two places along each column where quadratic elements are most
accurate, and taken linear in between: nothing is probed at points, which curved elements do not support.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.continuum.concrete import STRESS_POINTS, Stresses
from structure.continuum.mesh import ContinuumMesh


def section_forces(
    mesh: ContinuumMesh, stresses: Stresses, centre_radius: float, theta: np.ndarray
) -> tuple[sparse.csr_array, sparse.csr_array, sparse.csr_array]:
    """N, Q and M at angles theta [rad] from the unknowns, (n_theta, n_unknowns) each; rows in the opening are zero.

    N = -integral of the hoop stress, Q = -integral of the shear stress, M = integral of the hoop stress times
    (r - R).
    """
    across, levers = _section_integrals(mesh, stresses, centre_radius)
    between = _between_stations(mesh, theta)
    return (
        -(between @ across @ stresses.hoop).tocsr(),
        -(between @ across @ stresses.shear).tocsr(),
        (between @ levers @ stresses.hoop).tocsr(),
    )


def _between_stations(mesh: ContinuumMesh, theta: np.ndarray) -> sparse.csr_array:
    """Linear interpolation at theta [rad] between the two stations around it, (n_theta, 2 n_columns).

    They may belong to neighbouring columns, also across a joint, which passes on all forces; not across the opening.
    """
    column, place = mesh.locate(theta)
    inside = np.flatnonzero(column >= 0)
    column, place = column[inside], place[inside]
    edges, count = mesh.column_angles(), len(mesh.column_lines)
    span = edges[:, 2] - edges[:, 0]
    apart = np.abs((edges[np.arange(1, count + 1) % count, 0] - edges[:, 2] + np.pi) % (2 * np.pi) - np.pi)
    leads_back = ((place < STRESS_POINTS[0]) & (apart[column - 1] < 1e-9)).astype(int)
    leads_on = ((place > STRESS_POINTS[1]) & (apart[column] < 1e-9)).astype(int)
    first = (2 * column + leads_on - leads_back) % (2 * count)
    second = (first + 1) % (2 * count)
    station = (edges[:, :1] + span[:, None] * STRESS_POINTS).ravel()
    gap = (station[second] - station[first]) % (2 * np.pi)
    here = edges[column, 0] + place * span[column]
    share = ((here - station[first] + np.pi) % (2 * np.pi) - np.pi) / gap
    return sparse.coo_array(
        (np.concatenate([1 - share, share]), (np.tile(inside, 2), np.concatenate([first, second]))),
        shape=(len(theta), 2 * count),
    ).tocsr()


def _section_integrals(mesh: ContinuumMesh, stresses: Stresses, centre_radius: float):
    """Integrals of a stress, and of it times (r - R), across the stations, (2 n_columns, n_points) sparse each."""
    count, layers = len(mesh.column_lines), mesh.layers
    point = np.arange(4 * layers * count).reshape(count, layers, 2, 2)
    # [column, place along, layer and place across]
    points = point.transpose(0, 3, 1, 2).reshape(2 * count, 2 * layers)
    height = np.broadcast_to(np.repeat(mesh.layer_height / 2, 2), points.shape)
    where = (np.repeat(np.arange(2 * count), 2 * layers), points.ravel())
    lever = stresses.radius[points] - centre_radius
    return tuple(
        sparse.coo_array((values.ravel(), where), shape=(2 * count, point.size)).tocsr()
        for values in (height, height * lever)
    )


def edge_shapes(place: np.ndarray) -> np.ndarray:
    """Quadratic shape functions of an edge at places from 0 to 1, (n, 3)."""
    return np.stack([(1 - place) * (1 - 2 * place), 4 * place * (1 - place), place * (2 * place - 1)], axis=-1)


def section_displacements(
    mesh: ContinuumMesh, theta: np.ndarray, centre_radius: float
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Mean radial and tangential displacement of the sections at theta [rad], (n_theta, n_unknowns) each.

    Quadratic between the lines of a column, as vectors; their sections' rotation moves the circle against that, so that
    the whole ring's movements are those of its sections.
    """
    column, place = mesh.locate(theta)
    inside = np.flatnonzero(column >= 0)
    lines, shapes = mesh.column_lines[column[inside]], edge_shapes(place[inside])
    lean = theta[inside, None] - mesh.angle[lines]
    cosine, sine = shapes * np.cos(lean), shapes * np.sin(lean)
    lever = mesh.radius - centre_radius
    slope = mesh.level_mean * lever / (mesh.level_mean @ lever**2)
    rows = []
    for outward, along, turned in ((cosine, sine, 0.0), (-sine, cosine, 1.0)):
        off = centre_radius * (turned - along.sum(axis=1))[:, None] * shapes
        parts = outward[:, :, None] * mesh.level_mean, along[:, :, None] * mesh.level_mean + off[:, :, None] * slope
        rows.append(mesh.gathered(mesh.line_nodes(lines), *parts, inside, len(theta)))
    return rows[0], rows[1]


def column_means(mesh: ContinuumMesh, edge_mean: np.ndarray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Mean radial and tangential displacement of whole columns, (n_columns, n_unknowns) each."""
    nodes, weights = mesh.line_nodes(mesh.column_lines), edge_mean[:, None] * mesh.level_mean
    return mesh.gathered(nodes, weights, 0.0), mesh.gathered(nodes, 0.0, weights)
