"""Bodies that fall, slide and turn: gravity, friction and objectivity, each without the others."""

import math

import numpy as np

from mpm.fields import (
    CONTACT_RECORD,
    REACTION_RECORD,
    values,
)
from mpm.solver import Solver
from verification.problems.boxes import box_mesh
from verification.problems.columns import column
from verification.problems.driven import DrivenSolver, box_scene
from verification.problems.problem import NUMERICS, WET, Problem, Result, Stopwatch, register


def free_fall(cells=10, duration=0.5, **numerics):
    """Throw a block of soil and water, `cells` elements a metre, free of stress: it flies as a stone does.

    Reference: x0 + v t - g t^2 / 2, and no stress at all.
    """
    scene, _ = column(cells, 1.0, 1e-4, 8e7, model="mohr-coulomb", **numerics)
    size = 1.0 / cells
    x, y = np.arange(-cells, 4 * cells + 1) * size, np.arange(-3 * cells, 3 * cells + 1) * size
    mesh = box_mesh(x, y, lambda x, y: (np.abs(x) < 0.3) & (np.abs(y + 0.5) < 0.3))
    solver = Solver(scene, mesh, threads=1)
    solver.points[["stress_xx", "stress_yy", "stress_zz", "stress_xy", "pore_pressure"]] = 0.0
    thrown = np.array([3.0, 4.0])
    solver.points[["velocity_solid_x", "velocity_solid_y"]] = solver.points[
        ["velocity_liquid_x", "velocity_liquid_y"]
    ] = thrown
    with Stopwatch() as watch:
        while solver.time < duration * (1 - 1e-12):
            solver.step(duration - solver.time)
    way = thrown * duration - [0.0, 0.5 * scene.gravity * duration**2]
    miss = values(solver.points, ("x", "y")) - values(solver.points, ("x_initial", "y_initial")) - way
    stress = np.abs(values(solver.points, ("stress_xx", "stress_yy", "stress_zz", "stress_xy", "pore_pressure"))).max()
    weight = scene.gravity * (solver.initial_grain_mass + solver.initial["water"]) / 0.6
    return Result(
        error=float(np.abs(miss).max() / np.linalg.norm(way)),
        values={"stress_over_weight": float(stress / weight)},
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


def sliding_block(cells=5, slope=30.0, friction=0.2, duration=0.5, **numerics):
    """An elastic block, 1 m long and 0.4 m high, `cells` elements a metre, slides down an incline from rest.

    Reference: Coulomb, x = (sin a - mu cos a) g t^2 / 2. It begins with the stresses of a long sliding slab.
    """
    size, height, gravity = 1.0 / cells, 0.4, 9.81
    columns, rows = round(3 * cells), round(height * cells) + 1
    angle = math.radians(slope)
    along, normal = np.array([math.cos(angle), -math.sin(angle)]), np.array([math.sin(angle), math.cos(angle)])
    soil = {"model": "elastic", "youngs_modulus": 1e7, "k0": 0.5}
    scene = box_scene("block", size, 3.0, 3.0, soil, gravity=gravity, **numerics)
    mesh = box_mesh(
        np.arange(columns + 1) * size, np.arange(rows + 1) * size, lambda x, y: (x < 1) & (y < height),
        fixed_bottom=False,
    )  # fmt: skip
    floor = np.flatnonzero(mesh.nodes[:, 1] < 1e-9).astype(np.int32)
    mesh.left = mesh.right = np.zeros(0, np.int32)
    mesh.nodes = mesh.nodes[:, :1] * along + mesh.nodes[:, 1:] * normal - 3.0 * normal
    solver = Solver(scene, mesh, threads=1)
    solver.contact_of_node[floor] = np.arange(len(floor), dtype=np.int32)
    solver.n_contact = len(floor)
    solver.contact, solver.impulse = np.zeros(len(floor), CONTACT_RECORD), np.zeros(len(floor), REACTION_RECORD)
    solver.wall = np.zeros((len(floor), 2))
    solver.contact["normal_x"], solver.contact["normal_y"] = normal
    solver.contact["active"], solver.contact["friction"] = 1.0, friction
    density = (1 - scene.soils[0].porosity) * scene.soils[0].grain_density
    above = height - (values(solver.points, ("x", "y")) @ normal + 3.0)
    pressure = density * gravity * math.cos(angle) * above
    # stress -p n n - tau (n s + s n) with tau = mu p: the floor drags the block back along s
    for column_, i, j in (("stress_xx", 0, 0), ("stress_yy", 1, 1), ("stress_xy", 0, 1)):
        solver.points[column_] = -pressure * normal[i] * normal[j] - friction * pressure * (
            -normal[i] * along[j] - along[i] * normal[j]
        )
    solver.points["stress_zz"] = 0.0
    with Stopwatch() as watch:
        while solver.time < duration * (1 - 1e-12):
            solver.step(duration - solver.time)
    mass = solver.points["grain_mass"]
    moved = float(
        mass
        @ ((values(solver.points, ("x", "y")) - values(solver.points, ("x_initial", "y_initial"))) @ along)
        / mass.sum()
    )
    lifted = float(
        mass
        @ ((values(solver.points, ("x", "y")) - values(solver.points, ("x_initial", "y_initial"))) @ normal)
        / mass.sum()
    )
    way = 0.5 * gravity * (math.sin(angle) - friction * math.cos(angle)) * duration**2
    return Result(
        error=abs(moved / way - 1), values={"way": moved, "lifted": lifted},
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


def rotation(cells=10, turn=90.0, steps=400, **numerics):
    """Turn a block under stress rigidly by `turn` degrees in `steps` steps: its stress turns with it.

    Reference: sigma(t) = R sigma R^T (objectivity).
    """
    size = 1.0 / cells
    scene = box_scene("turn", size, 4.0, 4.0, {"model": "elastic"}, gravity=1e-9, **numerics)
    line = np.arange(-2 * cells, 2 * cells + 1) * size
    mesh = box_mesh(line, line, lambda x, y: np.hypot(x, y) < 0.8, fixed_bottom=False)
    mesh.left = mesh.right = np.zeros(0, np.int32)
    solver = DrivenSolver(scene, mesh)
    stress = np.array([[-3e3, 1e3], [1e3, -1e3]])
    solver.points["stress_xx"], solver.points["stress_yy"] = stress[0, 0], stress[1, 1]
    solver.points["stress_xy"], solver.points["stress_zz"] = stress[0, 1], -2e3
    total, dt = math.radians(turn), 0.25 * solver.time_step_estimate()[0]
    rate = total / (steps * dt)
    solver.driven[:] = True
    solver.velocity[:] = rate * np.column_stack([-mesh.nodes[:, 1], mesh.nodes[:, 0]])
    solver.points["velocity_solid_x"], solver.points["velocity_solid_y"] = (
        -rate * solver.points["y"],
        rate * solver.points["x"],
    )
    with Stopwatch() as watch:
        for _ in range(steps):
            solver.step(dt)
    turned = np.array([[math.cos(total), -math.sin(total)], [math.sin(total), math.cos(total)]])
    exact = turned @ stress @ turned.T
    miss = values(solver.points, ("stress_xx", "stress_yy", "stress_xy", "stress_zz")) - [
        exact[0, 0],
        exact[1, 1],
        exact[0, 1],
        -2e3,
    ]
    return Result(
        error=float(np.abs(miss).max() / np.abs(np.linalg.eigvalsh(stress)).max()),
        values={"angle": math.degrees(rate * solver.time)},
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


register(Problem(
    name="free-fall", title="a block of soil and water in flight", source="Galilei: x0 + v t - g t^2 / 2",
    norm="largest error of a point's way over the way", solve=free_fall, fast={"cells": 10},
    ladder={"cells": (5, 10, 20), **NUMERICS, **WET},
    limit=2e-3, why="positions move with the velocity at the end of a step: g t dt / 2 over the way",
))  # fmt: skip

register(Problem(
    name="sliding-block", title="a block slides down an incline with friction",
    source="Coulomb: (sin a - mu cos a) g t^2 / 2", norm="relative error of the way of its centre of mass",
    solve=sliding_block, fast={"cells": 5},
    ladder={
        "cells": (5, 10, 20), "slope": (15.0, 30.0, 45.0), "friction": (0.0, 0.1, 0.2), **NUMERICS,
    },
    limit=0.02, why="the block rocks on the floor nodes that it meets and leaves",
))  # fmt: skip

register(Problem(
    name="rotation", title="stress of a body that turns rigidly", source="objectivity: R sigma R^T",
    norm="largest error of a stress component over the largest principal stress", solve=rotation, fast={"steps": 400},
    ladder={"steps": (100, 200, 400, 800), "cells": (5, 10, 20), "turn": (90.0, 360.0)},
    limit=0.01, why="the Jaumann rate by forward Euler: a step w dt stretches the deviator by 2 (w dt)^2",
))  # fmt: skip
