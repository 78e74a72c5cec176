"""Bodies that fall, slide and turn: gravity, friction and objectivity, each without the others."""

import math

import numpy as np

from mpm.fields import CONTACT_RECORD, REACTION_RECORD
from mpm.solver import Solver
from verification.boxes import STRESS, box_mesh, box_scene, clear_stress, put, run_to, state
from verification.driven import DrivenSolver
from verification.problems.columns import column
from verification.problems.problem import NUMERICS, WET, Problem, Result, register


def ways(solver):
    """Displacements of the points [m]: (n_points, 2)."""
    return state(solver, "x", "y") - state(solver, "x_initial", "y_initial")


def free_fall(cells=10, duration=0.5, **numerics):
    """Throw a block of soil and water, `cells` elements a metre, free of stress: it flies as a stone does.

    Reference: x0 + v t - g t^2 / 2, and no stress at all.
    """
    scene, _ = column(cells, 1.0, 1e-4, 8e7, model="mohr-coulomb", **numerics)
    size = 1.0 / cells
    x, y = np.arange(-cells, 4 * cells + 1) * size, np.arange(-3 * cells, 3 * cells + 1) * size
    mesh = box_mesh(x, y, lambda x, y: (np.abs(x) < 0.3) & (np.abs(y + 0.5) < 0.3))
    solver = Solver(scene, mesh, threads=1)
    clear_stress(solver)
    thrown = np.array([3.0, 4.0])
    for phase in ("solid", "liquid"):
        put(solver, **{f"velocity_{phase}_x": thrown[0], f"velocity_{phase}_y": thrown[1]})
    seconds = run_to(solver, duration)
    way = thrown * duration - [0.0, 0.5 * scene.gravity * duration**2]
    weight = scene.gravity * (solver.initial_grain_mass + solver.initial["water"]) / 0.6
    return Result.of(
        solver, seconds, np.abs(ways(solver) - way).max() / np.linalg.norm(way),
        stress_over_weight=np.abs(state(solver, *STRESS, "pore_pressure")).max() / weight,
    )  # fmt: skip


def rough_floor(solver, floor, normal, friction):
    """Make a row of nodes the surface of a rough obstacle; normal : (2,), into the ground."""
    count = len(floor)
    solver.contact_of_node[floor] = np.arange(count, dtype=np.int32)
    solver.n_contact = count
    solver.contact, solver.impulse = np.zeros(count, CONTACT_RECORD), np.zeros(count, REACTION_RECORD)
    solver.wall = np.zeros((count, 2))
    solver.contact["normal_x"], solver.contact["normal_y"] = normal
    solver.contact["active"], solver.contact["friction"] = 1.0, friction


def sliding_block(cells=5, slope=30.0, friction=0.2, duration=0.5, **numerics):
    """An elastic block, 1 m long and 0.4 m high, `cells` elements a metre, slides down an incline from rest.

    Reference: Coulomb, x = (sin a - mu cos a) g t^2 / 2. It begins with the stresses of a long sliding slab.
    """
    size, height, gravity = 1.0 / cells, 0.4, 9.81
    columns, rows = round(3 * cells), round(height * cells) + 1
    angle = math.radians(slope)
    along, normal = np.array([math.cos(angle), -math.sin(angle)]), np.array([math.sin(angle), math.cos(angle)])
    scene = box_scene("block", size, 3.0, 3.0, gravity, model="elastic", youngs_modulus=1e7, **numerics)
    mesh = box_mesh(
        np.arange(columns + 1) * size, np.arange(rows + 1) * size, lambda x, y: (x < 1) & (y < height),
        fixed_bottom=False,
    )  # fmt: skip
    floor = np.flatnonzero(mesh.nodes[:, 1] < 1e-9).astype(np.int32)
    mesh.left = mesh.right = np.zeros(0, np.int32)
    mesh.nodes = mesh.nodes[:, :1] * along + mesh.nodes[:, 1:] * normal - 3.0 * normal
    solver = Solver(scene, mesh, threads=1)
    rough_floor(solver, floor, normal, friction)
    density = (1 - scene.soils[0].porosity) * scene.soils[0].grain_density
    above = height - (state(solver, "x", "y") @ normal + 3.0)
    pressure = density * gravity * math.cos(angle) * above
    # stress -p n n - tau (n s + s n) with tau = mu p: the floor drags the block back along s
    shape = -np.outer(normal, normal) + friction * (np.outer(normal, along) + np.outer(along, normal))
    put(solver, stress_xx=pressure * shape[0, 0], stress_yy=pressure * shape[1, 1], stress_xy=pressure * shape[0, 1],
        stress_zz=0.0)  # fmt: skip
    seconds = run_to(solver, duration)
    moved = np.average(ways(solver), axis=0, weights=state(solver, "grain_mass"))
    way = 0.5 * gravity * (math.sin(angle) - friction * math.cos(angle)) * duration**2
    return Result.of(solver, seconds, abs(moved @ along / way - 1), way=moved @ along, lifted=moved @ normal)


def rotation(cells=10, turn=90.0, steps=400, **numerics):
    """Turn a block under stress rigidly by `turn` degrees in `steps` steps: its stress turns with it.

    Reference: sigma(t) = R sigma R^T (objectivity).
    """
    size = 1.0 / cells
    scene = box_scene("turn", size, 4.0, 4.0, 1e-9, model="elastic", **numerics)
    line = np.arange(-2 * cells, 2 * cells + 1) * size
    mesh = box_mesh(line, line, lambda x, y: np.hypot(x, y) < 0.8, fixed_bottom=False)
    mesh.left = mesh.right = np.zeros(0, np.int32)
    solver = DrivenSolver(scene, mesh)
    stress = np.array([[-3e3, 1e3], [1e3, -1e3]])
    put(solver, stress_xx=stress[0, 0], stress_yy=stress[1, 1], stress_xy=stress[0, 1], stress_zz=-2e3)
    total, dt = math.radians(turn), 0.25 * solver.time_step_estimate()[0]
    rate = total / (steps * dt)
    solver.driven[:] = True
    solver.velocity[:] = rate * np.column_stack([-mesh.nodes[:, 1], mesh.nodes[:, 0]])
    put(solver, velocity_solid_x=-rate * state(solver, "y"), velocity_solid_y=rate * state(solver, "x"))
    seconds = run_to(solver, steps * dt, longest=dt)
    turned = np.array([[math.cos(total), -math.sin(total)], [math.sin(total), math.cos(total)]])
    exact = turned @ stress @ turned.T
    miss = state(solver, *STRESS) - [exact[0, 0], exact[1, 1], -2e3, exact[0, 1]]
    return Result.of(
        solver, seconds, np.abs(miss).max() / np.abs(np.linalg.eigvalsh(stress)).max(),
        angle=math.degrees(rate * solver.time),
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
    ladder={"cells": (5, 10, 20), "slope": (15.0, 30.0, 45.0), "friction": (0.0, 0.1, 0.2), **NUMERICS},
    limit=0.02, why="the block rocks on the floor nodes that it meets and leaves",
))  # fmt: skip

register(Problem(
    name="rotation", title="stress of a body that turns rigidly", source="objectivity: R sigma R^T",
    norm="largest error of a stress component over the largest principal stress", solve=rotation, fast={"steps": 400},
    ladder={"steps": (100, 200, 400, 800), "cells": (5, 10, 20), "turn": (90.0, 360.0)},
    limit=0.01, why="the Jaumann rate by forward Euler: a step w dt stretches the deviator by 2 (w dt)^2",
))  # fmt: skip
