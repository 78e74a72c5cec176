"""The source's lining in its soil computation: how stiff one layer of linear triangles through the lining is."""

import numpy as np


def one_layer(size: float, outer: float, inner: float, poissons_ratio: float, harmonic: int = 2) -> float:
    """Bending stiffness of a ring of one layer of linear triangles over that of the ring, plane strain [-].

    A radial traction cos(harmonic theta) on the outer face; stiffness is the inverse of the work it does. Linear
    triangles have constant strain, so a layer that bends shears and stretches as a whole.

    size : length of the triangles along the ring [m];  outer, inner : radii [m].
    """
    import skfem

    along = round(0.5 * np.pi * (outer + inner) / size)
    ring = outer, inner, poissons_ratio, harmonic
    return _compliance(3, 120, skfem.ElementTriP2(), *ring) / _compliance(1, along, skfem.ElementTriP1(), *ring)


def _compliance(across, along, element, outer, inner, poissons_ratio, harmonic):
    """Work of a unit traction on half a ring of Young's modulus 1, cut in its axis of symmetry."""
    import skfem
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    plain = skfem.MeshTri.init_tensor(np.linspace(0, np.pi, along + 1), np.linspace(inner, outer, across + 1))
    angle, radius = plain.p
    on_outer = plain.facets_satisfying(lambda x: np.isclose(x[1], outer), boundaries_only=True)
    mesh = skfem.MeshTri(np.ascontiguousarray([radius * np.sin(angle), radius * np.cos(angle)]), plain.t)
    inside = skfem.Basis(mesh, skfem.ElementVector(element), intorder=4)

    @skfem.LinearForm
    def traction(v, w):
        x, y = w.x
        return np.cos(harmonic * np.arctan2(x, y)) * (v[0] * x + v[1] * y) / np.hypot(x, y)

    load = traction.assemble(skfem.FacetBasis(mesh, inside.elem, facets=on_outer, intorder=6))
    stiffness = linear_elasticity(*lame_parameters(1.0, poissons_ratio)).assemble(inside)
    across_cut = inside.get_dofs(lambda x: np.isclose(x[0], 0.0, atol=1e-9)).all(["u^1"])
    held = np.append(across_cut, inside.nodal_dofs[1, 0])  # and one node along the cut, which the load does not move
    return float(load @ skfem.solve(*skfem.condense(stiffness, load, D=held)))
