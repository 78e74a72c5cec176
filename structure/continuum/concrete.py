"""Stiffness of the concrete of a ring in plane strain, in polar unknowns, and stresses from them.

Unknowns: radial (outward), then tangential (clockwise) displacement of every node of
:class:`structure.continuum.mesh.ContinuumMesh`; unknown number = 2 node + direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from structure.continuum.mesh import ContinuumMesh
from structure.ring import Ring
from structure.springs import joint_spring

#: Reference places, along and across an element, where stresses of quadratic elements converge one order faster.
STRESS_POINTS = (0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3))
#: Stiffness and weight of what fills a groove over those of concrete: it holds the nodes inside and nothing else.
GROOVE_SHARE = 1e-6


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
