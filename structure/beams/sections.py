"""Axial force, shear force, bending moment and displacement of the sections of a ring of beams."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.arcs import periodic_shares
from structure.beams.elements import element_matrices
from structure.beams.mesh import RingMesh
from structure.ring import Ring


def section_forces(
    ring: Ring, mesh: RingMesh, theta: np.ndarray
) -> tuple[sparse.csr_array, sparse.csr_array, sparse.csr_array]:
    """N, Q and M at angles theta [rad] from the unknowns, (n_theta, 3 n_nodes) each.

    They are taken at the middles of the elements, where the chord is parallel to the circle.
    """
    at_theta = forces_at(mesh, theta)
    axial, shear, first, second = np.moveaxis(element_matrices(ring, mesh)[0], 1, 0)
    parts = axial, shear, (first + second) / 2
    return tuple((at_theta @ mesh.gathered(part, mesh.first, mesh.second)).tocsr() for part in parts)


def forces_at(mesh: RingMesh, theta: np.ndarray) -> sparse.csr_array:
    """Section forces at angles theta [rad] from those at the middles of the elements, (n_theta, n_elements).

    Linear between the middles, also across a joint, which passes on all that reaches it.
    """
    middle = mesh.mid_angle % (2 * np.pi)
    order = np.argsort(middle)
    samples, shares = periodic_shares(middle[order], theta)
    place = (np.tile(np.arange(len(theta)), 2), order[np.concatenate(samples)])
    return sparse.coo_array((np.concatenate(shares), place), shape=(len(theta), len(middle))).tocsr()


def displacements_at(
    mesh: RingMesh, theta: np.ndarray, centre_radius: float
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Radial and tangential displacement of the centre line at theta [rad], (n_theta, 3 n_nodes) each.

    Straight between the two nodes of an element; the section's rotation moves the circle against the chord, so that a
    turn of the whole ring is one of the circle. On a joint one of its sides is taken.
    """
    along = (theta[:, None] - mesh.node_angle[mesh.first]) % (2 * np.pi)
    element = np.argmax(along <= mesh.span, axis=1)
    share = along[np.arange(len(theta)), element] / mesh.span[element]
    nodes = np.stack([mesh.first[element], mesh.second[element]], axis=1)
    of_node, lean = np.stack([1 - share, share], axis=1), theta[:, None] - mesh.node_angle[nodes]
    cosine, sine = of_node * np.cos(lean), of_node * np.sin(lean)
    off = -sine.sum(axis=1), 1 - cosine.sum(axis=1)
    return tuple(
        mesh.gathered(np.stack([*parts, centre_radius * far[:, None] * of_node], axis=2).reshape(-1, 6), *nodes.T)
        for parts, far in zip(((cosine, sine), (-sine, cosine)), off, strict=True)
    )
