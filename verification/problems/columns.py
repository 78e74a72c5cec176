"""Columns of ground at rest, under load and while they drain; ground at rest around a lining."""

import math

import numpy as np

from mpm.fields import OPEN_X, OPEN_Y
from mpm.solver import Solver
from verification.boxes import STRESS, box_mesh, box_scene, hold, inside, put, run_to, state
from verification.driven import DrivenSolver
from verification.loads import theory_pressures
from verification.problems.exact_two_phase import (
    NU,
    POROSITY,
    consolidation_with_inertia,
    constrained_modulus,
    terzaghi_series,
)
from verification.problems.problem import NUMERICS, WET, Problem, Result, register

DRAINAGE = ("two-phase", "undrained")
GROUND = {
    "model": "elastic", "youngs_modulus": 4e7, "poissons_ratio": NU, "cohesion": 1e5, "porosity": POROSITY,
    "loose_porosity": 0.6,
}  # fmt: skip


def column(cells, height, conductivity, bulk_modulus, **settings):
    """A wet column, two elements wide, drained at its top, and its scene: (scene, mesh).

    `cells` elements over `height` [m]; the ground water stands at the top; elastic, unless `settings` say otherwise.
    """
    size = height / cells
    wet = {"hydraulic_conductivity": conductivity, "bulk_modulus": bulk_modulus}
    scene = box_scene("column", size, 2 * size, height, **GROUND | wet | settings)
    return scene, box_mesh(np.array([-size, 0.0, size]), (np.arange(cells + 2) - cells) * size)


def terzaghi(cells=20, conductivity=1e-4, bulk_modulus=8e7, time_factor=0.1, inertia=False, **numerics):
    """Let an excess pressure, carried by the water of a column of 1 m, drain through its top until Tv = `time_factor`.

    Reference: Terzaghi (1923), series; c_v = k / (rho g (1/M + n/K_w)). Where the time factor can not be reached,
    since the column stays undrained, ask for the small one that is: the exact answer is the initial state then. With
    `inertia` against the answer of grains and water that have mass.
    """
    height, initial, longest = 1.0, 1e4, [0.0]
    scene, mesh = column(cells, height, conductivity, bulk_modulus, **numerics)
    solver = Solver(scene, mesh, threads=1)
    hydrostatic = state(solver, "pore_pressure")
    # total stress unchanged: the load is carried by the water
    for name, share in (("stress_yy", 1.0), ("stress_xx", NU / (1 - NU)), ("stress_zz", NU / (1 - NU))):
        put(solver, **{name: state(solver, name) + share * initial})
    put(solver, pore_pressure=hydrostatic + initial)
    storage = 1 / constrained_modulus() + POROSITY / bulk_modulus
    end = time_factor * height**2 * 1000 * 9.81 * storage / conductivity
    seconds = run_to(solver, end, after=lambda dt: longest.append(max(longest.pop(), dt)))
    depth = -state(solver, "y")
    series = terzaghi_series(depth, time_factor)
    exact = consolidation_with_inertia(depth, end, bulk_modulus, conductivity) if inertia else series
    miss = (state(solver, "pore_pressure") - hydrostatic) / initial - exact
    return Result.of(
        solver, seconds, np.sqrt(np.mean(miss**2)), time_step=longest[0], time=end, largest=np.abs(miss).max(),
        inertia=np.sqrt(np.mean((exact - series) ** 2)),
    )  # fmt: skip


def seepage(cells=10, conductivity=1e-3, upward=True, **numerics):
    """Press water through 1 m of ground from one open side of the box to the other, until it flows steadily.

    Upward it leaves through the surface; else from left to right below a lid. Reference: Darcy, q = k dp / (rho g L),
    and a pressure that falls along a straight line.
    """
    excess, size = 2e3, 1.0 / cells
    wet = {"hydraulic_conductivity": conductivity, "bulk_modulus": 8e7, "sides": "held"}
    width, depth = (2 * size, 1.0) if upward else (1.0, 2 * size)
    scene = box_scene("seepage", size, width, depth, **GROUND | wet | numerics)
    x = np.linspace(-width / 2, width / 2, round(width / size) + 1)
    y = np.linspace(-depth, 0.0, round(depth / size) + 1)
    solver = Solver(scene, box_mesh(x, np.append(y, size) if upward else y), threads=1)
    mesh, sides = solver.mesh, solver.sides
    shut, axis, nodes = ("x", "y", mesh.bottom) if upward else ("y", "x", mesh.left)
    solver.fixed[sides[f"area_{shut}"] != 0] &= ~(OPEN_X if upward else OPEN_Y)
    sides[f"area_{shut}"] = sides[f"push_{shut}"] = 0.0
    sides[f"push_{axis}"][nodes] += excess * sides[f"area_{axis}"][nodes]
    if not upward:
        hold(solver, mesh.top, y=True)
    storage = 1 / constrained_modulus() + POROSITY / 8e7
    end, hydrostatic = 3.0 * 1000 * 9.81 * storage / conductivity, state(solver, "pore_pressure")
    rate, area = [0.0, 0.0], sides[f"area_{axis}"][nodes]

    def add(dt):
        if solver.time > 0.8 * end:
            speed = solver.nodes[f"velocity_liquid_{axis}"][nodes] * area
            rate[0], rate[1] = rate[0] + dt * POROSITY * speed.sum() / area.sum(), rate[1] + dt

    seconds = run_to(solver, end, after=add)
    along = -state(solver, "y") if upward else 0.5 - state(solver, "x")
    miss = (state(solver, "pore_pressure") - hydrostatic) / excess - along
    darcy = conductivity * excess / (1000 * 9.81)
    return Result.of(
        solver, seconds, np.sqrt(np.mean(miss**2)), time=end, flow=rate[0] / rate[1] / darcy,
        recharge=float(solver.ledger["recharge"].sum()), water_missing=solver.balances()["water_missing"],
    )  # fmt: skip


def oedometer(cells=5, strain=1e-3, duration=0.5, **numerics):
    """Press the top of a dry elastic column of 1 m down by `strain`, slowly: stresses of its points.

    Reference: Hooke's law without lateral strain, sigma_yy = M e, sigma_xx = nu/(1-nu) sigma_yy, with the logarithmic
    strain e, since the rates add up on the deformed column.
    """
    size = 1.0 / cells
    scene = box_scene("oedometer", size, 2 * size, 1.0, 1e-9, model="elastic", poissons_ratio=NU, **numerics)
    solver = DrivenSolver(scene, box_mesh([-size, 0.0, size], np.linspace(-1, 0, cells + 1)), damping=0.5)
    put(solver, stress_xx=0.0, stress_yy=0.0, stress_zz=0.0)
    top = solver.mesh.top
    solver.driven[top, 1] = True

    def press():
        # a velocity that rises and falls as sin^2 leaves no wave behind
        solver.velocity[top, 1] = -2 * strain / duration * math.sin(math.pi * solver.time / duration) ** 2

    seconds = run_to(solver, duration, press, longest=duration / 200)
    vertical = constrained_modulus(scene.soils[0].youngs_modulus) * math.log1p(-strain)
    stress = state(solver, *STRESS[:3]) / vertical
    miss = stress - [NU / (1 - NU), 1.0, NU / (1 - NU)]
    return Result.of(
        solver, seconds, np.sqrt(np.mean(miss**2)), vertical=stress[:, 1].mean(), lateral=stress[:, 0].mean()
    )


def _rough_tunnel(lining):
    rough = {"x": 0.0, "cover": 20.0, "outer_diameter": 6.6, "inner_diameter": 5.9, "friction_coefficient": 2.0}
    if lining == "fixed":
        return rough
    ring = 1.0 - (rough["inner_diameter"] / rough["outer_diameter"]) ** 2
    ground = (1 - POROSITY) * 2650.0 + POROSITY * 1000.0
    return rough | {"lining_density": ground / ring, "lining_modulus": 1e13, "lining_poissons_ratio": 0.2}


def hydrostatics(size=0.35, size_growth=0.3, duration=0.05, points=3, lining="fixed", **numerics):
    """Ground under K0 and hydrostatic stress around a lining without a gate, left to itself for `duration` [s].

    Reference: at angle a from the crown soil presses with sigma_v (cos^2 a + K0 sin^2 a), water with rho g z, and
    nothing moves where the lining is rough enough to hold its shear. `size` : elements at
    the lining [m]; far away they are 3 m. A `lining` that moves has the weight of the ground it stands for, and the
    largest modulus allowed: it has no reason to move either, but for an ovalisation that changes pressures by 0.1 %.
    """
    import coupling
    from mpm.mesh.build import build_mesh

    scene = coupling.load_scene(
        "quick", gate="none", tunnels=[_rough_tunnel(lining)], lining=lining, stop={"time": duration},
        output={"interval": duration}, numerics=numerics,
        discretisation={
            "element_size": 3.0, "element_size_lining": size, "size_growth": size_growth, "points_per_element": points,
        },
    )  # fmt: skip
    solver = Solver(scene, build_mesh(scene), threads=1)
    solver.relax()
    carried = (*STRESS[:3], "pore_pressure")
    before, places, begin = state(solver, *carried), state(solver, "x_initial", "y_initial"), [0.0]

    def forget():
        solver.impulse[:] = 0.0
        begin[0] = solver.time

    seconds = run_to(solver, duration, forget)
    (lining,) = solver.lining_pressures(solver.time - begin[0])
    theory = theory_pressures(scene, theta=lining["theta"]).isel(time=0)
    names = ("soil_pressure", "water_pressure")
    misses = {name: float(np.abs(lining[name] / theory[name].values - 1).max()) for name in names}
    # points are sorted on the way
    now, then = np.lexsort(state(solver, "x_initial", "y_initial").T), np.lexsort(places.T)
    change = np.abs(state(solver, *carried)[now] - before[then]).max()
    velocities = state(solver, "velocity_solid_x", "velocity_solid_y", "velocity_liquid_x", "velocity_liquid_y")
    return Result.of(
        solver, seconds, max(misses.values()), **misses, largest_velocity=np.abs(velocities[inside(solver)]).max(),
        change_of_stress=change / np.abs(before[:, 1]).max(),
        grains=state(solver, "grain_mass").sum() / solver.initial_grain_mass - 1,
    )  # fmt: skip


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

register(Problem(
    name="seepage", title="steady flow from one open side of the box to the other",
    source="Darcy (1856): pressure falls along a straight line",
    norm="root mean square of the pressure error over the excess", solve=seepage,
    fast={"cells": 10, "conductivity": 1e-3},
    ladder={"cells": (5, 10, 20), "conductivity": (1e-2, 1e-3, 1e-4), "upward": (True, False), **NUMERICS, **WET},
    limit=2e-4, why="exact on linear triangles; what is left of the waves of the start",
))  # fmt: skip
