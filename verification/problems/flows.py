"""Collapses under gravity: dry columns of sand in a channel, and water after a dam has been taken away."""

import numpy as np

from mpm.solver import Solver
from verification.boxes import (
    STRESS,
    box_mesh,
    box_scene,
    hat_functions,
    hold,
    inside,
    put,
    run_to,
    set_porosity,
    state,
    volumes,
)
from verification.problems.problem import NUMERICS, WET, Problem, Result, register


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
    mesh, here = solver.mesh, inside(solver)
    corners, count = mesh.elements[solver.element_of_point[here]], len(mesh.nodes)
    share = hat_functions(solver) * volumes(solver)[here, None]
    volume = np.bincount(corners.ravel(), share.ravel(), count)
    area = np.bincount(mesh.elements.ravel(), np.repeat(solver.geometry["area"] / 3, 3), count)
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
    if 1.8 < aspect < 2.8:
        return float(np.interp(aspect, [1.8, 2.8], [1.2 * 1.8, 1.9 * 2.8 ** (2 / 3)]))
    return 1.2 * aspect if aspect <= 1.8 else 1.9 * aspect ** (2 / 3)


def lube_height(aspect):
    """Final height over initial length; Lube et al. (2005), as in Lagree et al. (2011), eq. (3.2)."""
    return aspect if aspect < 1.0 else aspect**0.4


def column_collapse(aspect=2.0, cells=10, repose=31.0, stiffness=300.0, times=6.0, conductivity=None, **numerics):
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
    mesh = box_mesh(x, np.arange(-rows, 3) * size, lambda x, y: (x < 1) & (y < 0))
    scene = box_scene(
        "column", size, x[-1], rows * size, loose_porosity=0.5, hydraulic_conductivity=conductivity,
        friction_angle=np.degrees(np.arcsin(np.tan(np.radians(repose)))),
        youngs_modulus=stiffness * (1 - porosity) * grains * gravity * aspect,
        bulk_modulus=None if conductivity is None else 2e7, **numerics,
    )  # fmt: skip
    solver = Solver(scene, mesh, threads=1)
    seconds = run_to(solver, times * np.sqrt(aspect / gravity))
    run_out = front(state(solver, "x"), size) - 1
    height = float(depth_profile(solver, x)[0])
    grains = state(solver, "velocity_solid_x", "velocity_solid_y")
    speed = np.sqrt(np.average(np.sum(grains**2, axis=1), weights=state(solver, "grain_mass")))
    return Result.of(
        solver, seconds, max(abs(run_out / lube_run_out(aspect) - 1), abs(height / lube_height(aspect) - 1)),
        run_out=run_out, run_out_lube=lube_run_out(aspect), height=height, height_lube=lube_height(aspect),
        late_speed=speed / np.sqrt(gravity * aspect), overlap=overlap(solver),
    )  # fmt: skip


def water(name, mesh, size, width, depth, modulus=1e6, **numerics):
    """A solver of water alone: a suspension of grains as heavy as water, too loose to touch, tied to it by drag.

    The solver has no phase without grains; these take 11 % of the volume, carry no stress and follow the water, so
    the mixture moves as one inviscid fluid. Bulk modulus 1 MPa: speed of sound 33 m/s, no flow here is faster.
    """
    scene = box_scene(
        name, size, width, depth, model="elastic", youngs_modulus=1e4, poissons_ratio=0.0, porosity=0.87,
        loose_porosity=0.875, grain_density=1000.1, hydraulic_conductivity=1e-4, k0=1.0, bulk_modulus=modulus,
        **numerics,
    )  # fmt: skip
    solver = Solver(scene, mesh, threads=1)
    set_porosity(solver, 0.89)
    put(solver, **dict.fromkeys(STRESS, 0.0))
    solver.initial_grain_mass = float(state(solver, "grain_mass").sum())
    hold(solver, np.abs(mesh.nodes[:, 1] - mesh.nodes[:, 1].min()) < 1e-9, y=True)
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
    solver = water("dam", mesh, size, (behind + before) * size, 1.0, **numerics)
    end = times / np.sqrt(gravity)
    seconds = run_to(solver, end)
    edges = np.arange(-behind, before + 1) * size
    depth = depth_profile(solver, edges)
    exact = ritter_depth(edges, end, 1.0, gravity)
    wave = np.abs(edges) < 2 * times
    return Result.of(
        solver, seconds, np.abs(depth - exact)[wave].sum() / exact[wave & (edges > -times)].sum(),
        front=front(state(solver, "x"), size) / (2 * times), depth_at_dam=depth[behind],
        volume=np.trapezoid(depth, edges) / behind * cells, overlap=overlap(solver),
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
    fronts, seconds = [], 0.0
    for time, _ in MARTIN_MOYCE:
        seconds += run_to(solver, time / np.sqrt(2 * gravity))
        fronts.append(front(state(solver, "x"), size))
    error = np.abs(np.array(fronts) - MARTIN_MOYCE[:, 1]) / (MARTIN_MOYCE[-1, 1] - 1)
    return Result.of(solver, seconds, error.mean(), last_front=fronts[-1], overlap=overlap(solver))


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
    why="one fit for sand, rice and sugar alike: no friction angle enters",
))  # fmt: skip

register(Problem(
    name="dam-break", title="water behind a dam that vanishes, on a dry smooth bed", source="Ritter (1892)",
    norm="sum of depth errors over the sum of depths within the wave", solve=dam_break,
    fast={"cells": 10, "points": 12},
    ladder={"cells": (5, 10, 20), "times": (2.0, 4.0, 8.0), **FLOWING, **WET}, limit=0.14,
    why="the reference is hydrostatic with a front of no thickness: at its tip, below a tenth of the depth, no element "
    "is full, and some of the water overlaps",
))  # fmt: skip

register(Problem(
    name="water-column", title="collapse of a column of water twice as high as wide",
    source="Martin & Moyce (1952), Phil. Trans. R. Soc. A 244, figure 3",
    norm="mean error of the front's position over the distance travelled", solve=water_column,
    fast={"cells": 10, "points": 12},
    ladder={"cells": (5, 10, 20), **FLOWING, **WET}, limit=0.12,
    why="the gate of the experiment takes time to leave: its front starts 0.1 a behind; no wall friction here",
))  # fmt: skip
