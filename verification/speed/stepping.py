"""Processor time of whole steps and of their kernels, for what a scene has and has not and for numbers of points."""

import math
import time as clock

import numpy as np

import mpm
from mpm.simulation import STEPS_BETWEEN_CHECKS
from verification.boxes import box_mesh

SECONDS_OF_WARM_UP = 0.5
ROUNDS = 3  # the best counts: other programs slow one down, and in few steps of many points a spectrum may fall or not
SIZES = (1e3, 1e4, 1e5, 1e6)
LARGEST = 3e6


FULL, CROWN, TIGHT = "full", "gate at the crown, whole", "k = 1e-12 m/s"


def variants(scene):
    """Name, what is left out and how, name of the scene it is compared with, and the `mpm.Scene` without it."""
    elastic = tuple(soil.model_copy(update={"model": "elastic"}) for soil in scene.soils)
    tight = tuple(soil.model_copy(update={"hydraulic_conductivity": 1e-12}) for soil in scene.soils)
    smooth = tuple(tunnel.model_copy(update={"friction_coefficient": 0.0}) for tunnel in scene.tunnels)
    tied = scene.water.model_copy(update={"drainage": "undrained"})

    def without(**changes):
        return scene.model_copy(update=changes)

    def numerics(**changes):
        return without(numerics=scene.numerics.model_copy(update=changes))

    yield FULL, "nothing: two phases, Mohr-Coulomb, friction, filter, damping", FULL, scene
    yield "dry", "the water: compiled out", FULL, without(water=None)
    yield "elastic", "the return mapping: compiled out", FULL, without(soils=elastic)
    yield "dry, elastic", "both", FULL, without(water=None, soils=elastic)
    yield "no filter", "the pressure that nodes feel: not asked for", FULL, numerics(pressure_filter=0.0)
    yield "no damping", "what stress runs ahead by: not summed; longer steps", FULL, numerics(stress_damping=0.0)
    yield "frictionless", "nothing: contacts with a coefficient of 0", FULL, without(tunnels=smooth)
    yield TIGHT, "nothing: both velocities", FULL, without(soils=tight)
    yield "undrained", "velocity and momentum of the water, drag: compiled out", TIGHT, without(water=tied)
    yield "sink", "the inside of the tunnel: not meshed", FULL, without(interior="sink")
    if scene.gate is None:
        return
    crown = {"gate": scene.gate.model_copy(update={"angle": 0.0})}
    yield "no gate", "the gate and its fine mesh: not meshed; right half only", FULL, without(gate=None)
    yield "no gate, whole", "the gate and its fine mesh: not meshed", FULL, without(gate=None, symmetry="whole")
    yield CROWN, "nothing", CROWN, without(symmetry="whole", **crown)
    yield "gate at the crown, half", "x < 0: neither meshed nor filled", CROWN, without(**crown)


def configurations(scene):
    """Name and `mpm.Scene` of what `gush bench` measures on the scene's own mesh: some variants, and one time step."""
    chosen = (FULL, "dry", "elastic", "dry, elastic", "no filter", "no damping")
    together = scene.numerics.model_copy(update={"local_time_stepping": False})
    one = ("one time step", scene.model_copy(update={"numerics": together}))
    return [(name, variant) for name, _, _, variant in variants(scene) if name in chosen] + [one]


def prepared(scene, mesh, threads=1):
    """A solver with its gate open that has stepped until its kernels are compiled and its points are spread."""
    solver = mpm.Solver(scene, mesh, threads)
    if scene.gate is not None:
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
