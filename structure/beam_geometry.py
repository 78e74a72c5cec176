"""The ring as beam elements: nodes, constant stiffness of segments and joints, and how tractions become nodal forces.

Unknowns at a node: radial w (outward), tangential v (clockwise), rotation b (clockwise). Nodes run clockwise from the
first joint (or the crown); a joint has two nodes at one place, the last of one segment and the first of the next.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from structure.ring import Ring
from structure.springs import joint_spring

#: Gauss points of a piece of an arc on [0, 1]: up to 15 degrees only rounding is left of linear tractions times linear
#: or quadratic shares times the sine of an angle within the piece.
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(5)[0] / 2 + 0.5, np.polynomial.legendre.leggauss(5)[1] / 2


class RingMesh:
    """Nodes and elements of a ring.

    Attributes
    ----------
    node_angle : (n_nodes,) float64
        [rad], may exceed 2 pi.
    node_span : (n_nodes,) float64
        Tributary angle [rad].
    first : (n_elements,) int
        First node of each element; its second is the next one, modulo n_nodes.
    mid_angle, span : (n_elements,) float64
        Mid angle and angle of an element [rad].
    joint_before, joint_after : (n_joints,) int
        Nodes on the counter-clockwise and on the clockwise side of each joint.
    """

    def __init__(self, ring: Ring):
        counts = _elements_per_segment(ring)
        starts = np.radians(ring.joint_angles or (0.0,))
        gaps = np.radians(ring.segment_angles)
        jointed = bool(ring.joint_angles)
        angles, firsts = [], []
        for start, gap, count in zip(starts, gaps, counts, strict=True):
            offset = sum(map(len, angles))
            firsts.append(offset + np.arange(count))
            angles.append(start + gap * np.arange(count + jointed) / count)
        self.node_angle = np.concatenate(angles)
        self.n_nodes = len(self.node_angle)
        self.first = np.concatenate(firsts)
        self.second = (self.first + 1) % self.n_nodes
        self.span = np.repeat(gaps / counts, counts)
        self.mid_angle = self.node_angle[self.first] + self.span / 2
        self.node_span = np.bincount(self.first, self.span / 2, self.n_nodes)
        self.node_span += np.bincount(self.second, self.span / 2, self.n_nodes)
        heads = np.cumsum([0, *map(len, angles[:-1])]) if jointed else np.zeros(0, dtype=int)
        self.joint_after = heads
        self.joint_before = (heads - 1) % self.n_nodes

    def element_unknowns(self) -> np.ndarray:
        """(n_elements, 6) unknowns of each element: w, v, b of its first and of its second node."""
        return np.hstack([_unknowns(self.first), _unknowns(self.second)])

    def joint_unknowns(self) -> np.ndarray:
        """(n_joints, 6) unknowns of each joint: its counter-clockwise, then its clockwise node."""
        return np.hstack([_unknowns(self.joint_before), _unknowns(self.joint_after)])


def _unknowns(nodes: np.ndarray) -> np.ndarray:
    return 3 * nodes[:, None] + np.arange(3)


def _elements_per_segment(ring: Ring) -> np.ndarray:
    """Elements of each segment, in proportion to its angle, n_elements in all (largest remainders)."""
    share = ring.n_elements * np.array(ring.segment_angles) / 360
    counts = np.maximum(np.floor(share + 1e-9).astype(int), 1)
    left = ring.n_elements - counts.sum()
    counts[np.argsort(counts - share, kind="stable")[:left]] += 1
    return counts


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


def joint_matrices(ring: Ring) -> tuple[np.ndarray, np.ndarray]:
    """Jumps (opening, dislocation, rotation) per unknown (3, 6), and the stiffness (6, 6), the same at every joint."""
    jumps = np.zeros((3, 6))
    jumps[0, [1, 4]] = -1, 1
    jumps[1, [0, 3]] = 1, -1
    jumps[2, [2, 5]] = -1, 1
    spring = joint_spring(ring)
    return jumps, jumps.T @ np.diag([spring.normal, spring.shear, spring.rotation]) @ jumps


def constant_stiffness(ring: Ring, mesh: RingMesh, with_joints: bool = True) -> sparse.csr_array:
    """Stiffness of the segments, and of linear joints unless left out, (3 n_nodes, 3 n_nodes)."""
    element_stiffness = element_matrices(ring, mesh)[1]
    unknowns = [mesh.element_unknowns()]
    blocks = [element_stiffness]
    if with_joints and len(mesh.joint_after):
        unknowns.append(mesh.joint_unknowns())
        blocks.append(np.broadcast_to(joint_matrices(ring)[1], (len(mesh.joint_after), 6, 6)))
    index = np.concatenate(unknowns)
    values = np.concatenate(blocks)
    rows = np.repeat(index, 6, axis=1)
    columns = np.tile(index, (1, 6))
    size = 3 * mesh.n_nodes
    return sparse.coo_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)).tocsr()


def arc_pieces(start: np.ndarray, span: np.ndarray, kinks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gauss points on arcs that are cut at kinks, so that what is smooth between the kinks is integrated exactly.

    Parameters
    ----------
    start, span : (n_arcs,) float64
        First angle and angle of each arc [rad], no two overlapping.
    kinks : (n_kinks,) float64
        [rad].

    Returns
    -------
    arc : (n_points,) int
        Which arc a point lies on.
    angle : (n_points,) float64
        [rad], from `start` on.
    weight : (n_points,) float64
        Angle that the point stands for [rad]; those of an arc sum to its span.
    """
    order = np.argsort(start % (2 * np.pi))
    last = np.searchsorted(start[order] % (2 * np.pi), kinks % (2 * np.pi), side="right") - 1  # -1: across the crown
    after = (kinks - start[order[last]]) % (2 * np.pi)
    inside = after < span[order[last]]
    ends = np.arange(len(start))
    arcs = np.concatenate([ends, ends, order[last[inside]]])
    cuts = np.concatenate([np.zeros(len(start)), span, after[inside]])
    sorting = np.lexsort((cuts, arcs))
    arcs, cuts = arcs[sorting], cuts[sorting]
    length = np.diff(cuts)
    kept = np.flatnonzero((arcs[1:] == arcs[:-1]) & (length > 0))
    arc, begin, length = arcs[kept], cuts[kept], length[kept]
    angle = (start[arc] + begin)[:, None] + length[:, None] * POINTS
    return np.repeat(arc, len(POINTS)), angle.ravel(), (length[:, None] * WEIGHTS).ravel()


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
    return _unknowns(nodes.ravel()).reshape(*nodes.shape, 3), shares * inward, shares * clockwise


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


def sampled_operator(
    unknown: np.ndarray, values: np.ndarray, theta: np.ndarray, angle: np.ndarray, n_unknowns: int
) -> sparse.csr_array:
    """Nodal forces per sample at `theta` from those per traction at points, (n_unknowns, n_theta).

    unknown, values : (n_points, ...);  angle : (n_points,) of the points [rad].
    """
    samples, shares = _periodic_interpolation(theta, angle)
    count = values[0].size
    columns = np.concatenate([np.repeat(sample, count) for sample in samples])
    shared = np.concatenate([np.repeat(share, count) * values.ravel() for share in shares])
    rows = np.tile(unknown.ravel(), 2)
    return sparse.coo_array((shared, (rows, columns)), shape=(n_unknowns, len(theta))).tocsr()


def _periodic_interpolation(theta: np.ndarray, angle: np.ndarray):
    """Two samples around each angle [rad] and their linear shares; the last sample neighbours the first."""
    angle = angle % (2 * np.pi)
    after = np.searchsorted(theta, angle, side="right") % len(theta)
    before = after - 1
    gap = (theta[after] - theta[before]) % (2 * np.pi)
    share = ((angle - theta[before]) % (2 * np.pi)) / gap
    return (before % len(theta), after), (1 - share, share)


def forces_at(mesh: RingMesh, theta: np.ndarray) -> sparse.csr_array:
    """Section forces at angles theta [rad] from those at the middles of the elements, (n_theta, n_elements).

    Linear between the middles, also across a joint, which passes on all that reaches it.
    """
    middle = mesh.mid_angle % (2 * np.pi)
    order = np.argsort(middle)
    samples, shares = _periodic_interpolation(middle[order], theta)
    place = (np.tile(np.arange(len(theta)), 2), order[np.concatenate(samples)])
    return sparse.coo_array((np.concatenate(shares), place), shape=(len(theta), len(middle))).tocsr()


def displacements_at(mesh: RingMesh, theta: np.ndarray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Radial and tangential displacement of the centre line at theta [rad], (n_theta, 3 n_nodes) each.

    Straight between the two nodes of an element. On a joint one of its sides is taken.
    """
    along = (theta[:, None] - mesh.node_angle[mesh.first]) % (2 * np.pi)
    element = np.argmax(along <= mesh.span, axis=1)
    share = along[np.arange(len(theta)), element] / mesh.span[element]
    rows, columns, radial, tangential = [], [], [], []
    for nodes, of_node in ((mesh.first[element], 1 - share), (mesh.second[element], share)):
        cosine, sine = np.cos(theta - mesh.node_angle[nodes]), np.sin(theta - mesh.node_angle[nodes])
        for way, values in enumerate(((cosine, -sine), (sine, cosine))):
            rows.append(np.arange(len(theta)))
            columns.append(3 * nodes + way)
            radial.append(of_node * values[0])
            tangential.append(of_node * values[1])
    place, shape = (np.concatenate(rows), np.concatenate(columns)), (len(theta), 3 * mesh.n_nodes)
    return tuple(
        sparse.coo_array((np.concatenate(values), place), shape=shape).tocsr() for values in (radial, tangential)
    )


def self_weight(ring: Ring, mesh: RingMesh) -> np.ndarray:
    """Nodal forces of the concrete's weight, (3 n_nodes,); all of it on the centre line."""
    element, angle, weight = arc_pieces(mesh.node_angle[mesh.first], mesh.span, np.zeros(0))
    unknown, inward, clockwise = _moved_to_nodes(ring, mesh, ring.centre_radius, element, angle)
    force = (ring.concrete_unit_weight * ring.thickness * ring.centre_radius * weight)[:, None, None]
    downward = np.cos(angle)[:, None, None] * inward + np.sin(angle)[:, None, None] * clockwise
    return np.bincount(unknown.ravel(), (force * downward).ravel(), 3 * mesh.n_nodes)
