"""The concrete of a ring in plane strain: strains and stresses from polar unknowns, its stiffness and its weight.

Unknowns: radial (outward), then tangential (clockwise) displacement of every node of
:class:`structure.continuum.mesh.ContinuumMesh`; unknown number = 2 node + direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from structure.continuum.mesh import ContinuumMesh
from structure.ring import Ring

#: Reference places, along and across an element, where stresses of quadratic elements converge one order faster.
STRESS_POINTS = (0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3))
#: Stiffness and weight of what fills a groove over those of concrete: it holds the nodes inside and nothing else.
GROOVE_SHARE = 1e-6


class Stresses(NamedTuple):
    """Stresses at points, tension positive, as sparse matrices (n_points, n_unknowns), and where they are.

    Point number = (element * n + place across) * n + place along, n places each.
    """

    radial: sparse.csr_array
    hoop: sparse.csr_array
    shear: sparse.csr_array
    angle: np.ndarray
    radius: np.ndarray


class Concrete:
    """Nine-node quadrilaterals of concrete, strips and what fills grooves.

    Parameters
    ----------
    ring : Ring
    mesh : ContinuumMesh
    strip_width : float
        [m]; decides the stiffness of strip columns, which together bend and shear as the joint.
    """

    def __init__(self, ring: Ring, mesh: ContinuumMesh, strip_width: float = 0.0):
        self.ring, self.mesh = ring, mesh
        self.nodes = mesh.element_nodes()
        self._strip = np.repeat(mesh.column_is_strip, mesh.layers)
        share = np.broadcast_to(mesh.column_share[:, None], mesh.is_groove.shape)
        self._share = np.where(mesh.is_groove, GROOVE_SHARE, share).ravel()
        self._moduli = [self._share * modulus for modulus in _moduli(ring, self._strip, strip_width)]

    def _points(self, places, weights):
        """Shape functions (9, n_elements, n) and gradients (9, 2, ..) at places along and across all elements; angle,
        radius and area of these points.
        """
        from skfem import Basis, ElementQuad2, MeshQuad2

        radius, angle = self.mesh.node_radius, self.mesh.node_angle
        elements = MeshQuad2(np.stack([radius * np.sin(angle), radius * np.cos(angle)]), self.nodes)
        along, across = (part.ravel() for part in np.meshgrid(places, places))
        basis = Basis(
            elements, ElementQuad2(), quadrature=(np.stack([along, across]), np.outer(weights, weights).ravel())
        )
        x, y = basis.global_coordinates()
        values, gradients = (np.stack(kind) for kind in zip(*((one, one.grad) for (one,) in basis.basis), strict=True))
        return values, gradients, np.arctan2(x, y), np.hypot(x, y), basis.dx

    def _strains(self, gradients, angle):
        """Radial, hoop and engineering shear strain at points, (n_points, n_unknowns) sparse each."""
        # Axes of unknown `way` of a node seen from a point, of which the node lies `lean` clockwise.
        lean = self.mesh.node_angle[self.nodes][:, :, None] - angle
        outward = np.stack([np.cos(lean), -np.sin(lean)], axis=1)
        onward = np.stack([np.sin(lean), np.cos(lean)], axis=1)
        sine, cosine = np.sin(angle), np.cos(angle)
        by_radius, by_arc = (
            (gradients[:, 0] * one + gradients[:, 1] * other)[:, None]
            for one, other in ((sine, cosine), (cosine, -sine))
        )
        unknown = np.broadcast_to((2 * self.nodes[:, None] + np.arange(2)[:, None])[..., None], outward.shape)
        place = (np.broadcast_to(np.arange(angle.size).reshape(angle.shape), outward.shape).ravel(), unknown.ravel())
        shape = (angle.size, 2 * len(self.mesh.node_angle))
        strains = (outward * by_radius, onward * by_arc, outward * by_arc + onward * by_radius)
        return [sparse.coo_array((strain.ravel(), place), shape=shape).tocsr() for strain in strains]

    def _stresses(self, strains, radius):
        """Stresses from strains at the points of all elements, radius (n_elements, n)."""
        # A strip between radial faces is wider outside; this keeps its stiffness per area of the face the same.
        wider = np.where(self._strip[:, None], radius / self.ring.centre_radius, 1.0)
        scales = (1.0, 1.0, wider, wider)
        direct, coupling, along, sliding = (
            sparse.diags_array((modulus[:, None] * scale * np.ones_like(radius)).ravel())
            for modulus, scale in zip(self._moduli, scales, strict=True)
        )
        radial, hoop, shear = strains
        return direct @ radial + coupling @ hoop, coupling @ radial + along @ hoop, sliding @ shear

    def stiffness(self) -> sparse.csr_array:
        """Stiffness of concrete and strips, (n_unknowns, n_unknowns)."""
        _, gradients, angle, radius, area = self._gauss()
        strains = self._strains(gradients, angle)
        weighted = sparse.diags_array(area.ravel())
        pairs = zip(strains, self._stresses(strains, radius), strict=True)
        return sum(strain.T @ (weighted @ stress) for strain, stress in pairs).tocsr()

    def body_force(self) -> np.ndarray:
        """Nodal forces of the concrete's weight, (n_unknowns,)."""
        angle, total = self.mesh.node_angle, -self.ring.concrete_unit_weight * self.nodal_areas()
        return np.stack([total * np.cos(angle), -total * np.sin(angle)], axis=1).ravel()

    def nodal_areas(self) -> np.ndarray:
        """Concrete that is lumped at each node, (n_nodes,) [m2]."""
        values, _, _, _, area = self._gauss()
        shares = (self._share[:, None] * area * values).sum(axis=2)
        return np.bincount(self.nodes.ravel(), shares.ravel(), len(self.mesh.node_angle))

    def stresses(self) -> Stresses:
        """Stresses at two by two points of every element."""
        _, gradients, angle, radius, _ = self._points(STRESS_POINTS, (0.5, 0.5))
        operators = self._stresses(self._strains(gradients, angle), radius)
        return Stresses(*(part.tocsr() for part in operators), angle.ravel() % (2 * np.pi), radius.ravel())

    def _gauss(self):
        points, weights = np.polynomial.legendre.leggauss(3)
        return self._points((points + 1) / 2, weights / 2)


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
    _, shearing, turning = ring.joint_springs[0] if strip.any() else np.zeros(3)
    hoop_strip = 12 * turning * strip_width / ring.thickness**3
    shear_strip = shearing * strip_width / ring.thickness
    return (
        np.full(len(strip), direct),
        np.where(strip, 0.0, coupling),
        np.where(strip, hoop_strip, direct),
        np.where(strip, shear_strip, shear),
    )
