"""From a scene to its mesh of quadrilateral cells, each cut by both diagonals into four triangles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mpm.mesh.cells import crossing, fill_faces, relax
from mpm.mesh.half import with_mirror_image
from mpm.mesh.mesh import Mesh, MeshError, altitudes
from mpm.mesh.outline import Outline, draw_headroom, draw_scene, horizontal_lines
from mpm.mesh.sizes import element_size
from mpm.scene import Scene, check_scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Smallest altitude of a triangle over the cell size asked for at that place; in a square it is 0.5. A mesh as good as
# the first is taken, one worse than the second refused: flatter triangles would set the time step of the whole run
# while resolving nothing.
GOOD_ALTITUDE, MIN_RELATIVE_ALTITUDE = 0.25, 0.15
# Most rows of regular cells along a lining and gmsh's algorithm (8 frontal for quadrilaterals, 6 frontal, 5 Delaunay),
# in the order tried.
ATTEMPTS = ((3, 8), (3, 6), (2, 8), (1, 8), (1, 6), (0, 8), (0, 6), (0, 5))
ITERATIONS = 100


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
    check_scene(scene)
    best: tuple[float, NDArray[np.float64], Outline, NDArray[np.int64]] | None = None
    failure = MeshError("mesh: channel and rows along the linings must not fold, got none that fit; refine the linings")
    for rows, algorithm in ATTEMPTS:
        outline = draw_scene(scene, rows)
        if not _is_regular(outline):
            continue
        try:
            cells = _cells(scene, outline, algorithm)
        except MeshError as error:
            failure = error
            continue
        lowest, where = _flattest(scene, outline.nodes, cells)
        if best is None or lowest > best[0]:
            best = lowest, where, outline, cells
        if lowest >= GOOD_ALTITUDE:
            break
    if best is None:
        raise failure
    lowest, where, outline, cells = best
    if lowest < MIN_RELATIVE_ALTITUDE:
        size = float(_size(scene, where[None])[0])
        raise MeshError(
            f"mesh: the flattest triangle must be at least {MIN_RELATIVE_ALTITUDE:g} element sizes high, got "
            f"{lowest:.2g} ({lowest * size:.2g} m, flattest near x = {where[0]:.2f} m, y = {where[1]:.2f} m); "
            "keep soil layers, tunnels and box sides further apart or refine there"
        )
    mesh = _assemble(scene, outline, cells)
    return with_mirror_image(mesh) if scene.is_half else mesh


def _size(scene: Scene, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cell size asked for at (n, 2) places [m]: at most half the distance of the lines around it, for two rows."""
    size = element_size(scene, place[:, 0], place[:, 1])
    levels = np.array([-scene.box.depth, *horizontal_lines(scene)[::-1], 0.0])
    gap = np.concatenate([[math.inf], np.diff(levels), [math.inf]])
    return np.minimum(size, gap[np.searchsorted(levels, place[:, 1])] / 2)


def _is_regular(outline: Outline) -> bool:
    """Whether the cells drawn by hand are convex and none is turned over: lines that cut a lining may fold them."""
    for block in outline.cells:
        area = _area(outline.nodes[block])
        corners = outline.nodes[block if area[0] > 0 else block[:, ::-1]]
        if not np.all(area * area[0] > 0) or np.isnan(crossing(corners)).any():
            return False
    return True


def _cells(scene: Scene, outline: Outline, algorithm: int) -> NDArray[np.int64]:
    """Fill an outline; corners of all cells, counter-clockwise."""
    fill_faces(scene, outline, algorithm)
    cells = np.concatenate(outline.cells)
    turned = _area(outline.nodes[cells]) < 0
    cells[turned] = cells[turned][:, ::-1]
    size = _size(scene, outline.nodes[cells].mean(axis=1)) ** 2
    outline.nodes = relax(outline.nodes, outline.free, cells, size, ITERATIONS)
    outline.cells = [cells]
    draw_headroom(scene, outline)
    cells = np.concatenate(outline.cells)
    turned = _area(outline.nodes[cells]) < 0
    cells[turned] = cells[turned][:, ::-1]
    return cells


def _area(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area of quadrilaterals, (m,), positive when counter-clockwise."""
    first, second = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    return 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def crossed(nodes: NDArray[np.float64], cells: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Nodes with the centres of the cells behind them, and the four triangles of each cell."""
    number = np.broadcast_to(len(nodes) + np.arange(len(cells))[:, None], cells.shape)
    triangles = np.stack([cells, np.roll(cells, -1, axis=1), number], axis=-1).reshape(-1, 3)
    return np.concatenate([nodes, crossing(nodes[cells])]), triangles


def _flattest(scene: Scene, nodes: NDArray[np.float64], cells: NDArray[np.int64]) -> tuple[float, NDArray[np.float64]]:
    """Smallest altitude over the size asked for, and the place of that triangle."""
    points, triangles = crossed(nodes, cells)
    middle = points[triangles].mean(axis=1)
    relative = altitudes(points, triangles) / _size(scene, middle)
    relative = np.nan_to_num(relative, nan=-1.0)
    worst = int(relative.argmin())
    return float(relative[worst]), nodes[cells[worst // 4]].mean(axis=0)


def _assemble(scene: Scene, outline: Outline, cells: NDArray[np.int64]) -> Mesh:
    """The mesh, sorted for locality."""
    order = np.argsort(_hilbert(outline.nodes[cells].mean(axis=1)), kind="stable")
    nodes, triangles = crossed(outline.nodes, cells[order])
    region = np.repeat(np.array(outline.region, np.int8)[order], 4)
    # Nodes numbered by first use, so that neighbours in space are neighbours in memory; unused ones drop out.
    used, first = np.unique(triangles.ravel(), return_index=True)
    used = used[np.argsort(first)]
    renumber = np.full(len(nodes), -1, dtype=np.int64)
    renumber[used] = np.arange(len(used))
    nodes = nodes[used]

    def numbers(chosen: NDArray[np.int64] | list[int]) -> NDArray[np.int32]:
        return renumber[np.asarray(chosen, np.int64)].astype(np.int32)

    def on_side(axis: int, value: float) -> NDArray[np.int32]:
        members = np.flatnonzero(nodes[:, axis] == value)
        return members[np.argsort(nodes[members, 1 - axis])].astype(np.int32)

    half = scene.box.width / 2
    sides = [1] if len(outline.corners) else []
    if len(outline.corners) == 2:
        sides = [1, -1]
    elif scene.is_half and scene.gate is not None and scene.gate.angle == 0:
        sides = [-1]
    wall_nodes = [numbers(wall) for wall in outline.walls]
    return Mesh(
        nodes=np.ascontiguousarray(nodes),
        elements=np.ascontiguousarray(renumber[triangles], dtype=np.int32),
        region=region,
        left=on_side(0, 0.0 if scene.is_half else -half),
        right=on_side(0, half),
        bottom=on_side(1, -scene.box.depth),
        top=on_side(1, float(nodes[:, 1].max())),
        outer_nodes=tuple(numbers(ring) for ring in outline.outer),
        outer_theta=tuple(outline.theta),
        opening_nodes=numbers(outline.opening),
        corner_nodes=numbers(outline.corners),
        wall_nodes=np.concatenate([np.zeros(0, np.int32), *wall_nodes]),
        wall_side=np.repeat(np.array(sides, np.int8), [len(wall) for wall in wall_nodes]),
        corner_side=np.array(sides, dtype=np.int8),
        inner_nodes=numbers(outline.inner),
        inner_opening_nodes=numbers(outline.inner_opening),
        gate_angle=math.nan if scene.gate is None else scene.gate.angle % 360.0,
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
