"""The outline that gmsh meshes: rings, channel, soil layers and box, drawn with the nodes they must have."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from mpm.element_size import element_size, gate_size, headroom_height
from mpm.mesh import CHANNEL, HEADROOM, INTERIOR, SOIL, MeshError
from mpm.scene import Scene, Tunnel

if TYPE_CHECKING:
    pass


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


class Drawing:
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


def _on_ring(draw: Drawing, tunnel: Tunnel, radius: float, theta: list[float]) -> list[int]:
    return [
        draw.point(
            tunnel.x + radius * math.sin(math.radians(t)), -tunnel.axis_depth + radius * math.cos(math.radians(t))
        )
        for t in theta
    ]


@dataclass
class Outline:
    """gmsh point tags (later node numbers) of the lining, per tunnel and at the gate."""

    outer: list[list[int]]
    theta: list[list[float]]
    opening: list[int]
    corners: list[int]
    walls: list[list[int]]
    inner: list[int]
    inner_corners: list[int]
    inner_opening: list[int]


def _draw_lining(scene: Scene, draw: Drawing) -> Outline:
    """Points of every outer face, and of channel and inner face at the gate."""
    outline = Outline([], [], [], [], [], [], [], [])
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


def _draw_channel(scene: Scene, draw: Drawing, outline: Outline, tunnel: Tunnel, n: int) -> None:
    """Points of the channel walls and of the inner face of the gate's tunnel."""
    gate = scene.gate
    assert gate is not None
    half = math.degrees(math.asin(gate.width / 2 / tunnel.inner_radius))
    opening = [gate.angle + half * (2 * k / n - 1) for k in range(n + 1)]
    tags = _on_ring(draw, tunnel, tunnel.inner_radius, opening)
    outline.inner_corners = [tags[0], tags[-1]]
    outline.inner_opening = tags[1:-1]
    length = tunnel.outer_radius - tunnel.inner_radius
    pieces = max(1, round(length / gate_size(scene)))
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


def draw_scene(scene: Scene, gmsh: Any) -> tuple[Drawing, Outline, dict[int, int], dict[str, list[int]]]:
    """The whole geometry; also the region of each surface and the curves of each side of the box."""
    draw = Drawing(gmsh)
    half, depth, top = scene.box.width / 2, scene.box.depth, headroom_height(scene)
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


def _middle_points(scene: Scene, draw: Drawing, levels: list[float]) -> list[list[int]]:
    """Per level, the point at x = 0 of a half model; none where the tunnel interrupts the level or in a whole model."""
    if not scene.is_half:
        return [[] for _ in levels]
    (tunnel,) = scene.tunnels
    return [[draw.point(0.0, y)] if abs(y + tunnel.axis_depth) >= tunnel.outer_radius else [] for y in levels]


def _draw_layers(
    scene: Scene, draw: Drawing, outline: Outline, left: list[int], middle: list[list[int]], right: list[int]
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
