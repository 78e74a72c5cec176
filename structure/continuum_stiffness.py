"""Stiffness of the concrete and of the joints of a ring in plane strain, in polar unknowns, and stresses from them.

Unknowns: radial (outward), then tangential (clockwise) displacement of every node of
:class:`structure.continuum_mesh.ContinuumMesh`; unknown number = 2 node + direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from structure.continuum_mesh import ContinuumMesh
from structure.ring import Ring
from structure.springs import joint_spring

#: Reference places, along and across an element, where stresses of quadratic elements converge one order faster.
STRESS_POINTS = (0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3))
#: Stiffness and weight of what fills a groove over those of concrete: it holds the nodes inside and nothing else.
GROOVE_SHARE = 1e-6
#: Integrals of products of the three shape functions of a quadratic edge of unit length.
EDGE_MASS = np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]]) / 30


class StressOperators(NamedTuple):
    """Stresses at the stress points, as sparse matrices (n_elements * 4, n_unknowns), and where they are.

    Point number = element * 4 + 2 (place across) + (place along).
    """

    radial: sparse.csr_array
    hoop: sparse.csr_array
    shear: sparse.csr_array
    angle: np.ndarray
    radius: np.ndarray


class Concrete:
    """The finite element basis of the ring and what follows from it.

    Parameters
    ----------
    ring : Ring
    mesh : ContinuumMesh
    strip_width : float
        [m]; decides the stiffness of strip columns, which together bend and shear as the joint.
    """

    def __init__(self, ring: Ring, mesh: ContinuumMesh, strip_width: float = 0.0):
        from skfem import ElementQuad2, ElementVector, MeshQuad2

        self.ring, self.mesh = ring, mesh
        angle, radius = mesh.node_angle, mesh.node_radius
        self.nodes = mesh.element_nodes()
        places = np.stack([radius * np.sin(angle), radius * np.cos(angle)])
        self._skfem_mesh = MeshQuad2(places, self.nodes)
        self._element = ElementVector(ElementQuad2())
        self.n_unknowns = 2 * len(angle)
        sine, cosine = np.sin(angle), np.cos(angle)
        node = np.arange(len(angle))
        #: Cartesian displacements (x right, y up) from polar unknowns.
        self.to_cartesian = sparse.coo_array(
            (
                np.concatenate([sine, cosine, cosine, -sine]),
                (
                    np.concatenate([2 * node, 2 * node, 2 * node + 1, 2 * node + 1]),
                    np.concatenate([2 * node, 2 * node + 1, 2 * node, 2 * node + 1]),
                ),
            ),
            shape=(self.n_unknowns, self.n_unknowns),
        ).tocsr()
        self._strip = np.repeat(mesh.column_is_strip, mesh.layers)
        share = np.broadcast_to(mesh.column_share[:, None], mesh.is_groove.shape)
        self._share = np.where(mesh.is_groove, GROOVE_SHARE, share).ravel()
        self._moduli = [self._share * modulus for modulus in _moduli(ring, self._strip, strip_width)]

    def _moduli_at(self, radius: np.ndarray) -> list[np.ndarray]:
        """Radial, coupling, hoop and shear modulus at points of every element, (n_elements, n) each [Pa]."""
        radial, coupling, hoop, shear = (np.broadcast_to(modulus[:, None], radius.shape) for modulus in self._moduli)
        # A strip between radial faces is wider outside; this keeps its stiffness per area of the face the same.
        widening = np.where(self._strip[:, None], radius / self.ring.centre_radius, 1.0)
        return [radial, coupling, hoop * widening, shear * widening]

    def stiffness(self) -> sparse.csr_array:
        """Stiffness of concrete and strips, (n_unknowns, n_unknowns)."""
        from skfem import Basis, BilinearForm

        basis = Basis(self._skfem_mesh, self._element, intorder=5)
        where = basis.global_coordinates()
        moduli = self._moduli_at(np.hypot(where[0], where[1]))

        def strains(field, place):
            return _polar(field.grad, np.arctan2(place[0], place[1]))

        @BilinearForm
        def energy(u, v, w):
            radial, hoop, shear = strains(u, w.x)
            test_radial, test_hoop, test_shear = strains(v, w.x)
            stress = _stress(radial, hoop, shear, moduli)
            return stress[0] * test_radial + stress[1] * test_hoop + stress[2] * test_shear

        matrix = energy.assemble(basis).tocoo()
        number = self._numbers(basis)
        ours = sparse.coo_array((matrix.data, (number[matrix.row], number[matrix.col])), shape=matrix.shape).tocsr()
        return (self.to_cartesian.T @ ours @ self.to_cartesian).tocsr()

    def body_force(self) -> np.ndarray:
        """Nodal forces of the concrete's weight, (n_unknowns,)."""
        from skfem import Basis, LinearForm

        basis = Basis(self._skfem_mesh, self._element, intorder=5)
        unit_weight = (self.ring.concrete_unit_weight * self._share)[:, None]

        @LinearForm
        def weight(v, w):
            return -unit_weight * v[1]

        forces = np.zeros(self.n_unknowns)
        forces[self._numbers(basis)] = weight.assemble(basis)
        return self.to_cartesian.T @ forces

    def stresses(self) -> StressOperators:
        """Stresses at two by two points of every element, tension positive."""
        from skfem import Basis

        along, across = np.meshgrid(STRESS_POINTS, STRESS_POINTS)
        points = np.stack([along.ravel(), across.ravel()])
        basis = Basis(self._skfem_mesh, self._element, quadrature=(points, np.full(4, 0.25)))
        place = basis.global_coordinates()
        angle = np.arctan2(place[0], place[1])
        moduli = self._moduli_at(np.hypot(place[0], place[1]))
        row = np.arange(angle.size).reshape(angle.shape)
        rows, columns, values = [], [], ([], [], [])
        for local in range(18):
            strain = _polar(basis.basis[local][0].grad, angle)
            number = 2 * self.nodes[local // 2] + local % 2
            rows.append(row.ravel())
            columns.append(np.repeat(number, 4))
            for kept, stress in zip(values, _stress(*strain, moduli), strict=True):
                kept.append(np.broadcast_to(stress, angle.shape).ravel())
        where = (np.concatenate(rows), np.concatenate(columns))
        shape = (angle.size, self.n_unknowns)
        operators = (
            sparse.coo_array((np.concatenate(kept), where), shape=shape).tocsr() @ self.to_cartesian for kept in values
        )
        return StressOperators(*operators, angle.ravel() % (2 * np.pi), np.hypot(place[0], place[1]).ravel())

    def _numbers(self, basis) -> np.ndarray:
        """Our number (2 node + direction, Cartesian) of each unknown of skfem."""
        number = np.empty(self.n_unknowns, dtype=int)
        number[basis.element_dofs] = 2 * np.repeat(self.nodes, 2, axis=0) + np.tile([0, 1], 9)[:, None]
        return number


def _moduli(ring: Ring, strip: np.ndarray, strip_width: float) -> tuple[np.ndarray, ...]:
    """Radial, coupling, hoop and shear modulus of every element, (n_elements,) each [Pa].

    Concrete: plane strain, isotropic. Strip: no coupling, hoop modulus 12 k_theta b/t^3 and shear modulus k_s b/t, so
    that a strip of width b and height t turns and slides as the joint does; its normal stiffness is then
    12 k_theta/t^2, whatever the joint's.
    """
    young, nu = ring.concrete_modulus, ring.concrete_poissons_ratio
    shear = young / (2 * (1 + nu))
    coupling = young * nu / ((1 + nu) * (1 - 2 * nu))
    direct = coupling + 2 * shear
    joint = joint_spring(ring)
    hoop_strip = 12 * joint.rotation * strip_width / ring.thickness**3
    shear_strip = joint.shear * strip_width / ring.thickness
    return (
        np.full(len(strip), direct),
        np.where(strip, 0.0, coupling),
        np.where(strip, hoop_strip, direct),
        np.where(strip, shear_strip, shear),
    )


def _polar(gradient: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radial, hoop and engineering shear strain from Cartesian gradients [component, direction]."""
    sine, cosine = np.sin(angle), np.cos(angle)
    xx, yy, xy = gradient[0, 0], gradient[1, 1], gradient[0, 1] + gradient[1, 0]
    radial = xx * sine**2 + yy * cosine**2 + xy * sine * cosine
    hoop = xx * cosine**2 + yy * sine**2 - xy * sine * cosine
    shear = 2 * (xx - yy) * sine * cosine + xy * (cosine**2 - sine**2)
    return radial, hoop, shear


def _stress(radial, hoop, shear, moduli):
    direct_radial, coupling, direct_hoop, shear_modulus = moduli
    return (
        direct_radial * radial + coupling * hoop,
        coupling * radial + direct_hoop * hoop,
        shear_modulus * shear,
    )


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


class JointOperators(NamedTuple):
    """Opening, dislocation and rotation of every joint from the unknowns, (n_joints, n_unknowns) sparse each."""

    opening: sparse.csr_array
    dislocation: sparse.csr_array
    rotation: sparse.csr_array


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


def joint_operators(ring: Ring, mesh: ContinuumMesh) -> JointOperators:
    """Movements of the clockwise face against the other one: gap on the centre line and rotation that fit best, and
    the mean dislocation.

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
    return JointOperators(opening, dislocation.tocsr(), rotation)


def joint_stiffness(ring: Ring, mesh: ContinuumMesh) -> sparse.csr_array:
    """Stiffness of zero-thickness joints, (n_unknowns, n_unknowns).

    Springs k_n and k_s per height of what touches alone would turn with k_n t^2/12. Rank-1 terms in the gap on the
    centre line and in the rotation bring the rest, so that the energy is k_n opening^2 + k_theta rotation^2 plus what
    the springs store in the rest of the gap; it is never negative. Without a groove only the rotation needs one,
    k_theta - k_n t^2/12.
    """
    n_unknowns = 2 * mesh.n_lines * mesh.n_levels
    spring = joint_spring(ring)
    mass = _face_mass(mesh)
    fit, matrix = _best_fit(ring, mesh)
    touching = matrix[0, 0]
    normal = spring.normal / touching * (mass - fit.T @ matrix @ fit) + fit.T @ (
        np.diag([spring.normal, spring.rotation]) @ fit
    )
    stiffness = sparse.csr_array((n_unknowns, n_unknowns))
    for direction, face in ((1, normal), (0, spring.shear / touching * mass)):
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
