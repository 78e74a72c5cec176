"""Axial force, shear force, bending moment and displacement of whole sections of a continuum ring.

Stresses are integrated across the thickness at the two places along each column where quadratic elements are most
accurate, and taken linear in between: nothing is probed at points, which curved elements do not support.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.continuum_mesh import ContinuumMesh
from structure.continuum_stiffness import STRESS_POINTS, StressOperators


def section_forces(
    mesh: ContinuumMesh, stresses: StressOperators, centre_radius: float, theta: np.ndarray
) -> tuple[sparse.csr_array, sparse.csr_array, sparse.csr_array]:
    """N, Q and M at angles theta [rad] from the unknowns, (n_theta, n_unknowns) each; rows in the opening are zero.

    N = -integral of the hoop stress, Q = -integral of the shear stress, M = integral of the hoop stress times
    (r - R). Where lines lean towards the wall of the opening the section leans with them.
    """
    weights = _section_weights(mesh, stresses, centre_radius)
    column, place = mesh.locate(theta)
    inside = np.flatnonzero(column >= 0)
    share = (place[inside] - STRESS_POINTS[0]) / (STRESS_POINTS[1] - STRESS_POINTS[0])
    station = 2 * column[inside]
    between = sparse.coo_array(
        (np.concatenate([1 - share, share]), (np.tile(inside, 2), np.concatenate([station, station + 1]))),
        shape=(len(theta), 2 * len(mesh.column_lines)),
    ).tocsr()
    parts = (stresses.radial, stresses.hoop, stresses.shear)
    return tuple(
        sum((between @ weight) @ part for weight, part in zip(row, parts, strict=True)).tocsr() for row in weights
    )


def _section_weights(mesh: ContinuumMesh, stresses: StressOperators, centre_radius: float):
    """For N, Q, M: weights of radial, hoop and shear stresses, (2 n_columns, n_points) sparse each."""
    count, layers = len(mesh.column_lines), mesh.layers
    point = np.arange(4 * layers * count).reshape(count, layers, 2, 2)
    # [column, place along, layer and place across]
    points = point.transpose(0, 3, 1, 2).reshape(2 * count, 2 * layers)
    height = (mesh.radius[-1] - mesh.radius[0]) / (2 * layers)
    radius = stresses.radius[points]
    at_centre, lean = _station_angles(mesh)
    off = (stresses.angle[points] - at_centre[:, None] + np.pi) % (2 * np.pi) - np.pi
    slope = radius * lean[:, None]
    sine, cosine = np.sin(off), np.cos(off)
    # Traction on the leaning line in the polar axes of its points, then in those of the section on the centre line.
    zero = np.zeros_like(radius)
    outward, clockwise = (-slope, zero, zero + 1), (zero, zero + 1, -slope)
    along_radius = [a * cosine + b * sine for a, b in zip(outward, clockwise, strict=True)]
    along_arc = [b * cosine - a * sine for a, b in zip(outward, clockwise, strict=True)]
    lever, aside = radius * cosine - centre_radius, radius * sine
    rows = np.repeat(np.arange(2 * count), 2 * layers)

    def matrix(values):
        return sparse.coo_array(
            ((height * values).ravel(), (rows, points.ravel())), shape=(2 * count, point.size)
        ).tocsr()

    return (
        [matrix(-values) for values in along_arc],
        [matrix(-values) for values in along_radius],
        [matrix(lever * arc - aside * out) for arc, out in zip(along_arc, along_radius, strict=True)],
    )


def _station_angles(mesh: ContinuumMesh) -> tuple[np.ndarray, np.ndarray]:
    """Angle on the centre line [rad] and lean dtheta/dr [rad/m] of the stations, (2 n_columns,) each."""
    place = np.array(STRESS_POINTS)
    shapes = edge_shapes(place)
    inner, centre, outer = (mesh.column_angles(level) @ shapes.T for level in (0, mesh.layers, mesh.n_levels - 1))
    return centre.ravel(), ((outer - inner) / (mesh.radius[-1] - mesh.radius[0])).ravel()


def edge_shapes(place: np.ndarray) -> np.ndarray:
    """Quadratic shape functions of an edge at places from 0 to 1, (n, 3)."""
    return np.stack([(1 - place) * (1 - 2 * place), 4 * place * (1 - place), place * (2 * place - 1)], axis=-1)


def section_displacements(mesh: ContinuumMesh, theta: np.ndarray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Mean radial and tangential displacement of the sections at theta [rad], (n_theta, n_unknowns) each."""
    column, place = mesh.locate(theta)
    inside = np.flatnonzero(column >= 0)
    weights = edge_shapes(place[inside])[:, :, None] * mesh.level_mean
    return tuple(_gather(mesh, mesh.column_lines[column[inside]], weights, inside, len(theta), way) for way in (0, 1))


def column_means(mesh: ContinuumMesh, edge_mean: np.ndarray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Mean radial and tangential displacement of whole columns, (n_columns, n_unknowns) each."""
    count = len(mesh.column_lines)
    weights = np.broadcast_to(edge_mean[:, None] * mesh.level_mean, (count, 3, mesh.n_levels))
    return tuple(_gather(mesh, mesh.column_lines, weights, np.arange(count), count, way) for way in (0, 1))


def _gather(mesh, lines, weights, rows, n_rows, direction):
    unknowns = 2 * (lines[:, :, None] * mesh.n_levels + np.arange(mesh.n_levels)) + direction
    return sparse.coo_array(
        (weights.ravel(), (np.repeat(rows, 3 * mesh.n_levels), unknowns.ravel())),
        shape=(n_rows, 2 * mesh.n_lines * mesh.n_levels),
    ).tocsr()
