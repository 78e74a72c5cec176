"""The ring as quadratic quadrilaterals: lines of nodes across the thickness, columns of elements between them.

The mesh is mapped, so it is written down here instead of being asked from a mesher: lines lie exactly on joints and
gate walls, nodes exactly on both faces, and nothing but the angle of each line has to be chosen, all of them
radial. Lines are numbered
clockwise, the nodes of a line outward; two lines at a zero-thickness joint share their places, not their nodes.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

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
    anchor_angle : float or None
        Angle of anchors from their joint [rad]: lines too, so that their force enters between columns, not inside one.

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
        anchor_angle: float | None = None,
    ):
        edges = _layer_edges(ring, layers, groove)
        self.layer_height = np.diff(edges)
        self.layers = layers = len(self.layer_height)
        self.radius = np.interp(np.arange(2 * layers + 1) / 2, np.arange(layers + 1), edges)
        self.level_mean = np.zeros(2 * layers + 1)
        for layer, height in enumerate(self.layer_height):
            self.level_mean[2 * layer : 2 * layer + 3] += EDGE_MEAN * height / ring.thickness
        self._centre_radius = ring.centre_radius
        self._groove_span = 0.0 if groove is None else groove.depth / ring.centre_radius
        self._line_offsets = [offset for offset in (self._groove_span, anchor_angle) if offset]
        boundaries = self._boundaries(ring, strip_width, gate)
        bridge = 0.0 if gate is None else 1 - gate.cut
        angles, column_lines, strips, shares, before, after, grooved = [], [], [], [], [], [], []
        closed = not boundaries
        for index, (start, end) in enumerate(self._bodies(boundaries)):
            first = sum(map(len, angles))
            at_joint = [not closed and boundaries[(index + k) % len(boundaries)].is_joint for k in (0, 1)]
            body = self._body_lines(start, end, columns, at_joint)
            count = len(body) // 2
            angles.append(body[:-1] if closed else body)
            counts = [count]
            if not closed:
                boundary = boundaries[(index + 1) % len(boundaries)]
                turn = 0 if index + 1 < len(boundaries) else 2 * np.pi
                counts.append(int(strip_width > 0) if boundary.is_joint else BRIDGE_COLUMNS * (bridge > 0))
                half = boundary.width / 2 / ring.centre_radius
                inside = np.linspace(-half, half, 2 * counts[1] + 1)[1:-1] if counts[1] else np.zeros(0)
                angles.append(boundary.angle + turn + inside)
                if boundary.is_joint:
                    before.append(first + 2 * counts[0])
                    after.append(before[-1] + max(2 * counts[1], 1))
            column_lines += [(first + 2 * k, first + 2 * k + 1, first + 2 * k + 2) for k in range(sum(counts))]
            fills_joint = not closed and boundary.is_joint
            strips += [False] * counts[0] + [fills_joint] * sum(counts[1:])
            shares += [1.0] * counts[0] + [1.0 if fills_joint else bridge] * sum(counts[1:])
            beside = np.zeros(sum(counts), dtype=bool)
            middle = body[1::2]
            beside[:count] = at_joint[0] & (middle < start + self._groove_span)
            beside[:count] |= at_joint[1] & (middle > end - self._groove_span)
            grooved.append(beside)
        self.angle = np.concatenate(angles)
        self.n_lines, self.n_levels = len(self.angle), len(self.radius)
        self.column_lines = np.array(column_lines) % self.n_lines
        self.column_is_strip, self.column_share = np.array(strips), np.array(shares)
        middle = ring.outer_radius - self.radius[1::2]
        #: Layers of the groove, (layers,) bool.
        self.groove_layers = np.zeros(layers, dtype=bool)
        if groove is not None:
            self.groove_layers = (middle > groove.cover) & (middle < groove.cover + groove.height)
        self.is_groove = np.concatenate(grooved)[:, None] & self.groove_layers
        # The body after the first boundary comes first, so the joint at its start is met last.
        joints = np.argsort([self.angle[line] % (2 * np.pi) for line in np.array(after, dtype=int) % self.n_lines])
        self.joint_before = np.array(before, dtype=int)[joints]
        self.joint_after = np.array(after, dtype=int)[joints] % self.n_lines

    def _body_lines(self, start: float, end: float, columns: int, at_joint: list[bool]) -> np.ndarray:
        """Angles of the lines of a body, two per column and one more; anchors and the groove's ends lie on lines."""
        inner = [start, end]
        for offset in (offset for offset in self._line_offsets if offset < end - start):
            inner += [start + offset] * at_joint[0] + [end - offset] * at_joint[1]
        # Anchors of both ends may meet; lines closer than this are one.
        corners = np.sort(inner)
        corners = corners[np.append(True, np.diff(corners) > 1e-6)]
        counts = np.maximum(1, np.rint(np.diff(corners) / (2 * np.pi) * columns)).astype(int)
        parts = [np.linspace(corners[k], corners[k + 1], 2 * count + 1)[int(k > 0) :] for k, count in enumerate(counts)]
        return np.concatenate(parts)

    @staticmethod
    def _boundaries(ring: Ring, strip_width: float, gate: Gate | None) -> list[Boundary]:
        boundaries = [Boundary(np.radians(angle), strip_width, True) for angle in ring.joint_angles]
        if gate is not None:
            boundaries.append(Boundary(np.radians(gate.angle % 360), gate.width, False))
        return sorted(boundaries)

    def _bodies(self, boundaries: list[Boundary]) -> list[tuple[float, float]]:
        """Angles of the start and of the end of each body of concrete [rad]."""
        if not boundaries:
            return [(0.0, 2 * np.pi)]
        bodies = []
        for index, boundary in enumerate(boundaries):
            following = boundaries[(index + 1) % len(boundaries)]
            turn = 0 if index + 1 < len(boundaries) else 2 * np.pi
            start = boundary.angle + boundary.width / 2 / self._centre_radius
            end = following.angle + turn - following.width / 2 / self._centre_radius
            if end - start < np.radians(0.5):
                raise ValueError(
                    f"ring: joints and gate must leave at least 0.5 degrees of concrete between them, got"
                    f" {np.degrees(end - start):.3g} degrees after {np.degrees(boundary.angle):g} degrees;"
                    " move the gate, or make it or the joint strip narrower"
                )
            bodies.append((start, end))
        return bodies

    @property
    def node_angle(self) -> np.ndarray:
        """(n_nodes,) float64 [rad]; node number = line * n_levels + level."""
        return np.repeat(self.angle, self.n_levels)

    @property
    def node_radius(self) -> np.ndarray:
        """(n_nodes,) float64 [m]."""
        return np.tile(self.radius, self.n_lines)

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
        """Column of each angle [rad], and the place in it from 0 to 1.

        Columns are -1 in the gate. On a zero-thickness joint one of its sides is taken.
        """
        edges = self.column_angles()
        begin, span = edges[:, 0], edges[:, 2] - edges[:, 0]
        column = np.full(len(theta), -1)
        place = np.zeros(len(theta))
        for index, angle in enumerate(theta):
            share = ((angle - begin + 1e-9) % (2 * np.pi) - 1e-9) / span
            best = int(np.argmin(np.abs(share - 0.5)))
            if share[best] <= 1 + 1e-6:
                column[index], place[index] = best, share[best]
        return column, place


def _layer_edges(ring: Ring, layers: int, groove: GasketGroove | None) -> np.ndarray:
    """Radii between the layers: even, but lines at the edges of the groove."""
    inner, outer = ring.inner_diameter / 2, ring.outer_radius
    corners = [inner, outer]
    if groove is not None:
        corners[1:1] = [outer - groove.cover - groove.height, outer - groove.cover]
    counts = [max(1, round((b - a) / ring.thickness * layers)) for a, b in pairwise(corners)]
    parts = [np.linspace(a, b, n + 1)[1:] for (a, b), n in zip(pairwise(corners), counts, strict=True)]
    return np.concatenate([[inner], *parts])
