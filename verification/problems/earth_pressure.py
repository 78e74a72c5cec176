"""Limit loads of soil: Rankine's active and passive wall, Prandtl's strip footing.

Displacements stay below a sixth of an element, where the first points lie: nodes of the grid are wall and footing.
"""

from functools import partial

import numpy as np

from verification.boxes import STRESS, box_mesh, box_scene, hold, put, run_to, state
from verification.driven import DrivenSolver
from verification.problems.problem import NUMERICS, WET, Problem, Result, register

COHESION = 1e4  # of the ground under a footing [Pa]
LATE = 0.2  # share of the path at its end over which the load is averaged


def load_path(solver, duration, nodes, component, speed):
    """Move nodes with `speed` [m/s], reached within the first fifth; late load [N/m], its trend, processor time [s]."""
    solver.driven[nodes, component] = True
    times, loads = [], []

    def drive():
        solver.velocity[nodes, component] = speed * min(1.0, 5 * solver.time / duration)

    def look(dt):
        times.append(solver.time)
        loads.append(solver.reaction[nodes, component].sum())

    seconds = run_to(solver, duration, drive, look)
    times, loads = np.array(times), np.array(loads)
    mean = loads[times > (1 - LATE) * duration].mean()
    trend = 2 * (loads[times > (1 - LATE / 2) * duration].mean() / mean - 1)
    return mean, trend, seconds


def wall(
    direction, strain, cells=10, width=2.0, friction_angle=30.0, dilatancy_angle=0.0, cohesion=0.0, rough_base=False,
    duration=0.5, damping=0.0, **settings,
):  # fmt: skip
    """Move a smooth wall of 1 m height away from (-1) or into (1) the soil.

    Reference: Rankine (1857), P = K gamma H^2 / 2 -+ 2 c sqrt(K) H with K = tan^2(45 -+ phi / 2); tension is not cut.
    Where strain localises, strength falls to that on slip lines, tan(phi*) = sin(phi) cos(psi) / (1 - sin(psi)
    sin(phi)), Davis (1968): `beyond` is how far the thrust is outside of what lies between both.
    """
    size = 1.0 / cells
    columns = round(width * cells)
    mesh = box_mesh(np.arange(columns + 1) * size, np.arange(-cells, 3) * size, fixed_bottom=False)
    scene = box_scene(
        "wall", size, columns * size, 1.0, friction_angle=friction_angle, dilatancy_angle=dilatancy_angle,
        cohesion=cohesion, tensile_strength=1e8, youngs_modulus=1e8, **settings,
    )  # fmt: skip
    solver = DrivenSolver(scene, mesh, damping)
    hold(solver, np.abs(mesh.nodes[:, 1] + 1.0) < 1e-9, x=rough_base or None, y=True)
    hold(solver, mesh.left, x=False)
    load, trend, seconds = load_path(solver, duration, mesh.left, 0, direction * strain * width / duration)
    phi, psi = np.radians([friction_angle, dilatancy_angle])
    slip = np.arctan(np.sin(phi) * np.cos(psi) / (1 - np.sin(psi) * np.sin(phi)))
    coefficient, localised = (np.tan(np.pi / 4 + direction * angle / 2) ** 2 for angle in (phi, slip))
    geostatic = 0.5 * scene.gravity * state(solver, "grain_mass").sum() / (columns * size)
    exact = coefficient * geostatic + direction * 2 * cohesion * np.sqrt(coefficient)
    softened = localised * geostatic + direction * 2 * cohesion * np.tan(slip) / np.tan(phi) * np.sqrt(localised)
    beyond = max(load - max(exact, softened), min(exact, softened) - load, 0.0)
    return Result.of(
        solver, seconds, abs(load / exact - 1), coefficient=load / geostatic, exact=exact / geostatic, trend=trend,
        localised=softened / geostatic, beyond=beyond / exact,
    )  # fmt: skip


def bearing_capacity_factor(friction_angle):
    """N_c of weightless soil with associated flow: Prandtl (1920); 2 + pi without friction."""
    if friction_angle == 0:
        return 2 + np.pi
    phi = np.radians(friction_angle)
    return (np.exp(np.pi * np.tan(phi)) * np.tan(np.pi / 4 + phi / 2) ** 2 - 1) / np.tan(phi)


def footing_solver(cells, friction_angle, stiffness, bulk_modulus, damping, **numerics):
    """Half a strip footing on weightless soil, 1 m in `cells` elements: (solver, nodes under it, size of the spiral).

    bulk_modulus : of the water of undrained saturated soil [Pa], None: dry. It is under a pressure that effective
    tension balances, so that it does not cavitate where the ground dilates.
    """
    size, exact = 1.0 / cells, bearing_capacity_factor(friction_angle)
    phi = np.radians(friction_angle)
    spiral = np.exp(0.5 * np.pi * np.tan(phi)) * np.tan(np.pi / 4 + phi / 2)
    depth, width = 0.6 + 1.4 * spiral, 1.5 + 2 * spiral
    mesh = box_mesh(np.arange(round(width * cells) + 1) * size, np.arange(-round(depth * cells), 2) * size)
    scene = box_scene(
        "footing", size, width, depth, 0.0, cohesion=COHESION, friction_angle=friction_angle,
        dilatancy_angle=friction_angle, tensile_strength=1e8, youngs_modulus=stiffness * COHESION * exact / (2 + np.pi),
        k0=1.0, bulk_modulus=bulk_modulus, drainage="undrained", **numerics,
    )  # fmt: skip
    solver = DrivenSolver(scene, mesh, damping)
    if bulk_modulus is not None:
        put(solver, **dict.fromkeys((*STRESS[:3], "pore_pressure"), 20 * COHESION))
    under = np.flatnonzero((np.abs(mesh.nodes[:, 1]) < 1e-9) & (mesh.nodes[:, 0] < 1 + 1e-9))
    return solver, under, spiral


def footing(
    cells=8, friction_angle=0.0, rough=True, settlement=0.0025, stiffness=20000.0, duration=0.25, damping=0.0,
    bulk_modulus=None, **numerics,
):  # fmt: skip
    """Press half a strip footing into weightless soil: `cells` elements, 1 m, and half an element.

    The velocity of the outermost node falls to zero over an element; half of it counts as width, as usual. Without
    friction Prandtl's mechanism is 1.41 m deep and 3 m wide; with it the log spiral makes both larger.
    stiffness : Young's modulus over cohesion, times N_c over 2 + pi [-];  duration : times the size of the spiral [s].
    """
    exact = bearing_capacity_factor(friction_angle)
    solver, under, spiral = footing_solver(cells, friction_angle, stiffness, bulk_modulus, damping, **numerics)
    solver.driven[under, 0] = rough
    load, trend, seconds = load_path(solver, duration * spiral, under, 1, -settlement / (duration * spiral))
    factor = -load / (COHESION * (1 + 0.5 / cells))
    return Result.of(
        solver, seconds, abs(factor / exact - 1), bearing_capacity_factor=factor, exact=exact,
        over_nodes_only=factor * (1 + 0.5 / cells), trend=trend,
    )  # fmt: skip


def loaded_footing(cells=8, share=0.9, stiffness=20000.0, duration=1.0, damping=0.0, bulk_modulus=None, **numerics):
    """Load the ground by `share` of its bearing capacity, spread evenly on 1 m, and wait: it must come to rest.

    A negative share is the pressure that is missing where ground is pressed into a gap.

    Reference: a statically admissible load below the limit, at which a perfectly plastic body stands still. Evenly: a
    load that goes on to the middle of the next element punches its outermost nodes through at 0.9 already.
    """
    solver, under, _ = footing_solver(cells, 0.0, stiffness, bulk_modulus, damping, **numerics)
    length = np.where(np.abs(solver.mesh.nodes[under, 0] - 0.5) > 0.5 - 1e-9, 0.5, 1.0) / cells  # of a pressure on 1 m
    top = state(solver, "y") > -1.0 / cells
    settled, times = [], []

    def load():
        ramp = min(1.0, 5 * solver.time / duration)
        solver.force[under, 1] = -ramp * share * (2 + np.pi) * COHESION * length

    def look(dt):
        settled.append(np.abs(state(solver, "y_initial")[top] - state(solver, "y")[top]).max())
        times.append(solver.time)

    seconds = run_to(solver, duration, load, look)
    settled, times = np.array(settled), np.array(times)
    first, last = (settled[(times > a * duration) & (times <= (a + 0.1) * duration)].mean() for a in (0.5, 0.9))
    return Result.of(solver, seconds, abs(last / first - 1), settlement=last, elastic=last * stiffness / (2 + np.pi))


for name, title, state_, direction, strain in (
    ("active-wall", "active thrust on a smooth wall that gives way", "active", -1, 4e-4),
    ("passive-wall", "passive resistance of soil to a smooth wall", "passive", 1, 1.5e-3),
):
    register(Problem(
        name=name, title=title, source=f"Rankine (1857), {state_} state", solve=partial(wall, direction, strain=strain),
        norm="thrust over Rankine's less 1, mean over the last fifth of the path", fast={"cells": 10}, limit=0.02,
        ladder={
            "cells": (5, 10, 20), **NUMERICS, "damping": (0.0, 0.3, 0.8), "friction_angle": (20.0, 30.0, 40.0),
            "dilatancy_angle": (0.0, 10.0, 30.0), "cohesion": (0.0, 2e3), "rough_base": (False, True),
            "relaxation_time": (0.0, 2e-4),
        },
        why="uniform in x and linear in y, which linear triangles hold with associated flow; without dilatancy strain "
        "localises and strength falls towards Davis' (0.382, 2.62 instead of 1/3, 3), the more the finer the mesh",
    ))  # fmt: skip

register(Problem(
    name="strip-footing", title="bearing capacity of weightless undrained clay under a strip footing",
    source="Prandtl (1920): N_c = 2 + pi", norm="N_c over 2 + pi less 1, mean over the last fifth of the path",
    solve=footing, fast={"cells": 8},
    ladder={
        "cells": (2, 4, 8, 16), **NUMERICS, "damping": (0.0, 0.3, 0.8), "rough": (False, True),
        "friction_angle": (0.0, 10.0, 20.0), "stiffness": (10000.0, 20000.0, 40000.0),
    },
    limit=0.01,
    why="first order, from below since half an element beside the edge counts as width",
))  # fmt: skip

register(Problem(
    name="undrained-footing", title="bearing capacity of saturated ground that does not drain",
    source="Prandtl (1920): N_c = 2 + pi", norm="N_c over 2 + pi less 1, mean over the last fifth of the path",
    solve=footing, fast={"cells": 8, "bulk_modulus": 2e8},
    ladder={"cells": (2, 4, 8, 16), **NUMERICS, **WET, "bulk_modulus": (2e7, 2e8)},
    limit=0.01, why="as of dry ground: crossed quadrilaterals do not lock at constant volume",
))  # fmt: skip

register(Problem(
    name="footing-at-rest", title="saturated ground under nine tenths of its bearing capacity comes to rest",
    source="lower bound theorem; Prandtl (1920): N_c = 2 + pi",
    norm="settlement in the last tenth of the run over that at its half, less 1", solve=loaded_footing,
    fast={"cells": 8, "bulk_modulus": 2e8, "share": 0.9},
    ladder={"cells": (4, 8, 16), **NUMERICS, **WET, "share": (-0.9, 0.5, 0.95), "damping": (0.0, 0.3)},
    limit=2e-3, why="an elastic vibration of the ground is left",
))  # fmt: skip
