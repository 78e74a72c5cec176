"""The body-fitted triangle mesh: ground around the lining, channel through it, tunnel interior and headroom.

The outer face, the channel walls and the inner face are mesh lines with nodes exactly on the circles, so contact is a
condition at nodes; so are the ground surface and the soil layer boundaries.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mpm.half_model import right_half, with_mirror_image
from mpm.scene import Scene, Tunnel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["CHANNEL", "HEADROOM", "INTERIOR", "SOIL", "Mesh", "MeshError", "build_mesh", "element_size"]

SOIL, CHANNEL, INTERIOR, HEADROOM = 0, 1, 2, 3

# Smallest altitude over the size asked for at that place; equilateral is 0.87. Flatter triangles would set the time
# step of the whole run while resolving nothing.
MIN_RELATIVE_ALTITUDE = 0.3
# Meshing algorithms of gmsh in the order tried until no triangle is flatter than that: frontal, Delaunay, adaptive.
ALGORITHMS = (6, 5, 1)
# Share of the element size within which a node belongs to the mirror line x = 0 of a half model: those of the strip
# through the gate are relocated by some thousandths.
ON_MIRROR_LINE = 0.02
SYSTEM_PACKAGES = "libglu1-mesa libgl1 libxrender1 libxcursor1 libxft2 libxinerama1 libgomp1"


class MeshError(ValueError):
    """The scene's geometry can not be meshed well enough; the message says where and what to change."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Linear triangles with the node sets that contact and boundaries need.

    Attributes
    ----------
    nodes : (n, 2) float64
        Coordinates [m]; y = 0 is the ground surface.
    elements : (m, 3) int32
        Nodes of each triangle, counter-clockwise; sorted along a space-filling curve.
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

    @cached_property
    def quality(self) -> dict[str, float]:
        """Counts, smallest altitude and its place [m], extreme angles [deg], share of triangles with one below 30."""
        altitude = altitudes(self.nodes, self.elements)
        angle = np.degrees(angles(self.nodes, self.elements))
        worst = int(altitude.argmin())
        x, y = self.nodes[self.elements[worst]].mean(axis=0)
        return {
            "n_nodes": len(self.nodes),
            "n_elements": len(self.elements),
            "min_altitude": float(altitude[worst]),
            "min_altitude_x": float(x),
            "min_altitude_y": float(y),
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
            elements=np.ascontiguousarray(self.elements[:, [0, 2, 1]]),
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


def altitudes(nodes: NDArray[np.float64], elements: NDArray[np.int32]) -> NDArray[np.float64]:
    """Smallest altitude of each triangle [m], shape (m,): twice the area over the longest edge."""
    corner = nodes[elements]
    edge = np.roll(corner, -1, axis=1) - corner
    longest = np.hypot(edge[..., 0], edge[..., 1]).max(axis=1)
    return 2 * areas(nodes, elements) / longest


def areas(nodes: NDArray[np.float64], elements: NDArray[np.int32]) -> NDArray[np.float64]:
    """Area of each triangle [m2], shape (m,), positive when counter-clockwise."""
    a, b, c = (nodes[elements[:, i]] for i in range(3))
    return 0.5 * ((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1]))


def angles(nodes: NDArray[np.float64], elements: NDArray[np.int32]) -> NDArray[np.float64]:
    """Angles of each triangle at its nodes [rad], shape (m, 3)."""
    corner = nodes[elements]
    forward = np.roll(corner, -1, axis=1) - corner
    backward = np.roll(corner, 1, axis=1) - corner
    cosine = (forward * backward).sum(axis=2) / np.linalg.norm(forward, axis=2) / np.linalg.norm(backward, axis=2)
    return np.arccos(np.clip(cosine, -1, 1))


def element_size(scene: Scene, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Element size asked for at (x, y) [m]: the smallest of the scene's sizes, each growing with distance.

    Parameters
    ----------
    x, y : array
        Positions [m], any shape.
    """
    d = scene.discretisation
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    size = np.full(np.broadcast(x, y).shape, d.element_size)
    for each in scene.tunnels:
        gap = np.abs(np.hypot(x - each.x, y + each.axis_depth) - each.outer_radius)
        size = np.minimum(size, d.element_size_lining + d.size_growth * gap)
    gate, tunnel = scene.gate, _gate_tunnel(scene)
    if gate is None or tunnel is None:
        return size
    inside = np.hypot(x - tunnel.x, y + tunnel.axis_depth) < tunnel.inner_radius
    size = np.where(inside, np.minimum(size, d.element_size_interior), size)
    # Distance to the channel's centre line, from outer to inner face.
    along, across = _gate_axes(gate.angle)
    s = (x - tunnel.x) * along[0] + (y + tunnel.axis_depth) * along[1]
    t = (x - tunnel.x) * across[0] + (y + tunnel.axis_depth) * across[1]
    distance = np.hypot(s - np.clip(s, tunnel.inner_radius, tunnel.outer_radius), t)
    return np.minimum(size, _gate_size(scene) + d.size_growth * distance)


def _gate_tunnel(scene: Scene) -> Tunnel | None:
    return None if scene.gate is None else scene.tunnels[scene.gate.tunnel]


def _gate_size(scene: Scene) -> float:
    """Element size across the channel [m]."""
    assert scene.gate is not None
    return scene.gate.width / scene.discretisation.elements_across_gate


def _headroom(scene: Scene) -> float:
    """Height of the empty mesh above the ground [m], one element unless given."""
    return scene.box.headroom or scene.discretisation.element_size


def _gate_axes(angle: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Unit vectors (radial, outward) and (tangential, clockwise) at `angle` [deg]."""
    theta = math.radians(angle)
    return (math.sin(theta), math.cos(theta)), (math.cos(theta), -math.sin(theta))


def _divide(scene: Scene, tunnel: Tunnel, radius: float, start: float, end: float) -> list[float]:
    """Angles [deg] strictly between `start` and `end` that divide the arc into edges of the local size."""
    theta = np.linspace(start, end, 2001)
    rad = np.radians(theta)
    size = element_size(scene, tunnel.x + radius * np.sin(rad), -tunnel.axis_depth + radius * np.cos(rad))
    density = radius * math.radians(end - start) / 2000 / size
    cumulative = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2)])
    count = max(1, math.ceil(cumulative[-1] - 0.25))
    return [float(v) for v in np.interp(np.arange(1, count) * cumulative[-1] / count, cumulative, theta)]


def _ring(scene: Scene, tunnel: Tunnel, radius: float, forced: list[float]) -> list[float]:
    """Angles [deg, ascending from forced[0], within one turn] of the nodes of a ring through the `forced` angles."""
    stations = [*forced, forced[0] + 360.0]
    result: list[float] = []
    for start, end in pairwise(stations):
        result += [start, *_divide(scene, tunnel, radius, start, end)]
    return result


def _layer_angles(scene: Scene, tunnel: Tunnel) -> list[float]:
    """Angles [deg] at which soil layer boundaries meet the tunnel's outer face."""
    result = []
    for soil in scene.soils[1:]:
        cosine = (-soil.top_depth + tunnel.axis_depth) / tunnel.outer_radius
        if abs(cosine) < 1:
            theta = math.degrees(math.acos(cosine))
            result += [theta, 360.0 - theta]
    return result


def _import_gmsh() -> Any:
    try:
        import gmsh
    except OSError as error:
        raise MeshError(
            f"meshing needs system libraries that are missing ({error}); "
            f"on Debian or Ubuntu type: sudo apt-get install -y {SYSTEM_PACKAGES}"
        ) from error
    return gmsh


class _Drawing:
    """Points and one-element lines of a gmsh geometry, each made once."""

    def __init__(self, gmsh: Any) -> None:
        self.gmsh = gmsh
        self.geo = gmsh.model.geo
        self.lines: dict[tuple[int, int], int] = {}
        self.exact: dict[int, tuple[float, float]] = {}

    def point(self, x: float, y: float) -> int:
        tag: int = self.geo.addPoint(x, y, 0.0)
        self.exact[tag] = (x, y)
        return tag

    def line(self, a: int, b: int) -> int:
        if (b, a) in self.lines:
            return -self.lines[b, a]
        if (a, b) not in self.lines:
            self.lines[a, b] = self.geo.addLine(a, b)
        return self.lines[a, b]

    def chain(self, points: list[int]) -> list[int]:
        """Lines from each point to the next."""
        return [self.line(a, b) for a, b in pairwise(points)]

    def on_axis(self, points: list[int]) -> int:
        """The point nearest to x = 0."""
        return min(points, key=lambda tag: abs(self.exact[tag][0]))

    def edges(self, chain: list[int]) -> list[int]:
        """Lines that are one mesh edge each."""
        tags = self.chain(chain)
        for tag in tags:
            self.geo.mesh.setTransfiniteCurve(abs(tag), 2)
        return tags

    def surface(self, *loops: list[int]) -> int:
        tag: int = self.geo.addPlaneSurface([self.geo.addCurveLoop(loop) for loop in loops])
        return tag


def _on_ring(draw: _Drawing, tunnel: Tunnel, radius: float, theta: list[float]) -> list[int]:
    return [
        draw.point(
            tunnel.x + radius * math.sin(math.radians(t)), -tunnel.axis_depth + radius * math.cos(math.radians(t))
        )
        for t in theta
    ]


@dataclass
class _Outline:
    """gmsh point tags (later node numbers) of the lining, per tunnel and at the gate."""

    outer: list[list[int]]
    theta: list[list[float]]
    opening: list[int]
    corners: list[int]
    walls: list[list[int]]
    inner: list[int]
    inner_corners: list[int]
    inner_opening: list[int]


def _draw_lining(scene: Scene, draw: _Drawing) -> _Outline:
    """Points of every outer face, and of channel and inner face at the gate."""
    outline = _Outline([], [], [], [], [], [], [], [])
    gate = scene.gate
    for i, tunnel in enumerate(scene.tunnels):
        layers = _layer_angles(scene, tunnel)
        if gate is None or gate.tunnel != i:
            stations = sorted({*layers, 0.0, 90.0, 180.0, 270.0} if not layers else {*layers, 0.0, 180.0})
            theta = _ring(scene, tunnel, tunnel.outer_radius, stations)
            outline.outer.append(_on_ring(draw, tunnel, tunnel.outer_radius, theta))
            outline.theta.append(theta)
            continue
        n = scene.discretisation.elements_across_gate
        half = math.degrees(math.asin(gate.width / 2 / tunnel.outer_radius))
        blocked = [t for t in layers if abs((t - gate.angle + 180) % 360 - 180) < 1.5 * half]
        if blocked:
            raise MeshError(
                f"gate: must not touch a soil layer boundary on the lining, got gate angle {gate.angle:g} deg and a "
                f"boundary at {blocked[0]:.4g} deg; move the layer or the gate by the gate's width"
            )
        opening = [gate.angle + half * (2 * k / n - 1) for k in range(n + 1)]
        rest = [opening[-1] + (t - opening[-1]) % 360.0 for t in layers]
        # The point opposite the gate keeps the ring's nodes symmetric about the gate's axis.
        stations = sorted([opening[-1], *rest, gate.angle + 180.0])
        stations.append(opening[0] + 360.0)
        outside = [stations[0]]
        for start, end in pairwise(stations):
            outside += [*_divide(scene, tunnel, tunnel.outer_radius, start, end), end]
        theta = opening + outside[1:-1]
        tags = _on_ring(draw, tunnel, tunnel.outer_radius, theta)
        outline.outer.append(tags)
        outline.theta.append(theta)
        outline.corners = [tags[0], tags[n]]
        outline.opening = tags[1:n]
        _draw_channel(scene, draw, outline, tunnel, n)
    return outline


def _draw_channel(scene: Scene, draw: _Drawing, outline: _Outline, tunnel: Tunnel, n: int) -> None:
    """Points of the channel walls and of the inner face of the gate's tunnel."""
    gate = scene.gate
    assert gate is not None
    half = math.degrees(math.asin(gate.width / 2 / tunnel.inner_radius))
    opening = [gate.angle + half * (2 * k / n - 1) for k in range(n + 1)]
    tags = _on_ring(draw, tunnel, tunnel.inner_radius, opening)
    outline.inner_corners = [tags[0], tags[-1]]
    outline.inner_opening = tags[1:-1]
    length = tunnel.outer_radius - tunnel.inner_radius
    pieces = max(1, round(length / _gate_size(scene)))
    for corner, inner in zip(outline.corners, outline.inner_corners, strict=True):
        (x0, y0), (x1, y1) = draw.exact[corner], draw.exact[inner]
        outline.walls.append(
            [draw.point(x0 + (x1 - x0) * k / pieces, y0 + (y1 - y0) * k / pieces) for k in range(1, pieces)]
        )
    if scene.interior == "resolved":
        opposite = gate.angle + 180.0
        theta = [
            *_divide(scene, tunnel, tunnel.inner_radius, opening[-1], opposite),
            opposite,
            *_divide(scene, tunnel, tunnel.inner_radius, opposite, opening[0] + 360.0),
        ]
        outline.inner = _on_ring(draw, tunnel, tunnel.inner_radius, theta)


def _draw(scene: Scene, gmsh: Any) -> tuple[_Drawing, _Outline, dict[int, int], dict[str, list[int]]]:
    """The whole geometry; also the region of each surface and the curves of each side of the box."""
    draw = _Drawing(gmsh)
    half, depth, top = scene.box.width / 2, scene.box.depth, _headroom(scene)
    outline = _draw_lining(scene, draw)
    levels = [-soil.top_depth for soil in scene.soils] + [-depth]
    left = [draw.point(-half, y) for y in levels]
    right = [draw.point(half, y) for y in levels]
    # Where a line from side to side crosses the mirror line of a half model.
    middle = _middle_points(scene, draw, levels)
    upper = [draw.point(x, top) for x in ((-half, 0.0, half) if scene.is_half else (-half, half))]
    side_left, side_right = draw.chain(left), draw.chain(right[::-1])
    bottom = draw.chain([left[-1], *middle[-1], right[-1]])
    ground = draw.chain([right[0], *middle[0], left[0]])
    rings = [draw.edges([*tags, tags[0]]) for tags in outline.outer]
    soil = draw.surface([*side_left, *bottom, *side_right, *ground], *rings)
    regions = {soil: SOIL}
    above = draw.chain([left[0], *middle[0], right[0]]), draw.chain([right[0], *upper[::-1], left[0]])
    headroom = draw.surface([*above[0], *above[1]])
    regions[headroom] = HEADROOM
    embedded = {soil: _draw_layers(scene, draw, outline, left, middle, right)}
    if scene.is_half:
        axis = -scene.tunnels[0].axis_depth
        above_tunnel = [tag for tags in middle for tag in tags if draw.exact[tag][1] > axis]
        below_tunnel = [tag for tags in middle for tag in tags if draw.exact[tag][1] < axis]
        crown = draw.on_axis([tag for tag in outline.outer[0] if draw.exact[tag][1] > axis])
        invert = draw.on_axis([tag for tag in outline.outer[0] if draw.exact[tag][1] < axis])
        embedded[soil] += draw.chain([*above_tunnel, crown]) + draw.chain([invert, *below_tunnel])
        embedded[headroom] = [draw.line(middle[0][0], upper[1])]
    if scene.gate is not None:
        (a, b), (c, d) = outline.corners, outline.inner_corners
        mouth = draw.edges([a, *outline.opening, b])
        throat = draw.edges([d, *outline.inner_opening[::-1], c])
        sides = draw.edges([b, *outline.walls[1], d]), draw.edges([c, *outline.walls[0][::-1], a])
        channel = draw.surface([*mouth, *sides[0], *throat, *sides[1]])
        # A regular strip: the smallest elements set the time step, and free meshing would make some of them flatter.
        draw.geo.mesh.setTransfiniteSurface(channel, "Alternate", [a, b, d, c])
        regions[channel] = CHANNEL
        if scene.interior == "resolved":
            face = draw.edges([d, *outline.inner, c])
            interior = draw.surface([*face, *[-tag for tag in throat[::-1]]])
            regions[interior] = INTERIOR
            if scene.is_half:
                # The channel needs no line: it is a strip with nodes on its axis.
                embedded[interior] = draw.chain([draw.on_axis(outline.inner_opening), draw.on_axis(outline.inner)])
    draw.geo.synchronize()
    for surface, lines in embedded.items():
        if lines:
            gmsh.model.mesh.embed(1, lines, 2, surface)
    sides_of_box = {
        "left": [*side_left, above[1][-1]],
        "right": [*side_right, above[1][0]],
        "bottom": bottom,
        "top": above[1][1:-1],
    }
    return draw, outline, regions, sides_of_box


def _middle_points(scene: Scene, draw: _Drawing, levels: list[float]) -> list[list[int]]:
    """Per level, the point at x = 0 of a half model; none where the tunnel interrupts the level or in a whole model."""
    if not scene.is_half:
        return [[] for _ in levels]
    (tunnel,) = scene.tunnels
    return [[draw.point(0.0, y)] if abs(y + tunnel.axis_depth) >= tunnel.outer_radius else [] for y in levels]


def _draw_layers(
    scene: Scene, draw: _Drawing, outline: _Outline, left: list[int], middle: list[list[int]], right: list[int]
) -> list[int]:
    """Lines of the soil layer boundaries, interrupted by tunnels and by the mirror line of a half model."""
    result = []
    for k, soil in enumerate(scene.soils[1:], start=1):
        crossings = []
        for tunnel, tags in zip(scene.tunnels, outline.outer, strict=True):
            if abs(-soil.top_depth + tunnel.axis_depth) < tunnel.outer_radius:
                by_height = sorted(tags, key=lambda tag: abs(draw.exact[tag][1] + soil.top_depth))[:2]
                crossings.append(sorted(by_height, key=lambda tag: draw.exact[tag][0]))
        crossings.sort(key=lambda pair: draw.exact[pair[0]][0])
        crossings += [2 * middle[k]] if middle[k] else []
        chain = [left[k], *[tag for pair in crossings for tag in pair], right[k]]
        result += [draw.line(a, b) for a, b in zip(chain[::2], chain[1::2], strict=True)]
    return result


def build_mesh(scene: Scene) -> Mesh:
    """Mesh a scene, the whole of it: for a half model, of a half and its mirror image.

    Parameters
    ----------
    scene : Scene
        Validated scene.

    Returns
    -------
    Mesh

    Raises
    ------
    MeshError
        When a triangle would be much flatter than the size asked for, or gmsh or its system libraries fail.
    """
    gmsh = _import_gmsh()
    best: tuple[float, Mesh] | None = None
    for algorithm in ALGORITHMS:
        mesh = _mesh_once(scene, gmsh, algorithm)
        if scene.is_half:
            mesh = with_mirror_image(right_half(mesh))
        centre = mesh.nodes[mesh.elements].mean(axis=1)
        relative = altitudes(mesh.nodes, mesh.elements) / element_size(scene, centre[:, 0], centre[:, 1])
        flattest = float(relative.min())
        if best is None or flattest > best[0]:
            best = flattest, mesh
        if flattest >= MIN_RELATIVE_ALTITUDE:
            return mesh
    assert best is not None
    quality = best[1].quality
    raise MeshError(
        f"mesh: the flattest triangle must be at least {MIN_RELATIVE_ALTITUDE:g} element sizes high, got {best[0]:.2g} "
        f"({quality['min_altitude']:.2g} m, flattest near x = {quality['min_altitude_x']:.2f} m, "
        f"y = {quality['min_altitude_y']:.2f} m); keep soil layers, tunnels and box sides further apart or refine there"
    )


def _mesh_once(scene: Scene, gmsh: Any, algorithm: int) -> Mesh:
    """One attempt with one gmsh algorithm."""
    # gmsh is one global session: leave a caller's own session as it was.
    mine = not gmsh.isInitialized()
    if mine:
        gmsh.initialize(interruptible=False, readConfigFiles=False)
    previous = None if mine else gmsh.model.getCurrent()
    name = "gushing scene"
    try:
        for option, value in {
            "General.Terminal": 0,
            "General.NumThreads": 1,
            "Mesh.Algorithm": algorithm,
            "Mesh.MeshSizeExtendFromBoundary": 0,
            "Mesh.MeshSizeFromPoints": 0,
            "Mesh.MeshSizeFromCurvature": 0,
            "Mesh.Optimize": 1,
        }.items():
            gmsh.option.setNumber(option, value)
        gmsh.model.add(name)
        draw, outline, regions, sides = _draw(scene, gmsh)
        gmsh.model.mesh.setSizeCallback(_size_callback(scene))
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.optimize("Relocate2D")
        return _extract(scene, gmsh, draw, outline, regions, sides)
    except MeshError:
        raise
    except Exception as error:
        # gmsh raises bare Exception with its last message.
        raise MeshError(f"mesh: gmsh could not mesh the scene ({error}); check distances between its parts") from error
    finally:
        gmsh.model.mesh.removeSizeCallback()
        if mine:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent(name)
            gmsh.model.remove()
            if previous is not None:
                gmsh.model.setCurrent(previous)


def _size_callback(scene: Scene) -> Any:
    """`element_size` for one point, in scalar arithmetic: gmsh asks some 100 000 times."""
    d = scene.discretisation
    rings = [(t.x, -t.axis_depth, t.outer_radius) for t in scene.tunnels]
    gate, tunnel = scene.gate, _gate_tunnel(scene)

    def size(dim: int, tag: int, x: float, y: float, z: float, lc: float) -> float:
        result = d.element_size
        for xt, yt, radius in rings:
            gap = abs(math.hypot(x - xt, y - yt) - radius)
            result = min(result, d.element_size_lining + d.size_growth * gap)
        if gate is None or tunnel is None:
            return result
        dx, dy = x - tunnel.x, y + tunnel.axis_depth
        if math.hypot(dx, dy) < tunnel.inner_radius:
            result = min(result, d.element_size_interior)
        s = dx * along[0] + dy * along[1]
        t = dx * across[0] + dy * across[1]
        distance = math.hypot(s - min(max(s, tunnel.inner_radius), tunnel.outer_radius), t)
        return min(result, _gate_size(scene) + d.size_growth * distance)

    if gate is not None:
        along, across = _gate_axes(gate.angle)
    return size


def _extract(
    scene: Scene,
    gmsh: Any,
    draw: _Drawing,
    outline: _Outline,
    regions: dict[int, int],
    sides: dict[str, list[int]],
) -> Mesh:
    """Arrays of the current gmsh mesh, sorted for locality."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    node_of_tag = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    node_of_tag[tags] = np.arange(len(tags))
    nodes = coordinates.reshape(-1, 3)[:, :2].copy()
    elements, region = [], []
    for surface, kind in regions.items():
        triangles = gmsh.model.mesh.getElementsByType(2, surface)[1].reshape(-1, 3)
        elements.append(node_of_tag[triangles])
        region.append(np.full(len(triangles), kind, dtype=np.int8))
    triangles, kinds = np.concatenate(elements), np.concatenate(region)
    flipped = areas(nodes, triangles) < 0
    triangles[flipped] = triangles[flipped][:, [0, 2, 1]]
    order = np.argsort(_hilbert(nodes[triangles].mean(axis=1)), kind="stable")
    triangles, kinds = triangles[order], kinds[order]
    # Nodes numbered by first use, so that neighbours in space are neighbours in memory; unused ones drop out.
    used, first = np.unique(triangles.ravel(), return_index=True)
    used = used[np.argsort(first)]
    renumber = np.full(len(nodes), -1, dtype=np.int64)
    renumber[used] = np.arange(len(used))
    nodes, triangles = nodes[used], renumber[triangles]

    node_of_point = {tag: int(renumber[node_of_tag[gmsh.model.mesh.getNodes(0, tag)[0][0]]]) for tag in draw.exact}
    for tag, position in draw.exact.items():
        nodes[node_of_point[tag]] = position

    def numbers(points: list[int]) -> NDArray[np.int32]:
        return np.array([node_of_point[tag] for tag in points], dtype=np.int32)

    box: dict[str, NDArray[np.int32]] = {}
    places = {"left": (0, -scene.box.width / 2), "right": (0, scene.box.width / 2)}
    places |= {"bottom": (1, -scene.box.depth), "top": (1, _headroom(scene))}
    for name, curves in sides.items():
        on_side = np.concatenate([gmsh.model.mesh.getNodes(1, abs(curve), includeBoundary=True)[0] for curve in curves])
        members = np.unique(renumber[node_of_tag[on_side]])
        axis, value = places[name]
        nodes[members, axis] = value
        box[name] = members[np.argsort(nodes[members, 1 - axis])].astype(np.int32)

    if scene.is_half:
        nodes[np.abs(nodes[:, 0]) < ON_MIRROR_LINE * element_size(scene, nodes[:, 0], nodes[:, 1]), 0] = 0.0
    outer_nodes, outer_theta = [], []
    for chain, theta in zip(outline.outer, outline.theta, strict=True):
        angle = np.mod(np.array(theta), 360.0)
        ascending = np.argsort(angle)
        outer_nodes.append(numbers(chain)[ascending])
        outer_theta.append(angle[ascending])
    walls: list[int] = []
    wall_side: list[int] = []
    for side, wall, inner in zip((1, -1), outline.walls, outline.inner_corners, strict=False):
        walls += [*wall, inner]
        wall_side += [side] * (len(wall) + 1)
    return Mesh(
        nodes=np.ascontiguousarray(nodes),
        elements=np.ascontiguousarray(triangles, dtype=np.int32),
        region=kinds,
        outer_nodes=tuple(outer_nodes),
        outer_theta=tuple(outer_theta),
        opening_nodes=numbers(outline.opening),
        corner_nodes=numbers(outline.corners),
        wall_nodes=numbers(walls),
        wall_side=np.array(wall_side, dtype=np.int8),
        corner_side=np.array([1, -1][: len(outline.corners)], dtype=np.int8),
        inner_nodes=numbers(outline.inner),
        inner_opening_nodes=numbers(outline.inner_opening),
        gate_angle=math.nan if scene.gate is None else scene.gate.angle % 360.0,
        **box,
    )


def _hilbert(positions: NDArray[np.float64], bits: int = 16) -> NDArray[np.int64]:
    """Index of each position along a Hilbert curve over their bounding square, shape (n,)."""
    low = positions.min(axis=0)
    scale = (2**bits - 1) / (positions - low).max()
    x, y = ((positions - low) * scale).astype(np.int64).T
    index = np.zeros(len(positions), dtype=np.int64)
    for level in range(bits - 1, -1, -1):
        right, up = (x >> level) & 1, (y >> level) & 1
        index += ((3 * right) ^ up) << (2 * level)
        # Turn the quadrant so that the curve inside it starts where the last one ended (Warren, Hacker's Delight).
        flip = (up == 0) & (right == 1)
        x, y = np.where(flip, ~x, x), np.where(flip, ~y, y)
        swap = up == 0
        x, y = np.where(swap, y, x), np.where(swap, x, y)
    return index
