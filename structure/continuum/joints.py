"""Zero-thickness joints of a continuum ring: how their faces move against each other, and their stiffness."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.continuum.mesh import ContinuumMesh
from structure.ring import Ring

#: Integrals of products of the three shape functions of a quadratic edge of unit length.
EDGE_MASS = np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]]) / 30


def nodes_from_unknowns(mesh: ContinuumMesh) -> sparse.csr_array:
    """Displacements of the nodes from the unknowns that are solved for, (n_unknowns, n_unknowns).

    On the clockwise face of a joint the unknown is the jump across it. A joint of 1e15 N/m2 then acts on tiny unknowns
    of its own, not on the difference of two large ones, whose rounding it would multiply.
    """
    n_unknowns = 2 * mesh.n_lines * mesh.n_levels
    along = np.arange(2 * mesh.n_levels)
    if not len(mesh.joint_after) or mesh.column_is_strip.any():
        return sparse.eye_array(n_unknowns, format="csr")
    after = (2 * mesh.n_levels * mesh.joint_after[:, None] + along).ravel()
    before = (2 * mesh.n_levels * mesh.joint_before[:, None] + along).ravel()
    rows, columns = np.append(np.arange(n_unknowns), after), np.append(np.arange(n_unknowns), before)
    return sparse.coo_array((np.ones(len(rows)), (rows, columns)), shape=(n_unknowns, n_unknowns)).tocsr()


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


def joint_stiffness(ring: Ring, mesh: ContinuumMesh) -> sparse.csr_array:
    """Stiffness of zero-thickness joints, (n_unknowns, n_unknowns).

    Springs k_n and k_s per height of what touches alone would turn with k_n t^2/12. Rank-1 terms in the gap on the
    centre line and in the rotation bring the rest, so that the energy is k_n opening^2 + k_theta rotation^2 plus what
    the springs store in the rest of the gap; it is never negative. Without a groove only the rotation needs one,
    k_theta - k_n t^2/12.
    """
    n_unknowns = 2 * mesh.n_lines * mesh.n_levels
    mass = _face_mass(mesh)
    fit, matrix = _best_fit(ring, mesh)
    touching = matrix[0, 0]
    normal = ring.joint_normal_stiffness / touching * (mass - fit.T @ matrix @ fit) + fit.T @ (
        np.diag([ring.joint_normal_stiffness, ring.joint_rotational_stiffness]) @ fit
    )
    stiffness = sparse.csr_array((n_unknowns, n_unknowns))
    for direction, face in ((1, normal), (0, ring.joint_shear_stiffness / touching * mass)):
        jumps = sparse.vstack([_face_jump(mesh, row, direction) for row in np.eye(mesh.n_levels)]).tocsr()
        spread = sparse.kron(face, sparse.eye_array(len(mesh.joint_before)))
        stiffness = stiffness + jumps.T @ spread @ jumps
    return stiffness.tocsr()


def _face_jump(mesh: ContinuumMesh, weights: np.ndarray, direction: int, before: float = -1.0) -> sparse.csr_array:
    """Weighted displacement of the clockwise face plus `before` times that of the other, in the joint's own axes.

    Faces of a strip lie at angles of their own; direction 0 is outward, 1 clockwise at the middle of the joint.
    """
    n_joints = len(mesh.joint_before)
    apart = (mesh.angle[mesh.joint_after] - mesh.angle[mesh.joint_before] + 1) % (2 * np.pi) - 1
    level = np.arange(mesh.n_levels)
    rows, columns, values = [], [], []
    for lines, off, sign in ((mesh.joint_after, apart / 2, 1.0), (mesh.joint_before, -apart / 2, before)):
        first = 2 * (lines[:, None] * mesh.n_levels + level)
        axes = (np.cos(off), -np.sin(off)) if direction == 0 else (np.sin(off), np.cos(off))
        for way in (0, 1):
            rows.append(np.repeat(np.arange(n_joints), mesh.n_levels))
            columns.append((first + way).ravel())
            values.append((sign * axes[way][:, None] * weights).ravel())
    values = np.concatenate(values)
    kept = values != 0
    return sparse.coo_array(
        (values[kept], (np.concatenate(rows)[kept], np.concatenate(columns)[kept])),
        shape=(n_joints, 2 * mesh.n_lines * mesh.n_levels),
    ).tocsr()
