"""The ring as quadratic quadrilaterals: lines of nodes across the thickness, columns of elements between them.

The mesh is mapped, so it is written down here instead of being asked from a mesher: lines lie exactly on joints and
gate walls, nodes exactly on both faces, and nothing but the angle of each line has to be chosen, all of them
radial. Lines are numbered clockwise, the nodes of a line outward; two lines at a zero-thickness joint share their
places, not their nodes. Unknowns: radial (outward), then tangential (clockwise) displacement of every node.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import sparse

from structure.ring import Ring

#: Columns across what is left of the lining at a hole.
BRIDGE_COLUMNS = 4
#: Shares of the three nodes of a quadratic edge in its mean (Simpson).
EDGE_MEAN = np.array([1, 4, 1]) / 6


class Gate(NamedTuple):
    """A slot with radial walls through the lining, or a hole spread evenly over the tunnel's length.

    angle : of its middle [degree, clockwise];  width : on the centre line [m];
    cut : share of the tunnel's length that is open [-]: 1 for a slot that cuts the ring, 1/6 for a hole 0.2 m long in
    a ring 1.2 m wide. The rest bridges the hole with that share of stiffness, weight and loaded area.
    """

    angle: float
    width: float
    cut: float = 1.0


class GasketGroove(NamedTuple):
    """A recess in both faces of every joint, as gaskets lie in; segments touch above and below it only.

    cover : from the outer face to its nearer edge [m];  height : along the face [m];  depth : into either segment, on
    the centre line [m].
    """

    cover: float
    height: float
    depth: float


class Boundary(NamedTuple):
    """What separates two bodies of concrete: its angle [rad], width [m], and whether material could fill it."""

    angle: float
    width: float
    is_joint: bool


class ContinuumMesh:
    """Lines, columns and nodes of the ring.

    Parameters
    ----------
    ring : Ring
    columns : int
        Columns around the whole ring.
    layers : int
        Elements across the thickness.
    strip_width : float
        [m]; 0 for zero-thickness joints, else each joint is a column of this width.
    gate : Gate or None
    groove : GasketGroove or None
        Its edges become lines of the mesh, with at least `layers` elements across the thickness.
    anchor_angles : tuple of float
        Angles of anchors from their joint [rad]: lines too, so that their force enters between columns, not inside one.

    Attributes
    ----------
    layers : int
        Elements across the thickness.
    layer_height : (layers,) float64
        [m].
    radius : (n_levels,) float64
        Of the nodes of a line, n_levels = 2 layers + 1 [m].
    level_mean : (n_levels,) float64
        Shares of the nodes of a line in its mean.
    angle : (n_lines,) float64
        Of every line [rad], ascending, may exceed 2 pi.
    column_lines : (n_columns, 3) int
        First, middle and last line of each column.
    column_is_strip : (n_columns,) bool
    column_share : (n_columns,) float64
        Share of the tunnel's length that is lined: 1 but for what bridges a hole.
    is_groove : (n_columns, layers) bool
        Elements without concrete.
    joint_before, joint_after : (n_joints,) int
        Lines on the counter-clockwise and on the clockwise side of each joint, in the order of the ring's joints.

    Raises
    ------
    ValueError
        Bodies without room for concrete: joints or gate too close to each other.
    """

    def __init__(
        self,
        ring: Ring,
        columns: int,
        layers: int,
        strip_width: float = 0.0,
        gate: Gate | None = None,
        groove: GasketGroove | None = None,
        anchor_angles: tuple[float, ...] = (),
    ):
        edges = _layer_edges(ring, layers, groove)
        self.layer_height = np.diff(edges)
        self.layers = layers = len(self.layer_height)
        self.radius = np.interp(np.arange(2 * layers + 1) / 2, np.arange(layers + 1), edges)
        self.level_mean = np.zeros(2 * layers + 1)
        for layer, height in enumerate(self.layer_height):
            self.level_mean[2 * layer : 2 * layer + 3] += EDGE_MEAN * height / ring.thickness
        self.groove_layers = np.zeros(layers, dtype=bool)
        if groove is not None:
            depth = ring.outer_radius - self.radius[1::2]
            self.groove_layers = (depth > groove.cover) & (depth < groove.cover + groove.height)
        self._columns(ring, columns, strip_width, gate, groove, anchor_angles)
        self.n_lines, self.n_levels = len(self.angle), len(self.radius)

    def _columns(self, ring, columns, strip_width, gate, groove, anchor_angles):
        """Columns of every body of concrete and of what fills the place after it: a strip, what bridges a hole."""
        groove_span = 0.0 if groove is None else groove.depth / ring.centre_radius
        offsets = [offset for offset in (groove_span, *anchor_angles) if offset]
        bridge = 0.0 if gate is None else 1 - gate.cut
        boundaries = _boundaries(ring, strip_width, gate)
        cells, joints = [], []  # of every column: begin, end, is it a strip, its share, is it beside a groove, a cut
        for index, (start, end) in enumerate(_bodies(ring, boundaries)):
            at_joint = [bool(boundaries) and boundaries[(index + k) % len(boundaries)].is_joint for k in (0, 1)]
            for a, b in pairwise(_body_edges(start, end, columns, offsets, at_joint)):
                beside = at_joint[0] and (a + b) / 2 < start + groove_span
                cells.append([a, b, False, 1.0, beside or (at_joint[1] and (a + b) / 2 > end - groove_span), False])
            filling = int(strip_width > 0) if at_joint[1] else BRIDGE_COLUMNS * (bridge > 0)
            if boundaries:
                after = boundaries[(index + 1) % len(boundaries)]
                joints += [(after.angle, len(cells) - 1, len(cells) + filling)] * after.is_joint
                cells[-1][-1] = not filling
                for a, b in pairwise(np.linspace(end, end + after.width / ring.centre_radius, filling + 1)):
                    cells.append([a, b, after.is_joint, 1.0 if after.is_joint else bridge, False, False])
        begin, end, self.column_is_strip, self.column_share, beside, cut = map(np.array, zip(*cells, strict=True))
        self.is_groove = beside[:, None] & self.groove_layers
        # Where nothing fills the place between two bodies, a column has a last line of its own.
        first = 2 * np.arange(len(cut)) + np.cumsum(cut) - cut
        last = np.where(cut, first + 2, np.roll(first, -1))
        self.column_lines = np.stack([first, first + 1, last], axis=1)
        self.angle = np.zeros(2 * len(cut) + cut.sum())
        self.angle[last], self.angle[first], self.angle[first + 1] = end, begin, (begin + end) / 2
        _, before, after = np.array(sorted(joints)).reshape(-1, 3).T.astype(int)
        self.joint_before, self.joint_after = last[before], first[after % len(cut)]

    @property
    def n_unknowns(self) -> int:
        """Two of every node."""
        return 2 * self.n_lines * self.n_levels

    @property
    def node_angle(self) -> np.ndarray:
        """(n_nodes,) float64 [rad]; node number = line * n_levels + level."""
        return np.repeat(self.angle, self.n_levels)

    @property
    def node_radius(self) -> np.ndarray:
        """(n_nodes,) float64 [m]."""
        return np.tile(self.radius, self.n_lines)

    def line_nodes(self, lines: np.ndarray) -> np.ndarray:
        """(..., n_levels) nodes of lines (...), outward."""
        return np.asarray(lines)[..., None] * self.n_levels + np.arange(self.n_levels)

    def gathered(
        self,
        nodes: np.ndarray,
        radial: np.ndarray | float,
        tangential: np.ndarray | float,
        rows: np.ndarray | None = None,
        n_rows: int | None = None,
    ) -> sparse.csr_array:
        """Weighted sums of the displacements of nodes (n, ...), (n_rows, n_unknowns); weights broadcast to the nodes.

        rows : (n,) int, the row of each; one after the other where left out.
        """
        rows, n_rows = (np.arange(len(nodes)), len(nodes)) if rows is None else (rows, n_rows)
        weights = np.stack([np.broadcast_to(way, nodes.shape) for way in (radial, tangential)], axis=-1).ravel()
        columns = (2 * nodes[..., None] + np.arange(2)).ravel()
        rows, kept = np.repeat(rows, 2 * math.prod(nodes.shape[1:])), weights != 0
        shape = (n_rows, self.n_unknowns)
        return sparse.coo_array((weights[kept], (rows[kept], columns[kept])), shape=shape).tocsr()

    def column_angles(self) -> np.ndarray:
        """(n_columns, 3) float64 angles of the lines of each column [rad], ascending."""
        angles = self.angle[self.column_lines]
        # Only the column that closes the ring falls back by a turn.
        angles[:, 1:] += 2 * np.pi * (angles[:, 1:] < angles[:, :1])
        return angles

    def element_nodes(self) -> np.ndarray:
        """(9, n_elements) nodes of each element; element number = column * layers + layer.

        Corners, edge middles and centre in the order of skfem's ElementQuad2: first reference axis clockwise, second
        outward.
        """
        place = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]
        bottom = 2 * np.arange(self.layers)
        return np.stack(
            [
                (self.column_lines[:, along, None] * self.n_levels + bottom[None, :] + across).ravel()
                for along, across in place
            ]
        )

    def locate(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Column of each angle [rad], and the place in it from 0 to 1, beyond 1 in the gate.

        Columns are -1 there. On a zero-thickness joint one of its sides is taken.
        """
        edges = self.column_angles()
        begin, span = edges[:, 0], edges[:, 2] - edges[:, 0]
        shares = ((theta[:, None] - begin + 1e-9) % (2 * np.pi) - 1e-9) / span
        column = np.argmin(np.abs(shares - 0.5), axis=1)
        place = shares[np.arange(len(theta)), column]
        return np.where(place <= 1 + 1e-6, column, -1), place


def _layer_edges(ring: Ring, layers: int, groove: GasketGroove | None) -> np.ndarray:
    """Radii between the layers: even, but lines at the edges of the groove."""
    inner, outer = ring.inner_diameter / 2, ring.outer_radius
    corners = [inner, outer]
    if groove is not None:
        corners[1:1] = [outer - groove.cover - groove.height, outer - groove.cover]
    counts = [max(1, round((b - a) / ring.thickness * layers)) for a, b in pairwise(corners)]
    parts = [np.linspace(a, b, n + 1)[1:] for (a, b), n in zip(pairwise(corners), counts, strict=True)]
    return np.concatenate([[inner], *parts])


def _boundaries(ring: Ring, strip_width: float, gate: Gate | None) -> list[Boundary]:
    boundaries = [Boundary(np.radians(angle), strip_width, True) for angle in ring.joint_angles]
    if gate is not None:
        boundaries.append(Boundary(np.radians(gate.angle % 360), gate.width, False))
    return sorted(boundaries)


def _bodies(ring: Ring, boundaries: list[Boundary]) -> list[tuple[float, float]]:
    """Angles of the start and of the end of each body of concrete [rad]."""
    if not boundaries:
        return [(0.0, 2 * np.pi)]
    bodies = []
    for index, boundary in enumerate(boundaries):
        following = boundaries[(index + 1) % len(boundaries)]
        turn = 0 if index + 1 < len(boundaries) else 2 * np.pi
        start = boundary.angle + boundary.width / 2 / ring.centre_radius
        end = following.angle + turn - following.width / 2 / ring.centre_radius
        if end - start < np.radians(0.5):
            raise ValueError(
                f"ring: joints and gate must leave at least 0.5 degrees of concrete between them, got"
                f" {np.degrees(end - start):.3g} degrees after {np.degrees(boundary.angle):g} degrees;"
                " move the gate, or make it or the joint strip narrower"
            )
        bodies.append((start, end))
    return bodies


def _body_edges(start: float, end: float, columns: int, offsets: list[float], at_joint: list[bool]) -> np.ndarray:
    """Angles between the columns of a body; anchors and the groove's ends, `offsets` from a joint, lie on them."""
    inner = [start, end]
    for offset in (offset for offset in offsets if offset < end - start):
        inner += [start + offset] * at_joint[0] + [end - offset] * at_joint[1]
    # Anchors of both ends may meet; lines closer than this are one.
    corners = np.sort(inner)
    corners = corners[np.append(True, np.diff(corners) > 1e-6)]
    counts = np.maximum(1, np.rint(np.diff(corners) / (2 * np.pi) * columns)).astype(int)
    parts = [np.linspace(a, b, count + 1)[1:] for (a, b), count in zip(pairwise(corners), counts, strict=True)]
    return np.concatenate([[start], *parts])
