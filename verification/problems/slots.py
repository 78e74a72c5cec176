"""Openings in a floor: arching over a trapdoor, outflow of sand through a slot, of water from a tank."""

import numpy as np

from mpm.solver import Solver
from verification.boxes import box_mesh, box_scene, hold, run_to, state
from verification.driven import DrivenSolver
from verification.problems.earth_pressure import load_path
from verification.problems.flows import overlap, water
from verification.problems.problem import NUMERICS, WET, Problem, Result, register

KIRCHHOFF = np.pi / (np.pi + 2)  # width of a free jet far from a slot in a flat wall over that of the slot


def trapdoor(cells=8, cover=2.0, friction_angle=30.0, settlement=0.01, duration=1.0, damping=0.0, **numerics):
    """Lower a trapdoor of half width 1 m and half an element under `cover` m of sand; load on it over its weight.

    Reference: Terzaghi (1943), q = gamma B / (2 K mu) (1 - exp(-2 K mu H / B)). Without dilatancy a vertical slip plane
    lies at 45 degrees to the principal stresses: K = 1 and mu = sin(phi), Davis (1968), not tan(phi).
    """
    size = 1.0 / cells
    mesh = box_mesh(np.arange(4 * cells + 1) * size, np.arange(-round(cover * cells), 3) * size)
    scene = box_scene("trapdoor", size, 4.0, cover, youngs_modulus=5e7, friction_angle=friction_angle, **numerics)
    solver = DrivenSolver(scene, mesh, damping)
    door = mesh.bottom[mesh.nodes[mesh.bottom, 0] < 1 + 1e-9]
    hold(solver, door, y=False)
    load, trend, seconds = load_path(solver, duration, door, 1, -settlement / duration)
    half_width = 1 + size / 2
    friction = 2 * np.sin(np.radians(friction_angle)) * cover / (2 * half_width)
    exact = (1 - np.exp(-friction)) / friction
    ratio = load / (half_width * scene.gravity * state(solver, "grain_mass").sum() / 4.0)
    return Result.of(solver, seconds, abs(ratio / exact - 1), load_over_weight=ratio, exact=exact, trend=trend)


def left_through(solver, height):
    """Grains below a floor at -height [kg/m]."""
    return state(solver, "grain_mass")[state(solver, "y") < -height].sum()


def slot(cells=8, height=4.0, friction_angle=30.0, stiffness=300.0, times=(0.5, 1.1), **numerics):
    """Sand of the given height above a slot of 1 m, `cells` elements, in a floor: its steady outflow.

    Reference: Beverloo's law for a slot and fine grains, 1.03 rho sqrt(g) W^(3/2) per metre; Nedderman (1992),
    Statics and Kinematics of Granular Materials. stiffness : over the weight at the floor [-]. times : between which
    the outflow is steady [s]: before, the sand gathers speed, after, the funnel above the slot has sunk.
    """
    size, gravity, width = 1.0 / cells, 9.81, 2.5
    rows = round(height * cells) + round(1.5 * cells)
    mesh = box_mesh(
        np.arange(round(width * cells) + 1) * size, np.arange(-rows, 2) * size, lambda x, y: (y < 0) & (y > -height)
    )
    scene = box_scene(
        "slot", size, width, height + 1.5, friction_angle=friction_angle, loose_porosity=0.5,
        youngs_modulus=stiffness * 0.6 * 2650.0 * gravity * height, **numerics,
    )  # fmt: skip
    solver = Solver(scene, mesh, threads=1)
    floor = (np.abs(mesh.nodes[:, 1] + height) < 1e-9) & (mesh.nodes[:, 0] > 0.5 - 1e-9)
    hold(solver, floor, x=True, y=True)
    times, out, seconds = np.linspace(*times, 5), [], 0.0
    for end in times:
        seconds += run_to(solver, end)
        out.append(2 * left_through(solver, height))
    rate = np.diff(out) / np.diff(times) / (0.6 * 2650.0 * np.sqrt(gravity))
    return Result.of(
        solver, seconds, abs(rate.mean() / 1.03 - 1), coefficient=rate.mean(), first_quarter=rate[0],
        last_quarter=rate[-1], unsteadiness=np.ptp(rate[1:]) / rate.mean(), overlap=overlap(solver, -height + 1e-9),
    )  # fmt: skip


def water_level(solver, size, width, top):
    """Median height of the highest point of each column of elements."""
    x, y = state(solver, "x", "y").T
    held = (y > -top) & (x < width)
    highest = np.full(round(width / size), -top)
    np.maximum.at(highest, np.floor(x[held] / size).astype(int), y[held])
    return float(np.median(highest))


def tank(cells=8, head=3.0, width=3.0, emptied=0.2, **numerics):
    """Water, `head` m high, leaves half a tank of `width` m through half a slot of 0.5 m, `cells` elements.

    Reference: q = C b sqrt(2 g h), C = pi / (pi + 2), Kirchhoff (1869), as long as head and tank are large against the
    slot: a tank six times as wide as the slot adds 0.5 % (von Mises 1917). What leaves must lower the level.
    """
    size, gravity, slot = 0.5 / cells, 9.81, 0.5
    rows, below = round(head / size), 2 * cells
    mesh = box_mesh(
        np.arange(round(width / size) + 1) * size, np.arange(-rows - below, 2) * size,
        lambda x, y: (y < 0) & (y > -head), fixed_bottom=False,
    )  # fmt: skip
    solver = water("tank", mesh, size, width, head + below * size, modulus=1e7, **numerics)
    hold(solver, (np.abs(mesh.nodes[:, 1] + head) < 1e-9) & (mesh.nodes[:, 0] > slot - 1e-9), y=True)
    solver.fixed[np.abs(mesh.nodes[:, 1] - mesh.nodes[:, 1].min()) < 1e-9] = 0
    level0, whole = water_level(solver, size, width, head), state(solver, "grain_mass").sum()
    times, out, levels, seconds = [0.0], [0.0], [0.0], 0.0
    while out[-1] < emptied * head * width:
        seconds += run_to(solver, times[-1] + 0.02)
        times.append(solver.time)
        out.append(float(left_through(solver, head) / whole) * head * width)
        levels.append(level0 - water_level(solver, size, width, head))
    times, out = np.array(times), np.array(out)
    late = out > 0.4 * out[-1]
    rate = np.polyfit(times[late], out[late], 1)[0]
    coefficient = rate / (slot * np.sqrt(2 * gravity * (head - out[late].mean() / width)))
    return Result.of(
        solver, seconds, abs(coefficient / KIRCHHOFF - 1), coefficient=coefficient, time=times[-1],
        volume_lost=(levels[-1] * width - out[-1]) / (head * width), overlap=overlap(solver, -head + 1e-9),
    )  # fmt: skip


register(Problem(
    name="trapdoor", title="load on a trapdoor that gives way under sand",
    source="Terzaghi (1943), Theoretical Soil Mechanics; friction on the slip plane after Davis (1968)",
    norm="load over its reference less 1, mean over the last fifth of the path", solve=trapdoor, fast={"cells": 8},
    ladder={"cells": (4, 8, 16), **NUMERICS, "friction_angle": (20.0, 30.0, 40.0), "cover": (1.0, 2.0, 4.0)},
    limit=0.15, why="the reference is a slice theory: stress even across the door, slip planes straight",
))  # fmt: skip

register(Problem(
    name="slot-outflow", title="steady outflow of sand through a slot in a floor",
    source="Beverloo's law in the plane; Nedderman (1992), Statics and Kinematics of Granular Materials, ch. 10",
    norm="coefficient of rho sqrt(g) W^(3/2) over 1.03 less 1", solve=slot, fast={"cells": 8},
    ladder={"cells": (4, 8, 16), **NUMERICS, "friction_angle": (20.0, 30.0, 40.0), "height": (3.0, 4.0, 5.0)},
    limit=0.25, why="an empirical law: its width is less by some grain diameters, here by some elements",
))  # fmt: skip

register(Problem(
    name="tank", title="water leaves a tank through a slot in its floor",
    source="Kirchhoff (1869): contraction pi / (pi + 2) of a free jet from a slot in a flat wall",
    norm="discharge coefficient over 0.611 less 1", solve=tank, fast={"cells": 4},
    ladder={"cells": (2, 4, 8), **NUMERICS, "points": (3, 12), **WET, "head": (2.0, 3.0, 4.0)},
    limit=0.1, why="the node at the edge of the slot is held and closes half an element",
))  # fmt: skip
