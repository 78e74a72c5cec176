"""Closed boxes: what nothing may create or take away while soil and water collapse in them."""

import numpy as np

from mpm.solver import Solver
from verification.problems.boxes import box_mesh
from verification.problems.columns import column
from verification.problems.problem import NUMERICS, WET, Problem, Result, Stopwatch, register
from verification.stability.monitor import Monitor


def collapse(cells=10, duration=1.0, conductivity=1e-4, **numerics):
    """A column of sand and water, 0.5 m by 0.8 m, `cells` elements a metre, falls aside in a closed box.

    Reference: grains, water and momentum change only by what the walls and gravity do; energy does not grow beyond
    what gravity gives. Suspended, splashing material is the worst case for the water.
    """
    scene, _ = column(cells, 1.0, conductivity, 8e7, model="mohr-coulomb", **numerics)
    size = 1.0 / cells
    soil = scene.soils[0].model_copy(update={"cohesion": 0.0, "tensile_strength": 0.0})
    scene = scene.model_copy(update={"soils": (soil,)})
    mesh = box_mesh(
        np.arange(2 * cells + 1) * size, np.arange(-cells, cells + 1) * size - 0.5,
        lambda x, y: (x < 0.5) & (y < -0.7),
    )  # fmt: skip
    solver = Solver(scene, mesh, threads=1)
    solver.points[["stress_xx", "stress_yy", "stress_zz", "stress_xy", "pore_pressure"]] = 0.0
    solver.initial = solver.sums_over_points()
    monitor = Monitor(solver)
    with Stopwatch() as watch:
        while solver.time < duration * (1 - 1e-12):
            monitor.step(duration - solver.time)
    monitor.check()
    measures, balances = monitor.measures(), solver.balances()
    water = solver.initial["water"]
    impulse = scene.gravity * (solver.initial_grain_mass + water) * solver.time
    parts = {
        "grains": measures["mass_error"], "water": abs(balances["water_missing"]) / water,
        "momentum": balances["momentum_departure"] / impulse, "energy_created": measures["energy_created"],
    }  # fmt: skip
    return Result(
        error=float(max(parts.values())), values={name: float(value) for name, value in parts.items()},
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


register(Problem(
    name="closed-box", title="soil and water collapse in a closed box",
    source="conservation of mass and momentum; work of gravity",
    norm="largest of the relative errors of grains, water, momentum, and of the energy created over that in play",
    solve=collapse, fast={"cells": 10},
    ladder={
        "cells": (5, 10, 20), "duration": (0.5, 1.0, 2.0), **NUMERICS, **WET,
    },
    limit=0.1,
    why="water alone: a point's water fills the pores of its grains, and what seeps from point to point is not carried "
    "but follows from divergences; grains hold to round-off, and no energy is created",
))  # fmt: skip
