"""Straight Timoshenko beams: stiffness of elements, joints between them, loads on their nodes."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.arcs import arc_pieces, sampled_operator
from structure.beams.mesh import RingMesh
from structure.ring import Ring


def element_matrices(ring: Ring, mesh: RingMesh) -> tuple[np.ndarray, np.ndarray]:
    """Deformation-to-force of every element, in the unknowns of its nodes.

    Returns
    -------
    forces : (n_elements, 4, 6) float64
        Rows N, Q, M at the first node, M at the second node, per unknown.
    stiffness : (n_elements, 6, 6) float64
        Symmetric stiffness, per metre of tunnel.

    Straight Timoshenko beam; shear enters by phi = 12 EI/(G A_s L^2). Source: Przemieniecki (1968), section 5.6.
    """
    half = mesh.span / 2
    length = 2 * ring.centre_radius * np.sin(half)
    bending, axial = ring.bending_stiffness, ring.axial_stiffness
    phi = 12 * bending / (ring.shear_stiffness * length**2)
    n = len(half)
    # Rows of `local`: displacement along the chord and outward from it, and rotation, at both ends. The radius at an
    # end leans by half the element's angle from the normal of the chord.
    local = np.zeros((n, 6, 6))
    for end, lean in ((0, -half), (3, half)):
        local[:, end, end], local[:, end, end + 1] = np.sin(lean), np.cos(lean)
        local[:, end + 1, end], local[:, end + 1, end + 1] = np.cos(lean), -np.sin(lean)
        local[:, end + 2, end + 2] = 1
    deformation = np.zeros((n, 3, 6))
    deformation[:, 0, [0, 3]] = 1, -1
    # Clockwise end rotations from the chord; the chord itself turns clockwise when its first end moves outward.
    for row, end in ((1, 2), (2, 5)):
        deformation[:, row, 1], deformation[:, row, 4] = -1 / length, 1 / length
        deformation[:, row, end] = 1
    deformation = deformation @ local
    near = (4 + phi) * bending / (length * (1 + phi))
    far = (2 - phi) * bending / (length * (1 + phi))
    law = np.zeros((n, 3, 3))
    law[:, 0, 0] = axial / length
    law[:, 1, 1] = law[:, 2, 2] = near
    law[:, 1, 2] = law[:, 2, 1] = far
    end_forces = law @ deformation
    stiffness = np.swapaxes(deformation, 1, 2) @ end_forces
    axial_force, first_moment, second_moment = end_forces[:, 0], -end_forces[:, 1], end_forces[:, 2]
    shear_force = -(second_moment - first_moment) / length[:, None]
    return np.stack([axial_force, shear_force, first_moment, second_moment], axis=1), stiffness


def segment_stiffness(ring: Ring, mesh: RingMesh) -> sparse.csr_array:
    """Stiffness of all segments, (3 n_nodes, 3 n_nodes)."""
    blocks = element_matrices(ring, mesh)[1]
    index = np.hstack([mesh.unknowns(mesh.first), mesh.unknowns(mesh.second)])
    place, size = (np.repeat(index, 6, axis=1).ravel(), np.tile(index, (1, 6)).ravel()), 3 * mesh.n_nodes
    return sparse.coo_array((blocks.ravel(), place), shape=(size, size)).tocsr()


def joint_jumps(mesh: RingMesh) -> sparse.csr_array:
    """Opening, dislocation and rotation of every joint, (3 n_joints, 3 n_nodes)."""
    jumps = np.zeros((3, 6))
    jumps[0, [1, 4]] = -1, 1
    jumps[1, [0, 3]] = 1, -1
    jumps[2, [2, 5]] = -1, 1
    blocks = np.tile(jumps, (len(mesh.joint_after), 1))
    return mesh.gathered(blocks, np.repeat(mesh.joint_before, 3), np.repeat(mesh.joint_after, 3))


def _moved_to_nodes(ring: Ring, mesh: RingMesh, radius: float, element: np.ndarray, angle: np.ndarray):
    """Statically equivalent nodal forces of unit forces at points of a circle: to both nodes with the couple of moving.

    Returns
    -------
    unknown : (n_points, 2, 3) int
    inward, clockwise : (n_points, 2, 3) float64
        Of a force towards the axis, and of one along the circle.
    """
    nodes = np.stack([mesh.first[element], mesh.second[element]], axis=1)
    along = angle - mesh.node_angle[mesh.first[element]]
    lean = along[:, None] - mesh.span[element][:, None] * np.array([0.0, 1.0])
    share = along / mesh.span[element]
    shares = np.stack([1 - share, share], axis=1)[:, :, None]
    sine, cosine = np.sin(lean), np.cos(lean)
    inward = np.stack([-cosine, -sine, ring.centre_radius * sine], axis=2)
    clockwise = np.stack([-sine, cosine, radius - ring.centre_radius * cosine], axis=2)
    return mesh.unknowns(nodes), shares * inward, shares * clockwise


def traction_operator(ring: Ring, mesh: RingMesh, theta: np.ndarray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Nodal forces of a pressure and of a clockwise shear on the outer face, sampled at angles `theta`.

    Parameters
    ----------
    theta : (n_theta,) float64
        [rad], ascending in [0, 2 pi).

    Returns
    -------
    pressure, shear : (3 n_nodes, n_theta) sparse
        Forces [N/m] and couples [N m/m] per Pa. Statically equivalent to the traction, linear between the samples: the
        force on each piece of the face goes to the two nodes of its element with the couple that moves it there.
    """
    element, angle, weight = arc_pieces(mesh.node_angle[mesh.first], mesh.span, theta)
    unknown, *parts = _moved_to_nodes(ring, mesh, ring.outer_radius, element, angle)
    area = (ring.outer_radius * weight)[:, None, None]
    return tuple(sampled_operator(unknown, area * part, theta, angle, 3 * mesh.n_nodes) for part in parts)


def self_weight(ring: Ring, mesh: RingMesh) -> np.ndarray:
    """Nodal forces of the concrete's weight, (3 n_nodes,); all of it on the centre line."""
    element, angle, weight = arc_pieces(mesh.node_angle[mesh.first], mesh.span, np.zeros(0))
    unknown, inward, clockwise = _moved_to_nodes(ring, mesh, ring.centre_radius, element, angle)
    force = (ring.concrete_unit_weight * ring.thickness * ring.centre_radius * weight)[:, None, None]
    downward = np.cos(angle)[:, None, None] * inward + np.sin(angle)[:, None, None] * clockwise
    return np.bincount(unknown.ravel(), (force * downward).ravel(), 3 * mesh.n_nodes)


def nodal_masses(ring: Ring, mesh: RingMesh) -> np.ndarray:
    """Mass of every unknown for a density of one, (3 n_nodes,): that of its tributary arc [m2], turning [m4]."""
    area = ring.thickness * ring.centre_radius * mesh.node_span
    return np.column_stack([area, area, area * ring.thickness**2 / 12]).ravel()
