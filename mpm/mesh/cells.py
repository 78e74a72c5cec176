"""Quadrilateral cells between given lines: gmsh's of twice the size, each cut into quarters, then relaxed."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from mpm.machine.compile import kernel, kernel_part
from mpm.mesh.mesh import MeshError
from mpm.mesh.sizes import size_callback

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mpm.mesh.outline import Outline
    from mpm.scene import Scene

# Area of a corner over the squared edge below which its stand-in is much larger than it.
SOFTNESS = 0.05
# Of the size in the measure that is relaxed, and exponent that makes the worst corners count most.
WEIGHT, POWER = 2.0, 3
# Altitudes that are high enough: shares of the size asked for there and of the smallest one; in a square it is 0.5. The
# smallest elements set the time step of all, so more is asked of them.
ENOUGH, SWEEPS = (0.3, 0.13), 20
SYSTEM_PACKAGES = "libglu1-mesa libgl1 libxrender1 libxcursor1 libxft2 libxinerama1 libgomp1"


def fill_faces(scene: Scene, outline: Outline, algorithm: int) -> None:
    """Add the cells of all faces of an outline, with new nodes inside them.

    Parameters
    ----------
    algorithm : int
        Of gmsh's triangles, before they are joined.

    Raises
    ------
    MeshError
        When gmsh or its system libraries fail.
    """
    gmsh = _import_gmsh()
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
            "Mesh.RecombineAll": 1,
            "Mesh.RecombinationAlgorithm": 1,
        }.items():
            gmsh.option.setNumber(option, value)
        gmsh.model.add(name)
        tags, surfaces = _draw(gmsh, outline)
        gmsh.model.mesh.setSizeCallback(size_callback(scene, 2.0))
        gmsh.model.mesh.generate(2)
        coarse = _coarse_cells(gmsh, outline, tags, surfaces)
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
    _quarter(outline, coarse)


def _draw(gmsh: Any, outline: Outline) -> tuple[dict[int, int], list[int]]:
    """Every second node of the lines and one line from each to the next; gmsh points of nodes, and surfaces."""
    geo = gmsh.model.geo
    tags: dict[int, int] = {}
    lines: dict[tuple[int, int], int] = {}

    def point(node: int) -> int:
        if node not in tags:
            tags[node] = geo.addPoint(*outline.nodes[node], 0.0)
        return tags[node]

    def edges(chain: NDArray[np.int64]) -> list[int]:
        result = []
        for a, b in pairwise(chain[::2].tolist()):
            if (b, a) in lines:
                result.append(-lines[b, a])
                continue
            if (a, b) not in lines:
                lines[a, b] = geo.addLine(point(a), point(b))
                geo.mesh.setTransfiniteCurve(lines[a, b], 2)
            result.append(lines[a, b])
        return result

    surfaces, inside = [], []
    for face in outline.faces:
        loops = [geo.addCurveLoop([tag for chain in loop for tag in edges(chain)]) for loop in face.loops]
        surfaces.append(geo.addPlaneSurface(loops))
        inside.append([abs(tag) for chain in face.lines for tag in edges(chain)])
    geo.synchronize()
    for surface, embedded in zip(surfaces, inside, strict=True):
        if embedded:
            gmsh.model.mesh.embed(1, embedded, 2, surface)
    return tags, surfaces


def _coarse_cells(
    gmsh: Any, outline: Outline, tags: dict[int, int], surfaces: list[int]
) -> list[tuple[int, NDArray[np.int64]]]:
    """Region and nodes of gmsh's quadrilaterals and triangles; its inner nodes join the outline."""
    numbers, coordinates, _ = gmsh.model.mesh.getNodes()
    node_of = np.full(int(numbers.max()) + 1, -1, np.int64)
    for node, tag in tags.items():
        node_of[gmsh.model.mesh.getNodes(0, tag)[0][0]] = node
    new = node_of[numbers] < 0
    node_of[numbers[new]] = outline.add(coordinates.reshape(-1, 3)[new, :2], True, True)
    result = []
    for face, surface in zip(outline.faces, surfaces, strict=True):
        for kind, corners in ((3, 4), (2, 3)):
            found = gmsh.model.mesh.getElementsByType(kind, surface)[1].reshape(-1, corners)
            if len(found):
                result.append((face.region, node_of[found]))
    return result


def _quarter(outline: Outline, coarse: list[tuple[int, NDArray[np.int64]]]) -> None:
    """Cut every coarse cell into as many quadrilaterals as it has corners, through the middles of its edges."""
    given = {}
    for face in outline.faces:
        for chain in [*(chain for loop in face.loops for chain in loop), *face.lines]:
            for a, middle, b in zip(chain[:-2:2].tolist(), chain[1::2].tolist(), chain[2::2].tolist(), strict=True):
                given[min(a, b), max(a, b)] = middle
    pairs = np.concatenate([np.stack([c, np.roll(c, -1, axis=1)], axis=-1).reshape(-1, 2) for _, c in coarse])
    pairs.sort(axis=1)
    edges, of_corner = np.unique(pairs, axis=0, return_inverse=True)
    of_corner = of_corner.ravel()
    middles = np.array([given.get(pair, -1) for pair in map(tuple, edges.tolist())], np.int64)
    if len(set(middles[middles >= 0].tolist())) != len(set(given.values())):
        raise MeshError("mesh: gmsh lost a line of the scene; keep soil layers, tunnels and box sides further apart")
    new = middles < 0
    middles[new] = outline.add(outline.nodes[edges[new]].mean(axis=1), True, True)
    start = 0
    for region, corner in coarse:
        size = corner.shape[1]
        middle = middles[of_corner[start : start + corner.size]].reshape(-1, size)
        start += corner.size
        centre = outline.add(outline.nodes[corner].mean(axis=1), True, True)
        cells = np.stack(
            [corner, middle, np.repeat(centre[:, None], size, axis=1), np.roll(middle, 1, axis=1)], axis=-1
        ).reshape(-1, 4)
        outline.cells.append(cells)
        outline.region += [region] * len(cells)


def _import_gmsh() -> Any:
    try:
        import gmsh
    except OSError as error:
        raise MeshError(
            f"meshing needs system libraries that are missing ({error}); "
            f"on Debian or Ubuntu type: sudo apt-get install -y {SYSTEM_PACKAGES}"
        ) from error
    return gmsh


def relax(
    nodes: NDArray[np.float64],
    free: NDArray[np.bool_],
    cells: NDArray[np.int64],
    size: NDArray[np.float64],
    iterations: int,
) -> NDArray[np.float64]:
    """Move the free nodes until the corners of the cells are as square as the lines allow.

    The measure of a corner with edges a and b is (a^2 + b^2) / (2 a x b), 1 where they are of one length and at right
    angles; the sum of its squares over all corners is lowered by L-BFGS. Corners that are turned inside out count by a
    smooth positive stand-in for their area, so that they turn back (Escobar et al. 2003).

    Parameters
    ----------
    nodes : (n, 2) float64
    free : (n, 2) bool
        Which coordinates may change.
    cells : (m, 4) int
        Corner nodes, counter-clockwise.
    iterations : int
        Most steps of L-BFGS.

    Returns
    -------
    (n, 2) float64
    """
    from scipy.optimize import minimize
    from threadpoolctl import threadpool_limits

    movable = np.flatnonzero(free.ravel())
    position, slope = nodes.ravel().copy(), np.zeros(2 * len(nodes))
    corner = nodes[cells]
    edge = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
    softness = (SOFTNESS * edge.mean(axis=1) ** 2) ** 2
    elements = np.ascontiguousarray(cells, np.int32)

    def value_and_slope(moved: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        position[movable] = moved
        return shape_energy(position, elements, softness, size, WEIGHT, POWER, slope), slope[movable]

    # Threads of the linear algebra would wait for each other for longer than they compute.
    with threadpool_limits(1):
        result = minimize(
            value_and_slope, position[movable], jac=True, method="L-BFGS-B", options={"maxiter": iterations}
        )
    position[movable] = result.x
    count = np.bincount(cells.ravel(), minlength=len(nodes))
    start = np.concatenate([[0], np.cumsum(count)])
    around = np.argsort(cells.ravel(), kind="stable") // 4
    edge = np.sqrt(size)
    height = ENOUGH[0] * edge + ENOUGH[1] * edge.min()
    lift_lowest(position, elements, height, free.ravel(), start, around, SWEEPS)
    return position.reshape(-1, 2)


@kernel
def shape_energy(position, cells, softness, size, weight, power, slope):
    """Sum of squared corner measures of `relax`; their derivatives by the coordinates are written to `slope`."""
    slope[:] = 0.0
    energy = 0.0
    for q in range(cells.shape[0]):
        for k in range(4):
            i, a, b = 2 * cells[q, k], 2 * cells[q, (k + 1) % 4], 2 * cells[q, (k + 3) % 4]
            ax, ay = position[a] - position[i], position[a + 1] - position[i + 1]
            bx, by = position[b] - position[i], position[b + 1] - position[i + 1]
            area = ax * by - ay * bx
            root = math.sqrt(area * area + softness[q])
            inverse = 1.0 / (area + root)  # of twice the stand-in for the area
            measure = (ax * ax + ay * ay + bx * bx + by * by) * inverse
            # twice the stand-in over the area asked for, and its inverse
            small, large = 2.0 * size[q] * inverse, 0.5 * (area + root) / size[q]
            one = measure * measure + weight * (small + large)
            energy += one**power
            factor = power * one ** (power - 1)
            by_length = factor * 4.0 * measure * inverse
            by_area = factor * (-2.0 * measure * measure + weight * (large - small)) / root
            gax, gay = by_length * ax + by_area * by, by_length * ay - by_area * bx
            gbx, gby = by_length * bx - by_area * ay, by_length * by + by_area * ax
            slope[a] += gax
            slope[a + 1] += gay
            slope[b] += gbx
            slope[b + 1] += gby
            slope[i] -= gax + gbx
            slope[i + 1] -= gay + gby
    return energy


@kernel_part
def lowest_altitude(position, corner):
    """Smallest altitude of the four triangles of a quadrilateral; negative where its diagonals do not cross."""
    x0, y0 = position[2 * corner[0]], position[2 * corner[0] + 1]
    x1, y1 = position[2 * corner[1]], position[2 * corner[1] + 1]
    fx, fy = position[2 * corner[2]] - x0, position[2 * corner[2] + 1] - y0
    gx, gy = position[2 * corner[3]] - x1, position[2 * corner[3] + 1] - y1
    turn = fx * gy - fy * gx
    if turn <= 0.0:
        return -1.0
    # shares of the two diagonals at which they meet
    s = ((x1 - x0) * gy - (y1 - y0) * gx) / turn
    t = ((x1 - x0) * fy - (y1 - y0) * fx) / turn
    if s <= 0.0 or s >= 1.0 or t <= 0.0 or t >= 1.0:
        return -1.0
    first, second = math.sqrt(fx * fx + fy * fy), math.sqrt(gx * gx + gy * gy)
    lowest = math.inf
    for k in range(4):
        a, b = 2 * corner[k], 2 * corner[(k + 1) % 4]
        edge = math.hypot(position[b] - position[a], position[b + 1] - position[a + 1])
        along = s if k == 0 or k == 3 else 1.0 - s
        across = t if k < 2 else 1.0 - t
        longest = max(edge, along * first, across * second)
        lowest = min(lowest, along * across * turn / longest)
    return lowest


@kernel
def lift_lowest(position, cells, height, free, start, around, sweeps):
    """Move free nodes one by one so that the lowest triangle around each comes closer to the height asked for.

    position : (2 n,) float64, changed.
    height : (m,) float64
        Where all triangles around a node are as high as that it stays [m].
    free : (2 n,) bool
    start, around : (n + 1,), (4 m,) int
        Cells around node i: ``around[start[i]:start[i + 1]]``.
    """
    for _ in range(sweeps):
        moved = False
        for i in range(start.size - 1):
            if not (free[2 * i] or free[2 * i + 1]):
                continue
            first, last = start[i], start[i + 1]
            lowest, step = math.inf, math.inf
            for j in range(first, last):
                q = around[j]
                lowest = min(lowest, lowest_altitude(position, cells[q]) / height[q])
                step = min(step, height[q])
            if lowest >= 1.0:
                continue
            step *= 0.25
            while step > 2e-3 * height[around[first]]:
                better = False
                for k in range(8):
                    dx = step * math.cos(0.25 * math.pi * k) if free[2 * i] else 0.0
                    dy = step * math.sin(0.25 * math.pi * k) if free[2 * i + 1] else 0.0
                    position[2 * i] += dx
                    position[2 * i + 1] += dy
                    then = math.inf
                    for j in range(first, last):
                        q = around[j]
                        then = min(then, lowest_altitude(position, cells[q]) / height[q])
                        if then <= lowest + 1e-6:
                            break
                    if then > lowest + 1e-6:
                        lowest, better, moved = then, True, True
                        break
                    position[2 * i] -= dx
                    position[2 * i + 1] -= dy
                if not better:
                    step *= 0.5
        if not moved:
            break


def crossing(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where the diagonals of quadrilaterals meet, (m, 2), of their corners (m, 4, 2); nan where they do not."""
    first, second = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    between = corners[:, 1] - corners[:, 0]
    turn = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    turn = np.where(turn > 0, turn, math.nan)
    share = (between[:, 0] * second[:, 1] - between[:, 1] * second[:, 0]) / turn
    other = (between[:, 0] * first[:, 1] - between[:, 1] * first[:, 0]) / turn
    meet = (share > 0) & (share < 1) & (other > 0) & (other < 1)
    return np.where(meet[:, None], corners[:, 0] + share[:, None] * first, math.nan)
