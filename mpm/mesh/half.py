"""The half model of a symmetric scene: only x >= 0 is computed, and everything that leaves is of the whole.

On the mirror line x = 0 what is odd in x vanishes: horizontal velocities and momenta of both phases, the horizontal
gradient of the pore pressure, shear on the lining. Its nodes hold half of the masses and forces of the whole's nodes,
and half of the reactions of the lining there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mpm.mesh.mesh import Mesh

#: Variables of a point that change sign in the mirror.
ODD = ("x", "velocity_solid_x", "velocity_liquid_x", "stress_xy", "displacement_x")


def right_half(mesh: Mesh) -> Mesh:
    """The part x >= 0 of a mesh; its `left` is the mirror line, its rings run from crown to invert.

    Raises
    ------
    ValueError
        When triangles cross x = 0.
    """
    x = mesh.nodes[mesh.elements][:, :, 0]
    inside = x.max(axis=1) > 0
    if (x[inside] < 0).any():
        raise ValueError(
            "mesh: the mirror line x = 0 of a half model must be a mesh line, got "
            f"{int((x[inside] < 0).any(axis=1).sum())} triangles that cross it; use the mesh that build_mesh makes of "
            "this scene, or symmetry = 'whole'"
        )
    elements = mesh.elements[inside]
    kept = np.unique(elements)
    number = np.full(len(mesh.nodes), -1, np.int32)
    number[kept] = np.arange(len(kept), dtype=np.int32)
    nodes = np.ascontiguousarray(mesh.nodes[kept])

    def members(chosen: NDArray[np.int32]) -> NDArray[np.bool_]:
        return number[chosen] >= 0

    def numbers(chosen: NDArray[np.int32]) -> NDArray[np.int32]:
        return number[chosen[members(chosen)]]

    line = np.flatnonzero(nodes[:, 0] == 0)
    return replace(
        mesh,
        nodes=nodes,
        elements=np.ascontiguousarray(number[elements]),
        region=mesh.region[inside],
        left=line[np.argsort(nodes[line, 1])].astype(np.int32),
        right=numbers(mesh.right),
        bottom=numbers(mesh.bottom),
        top=numbers(mesh.top),
        outer_nodes=tuple(numbers(nodes) for nodes in mesh.outer_nodes),
        outer_theta=tuple(t[members(nodes)] for nodes, t in zip(mesh.outer_nodes, mesh.outer_theta, strict=True)),
        opening_nodes=numbers(mesh.opening_nodes),
        corner_nodes=numbers(mesh.corner_nodes),
        corner_side=mesh.corner_side[members(mesh.corner_nodes)],
        wall_nodes=numbers(mesh.wall_nodes),
        wall_side=mesh.wall_side[members(mesh.wall_nodes)],
        inner_nodes=numbers(mesh.inner_nodes),
        inner_opening_nodes=numbers(mesh.inner_opening_nodes),
    )


def with_mirror_image(half: Mesh) -> Mesh:
    """The mesh of a half model's whole: the half first, then its mirror image, in the same order."""
    off_axis = half.nodes[:, 0] > 0
    twin = np.arange(len(half.nodes), dtype=np.int32)
    twin[off_axis] = len(half.nodes) + np.arange(off_axis.sum())
    image = half.mirrored()
    nodes = np.concatenate([half.nodes, image.nodes[off_axis]])

    def joined(ours: NDArray[np.int32], theirs: NDArray[np.int32]) -> NDArray[np.int32]:
        """Nodes of the half and of its image, those on the mirror line once."""
        return np.concatenate([ours, twin[theirs[off_axis[theirs]]]]).astype(np.int32)

    def along(axis: int, ours: NDArray[np.int32], theirs: NDArray[np.int32]) -> NDArray[np.int32]:
        both = joined(ours, theirs)
        return both[np.argsort(nodes[both, axis])]

    def clockwise(start: float, ours: NDArray[np.int32], theirs: NDArray[np.int32]) -> NDArray[np.int32]:
        """In the order of their angles about the tunnel's axis, from `start` [deg] on."""
        both = joined(ours, theirs)
        x, y = (nodes[both] - centre).T
        angle = np.degrees(np.arctan2(x, y))
        return both[np.argsort((angle - start) % 360.0)]

    crown, invert = half.outer_nodes[0][[0, -1]]
    centre = 0.5 * (half.nodes[crown] + half.nodes[invert])
    theta = half.outer_theta[0]
    outer = np.concatenate([half.outer_nodes[0], twin[half.outer_nodes[0][-2:0:-1]]]).astype(np.int32)
    sides = np.concatenate([half.wall_side, image.wall_side])
    walls = np.concatenate([half.wall_nodes, twin[image.wall_nodes]])
    by_side = np.argsort(-sides, kind="stable")
    opposite = half.gate_angle + 180.0
    return replace(
        half,
        nodes=nodes,
        elements=np.concatenate([half.elements, twin[image.elements]]),
        region=np.concatenate([half.region, half.region]),
        left=twin[half.right],
        bottom=along(0, half.bottom, image.bottom),
        top=along(0, half.top, image.top),
        outer_nodes=(outer,),
        outer_theta=(np.concatenate([theta, 360.0 - theta[-2:0:-1]]),),
        opening_nodes=clockwise(opposite, half.opening_nodes, image.opening_nodes),
        corner_nodes=clockwise(opposite, half.corner_nodes, image.corner_nodes),
        corner_side=np.array([1, -1][: 2 * len(half.corner_nodes)], dtype=np.int8),
        wall_nodes=walls[by_side].astype(np.int32),
        wall_side=sides[by_side],
        inner_nodes=clockwise(half.gate_angle, half.inner_nodes, image.inner_nodes),
        inner_opening_nodes=clockwise(opposite, half.inner_opening_nodes, image.inner_opening_nodes),
    )


def with_mirrored_points(points: dict[str, NDArray]) -> dict[str, NDArray]:
    """Points of a half model by name, followed by their mirror images."""
    return {name: np.concatenate([v, -v if name in ODD else v]) for name, v in points.items()}


def whole_ring(nodes_of_half: int) -> NDArray[np.int64]:
    """For every node of a ring, clockwise from the crown: its place in the half ring, crown to invert."""
    half = np.arange(nodes_of_half)
    return np.concatenate([half, half[-2:0:-1]])


def ring_factors(nodes_of_half: int) -> NDArray[np.float64]:
    """What makes the whole ring's sums at the lining of those of the half: (n_nodes, 5), columns as of `impulse`.

    A node on the mirror line felt half of the force. What its contact recorded along the face is the push of the half
    against its mirror image, which the line takes up; there is no shear. The mirror turns the others around.
    """
    whole = whole_ring(nodes_of_half)
    share = np.where((whole == 0) | (whole == nodes_of_half - 1), 2.0, 1.0)
    side = np.where(np.arange(len(whole)) < nodes_of_half, 1.0, -1.0)
    side[share == 2.0] = 0.0
    return np.column_stack([share, share, side, share**2, share**2])
