"""Processor time of whole steps and of their kernels, for what a scene has and has not and for numbers of points."""

import math
import time as clock

import numpy as np

import mpm
from mpm.long_step import PASSES
from mpm.simulation import STEPS_BETWEEN_CHECKS
from verification.boxes import box_mesh

SECONDS_OF_WARM_UP = 0.5
ROUNDS = 3  # the best counts: other programs slow one down, and in few steps of many points a spectrum may fall or not
SIZES = (1e3, 1e4, 1e5, 1e6)
LARGEST = 3e6
#: Methods of the solver that a step calls only now and then, and what they are called in the table.
OCCASIONAL = {"_sort_physically": "sorting", "_update_wave_speed": "spectrum"}


def configurations(scene):
    """Name and `mpm.Scene` of the configurations measured: all of the scene, and parts left out."""
    elastic = tuple(soil.model_copy(update={"model": "elastic"}) for soil in scene.soils)

    def numerics(**changes):
        return scene.numerics.model_copy(update=changes)

    undamped = {"pressure_filter": 0.0, "stress_damping": 0.0}
    yield "two-phase, Mohr-Coulomb", scene
    yield "two-phase, Mohr-Coulomb, no filter or damping", scene.model_copy(update={"numerics": numerics(**undamped)})
    yield "two-phase, elastic", scene.model_copy(update={"soils": elastic})
    yield "dry, Mohr-Coulomb", scene.model_copy(update={"water": None})
    yield "dry, elastic", scene.model_copy(update={"water": None, "soils": elastic})
    one = {"local_time_stepping": False}
    yield "two-phase, Mohr-Coulomb, one time step", scene.model_copy(update={"numerics": numerics(**one)})


def prepared(mpm_scene, mesh, threads=1):
    """A solver with its gate open that has stepped until its kernels are compiled and its points are spread."""
    solver = mpm.Solver(mpm_scene, mesh, threads)
    if mpm_scene.gate is not None:
        solver.open_gate()
    solver.step()
    timed(lambda: steps(solver), SECONDS_OF_WARM_UP)
    return solver


def steps(solver):
    """As many steps at once as a run does until it looks at the inflow again."""
    solver.advance(math.inf, STEPS_BETWEEN_CHECKS)


def timed(step, seconds):
    """Repeat `step` for some processor time, at least twice; returns (count, processor seconds, wall seconds)."""
    count, begin, wall = 0, clock.process_time(), clock.perf_counter()
    while clock.process_time() - begin < seconds or count < 2:
        step()
        count += 1
    return count, clock.process_time() - begin, clock.perf_counter() - wall


def rate(solver, seconds):
    """Point-steps per processor second and per wall second of a solver, and simulated seconds per processor second."""
    points, time = solver.point_steps, solver.time
    _, used, wall = timed(lambda: steps(solver), seconds)
    done = solver.point_steps - points
    return done / used, done / wall, (solver.time - time) / used


def kernel_times(solver, seconds):
    """Processor time of each pass per point-step [s], the rest of a step as "python", of a solver on one thread."""
    occasional = dict.fromkeys(OCCASIONAL.values(), 0.0)
    inner = [0.0]

    def measured(function, name):
        def call():
            inner.append(0.0)
            begin = clock.process_time()
            function()
            spent = clock.process_time() - begin
            occasional[name] += spent - inner.pop()
            inner[-1] += spent

        return call

    for method, name in OCCASIONAL.items():
        setattr(solver, method, measured(getattr(solver, method), name))
    solver._used = np.zeros(len(PASSES), np.int64)
    points = solver.point_steps
    try:
        _, total, _ = timed(lambda: steps(solver), seconds)
    finally:
        passes, solver._used = solver._used, solver._used[:0]
        for method in OCCASIONAL:
            delattr(solver, method)
    used = {name: 1e-6 * int(spent) for name, spent in zip(PASSES, passes, strict=True)}
    used |= {name: spent for name, spent in occasional.items() if spent > 0}
    used["python"] = total - sum(used.values())
    done = solver.point_steps - points
    return {name: spent / done for name, spent in sorted(used.items(), key=lambda item: -item[1])}


def size_ladder(scene, sizes, seconds):
    """Point-steps per processor second and bytes a point of boxes of a scene's first soil with about so many points.

    Wet Mohr-Coulomb ground, the same everywhere: list of dicts.
    """
    rows = []
    for size in sizes:
        cells = round(math.sqrt(size / 6))  # two triangles of three points
        grid, width, depth = np.linspace(0, 1, cells + 1), scene.box.width, 0.5 * scene.box.depth
        box = scene.box.model_copy(update={"depth": depth})
        ground = scene.model_copy(update={"box": box, "tunnels": (), "gate": None, "soils": scene.soils[:1]})
        solver = prepared(ground, box_mesh(width * (grid - 0.5), depth * (grid - 1)))
        rows.append({
            "points": int(solver.n_points), "bytes_per_point": solver.memory_bytes() / solver.n_points,
            "points_per_second": max(rate(solver, seconds)[0] for _ in range(ROUNDS)),
        })  # fmt: skip
    return rows


def slope(rows):
    """Exponent of the cost of a step over the number of points, between the sizes beyond the cache and the last [-]."""
    large = [row for row in rows if row["points"] > 5e3]
    points = np.log([row["points"] for row in large])
    cost = points - np.log([row["points_per_second"] for row in large])
    return float(np.polyfit(points, cost, 1)[0])
