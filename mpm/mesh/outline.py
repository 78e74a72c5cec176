"""The lines that cells must fit, divided into their edges, and the regular cells along the linings and in the channel.

What lies between is filled by gmsh (`mpm.mesh.cells`) with cells of twice the size, which are cut into quarters: every
line between two of its fixed nodes therefore has an even number of edges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from mpm.mesh.circle import SAMPLES, divided, divided_circle, edges_along, loop_of, opening_only, place, rows_along
from mpm.mesh.mesh import CHANNEL, HEADROOM, INTERIOR, SOIL, MeshError
from mpm.mesh.sizes import gate_size, headroom_height
from mpm.scene import Scene

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Nodes = NDArray[np.int64]

# A water table closer than this to a soil layer boundary, surface or bottom, in element sizes, is no mesh line.
NEAR_LINE = 1.5


@dataclass
class Face:
    """What gmsh fills: loops and inner lines of nodes, every second of which is a node of the coarse mesh."""

    region: int
    loops: list[list[Nodes]]
    lines: list[Nodes]


@dataclass
class Outline:
    """Nodes and regular cells, the faces left to be filled, and the nodes of lining and gate."""

    nodes: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    free: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 2), bool))
    cells: list[Nodes] = field(default_factory=list)
    region: list[int] = field(default_factory=list)
    faces: list[Face] = field(default_factory=list)
    ground: Nodes = field(default_factory=lambda: np.zeros(0, np.int64))
    outer: list[Nodes] = field(default_factory=list)
    theta: list[NDArray[np.float64]] = field(default_factory=list)
    corners: Nodes = field(default_factory=lambda: np.zeros(0, np.int64))
    opening: Nodes = field(default_factory=lambda: np.zeros(0, np.int64))
    walls: list[Nodes] = field(default_factory=list)
    inner: Nodes = field(default_factory=lambda: np.zeros(0, np.int64))
    inner_opening: Nodes = field(default_factory=lambda: np.zeros(0, np.int64))

    def add(self, positions: ArrayLike, free_x: ArrayLike = False, free_y: ArrayLike = False) -> Nodes:
        """New nodes, and whether they may move along x and y; their numbers."""
        positions = np.asarray(positions, float).reshape(-1, 2)
        free = np.zeros((len(positions), 2), bool)
        free[:, 0], free[:, 1] = free_x, free_y
        first = len(self.nodes)
        self.nodes = np.concatenate([self.nodes, positions])
        self.free = np.concatenate([self.free, free])
        return np.arange(first, len(self.nodes))

    def add_grid(self, grid: Nodes, region: int) -> None:
        """Cells between neighbouring rows and columns of nodes."""
        cells = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)
        self.cells.append(cells)
        self.region += [region] * len(cells)


def _line(scene: Scene, outline: Outline, start: int, end: int, beside: list[Nodes] | None = None) -> Nodes:
    """Nodes of a horizontal or vertical line from node to node: an even number of edges.

    With the lines `beside` it, which close a loop with it, there are four times as many edges as a whole number.
    """
    a, b = outline.nodes[start], outline.nodes[end]
    cumulative = edges_along(scene, a + np.linspace(0, 1, SAMPLES)[:, None] * (b - a))
    pairs = max(1, round(cumulative[-1] / 2))
    if beside is not None and (sum(len(line) - 1 for line in beside) // 2 + pairs) % 2:
        pairs += 1 if pairs == 1 or pairs < cumulative[-1] / 2 else -1
    share = divided(cumulative, 2 * pairs)[1:-1, None]
    horizontal = bool(a[1] == b[1])
    between = outline.add(a + share * (b - a), horizontal, not horizontal)
    outline.nodes[between, 1 if horizontal else 0] = a[1 if horizontal else 0]
    return np.concatenate([[start], between, [end]])


def horizontal_lines(scene: Scene) -> list[float]:
    """Heights [m, downward] of soil layer boundaries, and of the water table where it is a mesh line of its own.

    The table is left out where it lies closer to a layer boundary, to the surface or to the bottom than `NEAR_LINE`
    element sizes, within a third of a tunnel's radius (or four of the lining's elements) of its crown or invert, or
    beside its gate: a kink of the pore pressure inside a cell does less harm than flat cells.
    """
    layers = [-soil.top_depth for soil in scene.soils[1:]]
    if scene.water is None:
        return layers
    table, size = -scene.water.table_depth, scene.discretisation.element_size
    if min(abs(table - y) for y in (0.0, -scene.box.depth, *layers)) < NEAR_LINE * size:
        return layers
    for i, tunnel in enumerate(scene.tunnels):
        rise, radius = table + tunnel.axis_depth, tunnel.outer_radius
        if abs(abs(rise) - radius) < max(radius / 3, 4 * scene.discretisation.element_size_lining):
            return layers
        if (
            abs(rise) < radius
            and scene.gate is not None
            and scene.gate.tunnel == i
            and _meets_gate(scene, tunnel, table)
        ):
            return layers
    return sorted([*layers, table], reverse=True)


def _cut_angle(tunnel, height):
    """Angle [deg] right of the crown at which a horizontal line meets the outer face."""
    return math.degrees(math.acos((height + tunnel.axis_depth) / tunnel.outer_radius))


def _meets_gate(scene, tunnel, height):
    gate = scene.gate
    half = math.degrees(math.asin(gate.width / 2 / tunnel.outer_radius))
    angle = _cut_angle(tunnel, height)
    return any(abs((t - gate.angle + 180) % 360 - 180) < 1.5 * half for t in (angle, 360.0 - angle))


def rows_that_fit(scene: Scene, i: int, lines: list[float], most: int) -> int:
    """Rows of cells along the outer face of tunnel i that stay clear of lines, box and other tunnels."""
    tunnel, size = scene.tunnels[i], scene.discretisation.element_size_lining
    radius = tunnel.outer_radius
    clear = [scene.box.width / 2 - abs(tunnel.x) - radius]
    clear += [
        abs(abs(y + tunnel.axis_depth) - radius)
        for y in (0.0, -scene.box.depth, *lines)
        if abs(y + tunnel.axis_depth) >= radius
    ]
    clear += [
        math.hypot(t.x - tunnel.x, t.axis_depth - tunnel.axis_depth) - t.outer_radius - radius
        for j, t in enumerate(scene.tunnels)
        if j != i
    ]
    return max(0, min(most, int(0.4 * min(clear) / size), max(1, int(0.7 * radius / size))))


def draw_scene(scene: Scene, rows: int) -> Outline:
    """All lines of a scene with their nodes, and the regular cells; of a half model those of x >= 0.

    Parameters
    ----------
    rows : int
        Most rows of regular cells along a lining.

    Raises
    ------
    MeshError
        When a soil layer boundary touches the gate.
    """
    outline = Outline()
    lines = horizontal_lines(scene)
    rings, edges = [], []
    for i, tunnel in enumerate(scene.tunnels):
        has_gate = scene.gate is not None and scene.gate.tunnel == i
        cut = [y for y in lines if abs(y + tunnel.axis_depth) < tunnel.outer_radius]
        if has_gate and scene.gate is not None:
            for y in cut:
                if _meets_gate(scene, tunnel, y):
                    raise MeshError(
                        "gate: must not touch a soil layer boundary on the lining, got gate angle "
                        f"{scene.gate.angle:g} deg and a boundary at {_cut_angle(tunnel, y):.4g} deg; "
                        "move the layer or the gate by the gate's width"
                    )
        cuts = [(t, y) for y in cut for t in (_cut_angle(tunnel, y), 360.0 - _cut_angle(tunnel, y))]
        cuts = sorted((t, y) for t, y in cuts if not scene.is_half or t < 180)
        ring = divided_circle(scene, tunnel, tunnel.outer_radius, [t for t, _ in cuts], has_gate)
        face = outline.add(place(tunnel, tunnel.outer_radius, ring.theta))
        for k, (_, y) in zip(ring.cuts, cuts, strict=True):
            outline.nodes[face[k], 1] = y  # but for round-off it is
        outline.outer.append(face)
        outline.theta.append(ring.theta)
        count = rows_that_fit(scene, i, lines, rows)
        grid = rows_along(
            scene, outline, tunnel, ring, face, tunnel.outer_radius, count, True, [y for _, y in cuts]
        )  # fmt: skip
        rings.append(ring)
        edges.append(grid[:, -1])
        if has_gate:
            _draw_gate(scene, outline, tunnel, ring, rows)
    _draw_ground(scene, outline, lines, rings, edges)
    return outline


def _draw_gate(scene, outline, tunnel, ring, rows):
    """The channel, and the inside of the gate's tunnel where it is resolved."""
    if scene.interior == "resolved":
        inner = divided_circle(scene, tunnel, tunnel.inner_radius, [], True, 2 if scene.is_half else 4)
        face = outline.add(place(tunnel, tunnel.inner_radius, inner.theta))
    else:
        inner = opening_only(scene, tunnel)
        face = outline.add(place(tunnel, tunnel.inner_radius, inner.theta))
    mouth, throat = outline.outer[-1][ring.opening], face[inner.opening]
    length = tunnel.outer_radius - tunnel.inner_radius
    pieces = max(1, round(length / gate_size(scene)))
    share = np.arange(1, pieces) / pieces
    columns = []
    for a, b in zip(mouth, throat, strict=True):
        between = outline.nodes[a] + share[:, None] * (outline.nodes[b] - outline.nodes[a])
        columns.append(np.concatenate([[a], outline.add(between), [b]]))
    outline.add_grid(np.stack(columns), CHANNEL)
    ends = [0, -1]
    if scene.is_half:
        ends = [-1] if scene.gate.angle == 0 else [0]
    outline.corners = mouth[ends]
    outline.walls = [columns[end][1:] for end in ends]
    # Of the two ends of a half model's opening one lies on the mirror line and is no corner.
    strict = slice(0 if ends == [-1] else 1, None if ends == [0] else -1)
    outline.opening, outline.inner_opening = mouth[strict], throat[strict]
    if scene.interior != "resolved":
        return
    n = len(face)
    after = (inner.opening[-1] + np.arange(1, n)) % n
    outside = [i for i in after if i not in set(inner.opening.tolist())]
    outline.inner = face[sorted(outside) if scene.is_half else outside]
    size = scene.discretisation.element_size_interior
    count = max(0, min(rows, int(0.2 * tunnel.inner_radius / size)))
    grid = rows_along(scene, outline, tunnel, inner, face, tunnel.inner_radius, count, False, [])
    loop = loop_of(inner, grid[:, -1])
    if scene.is_half:
        loop = [*loop, _line(scene, outline, grid[-1, -1], grid[0, -1], loop)]
    outline.faces.append(Face(INTERIOR, [loop], []))


def _draw_ground(scene, outline, lines, rings, edges):
    """Sides of the box, horizontal lines between them, and the ground that is left beside the rings."""
    half, depth = scene.box.width / 2, scene.box.depth
    levels = [0.0, *lines, -depth]
    right = outline.add([(half, y) for y in levels])
    if scene.is_half:
        (tunnel,), (edge,), (ring,) = scene.tunnels, edges, rings
        radius = tunnel.outer_radius
        left = [int(outline.add((0.0, y))[0]) if abs(y + tunnel.axis_depth) > radius else -1 for y in levels]
        above = [k for k, y in zip(left, levels, strict=True) if y + tunnel.axis_depth > radius]
        below = [k for k, y in zip(left, levels, strict=True) if y + tunnel.axis_depth < -radius]
        axis = [
            [_line(scene, outline, a, b) for a, b in pairwise([*above, edge[0]])],
            loop_of(ring, edge),
            [_line(scene, outline, a, b) for a, b in pairwise([edge[-1], *below])],
        ]
        side_left = [piece for part in axis for piece in part]
    else:
        left = outline.add([(-half, y) for y in levels]).tolist()
        side_left = [_line(scene, outline, a, b) for a, b in pairwise(left)]
    side_right = [_line(scene, outline, a, b) for a, b in pairwise(right)]
    outline.ground = _line(scene, outline, left[0], right[0])
    holes = [] if scene.is_half else [loop_of(ring, edge) for ring, edge in zip(rings, edges, strict=True)]
    beside = [*side_left, *side_right, outline.ground, *[piece for hole in holes for piece in hole]]
    bottom = _line(scene, outline, left[-1], right[-1], beside)
    loop = [*side_left, bottom, *[piece[::-1] for piece in side_right[::-1]], outline.ground[::-1]]
    inside = []
    for k, y in enumerate(lines, start=1):
        met = []
        for ring, edge in zip(rings, edges, strict=True):
            at = [edge[i] for i in ring.cuts if outline.nodes[edge[i], 1] == y]
            met += at
        met.sort(key=lambda node: outline.nodes[node, 0])
        ends = [*([left[k]] if left[k] >= 0 else []), *met, right[k]]
        inside += [_line(scene, outline, a, b) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    outline.faces.append(Face(SOIL, [loop, *holes], inside))


def draw_headroom(scene: Scene, outline: Outline) -> None:
    """Regular columns of empty cells above the ground surface, whose nodes do not move any more."""
    height = headroom_height(scene)
    pieces = max(1, round(height / scene.discretisation.element_size))
    rows = [outline.ground]
    for k in range(1, pieces + 1):
        row = outline.nodes[outline.ground].copy()
        row[:, 1] = height * k / pieces if k < pieces else height
        rows.append(outline.add(row))
    outline.add_grid(np.stack(rows), HEADROOM)
