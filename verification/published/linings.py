"""The source's lining in its soil computation: how stiff one layer of linear triangles through the lining is."""

from __future__ import annotations

import numpy as np


def one_layer(size: float, outer: float, inner: float, poissons_ratio: float, harmonic: int = 2) -> float:
    """Bending stiffness of a ring of one layer of linear triangles over that of the ring, plane strain [-].

    A radial traction cos(harmonic theta) on the outer face; stiffness is the inverse of the work it does. Linear
    triangles have constant strain, so bending of a layer needs shear and doubles back as stretch: never below 3.

    Parameters
    ----------
    size : float
        Length of the triangles along the ring [m].
    outer, inner : float
        Radii [m].
    """
    import skfem

    coarse = _compliance(_ring(1, round(np.pi * (outer + inner) / size), outer, inner), skfem.ElementTriP1(), outer,
                         poissons_ratio, harmonic)  # fmt: skip
    exact = _compliance(_ring(3, 240, outer, inner), skfem.ElementTriP2(), outer, poissons_ratio, harmonic)
    return exact / coarse


def _ring(across, around, outer, inner):
    """Triangles of a ring, two a quadrilateral, all cut along the same diagonal."""
    import skfem

    theta = 2 * np.pi * np.arange(around) / around
    radius = np.linspace(inner, outer, across + 1)
    places = np.array([(r * np.cos(t), r * np.sin(t)) for t in theta for r in radius]).T

    def number(i, j):
        return (i % around) * (across + 1) + j

    quads = [(number(i, j), number(i, j + 1), number(i + 1, j + 1), number(i + 1, j))
             for i in range(around) for j in range(across)]  # fmt: skip
    triangles = [part for a, b, c, d in quads for part in ((a, b, c), (a, c, d))]
    return skfem.MeshTri(np.ascontiguousarray(places), np.ascontiguousarray(np.array(triangles).T))


def _compliance(mesh, element, outer, poissons_ratio, harmonic):
    """Work of a unit traction for a Young's modulus of 1."""
    import skfem
    from skfem.helpers import dot
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    vector = skfem.ElementVector(element)
    inside = skfem.Basis(mesh, vector, intorder=4)
    middle = mesh.p[:, mesh.facets].mean(axis=1)
    boundary = mesh.boundary_facets()
    on_outer = boundary[np.hypot(*middle[:, boundary]) > 0.5 * (outer + np.hypot(*mesh.p).min())]
    face = skfem.FacetBasis(mesh, vector, facets=on_outer, intorder=6)

    @skfem.LinearForm
    def load(v, w):
        angle, radius = np.arctan2(w.x[1], w.x[0]), np.hypot(*w.x)
        return np.cos(harmonic * angle) * (v[0] * w.x[0] + v[1] * w.x[1]) / radius

    @skfem.BilinearForm
    def spring(u, v, _):
        return dot(u, v)

    stiffness = linear_elasticity(*lame_parameters(1.0, poissons_ratio)).assemble(inside)
    held = stiffness + 1e-10 * spring.assemble(inside)  # takes out rigid motion, which the load does not excite
    traction = load.assemble(face)
    return float(traction @ skfem.solve(held, traction))
