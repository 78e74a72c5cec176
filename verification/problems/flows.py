"""Collapses under gravity: dry columns of sand in a channel, and water after a dam has been taken away."""

import numpy as np

from mpm.fields import values
from mpm.solver import Solver
from mpm.walls.contact import FIXED_Y
from verification.problems.boxes import box_mesh
from verification.problems.driven import box_scene
from verification.problems.problem import NUMERICS, WET, Problem, Result, Stopwatch, register


def front(x, gap):
    """Where material that hangs together from the left ends: the first gap wider than `gap` [m]."""
    x = np.sort(x)
    wide = np.flatnonzero(np.diff(x) > gap)
    return float(x[wide[0]] if len(wide) else x[-1])


def patches(solver):
    """Area of the patch of each node, volume of the points in it, and how much of that it can hold [m2].

    The patch of a node cannot hold more than a third of its elements' area: what the points' volumes, shared among
    the corners of their elements, add up to beyond it has run into itself. Patches, since three points an element
    differ in number from element to element.
    """
    mesh, geometry = solver.mesh, solver.geometry
    inside = solver.element_of_point >= 0
    element = solver.element_of_point[inside]
    g, point = geometry[element], solver.points[inside]
    dx, dy = point["x"] - g["x"], point["y"] - g["y"]
    n1, n2 = g["dn1_dx"] * dx + g["dn1_dy"] * dy, g["dn2_dx"] * dx + g["dn2_dy"] * dy
    share = np.column_stack([1 - n1 - n2, n1, n2]) * solver.points_by_name()["volume"][inside, None]
    count = len(mesh.nodes)
    volume = np.bincount(mesh.elements[element].ravel(), share.ravel(), count)
    area = np.bincount(mesh.elements.ravel(), np.repeat(geometry["area"] / 3, 3), count)
    return area, volume, np.minimum(volume, area)


def overlap(solver, above=-np.inf):
    """Share of the points' volume above a height [m] that has run into itself [-]."""
    _, volume, held = patches(solver)
    here = solver.mesh.nodes[:, 1] > above
    return float(1 - held[here].sum() / volume[here].sum())


def depth_profile(solver, x):
    """Depth of the material at the grid lines `x` [m]."""
    area, _, held = patches(solver)
    line = np.searchsorted(x, solver.mesh.nodes[:, 0] - 1e-9)
    width = np.bincount(line, area, len(x)) / np.ptp(solver.mesh.nodes[:, 1])
    return np.bincount(line, held, len(x)) / width


def lube_run_out(aspect):
    """Run-out over initial length of sand, rice and sugar; between the two branches a straight line.

    Source: Lube et al. (2005), Phys. Rev. E 72, 041301, as in Lagree, Staron & Popinet (2011), JFM 686, eq. (3.1).
    """
    return float(np.interp(aspect, [1.8, 2.8], [1.2 * 1.8, 1.9 * 2.8 ** (2 / 3)])) if 1.8 < aspect < 2.8 else (
        1.2 * aspect if aspect <= 1.8 else 1.9 * aspect ** (2 / 3)
    )  # fmt: skip


def lube_height(aspect):
    """Final height over initial length; Lube et al. (2005), as in Lagree et al. (2011), eq. (3.2)."""
    return aspect if aspect < 1.0 else aspect**0.4


def column_collapse(
    aspect=2.0, cells=10, repose=31.0, stiffness=300.0, times=6.0, conductivity=None,
    **numerics,
):  # fmt: skip
    """Let a column of dry sand, 1 m long, `cells` elements, and `aspect` m high, fall aside on a rough floor.

    repose : angle of repose [deg], the friction on slip planes. Without dilatancy these lie at 45 degrees to the
    principal stresses: tan(repose) = sin(friction_angle), Davis (1968).
    stiffness : Young's modulus over the weight at the floor [-];  times : duration over sqrt(height / gravity) [-];
    conductivity : of sand that is full of water at the start [m/s], None: dry.
    """
    size, porosity, grains, gravity = 1.0 / cells, 0.4, 2650.0, 9.81
    rows = round(aspect * cells)
    length = 1.5 * (1 + lube_run_out(aspect)) + 0.5
    x = np.arange(round(length * cells) + 1) * size
    y = np.arange(-rows, 3) * size
    mesh = box_mesh(x, y, lambda x, y: (x < 1) & (y < 0))
    soil = {
        "friction_angle": np.degrees(np.arcsin(np.tan(np.radians(repose)))), "porosity": porosity,
        "loose_porosity": 0.5, "grain_density": grains,
        "youngs_modulus": stiffness * (1 - porosity) * grains * gravity * aspect, "k0": 0.5,
    }  # fmt: skip
    water = None if conductivity is None else {"bulk_modulus": 2e7}
    soil["hydraulic_conductivity"] = conductivity
    scene = box_scene("column", size, x[-1], rows * size, soil, water, **numerics)
    solver = Solver(scene, mesh, threads=1)
    end = times * np.sqrt(aspect / gravity)
    with Stopwatch() as watch:
        while solver.time < end:
            solver.step(end - solver.time)
    run_out = front(solver.points["x"], size) - 1
    depth = depth_profile(solver, x)
    height = float(depth[0])
    speed = np.sqrt(
        np.average(
            np.sum(values(solver.points, ("velocity_solid_x", "velocity_solid_y")) ** 2, axis=1),
            weights=solver.points["grain_mass"],
        )
    )
    return Result(
        error=float(max(abs(run_out / lube_run_out(aspect) - 1), abs(height / lube_height(aspect) - 1))),
        values={
            "run_out": run_out, "run_out_lube": lube_run_out(aspect), "height": height,
            "height_lube": lube_height(aspect),
            "late_speed": float(speed / np.sqrt(gravity * aspect)), "overlap": overlap(solver),
        },
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


def water(name, mesh, size, width, depth, modulus=1e6, **numerics):
    """A solver of water alone: a suspension of grains as heavy as water, too loose to touch, tied to it by drag.

    The solver has no phase without grains; these take 11 % of the volume, carry no stress and follow the water, so
    the mixture moves as one inviscid fluid. Bulk modulus 1 MPa: speed of sound 33 m/s, no flow here is faster.
    """
    loose, porosity = 0.875, 0.89
    soil = {
        "model": "elastic", "youngs_modulus": 1e4, "poissons_ratio": 0.0, "porosity": 0.87, "loose_porosity": loose,
        "grain_density": 1000.1, "hydraulic_conductivity": 1e-4, "k0": 1.0,
    }  # fmt: skip
    scene = box_scene(name, size, width, depth, soil, {"bulk_modulus": modulus}, **numerics)
    solver = Solver(scene, mesh, threads=1)
    solver.points["grain_mass"] *= (1 - porosity) / (1 - solver.points["porosity"])
    solver.points["porosity"] = porosity
    solver.points[["stress_xx", "stress_yy", "stress_zz", "stress_xy"]] = 0.0
    solver.initial_grain_mass = float(solver.points["grain_mass"].sum())
    floor = np.abs(mesh.nodes[:, 1] - mesh.nodes[:, 1].min()) < 1e-9
    solver.fixed[floor] |= FIXED_Y
    return solver


def ritter_depth(x, time, depth, gravity):
    """Depth of water behind and before a dam that vanished at x = 0, t = 0 [m]; Ritter (1892), dry bed, no friction."""
    wave = np.sqrt(gravity * depth)
    return np.clip((2 * wave - x / time) ** 2 / (9 * gravity), 0, depth) * (x < 2 * wave * time)


def dam_break(cells=10, times=4.0, **numerics):
    """Water 1 m deep, `cells` elements, behind a dam that vanishes: depth after `times` sqrt(depth / gravity)."""
    size, gravity = 1.0 / cells, 9.81
    behind, before = round((times + 1) * cells), round((2 * times + 1) * cells)
    mesh = box_mesh(
        np.arange(-behind, before + 1) * size, np.arange(-cells, 2) * size, lambda x, y: (x < 0) & (y < 0),
        fixed_bottom=False,
    )  # fmt: skip
    width = (behind + before) * size
    solver = water("dam", mesh, size, width, 1.0, **numerics)
    end = times / np.sqrt(gravity)
    with Stopwatch() as watch:
        while solver.time < end:
            solver.step(end - solver.time)
    edges = np.arange(-behind, before + 1) * size
    depth = depth_profile(solver, edges)
    exact = ritter_depth(edges, end, 1.0, gravity)
    wave = np.abs(edges) < 2 * times
    tip = front(solver.points["x"], size)
    return Result(
        error=float(np.abs(depth - exact)[wave].sum() / exact[wave & (edges > -times)].sum()),
        values={
            "front": tip / (2 * times), "depth_at_dam": float(depth[behind]),
            "volume": float(np.trapezoid(depth, edges) / behind * cells), "overlap": overlap(solver),
        },
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


#: Front of a water column twice as high as wide, a = 2.25 in: t sqrt(2 g / a), x / a.
#: Martin & Moyce (1952), Phil. Trans. R. Soc. A 244, 312, figure 3, as digitised for pysph/examples/db_exp_data.py.
MARTIN_MOYCE = np.array([
    (0.832, 1.217), (1.219, 1.474), (1.997, 2.292), (2.547, 2.995), (3.345, 4.134), (4.034, 4.944), (4.418, 5.881),
])  # fmt: skip


def water_column(cells=10, **numerics):
    """A column of water 1 m wide, `cells` elements, and 2 m high collapses: its front over time."""
    size, gravity = 1.0 / cells, 9.81
    mesh = box_mesh(
        np.arange(7 * cells + 1) * size, np.arange(-2 * cells, 2) * size, lambda x, y: (x < 1) & (y < 0),
        fixed_bottom=False,
    )  # fmt: skip
    solver = water("column", mesh, size, 7.0, 2.0, **numerics)
    fronts = []
    with Stopwatch() as watch:
        for time, _ in MARTIN_MOYCE:
            end = time / np.sqrt(2 * gravity)
            while solver.time < end:
                solver.step(end - solver.time)
            fronts.append(front(solver.points["x"], size))
    error = np.abs(np.array(fronts) - MARTIN_MOYCE[:, 1]) / (MARTIN_MOYCE[-1, 1] - 1)
    return Result(
        error=float(error.mean()), values={"last_front": fronts[-1], "overlap": overlap(solver)},
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


FLOWING = NUMERICS | {"points": (3, 12, 27)}

register(Problem(
    name="column-collapse", title="collapse of a dry column of sand in a channel",
    source="Lube et al. (2005), Phys. Rev. E 72, as in Lagree, Staron & Popinet (2011), JFM 686, (3.1)-(3.2)",
    norm="larger relative error of run-out and final height", solve=column_collapse,
    fast={"aspect": 2.0, "cells": 10, "points": 12},
    ladder={
        "aspect": (0.5, 1.0, 2.0, 4.0), "cells": (5, 10, 20), **FLOWING,
        "repose": (28.0, 31.0, 34.0), "conductivity": (None, 1e-1, 1e-3), "stiffness": (100.0, 300.0, 1000.0),
    },
    limit=0.25,
    why="one fit for sand, rice and sugar alike: no friction angle enters; an internal friction of 31 degrees, not "
    "the 37 that are 31 on slip planes, lengthens the run-out by 14 %",
))  # fmt: skip

register(Problem(
    name="dam-break", title="water behind a dam that vanishes, on a dry smooth bed", source="Ritter (1892)",
    norm="sum of depth errors over the sum of depths within the wave", solve=dam_break,
    fast={"cells": 10, "points": 12},
    ladder={
        "cells": (5, 10, 20), "times": (2.0, 4.0, 8.0), **FLOWING, **WET,
    },
    limit=0.14,
    why="the reference is hydrostatic with a front of no thickness: at its tip, below a tenth of the depth, no element "
    "is full; 4 % of the water overlaps (17 % with 3 points an element: loss of depth all over)",
))  # fmt: skip

register(Problem(
    name="water-column", title="collapse of a column of water twice as high as wide",
    source="Martin & Moyce (1952), Phil. Trans. R. Soc. A 244, figure 3",
    norm="mean error of the front's position over the distance travelled", solve=water_column,
    fast={"cells": 10, "points": 12},
    ladder={
        "cells": (5, 10, 20), **FLOWING, **WET,
    },
    limit=0.12,
    why="the gate of the experiment takes time to leave: its front starts 0.1 a behind; no wall friction here",
))  # fmt: skip
