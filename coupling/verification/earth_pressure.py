"""Limit loads of soil: Rankine's active and passive wall, Prandtl's strip footing."""

import numpy as np

from coupling.verification.boxes import box_mesh
from coupling.verification.driven import DrivenSolver, dry_scene
from coupling.verification.problem import Problem, Result, Stopwatch, register
from mpm.contact import FIXED_X, FIXED_Y
from mpm.variables import MASS


def _late_mean(times, loads, share):
    """Mean of the loads over the last share of the path, and its trend there over the mean."""
    times, loads = np.array(times), np.array(loads)
    late = times > (1 - share) * times[-1]
    mean = loads[late].mean()
    half = late & (times > (1 - share / 2) * times[-1])
    return mean, 2 * (loads[half].mean() - mean) / mean


def wall(
    direction, cells, friction_angle, dilatancy_angle, cohesion, width, rough_base, strain, duration, courant, points,
    pic_rate, smoothing,
):  # fmt: skip
    """Move a smooth wall of 1 m height away from (-1) or into (1) the soil; force on it over Rankine's."""
    size = 1.0 / cells
    columns = round(width * cells)
    mesh = box_mesh(np.arange(columns + 1) * size, np.arange(-cells, 3) * size, fixed_bottom=False)
    soil = {
        "friction_angle": friction_angle, "dilatancy_angle": dilatancy_angle, "cohesion": cohesion,
        "youngs_modulus": 1e8,
    }  # fmt: skip
    scene = dry_scene(
        "wall", size, columns * size, 1.0, soil, points=points, courant=courant, pic_rate=pic_rate,
        volumetric_smoothing=smoothing,
    )  # fmt: skip
    solver = DrivenSolver(scene, mesh, damping=0.3)
    bottom = np.abs(mesh.nodes[:, 1] + 1.0) < 1e-9
    solver.fixed[bottom] |= (FIXED_X | FIXED_Y) if rough_base else FIXED_Y
    left = mesh.left
    solver.fixed[left] &= ~FIXED_X
    solver.driven[left, 0] = True
    speed = direction * strain * width / duration
    times, loads = [], []
    with Stopwatch() as watch:
        while solver.time < duration:
            solver.velocity[left, 0] = speed * min(1.0, 5 * solver.time / duration)
            solver.step(duration - solver.time)
            times.append(solver.time)
            loads.append(solver.reaction[left, 0].sum())
    load, trend = _late_mean(times, loads, 0.2)
    k = np.tan(np.pi / 4 + direction * np.radians(friction_angle) / 2) ** 2
    weight = scene.gravity * solver.points[:, MASS].sum() / (columns * size)
    exact = 0.5 * k * weight + direction * 2 * cohesion * np.sqrt(k)
    return Result(
        error=float(abs(load / exact - 1)),
        values={"coefficient": float(load / (0.5 * weight)), "exact_coefficient": float(k), "trend": float(trend),
                "first": float(loads[0] / (0.5 * weight))},
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


def footing(cells, rough, depth, width, settlement, duration, courant, points, pic_rate, smoothing, stiffness):
    """Press half a strip footing of width 2 m into weightless clay; mean pressure over its strength."""
    size = 1.0 / cells
    strength = 1e4
    mesh = box_mesh(np.arange(round(width * cells) + 1) * size, np.arange(-round(depth * cells), 2) * size)
    soil = {
        "cohesion": strength, "friction_angle": 0.0, "tensile_strength": 1e8, "youngs_modulus": stiffness * strength,
        "k0": 1.0,
    }  # fmt: skip
    scene = dry_scene(
        "footing", size, width, depth, soil, gravity=0.0, points=points, courant=courant, pic_rate=pic_rate,
        volumetric_smoothing=smoothing,
    )  # fmt: skip
    solver = DrivenSolver(scene, mesh, damping=0.3)
    under = np.flatnonzero((np.abs(mesh.nodes[:, 1]) < 1e-9) & (mesh.nodes[:, 0] < 1 + 1e-9))
    solver.driven[under, 1] = True
    solver.driven[under, 0] = rough
    times, loads = [], []
    with Stopwatch() as watch:
        while solver.time < duration:
            solver.velocity[under, 1] = -settlement / duration * min(1.0, 5 * solver.time / duration)
            solver.step(duration - solver.time)
            times.append(solver.time)
            loads.append(-solver.reaction[under, 1].sum())
    load, trend = _late_mean(times, loads, 0.2)
    exact = 2 + np.pi
    return Result(
        error=float(abs(load / strength / exact - 1)),
        values={"bearing_capacity_factor": float(load / strength), "trend": float(trend)},
        steps=solver.step_count, points=solver.n_points, cpu_seconds=watch.seconds,
    )  # fmt: skip


def active(
    cells=10, friction_angle=30.0, dilatancy_angle=0.0, cohesion=0.0, width=2.0, rough_base=True, strain=2e-3,
    duration=1.0, courant=0.5, points=3, pic_rate=10.0, smoothing=True,
):  # fmt: skip
    return wall(-1, cells, friction_angle, dilatancy_angle, cohesion, width, rough_base, strain, duration, courant, points, pic_rate, smoothing)


def passive(
    cells=10, friction_angle=30.0, dilatancy_angle=0.0, cohesion=0.0, width=3.0, rough_base=True, strain=5e-3,
    duration=1.0, courant=0.5, points=3, pic_rate=10.0, smoothing=True,
):  # fmt: skip
    return wall(1, cells, friction_angle, dilatancy_angle, cohesion, width, rough_base, strain, duration, courant, points, pic_rate, smoothing)
