"""The body-fitted mesh: ground around the lining, channel through it, tunnel interior and headroom.

Every cell is a quadrilateral cut by both diagonals into four linear triangles. They do not lock at constant volume
where the centre node lies on both diagonals: one of the four constraints follows from the other three (Nagtegaal, Parks
& Rice 1974).

The outer face, the channel walls and the inner face are mesh lines with nodes exactly on the circles, so contact is a
condition at nodes; so are the ground surface and the soil layer boundaries.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["CHANNEL", "HEADROOM", "INTERIOR", "SOIL", "Mesh", "MeshError", "altitudes", "angles", "areas"]

SOIL, CHANNEL, INTERIOR, HEADROOM = 0, 1, 2, 3


class MeshError(ValueError):
    """The scene's geometry can not be meshed well enough; the message says where and what to change."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Crossed quadrilaterals with the node sets that contact and boundaries need.

    Attributes
    ----------
    nodes : (n, 2) float64
        Coordinates [m]; y = 0 is the ground surface.
    elements : (m, 3) int32
        Nodes of each triangle, counter-clockwise. Element 4 q + k has corners k and k + 1 (mod 4) of cell q, and the
        centre node of that cell, which no other has. Cells are sorted along a space-filling curve.
    region : (m,) int8
        0 soil, 1 channel, 2 tunnel interior, 3 headroom.
    left, right, bottom, top : (k,) int32
        Nodes on the sides of the box (left and right include the headroom's).
    outer_nodes : tuple of (k,) int32
        Per tunnel, nodes of the outer face by ascending angle, with gate corners and opening nodes.
    outer_theta : tuple of (k,) float64
        Their angles [deg from the crown, clockwise, in [0, 360)].
    opening_nodes : (k,) int32
        Nodes of the outer face strictly between the gate's corners, clockwise.
    corner_nodes : (2,) int32
        Corners of the gate on the outer face, counter-clockwise one (gate angle - d) first; empty without a gate.
    wall_nodes : (k,) int32
        Nodes of the channel walls without the outer corners, with the inner corners; from outside to inside.
    wall_side : (k,) int8
        For `wall_nodes`: the normal into the channel is ``wall_side * (cos(theta_g), -sin(theta_g))``.
    corner_side : (2,) int8
        The same for `corner_nodes`: (+1, -1).
    inner_nodes : (k,) int32
        Nodes of the inner face of the gate's tunnel outside the channel, clockwise from the gate, without the corners.
    inner_opening_nodes : (k,) int32
        Nodes of the inner face strictly between the inner corners.
    gate_angle : float
        [deg]; nan without a gate.
    """

    nodes: NDArray[np.float64]
    elements: NDArray[np.int32]
    region: NDArray[np.int8]
    left: NDArray[np.int32]
    right: NDArray[np.int32]
    bottom: NDArray[np.int32]
    top: NDArray[np.int32]
    outer_nodes: tuple[NDArray[np.int32], ...]
    outer_theta: tuple[NDArray[np.float64], ...]
    opening_nodes: NDArray[np.int32]
    corner_nodes: NDArray[np.int32]
    wall_nodes: NDArray[np.int32]
    wall_side: NDArray[np.int8]
    corner_side: NDArray[np.int8]
    inner_nodes: NDArray[np.int32]
    inner_opening_nodes: NDArray[np.int32]
    gate_angle: float

    @property
    def cells(self) -> NDArray[np.int32]:
        """Corners of the quadrilateral cells, counter-clockwise: (n_cells, 4); cell q owns elements 4 q to 4 q + 3."""
        return self.elements[:, 0].reshape(-1, 4)

    @cached_property
    def quality(self) -> dict[str, float]:
        """Counts, smallest altitude and its place [m], extreme angles [deg], share of triangles with one below 30.

        ``min_relative_altitude`` is the smallest altitude of a triangle over the root of its cell's area [-]: 0.5 in a
        square.
        """
        altitude = altitudes(self.nodes, self.elements)
        area = areas(self.nodes, self.elements).reshape(-1, 4).sum(axis=1)
        angle = np.degrees(angles(self.nodes, self.elements))
        worst = int(altitude.argmin())
        x, y = self.nodes[self.elements[worst]].mean(axis=0)
        return {
            "n_nodes": len(self.nodes),
            "n_elements": len(self.elements),
            "min_altitude": float(altitude[worst]),
            "min_altitude_x": float(x),
            "min_altitude_y": float(y),
            "min_relative_altitude": float((altitude.reshape(-1, 4).min(axis=1) / np.sqrt(area)).min()),
            "min_angle": float(angle.min()),
            "max_angle": float(angle.max()),
            "share_below_30_degrees": float((angle.min(axis=1) < 30).mean()),
        }

    def mirrored(self) -> Mesh:
        """The mirror image in x = 0: the same nodes and elements in the same order, turned counter-clockwise again."""
        outer_nodes, outer_theta = [], []
        for nodes, theta in zip(self.outer_nodes, self.outer_theta, strict=True):
            reflected = np.mod(360.0 - theta, 360.0)
            order = np.argsort(reflected)
            outer_nodes.append(nodes[order])
            outer_theta.append(reflected[order])
        return Mesh(
            nodes=self.nodes * np.array([-1.0, 1.0]),
            elements=np.ascontiguousarray(self.elements.reshape(-1, 4, 3)[:, ::-1, [1, 0, 2]].reshape(-1, 3)),
            region=self.region,
            left=self.right,
            right=self.left,
            bottom=self.bottom,
            top=self.top,
            outer_nodes=tuple(outer_nodes),
            outer_theta=tuple(outer_theta),
            opening_nodes=self.opening_nodes[::-1].copy(),
            corner_nodes=self.corner_nodes[::-1].copy(),
            wall_nodes=self.wall_nodes,
            wall_side=(-self.wall_side).astype(np.int8),
            corner_side=self.corner_side,
            inner_nodes=self.inner_nodes[::-1].copy(),
            inner_opening_nodes=self.inner_opening_nodes[::-1].copy(),
            gate_angle=(-self.gate_angle) % 360.0,
        )

    def save(self, path: str | Path) -> None:
        """Write a ``.vtu`` that ParaView shows and `Mesh.load` reads; node sets are stored as integer fields.

        A field holds -1 outside its set and the position within the set inside it.
        """
        import meshio

        n = len(self.nodes)
        point_data: dict[str, Any] = {}

        def rank(nodes: NDArray[np.int32]) -> NDArray[np.int32]:
            field = np.full(n, -1, dtype=np.int32)
            field[nodes] = np.arange(len(nodes), dtype=np.int32)
            return field

        for name in _NODE_SETS:
            point_data[name] = rank(getattr(self, name))
        point_data["wall_side"] = np.zeros(n, dtype=np.int32)
        point_data["wall_side"][self.wall_nodes] = self.wall_side
        for i, (nodes, theta) in enumerate(zip(self.outer_nodes, self.outer_theta, strict=True)):
            point_data[f"outer_nodes_{i}"] = rank(nodes)
            point_data[f"outer_theta_{i}"] = np.full(n, np.nan)
            point_data[f"outer_theta_{i}"][nodes] = theta
        meshio.Mesh(
            np.column_stack([self.nodes, np.zeros(n)]),
            [("triangle", self.elements)],
            point_data=point_data,
            cell_data={
                "region": [self.region.astype(np.int32)],
                "gate_angle": [np.full(len(self.elements), self.gate_angle)],
            },
        ).write(path)

    @staticmethod
    def load(path: str | Path) -> Mesh:
        """Read a mesh written by `save`.

        Raises
        ------
        MeshError
            When the file can not be read as such a mesh.
        """
        import meshio

        try:
            data = meshio.read(path)
            point, cell = data.point_data, data.cell_data

            def members(field: NDArray[np.int32]) -> NDArray[np.int32]:
                inside = np.flatnonzero(field >= 0)
                return inside[np.argsort(field[inside])].astype(np.int32)

            tunnels = sum(name.startswith("outer_nodes_") for name in point)
            outer_nodes = tuple(members(point[f"outer_nodes_{i}"]) for i in range(tunnels))
            sets = {name: members(point[name]) for name in _NODE_SETS}
            return Mesh(
                nodes=np.ascontiguousarray(data.points[:, :2]),
                elements=np.ascontiguousarray(data.cells[0].data, dtype=np.int32),
                region=cell["region"][0].astype(np.int8),
                outer_nodes=outer_nodes,
                outer_theta=tuple(point[f"outer_theta_{i}"][nodes] for i, nodes in enumerate(outer_nodes)),
                wall_side=point["wall_side"][sets["wall_nodes"]].astype(np.int8),
                corner_side=np.array([1, -1][: len(sets["corner_nodes"])], dtype=np.int8),
                gate_angle=float(cell["gate_angle"][0][0]),
                **sets,
            )
        except (OSError, KeyError, IndexError, ValueError, SyntaxError, SystemExit, meshio.ReadError) as error:
            raise MeshError(f"mesh file {str(path)!r} must be a mesh saved by this program, got {error!r}") from error


_NODE_SETS = (
    "left", "right", "bottom", "top", "opening_nodes", "corner_nodes", "wall_nodes", "inner_nodes",
    "inner_opening_nodes",
)  # fmt: skip


def altitudes(nodes: NDArray[np.float64], elements: NDArray[np.integer]) -> NDArray[np.float64]:
    """Smallest altitude of each triangle [m], shape (m,): twice the area over the longest edge."""
    corner = nodes[elements]
    edge = np.roll(corner, -1, axis=1) - corner
    longest = np.hypot(edge[..., 0], edge[..., 1]).max(axis=1)
    return 2 * areas(nodes, elements) / longest


def areas(nodes: NDArray[np.float64], elements: NDArray[np.integer]) -> NDArray[np.float64]:
    """Area of each triangle [m2], shape (m,), positive when counter-clockwise."""
    a, b, c = (nodes[elements[:, i]] for i in range(3))
    return 0.5 * ((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1]))


def angles(nodes: NDArray[np.float64], elements: NDArray[np.integer]) -> NDArray[np.float64]:
    """Angles of each triangle at its nodes [rad], shape (m, 3)."""
    corner = nodes[elements]
    forward = np.roll(corner, -1, axis=1) - corner
    backward = np.roll(corner, 1, axis=1) - corner
    cosine = (forward * backward).sum(axis=2) / np.linalg.norm(forward, axis=2) / np.linalg.norm(backward, axis=2)
    return np.arccos(np.clip(cosine, -1, 1))
