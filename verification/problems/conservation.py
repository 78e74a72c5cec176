"""Closed boxes: what nothing may create or take away while soil and water collapse in them."""

import time as clock

import numpy as np

from mpm.solver import Solver
from verification.boxes import box_mesh, clear_stress
from verification.monitor import Monitor
from verification.problems.columns import column
from verification.problems.problem import NUMERICS, WET, Problem, Result, register


def collapse(cells=10, duration=1.0, conductivity=1e-4, **numerics):
    """A column of sand and water, 0.5 m by 0.8 m, `cells` elements a metre, falls aside in a closed box.

    Reference: grains, water and momentum change only by what the walls and gravity do; energy does not grow beyond
    what gravity gives. Suspended, splashing material is the worst case for the water.
    """
    sand = {"model": "mohr-coulomb", "cohesion": 0.0, "tensile_strength": 0.0}
    scene, _ = column(cells, 1.0, conductivity, 8e7, **sand, **numerics)
    size = 1.0 / cells
    mesh = box_mesh(
        np.arange(2 * cells + 1) * size, np.arange(-cells, cells + 1) * size - 0.5,
        lambda x, y: (x < 0.5) & (y < -0.7),
    )  # fmt: skip
    solver = Solver(scene, mesh, threads=1)
    clear_stress(solver)
    solver.initial = solver.sums_over_points()
    monitor, begin = Monitor(solver), clock.process_time()
    while solver.time < duration * (1 - 1e-12):
        monitor.step(duration - solver.time)
    seconds = clock.process_time() - begin
    monitor.check()
    measures, balances, water = monitor.measures(), solver.balances(), solver.initial["water"]
    impulse = scene.gravity * (solver.initial_grain_mass + water) * solver.time
    parts = {
        "grains": measures["mass_error"], "water": abs(balances["water_missing"]) / water,
        "momentum": balances["momentum_departure"] / impulse, "energy_created": measures["energy_created"],
    }  # fmt: skip
    return Result.of(solver, seconds, max(parts.values()), **parts)


register(Problem(
    name="closed-box", title="soil and water collapse in a closed box",
    source="conservation of mass and momentum; work of gravity",
    norm="largest of the relative errors of grains, water, momentum, and of the energy created over that in play",
    solve=collapse, fast={"cells": 10},
    ladder={"cells": (5, 10, 20), "duration": (0.5, 1.0, 2.0), **NUMERICS, **WET}, limit=0.1,
    why="water alone: a point's water fills the pores of its grains, and what seeps from point to point is not carried "
    "but follows from divergences; grains hold to round-off, and no energy is created",
))  # fmt: skip
