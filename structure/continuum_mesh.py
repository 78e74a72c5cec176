"""The ring as quadratic quadrilaterals: lines of nodes across the thickness, columns of elements between them.

The mesh is mapped, so it is written down here instead of being asked from a mesher: lines lie exactly on joints and
gate walls, nodes exactly on both faces, and nothing but the angle of each line has to be chosen. Lines are numbered
clockwise, the nodes of a line outward; two lines at a zero-thickness joint share their places, not their nodes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from structure.ring import Ring

#: Columns over which lines turn from radial to the direction of a wall.
TAPER = 3
#: Shares of the three nodes of a quadratic edge in its mean (Simpson).
EDGE_MEAN = np.array([1, 4, 1]) / 6


class Opening(NamedTuple):
    """A slot with parallel walls through the lining: angle of its middle [degree, clockwise], width [m]."""

    angle: float
    width: float


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
    opening : Opening or None

    Attributes
    ----------
    radius : (n_levels,) float64
        Of the nodes of a line, n_levels = 2 layers + 1 [m].
    level_mean : (n_levels,) float64
        Shares of the nodes of a line in its mean.
    angle : (n_lines, n_levels) float64
        Of every node [rad], ascending from line to line, may exceed 2 pi.
    column_lines : (n_columns, 3) int
        First, middle and last line of each column.
    column_is_strip : (n_columns,) bool
    joint_before, joint_after : (n_joints,) int
        Lines on the counter-clockwise and on the clockwise side of each joint, in the order of the ring's joints.

    Raises
    ------
    ValueError
        Bodies without room for concrete: joints or opening too close to each other.
    """

    def __init__(self, ring: Ring, columns: int, layers: int, strip_width: float = 0.0, opening: Opening | None = None):
        self.radius = np.linspace(ring.inner_diameter / 2, ring.outer_radius, 2 * layers + 1)
        self.level_mean = np.zeros(2 * layers + 1)
        for layer in range(layers):
            self.level_mean[2 * layer : 2 * layer + 3] += EDGE_MEAN / layers
        self.layers = layers
        boundaries = self._boundaries(ring, strip_width, opening)
        angles, column_lines, strips, before, after = [], [], [], [], []
        closed = not boundaries
        for index, (start, end) in enumerate(self._bodies(boundaries)):
            first = sum(map(len, angles))
            body = _lines(start, end, columns, self.radius)
            angles.append(body[:-1] if closed else body)
            count = (len(body) - 1) // 2
            column_lines += [(first + 2 * k, first + 2 * k + 1, first + 2 * k + 2) for k in range(count)]
            strips += [False] * count
            boundary = boundaries[(index + 1) % len(boundaries)] if boundaries else None
            if boundary is not None and boundary.is_joint:
                last, after_last = first + 2 * count, first + 2 * count + 1
                if strip_width > 0:
                    middle = boundary.angle + (0 if index + 1 < len(boundaries) else 2 * np.pi)
                    angles.append(np.full((1, len(self.radius)), middle))
                    column_lines.append((last, after_last, after_last + 1))
                    strips.append(True)
                    after_last += 1
                before.append(last)
                after.append(after_last)
        self.angle = np.concatenate(angles)
        self.n_lines, self.n_levels = self.angle.shape
        self.column_lines = np.array(column_lines) % self.n_lines
        self.column_is_strip = np.array(strips)
        # The body after the first boundary comes first, so the joint at its start is met last.
        joints = np.argsort([self.angle[line, 0] % (2 * np.pi) for line in np.array(after, dtype=int) % self.n_lines])
        self.joint_before = np.array(before, dtype=int)[joints]
        self.joint_after = np.array(after, dtype=int)[joints] % self.n_lines

    @staticmethod
    def _boundaries(ring: Ring, strip_width: float, opening: Opening | None) -> list[Boundary]:
        boundaries = [Boundary(np.radians(angle), strip_width, True) for angle in ring.joint_angles]
        if opening is not None:
            boundaries.append(Boundary(np.radians(opening.angle % 360), opening.width, False))
        return sorted(boundaries)

    def _bodies(self, boundaries: list[Boundary]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Angles at all levels of the start and of the end of each body of concrete, (n_levels,) each."""
        if not boundaries:
            return [(np.zeros_like(self.radius), np.full_like(self.radius, 2 * np.pi))]
        bodies = []
        for index, boundary in enumerate(boundaries):
            following = boundaries[(index + 1) % len(boundaries)]
            turn = 0 if index + 1 < len(boundaries) else 2 * np.pi
            start = boundary.angle + np.arcsin(boundary.width / 2 / self.radius)
            end = following.angle + turn - np.arcsin(following.width / 2 / self.radius)
            if (end - start).min() < np.radians(0.5):
                raise ValueError(
                    f"ring: joints and opening must leave at least 0.5 degrees of concrete between them, got"
                    f" {np.degrees((end - start).min()):.3g} degrees after {np.degrees(boundary.angle):g} degrees;"
                    " move the opening, or make it or the joint strip narrower"
                )
            bodies.append((start, end))
        return bodies

    @property
    def node_angle(self) -> np.ndarray:
        """(n_nodes,) float64 [rad]; node number = line * n_levels + level."""
        return self.angle.ravel()

    @property
    def node_radius(self) -> np.ndarray:
        """(n_nodes,) float64 [m]."""
        return np.tile(self.radius, self.n_lines)

    def column_angles(self, level: int) -> np.ndarray:
        """(n_columns, 3) float64 angles of the lines of each column at a level [rad], ascending."""
        angles = self.angle[self.column_lines, level]
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
        """Column of each angle [rad] on the centre line, and the place in it from 0 to 1.

        Columns are -1 in the opening. On a zero-thickness joint one of its sides is taken.
        """
        edges = self.column_angles(self.layers)
        begin, span = edges[:, 0], edges[:, 2] - edges[:, 0]
        column = np.full(len(theta), -1)
        place = np.zeros(len(theta))
        for index, angle in enumerate(theta):
            share = ((angle - begin + 1e-9) % (2 * np.pi) - 1e-9) / span
            best = int(np.argmin(np.abs(share - 0.5)))
            if share[best] <= 1 + 1e-6:
                column[index], place[index] = best, share[best]
        return column, place

    def neighbour_place(self) -> np.ndarray:
        """(n_lines,) place of each line when the ring is folded flat, which closes it inside a narrow band."""
        line = np.arange(self.n_lines)
        return np.where(2 * line < self.n_lines, 2 * line, 2 * (self.n_lines - line) - 1)


def _lines(start: np.ndarray, end: np.ndarray, columns: int, radius: np.ndarray) -> np.ndarray:
    """Angles (2 n + 1, n_levels) of the lines of one body: radial, but for those that turn towards a slanted wall."""
    first, last = start.mean(), end.mean()
    count = max(1, round((last - first) / (2 * np.pi) * columns))
    number = np.arange(2 * count + 1)[:, None]
    taper = 2 * min(TAPER, count)
    towards_start = np.maximum(0, 1 - number / taper) * (start - first)
    towards_end = np.maximum(0, 1 - (2 * count - number) / taper) * (end - last)
    return first + (last - first) * number / (2 * count) + towards_start + towards_end
