"""Processor time of whole steps and of their kernels, for what a scene has and has not."""

import math
import time as clock

import numpy as np

from mpm.step.substep import PASSES

SECONDS_OF_WARM_UP = 0.5


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
    import mpm

    solver = mpm.Solver(mpm_scene, mesh, threads)
    if mpm_scene.gate is not None:
        solver.open_gate()
    solver.step()
    timed(lambda: steps(solver), SECONDS_OF_WARM_UP)
    return solver


def steps(solver):
    """As many steps at once as a run does until it looks at the inflow again."""
    from mpm.simulation import STEPS_BETWEEN_CHECKS

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


#: Methods of the solver that a step calls only now and then, and what they are called in the table.
OCCASIONAL = {"_sort_physically": "sorting", "_update_wave_speed": "spectrum"}


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
