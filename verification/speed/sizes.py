"""Cost of a point-step against the number of points: wet Mohr-Coulomb ground in a box, the same everywhere."""

import math

import numpy as np

from verification.speed.stepping import prepared, rate

ROUNDS = 3  # the best counts: other programs slow one down, and in few steps of many points a spectrum may fall or not
SIZES = (1e3, 1e4, 1e5, 1e6)
LARGEST = 3e6


def size_ladder(scene, sizes, seconds):
    """Point-steps per processor second and bytes a point of boxes with about so many points: list of dicts."""
    from verification.problems.boxes import box_mesh

    rows = []
    for size in sizes:
        cells = round(math.sqrt(size / 6))  # two triangles of three points
        width = scene.box.width
        grid = np.linspace(0, 1, cells + 1)
        depth = 0.5 * scene.box.depth
        mesh = box_mesh(width * (grid - 0.5), depth * (grid - 1))
        box = scene.box.model_copy(update={"depth": depth})
        ground = scene.model_copy(update={"box": box, "tunnels": (), "gate": None, "soils": scene.soils[:1]})
        solver = prepared(ground, mesh)
        points_per_second = max(rate(solver, seconds)[0] for _ in range(ROUNDS))
        rows.append(
            {
                "points": int(solver.n_points),
                "points_per_second": points_per_second,
                "bytes_per_point": solver.memory_bytes() / solver.n_points,
            }
        )
    return rows


def slope(rows):
    """Exponent of the cost of a step over the number of points, between the sizes beyond the cache and the last [-]."""
    large = [row for row in rows if row["points"] > 5e3]
    points = np.log([row["points"] for row in large])
    cost = points - np.log([row["points_per_second"] for row in large])
    return float(np.polyfit(points, cost, 1)[0])
