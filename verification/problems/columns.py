"""Columns of ground at rest, under load and while they drain; ground at rest around a lining."""

import math

import numpy as np

from mpm.solver import Solver
from mpm.variables import MASS, SXX, SYY, SZZ, VLX, VLY, VSX, VSY, X0, Y0, P, Y
from verification.problems.boxes import box_mesh
from verification.problems.driven import DrivenSolver, box_scene
from verification.problems.problem import NUMERICS, WET, Problem, Result, Stopwatch, register
from verification.problems.two_phase import (
    NU,
    POROSITY,
    consolidation_with_inertia,
    constrained_modulus,
    terzaghi_series,
)


def column(
    cells, height, conductivity, bulk_modulus, youngs_modulus=4e7, model="elastic", drainage="two-phase", **numerics,
):  # fmt: skip
    """A wet column, two elements wide, drained at its top, and its scene: (scene, mesh).

    `cells` elements over `height` [m]; the ground water stands at the top.
    """
    size = height / cells
    soil = {
        "model": model, "youngs_modulus": youngs_modulus, "poissons_ratio": NU, "cohesion": 1e5, "porosity": POROSITY,
        "loose_porosity": 0.6, "hydraulic_conductivity": conductivity,
    }  # fmt: skip
    water = {"bulk_modulus": bulk_modulus, "drainage": drainage}
    scene = box_scene("column", size, 2 * size, height, soil, water, **numerics)
    return scene, box_mesh(np.array([-size, 0.0, size]), (np.arange(cells + 2) - cells) * size)


def terzaghi(
    cells=20, conductivity=1e-4, bulk_modulus=8e7, time_factor=0.1, inertia=False, drainage="two-phase",
    **numerics,
):  # fmt: skip
    """Let an excess pressure, carried by the water of a column of 1 m, drain through its top until Tv = `time_factor`.

    Reference: Terzaghi (1923), series; c_v = k / (rho g (1/M + n/K_w)). Where the time factor can not be reached,
    since the column stays undrained, ask for the small one that is: the exact answer is the initial state then. With
    `inertia` against the answer of grains and water that have mass.
    """
    height, initial = 1.0, 1e4
    scene, mesh = column(cells, height, conductivity, bulk_modulus, drainage=drainage, **numerics)
    solver = Solver(scene, mesh, threads=1)
    hydrostatic = solver.points[:, P].copy()
    solver.points[:, P] += initial
    solver.points[:, SYY] += initial  # total stress unchanged: the load is carried by the water
    solver.points[:, SXX] += NU / (1 - NU) * initial
    solver.points[:, SZZ] += NU / (1 - NU) * initial
    storage = 1 / constrained_modulus() + POROSITY / bulk_modulus
    end = time_factor * height**2 * 1000 * 9.81 * storage / conductivity
    longest = 0.0
    with Stopwatch() as watch:
        while solver.time < end * (1 - 1e-12):
            longest = max(longest, solver.step(end - solver.time)[0])
    depth = -solver.points[:, Y]
    series = terzaghi_series(depth, time_factor)
    exact = consolidation_with_inertia(depth, end, bulk_modulus, conductivity) if inertia else series
    miss = (solver.points[:, P] - hydrostatic) / initial - exact
    return Result(
        error=math.sqrt(np.mean(miss**2)),
        values={
            "time_step": longest, "time": end, "largest": float(np.abs(miss).max()),
            "inertia": float(np.sqrt(np.mean((exact - series) ** 2))),
        },
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


def oedometer(cells=5, strain=1e-3, duration=0.5, **numerics):
    """Press the top of a dry elastic column of 1 m down by `strain`, slowly: stresses of its points.

    Reference: Hooke's law without lateral strain, sigma_yy = M e, sigma_xx = nu/(1-nu) sigma_yy, with the logarithmic
    strain e, since the rates add up on the deformed column.
    """
    size = 1.0 / cells
    soil = {"model": "elastic", "poissons_ratio": NU}
    scene = box_scene("oedometer", size, 2 * size, 1.0, soil, gravity=1e-9, **numerics)
    solver = DrivenSolver(scene, box_mesh([-size, 0.0, size], np.linspace(-1, 0, cells + 1)), damping=0.5)
    solver.points[:, [SXX, SYY, SZZ]] = 0.0
    top = solver.mesh.top
    solver.driven[top, 1] = True
    with Stopwatch() as watch:
        while solver.time < duration * (1 - 1e-12):
            # a velocity that rises and falls as sin^2 leaves no wave behind
            solver.velocity[top, 1] = -2 * strain / duration * math.sin(math.pi * solver.time / duration) ** 2
            solver.step(min(duration - solver.time, duration / 200))
    vertical = constrained_modulus(scene.soils[0].youngs_modulus) * math.log1p(-strain)
    stress = solver.points[:, [SXX, SYY, SZZ]] / vertical
    miss = stress - [NU / (1 - NU), 1.0, NU / (1 - NU)]
    return Result(
        error=float(np.sqrt(np.mean(miss**2))),
        values={"vertical": float(stress[:, 1].mean()), "lateral": float(stress[:, 0].mean())},
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


def hydrostatics(
    size=0.35, size_growth=0.3, duration=0.05, points=3, lining="fixed", **numerics,
):  # fmt: skip
    """Ground under K0 and hydrostatic stress around a lining without a gate, left to itself for `duration` [s].

    Reference: at angle a from the crown soil presses with sigma_v (cos^2 a + K0 sin^2 a), water with rho g z, and
    nothing moves where the lining is rough enough to hold its shear. `size` : elements at
    the lining [m]; far away they are 3 m. A `lining` that moves has the weight of the ground it stands for, and the
    largest modulus allowed: it has no reason to move either, but for an ovalisation that changes pressures by 0.1 %.
    """
    import coupling
    from mpm.meshing import build_mesh

    rough = {"x": 0.0, "cover": 20.0, "outer_diameter": 6.6, "inner_diameter": 5.9, "friction_coefficient": 2.0}
    if lining != "fixed":
        ring = 1.0 - (rough["inner_diameter"] / rough["outer_diameter"]) ** 2
        ground = (1 - POROSITY) * 2650.0 + POROSITY * 1000.0
        rough |= {"lining_density": ground / ring, "lining_modulus": 1e13, "lining_poissons_ratio": 0.2}
    scene = coupling.load_scene(
        "quick", gate="none", tunnels=[rough], lining=lining, stop={"time": duration}, output={"interval": duration},
        discretisation={
            "element_size": 3.0, "element_size_lining": size, "size_growth": size_growth, "points_per_element": points,
        },
        numerics=numerics,
    )  # fmt: skip
    solver = Solver(scene, build_mesh(scene), threads=1)
    solver.relax()
    before = solver.points.copy()
    with Stopwatch() as watch:
        while solver.time < duration * (1 - 1e-12):
            solver.impulse[:] = 0.0
            begin = solver.time
            solver.step(duration - solver.time)
    (lining,) = solver.lining_pressures(solver.time - begin)
    tunnel, soil, water = scene.tunnels[0], scene.soils[0], scene.water
    angle = np.radians(lining["theta"])
    depth = tunnel.axis_depth - tunnel.outer_radius * np.cos(angle)
    buoyant = (1 - soil.porosity) * (soil.grain_density - water.density) * scene.gravity
    k0 = soil.lateral_pressure_coefficient(buoyant * depth)
    exact = {
        "soil_pressure": buoyant * depth * (np.cos(angle) ** 2 + k0 * np.sin(angle) ** 2),
        "water_pressure": water.density * scene.gravity * depth,
    }
    misses = {name: float(np.abs(lining[name] / value - 1).max()) for name, value in exact.items()}
    inside = solver.element_of_point >= 0
    order = np.lexsort(solver.points[:, X0 : Y0 + 1].T), np.lexsort(before[:, X0 : Y0 + 1].T)
    change = np.abs(solver.points[order[0]][:, [SXX, SYY, SZZ, P]] - before[order[1]][:, [SXX, SYY, SZZ, P]]).max()
    speed = np.abs(solver.points[inside][:, [VSX, VSY, VLX, VLY]]).max()
    return Result(
        error=max(misses.values()),
        values={
            **misses, "largest_velocity": float(speed),
            "change_of_stress": float(change / np.abs(before[:, SYY]).max()),
            "grains": float(solver.points[:, MASS].sum() / solver.initial_grain_mass - 1),
        },
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


DRAINAGE = ("two-phase", "undrained")

register(Problem(
    name="hydrostatics", title="K0 and hydrostatic stress around a closed lining stay as they are",
    source="equilibrium of level ground: sigma_v (cos^2 + K0 sin^2) and rho g z",
    norm="largest relative error of soil and water pressure on the lining, over all angles", solve=hydrostatics,
    fast={"size": 0.35},
    ladder={
        "size": (0.175, 0.35, 0.7, 1.4), **NUMERICS, **WET,
        "local_time_stepping": (False, True), "lining": ("fixed", "floating", "elastic"),
    },
    limit=0.004, why="chords of s instead of arcs, s^2 / (8 r^2) = 0.14 %, and a pressure that is linear along them",
))  # fmt: skip

for bulk_modulus, name in ((8e7, "terzaghi"), (2.2e8, "terzaghi-220-MPa"), (2.2e9, "terzaghi-2200-MPa")):
    physical = {"conductivity": (1e-3, 1e-4, 1e-5), "time_factor": (0.05, 0.1, 0.5)}
    numerical = {"cells": (5, 10, 20, 40), **NUMERICS, **WET}
    register(Problem(
        name=name, title=f"consolidation of a column drained at its top, K_w = {bulk_modulus / 1e6:g} MPa",
        source="Terzaghi (1923) with inertia: two-phase equations, mode by mode",
        norm="root mean square of the pressure error over the initial excess", solve=terzaghi,
        fast={
            "cells": 20, "conductivity": 1e-4, "bulk_modulus": bulk_modulus, "time_factor": 0.1, "inertia": True,
        },
        ladder=physical | (numerical if name == "terzaghi" else {}) | {"inertia": (False, True)},
        limit=0.014, why="a front of 20 cells, with waves that the default damping lets stand",
    ))  # fmt: skip

register(Problem(
    name="undrained-column", title="a column too tight to drain keeps its excess pressure",
    source="Terzaghi (1923) at a time factor of 1e-6, the initial state",
    norm="root mean square of the pressure error over the initial excess", solve=terzaghi,
    fast={"cells": 20, "conductivity": 1e-7, "bulk_modulus": 8e7, "time_factor": 1e-6},
    ladder={
        "conductivity": (1e-7, 1e-9, 1e-12), "bulk_modulus": (8e7, 2.2e8, 2.2e9), "cells": (10, 20, 40),
        "drainage": DRAINAGE,
    },
    limit=0.02, why="the exact front at the drained top is thinner than an element",
))  # fmt: skip

register(Problem(
    name="oedometer", title="slow compression of an elastic column between smooth walls",
    source="Hooke's law at no lateral strain, logarithmic strain",
    norm="root mean square error of the normal stresses over the vertical one", solve=oedometer, fast={"cells": 5},
    ladder={"cells": (3, 5, 10), "strain": (1e-4, 1e-3, 1e-2), "duration": (0.1, 0.5, 1.0), **NUMERICS},
    limit=2e-3, why="a wave of the acceleration of the plate remains: strain rate times 1 m over the wave speed",
))  # fmt: skip
