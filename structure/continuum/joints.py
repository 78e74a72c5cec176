"""Zero-thickness joints of a continuum ring: how their faces move against each other, as wholes and at points."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure import joint_laws
from structure.continuum.mesh import ContinuumMesh
from structure.continuum.sections import edge_shapes
from structure.joint_laws import FacePoints
from structure.ring import Ring

#: Integrals of products of the three shape functions of a quadratic edge of unit length.
EDGE_MASS = np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]]) / 30


def nodes_from_unknowns(mesh: ContinuumMesh) -> sparse.csr_array:
    """Displacements of the nodes from the unknowns that are solved for, (n_unknowns, n_unknowns).

    On the clockwise face of a joint the unknown is the jump across it. A joint of 1e15 N/m2 then acts on tiny unknowns
    of its own, not on the difference of two large ones, whose rounding it would multiply.
    """
    own, along = sparse.eye_array(mesh.n_unknowns, format="csr"), np.arange(2 * mesh.n_levels)
    if not len(mesh.joint_after) or mesh.column_is_strip.any():
        return own
    after, before = (
        (2 * mesh.n_levels * lines[:, None] + along).ravel() for lines in (mesh.joint_after, mesh.joint_before)
    )
    return own + sparse.coo_array((np.ones(len(after)), (after, before)), shape=own.shape).tocsr()


def _face_mass(mesh: ContinuumMesh) -> np.ndarray:
    """Integrals of products of shape functions over the height on which the segments touch, (n_levels, n_levels)."""
    mass = np.zeros((mesh.n_levels, mesh.n_levels))
    for layer in np.flatnonzero(~mesh.groove_layers):
        nodes = slice(2 * layer, 2 * layer + 3)
        mass[nodes, nodes] += mesh.layer_height[layer] * EDGE_MASS
    return mass


def _best_fit(ring: Ring, mesh: ContinuumMesh) -> tuple[np.ndarray, np.ndarray]:
    """Gap on the centre line and rotation that fit the gap of a face best, from its nodes (2, n_levels), and the
    matrix of the fit, the areas and moments of what touches (2, 2)."""
    linear = np.stack([np.ones(mesh.n_levels), mesh.radius - ring.centre_radius])
    moments = linear @ _face_mass(mesh)
    matrix = moments @ linear.T
    return np.linalg.solve(matrix, moments), matrix


def joint_jumps(ring: Ring, mesh: ContinuumMesh) -> sparse.csr_array:
    """Opening, dislocation and rotation of every joint, (3 n_joints, n_unknowns).

    Movements of the clockwise face against the other one: gap on the centre line and rotation that fit best, and the
    mean dislocation.

    Without a groove the gap is the mean over the face, the rotation 12/t^3 times the integral of gap times (r - R).
    The rest of the gap does no work on them, so the section's laws N = -k_n opening, Q = k_s dislocation and
    M = k_theta rotation hold exactly.
    """
    (gap, slope), matrix = _best_fit(ring, mesh)
    mean = _face_mass(mesh).sum(0) / matrix[0, 0]
    opening = _face_jump(mesh, gap, 1)
    rotation = _face_jump(mesh, slope, 1)
    # Faces apart slide past each other when the whole ring turns; that is no dislocation of the joint.
    turn = _face_jump(mesh, slope, 1, before=1.0) / 2
    width = ring.centre_radius * ((mesh.angle[mesh.joint_after] - mesh.angle[mesh.joint_before] + 1) % (2 * np.pi) - 1)
    dislocation = -_face_jump(mesh, mean, 0) - sparse.diags_array(width) @ turn
    by_joint = np.arange(3 * len(width)).reshape(3, -1).T.ravel()
    return sparse.vstack([opening, dislocation, rotation]).tocsr()[by_joint]


def uneven_stiffness(ring: Ring, mesh: ContinuumMesh) -> sparse.csr_array:
    """What the springs of zero-thickness joints store in a gap beyond its jumps, (n_unknowns, n_unknowns).

    Springs k_n and k_s per height of what touches, less what they store in opening, rotation and mean dislocation,
    where the joint's own law acts. Never negative.
    """
    mass = _face_mass(mesh)
    fit, matrix = _best_fit(ring, mesh)
    touching, mean = matrix[0, 0], mass.sum(0)
    rest = (mass - fit.T @ matrix @ fit) / touching, mass / touching - np.outer(mean, mean) / touching**2
    stiffness = sparse.csr_array((mesh.n_unknowns, mesh.n_unknowns))
    for direction, face, springs in zip((1, 0), rest, ring.joint_springs.T, strict=False):
        jumps = sparse.vstack([_face_jump(mesh, row, direction) for row in np.eye(mesh.n_levels)]).tocsr()
        stiffness = stiffness + jumps.T @ sparse.kron(face, sparse.diags_array(springs)) @ jumps
    return stiffness.tocsr()


def face_points(ring: Ring, mesh: ContinuumMesh) -> tuple[FacePoints, sparse.csr_array]:
    """Points where the faces of joints touch, evenly over the contact height, and their gaps and slides from the nodes.

    Returns
    -------
    points : FacePoints
    faces : (2 n_points, n_unknowns) sparse
    """
    joint, lever, length, first, shapes = [], [], [], [], []
    edges = mesh.radius[::2] - ring.centre_radius
    for k, height in enumerate(ring.contact_heights):
        for layer in np.flatnonzero(~mesh.groove_layers):
            low, high = max(edges[layer], -height / 2), min(edges[layer + 1], height / 2)
            if high <= low:
                continue
            count = max(2, round(joint_laws.FACE_POINTS * (high - low) / height))
            at = low + (high - low) * (np.arange(count) + 0.5) / count
            joint.append(np.full(count, k))
            lever.append(at)
            length.append(np.full(count, (high - low) / count))
            first.append(np.full(count, 2 * layer))
            shapes.append(edge_shapes((at - edges[layer]) / mesh.layer_height[layer]))
    joint, lever, length, first, shapes = map(np.concatenate, (joint, lever, length, first, shapes))
    faces, gap = sparse.csr_array((2 * len(joint), mesh.n_unknowns)), 2 * np.arange(len(joint))
    for lines, apart in ((mesh.joint_after, shapes), (mesh.joint_before, -shapes)):
        node = lines[joint][:, None] * mesh.n_levels + first[:, None] + np.arange(3)
        # clockwise apart opens, outward apart slides back
        faces = faces + mesh.gathered(node, 0.0, apart, gap, 2 * len(joint))
        faces = faces + mesh.gathered(node, -apart, 0.0, gap + 1, 2 * len(joint))
    return FacePoints(joint, lever, length), faces.tocsr()


def _face_jump(mesh: ContinuumMesh, weights: np.ndarray, direction: int, before: float = -1.0) -> sparse.csr_array:
    """Weighted displacement of the clockwise face plus `before` times that of the other, in the joint's own axes.

    Faces of a strip lie at angles of their own; direction 0 is outward, 1 clockwise at the middle of the joint.
    """
    half = ((mesh.angle[mesh.joint_after] - mesh.angle[mesh.joint_before] + 1) % (2 * np.pi) - 1) / 2
    jumps = sparse.csr_array((len(half), mesh.n_unknowns))
    for lines, off, sign in ((mesh.joint_after, half, 1.0), (mesh.joint_before, -half, before)):
        axes = (np.cos(off), -np.sin(off)) if direction == 0 else (np.sin(off), np.cos(off))
        jumps = jumps + mesh.gathered(mesh.line_nodes(lines), *(sign * axis[:, None] * weights for axis in axes))
    return jumps.tocsr()
