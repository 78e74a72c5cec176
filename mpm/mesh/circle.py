"""Circles divided into the edges of cells, and the regular rows of cells along them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from mpm.mesh.mesh import INTERIOR, SOIL
from mpm.mesh.sizes import element_size
from mpm.scene import Scene, Tunnel

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Samples of the element size along a line that is divided.
SAMPLES = 2001


def place(tunnel: Tunnel, radius: float | NDArray[np.float64], theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positions at angles [deg] about a tunnel's axis; those of a multiple of 90 degrees are exact."""
    rad = np.radians(theta)
    sine, cosine = np.sin(rad), np.cos(rad)
    sine = np.where(np.mod(theta, 180.0) == 0, 0.0, sine)
    cosine = np.where(np.mod(theta, 180.0) == 90, 0.0, cosine)
    return np.stack([tunnel.x + radius * sine, -tunnel.axis_depth + radius * cosine], axis=-1)


def edges_along(scene: Scene, path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Number of edges of the local size from the beginning of a path to each of its points."""
    density = 1 / element_size(scene, path[:, 0], path[:, 1])
    length = np.hypot(*np.diff(path, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(length * (density[1:] + density[:-1]) / 2)])


def divided(cumulative: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Shares of a path's parameter at which `count` edges begin and end, each of the same number of local sizes."""
    share = np.interp(np.arange(1, count) * cumulative[-1] / count, cumulative, np.linspace(0, 1, len(cumulative)))
    return np.concatenate([[0.0], share, [1.0]])


@dataclass
class Circle:
    """Angles [deg, ascending] of the nodes of a circle; a whole one is closed, that of a half model runs to 180."""

    theta: NDArray[np.float64]
    closed: bool
    cuts: list[int]
    opening: NDArray[np.int64]


def divided_circle(
    scene: Scene, tunnel: Tunnel, radius: float, cuts: list[float], has_gate: bool, multiple: int = 2
) -> Circle:
    """Divide a circle. Between two cuts, and around as a whole, there is an even number of edges or a `multiple`.

    cuts : angles [deg] where horizontal lines meet the circle.
    """
    half_model, gate = scene.is_half, scene.gate
    opening = np.zeros(0)
    if has_gate:
        assert gate is not None
        n = scene.discretisation.elements_across_gate
        half = math.degrees(math.asin(gate.width / 2 / radius))
        opening = gate.angle + half * (2 * np.arange(n + 1) / n - 1)
    if half_model:
        opening = opening[(opening >= -1e-9) & (opening <= 180 + 1e-9)] if gate is not None else opening
        stations = {0.0, 180.0, *cuts}
        if len(opening):
            opening[[0, -1]] = (0.0, opening[-1]) if gate is not None and gate.angle == 0 else (opening[0], 180.0)
            stations |= {float(opening[0]), float(opening[-1])}
        elif not cuts:
            stations |= {90.0}
        ends = sorted(stations)
    elif has_gate:
        assert gate is not None
        start = float(opening[-1])
        # The point opposite the gate keeps the ring's nodes symmetric about the gate's axis; so does an odd rest.
        opposite = [gate.angle + 180.0] if not cuts and len(opening) % 2 else []
        ends = sorted([start, *(start + (t - start) % 360.0 for t in cuts), *opposite, float(opening[0]) + 360.0])
        ends.append(start + 360.0)
    else:
        ends = sorted({0.0, 90.0, 180.0, 270.0} if not cuts else {*cuts, 0.0, 180.0})
        ends.append(ends[0] + 360.0)
    hard = [*cuts, *([0.0, 180.0] if half_model else [])]
    arcs = list(pairwise(ends))
    is_opening = [len(opening) > 0 and _same_angle(a, opening[0]) for a, _ in arcs]
    measure = [edges_along(scene, place(tunnel, radius, np.linspace(a, b, SAMPLES))) for a, b in arcs]
    counts = [
        len(opening) - 1 if open_ else max(1, math.ceil(m[-1] - 0.25))
        for m, open_ in zip(measure, is_opening, strict=True)
    ]
    _make_even(arcs, counts, is_opening, hard, measure, closed=not half_model)
    while multiple > 2 and sum(counts) % multiple:
        counts = [count + (not open_) for count, open_ in zip(counts, is_opening, strict=True)]
    theta: list[float] = []
    for (a, b), m, count, open_ in zip(arcs, measure, counts, is_opening, strict=True):
        theta += list(opening[:-1] + (a - opening[0])) if open_ else list(a + divided(m, count)[:-1] * (b - a))
    if half_model:
        theta.append(180.0)
    angles = np.array(theta)
    if not half_model:
        angles = np.mod(angles, 360.0)
        angles = np.where(angles > 360.0 - 1e-12, 0.0, angles)
        angles = np.sort(angles)

    def nearest(value: float) -> int:
        return int(np.argmin(np.abs((angles - value + 180.0) % 360.0 - 180.0)))

    return Circle(angles, not half_model, [nearest(t) for t in cuts], np.array([nearest(t) for t in opening], int))


def _same_angle(a: float, b: float) -> bool:
    return abs((a - b + 180.0) % 360.0 - 180.0) < 1e-9


def _make_even(arcs, counts, is_opening, hard, measure, closed):
    """Give an arc one edge more or less where the number of edges between two hard stations is odd."""
    n = len(arcs)
    starts = [i for i, (a, _) in enumerate(arcs) if any(_same_angle(a, t) for t in hard)] or [0]
    for first, last in zip(starts, [*starts[1:], starts[0] + n if closed else n], strict=True):
        group = [i % n for i in range(first, last)]
        if sum(counts[i] for i in group) % 2:
            longest = max((i for i in group if not is_opening[i]), key=lambda i: counts[i])
            fewer = counts[longest] > 1 and measure[longest][-1] < counts[longest]
            counts[longest] += -1 if fewer and counts[longest] > 3 else 1


def rows_along(scene, outline, tunnel, ring, face, radius, count, outward, heights):
    """Regular rows of cells along a circle: (nodes of ring, count + 1) node numbers, `face` first.

    Their thickness is that of the ring's edges; columns through a cut follow its horizontal line.
    """
    theta = ring.theta
    rad = np.radians(theta)
    edge = radius * np.diff(np.concatenate([rad, [rad[0] + 2 * math.pi]]) if ring.closed else rad)
    if ring.closed:
        thickness = 0.5 * (edge + np.roll(edge, 1))
        for _ in range(2):
            thickness = 0.5 * thickness + 0.25 * (np.roll(thickness, 1) + np.roll(thickness, -1))
    else:
        thickness = 0.5 * (np.concatenate([edge[:1], edge]) + np.concatenate([edge, edge[-1:]]))
        for _ in range(2):
            padded = np.concatenate([thickness[1:2], thickness, thickness[-2:-1]])
            thickness = 0.5 * thickness + 0.25 * (padded[2:] + padded[:-2])
    grid = [face]
    offset = np.zeros_like(thickness)
    on_axis = np.zeros(len(theta), bool) if ring.closed else np.isin(np.arange(len(theta)), [0, len(theta) - 1])
    for j in range(count):
        offset = offset + thickness * (1 + 0.5 * scene.discretisation.growth * j)
        r = radius + (offset if outward else -offset)
        angle = theta.copy()
        if ring.cuts:
            shift = {}
            for i, height in zip(ring.cuts, heights, strict=True):
                there = math.degrees(math.acos((height + tunnel.axis_depth) / r[i]))
                shift[i] = (there if theta[i] < 180 else 360.0 - there) - theta[i]
            for value in (0.0, 180.0):
                i = int(np.argmin(np.abs(theta - value)))
                shift.setdefault(i, 0.0)
            for i in ring.opening[[0, -1]] if len(ring.opening) else ():
                shift[int(i)] = 0.0
            at = sorted(shift)
            angle = theta + np.interp(theta, theta[at], [shift[i] for i in at], period=360.0 if ring.closed else None)
        free_x, free_y = ~on_axis, np.ones(len(theta), bool)
        free_y[ring.cuts] = False
        row = outline.add(place(tunnel, r, angle), free_x, free_y)
        for i, height in zip(ring.cuts, heights, strict=True):
            outline.nodes[row[i], 1] = height
        grid.append(row)
    rows = np.stack(grid, axis=1)
    if count:
        outline.add_grid(np.concatenate([rows, rows[:1]]) if ring.closed else rows, SOIL if outward else INTERIOR)
    return rows


def loop_of(ring, row):
    """Pieces of a row of a ring between its cuts."""
    starts = sorted(ring.cuts)
    if not ring.closed:
        return [row[a : b + 1] for a, b in pairwise(sorted({0, len(row) - 1, *starts}))]
    first = starts[0] if starts else 0
    turned = np.roll(row, -first)
    turned = np.concatenate([turned, turned[:1]])
    return [turned[a : b + 1] for a, b in pairwise([*(i - first for i in starts or [0]), len(row)])]


def opening_only(scene, tunnel):
    """The inner end of the channel alone, where a sink takes what arrives."""
    n = scene.discretisation.elements_across_gate
    half = math.degrees(math.asin(scene.gate.width / 2 / tunnel.inner_radius))
    theta = scene.gate.angle + half * (2 * np.arange(n + 1) / n - 1)
    if scene.is_half:
        theta = theta[n // 2 :] if scene.gate.angle == 0 else theta[: n // 2 + 1]
    return Circle(theta, False, [], np.arange(len(theta)))
