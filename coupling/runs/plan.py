"""What a run would do and cost, before it starts: the table and the JSON of `gush plan`."""

import math
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from coupling.runs.memory import check_memory, free_memory_bytes
from coupling.scenes.features import features, initial_k0
from coupling.scenes.plausibility import warn_in_python, warnings_of
from coupling.scenes.scene import Scene, as_scene
from mpm.scene import Scene as MpmScene

WARM_UP_STEPS, MEASURED_SPELLS, SECONDS_A_SPELL = 10, 5, 0.3
# Inflow of grains over that of free discharge under the head at the gate, from runs of case 3 (docs/case-3.md): a rough
# guess that only the expected duration uses.
DISCHARGE_SHARE = 0.11


def plan(
    scene: Scene | str | Path, threads: int | None = None, warn: Callable[[str], None] | None = None
) -> dict[str, Any]:
    """Build the mesh and the points of a scene, take a few steps, and say what the run will cost.

    scene : as of :func:`coupling.run`;  warn : as of :func:`coupling.run`.

    Returns: scene; features: list of {feature, active, reason}; initial_k0: see :func:`initial_k0`; elements, nodes,
    points; min_altitude [m]; min_angle [degree]; dt [s]; dt_limit; stop_time [s] or None; stop_inflow_mass [kg/m] or
    None; steps_to_stop_time (None without a stop time); expected_time [s] and expected_steps: rough where an inflow
    mass stops the run; steps are those of the smallest elements, cut to the output interval; expected_point_steps:
    updates of one point by one step; records; memory_bytes, free_memory_bytes; point_steps_per_second: measured now;
    expected_seconds: of stepping, without mesh, relaxation and pictures. Steps are counted with the step of the initial
    state; where ground flows it becomes up to a third shorter.
    """
    import mpm

    scene = _checked(scene, warn)
    mesh = mpm.build_mesh(scene)
    solver = mpm.Solver(scene, mesh, threads)
    dt, limit = solver.time_step_estimate()
    rate = _measured_rate(solver)
    interval, time = scene.output.interval, expected_time(scene)
    steps, point_steps = _work(solver, dt, interval, time)
    return {
        **_of_scene(scene, solver.threads, len(mesh.elements), threads),
        "elements": len(mesh.elements),
        "nodes": len(mesh.nodes),
        "points": int(solver.n_points),
        "min_altitude": float(mesh.quality["min_altitude"]),
        "min_angle": float(mesh.quality["min_angle"]),
        "dt": float(dt),
        "dt_limit": limit,
        "steps_to_stop_time": None if scene.stop.time is None else _work(solver, dt, interval, scene.stop.time)[0],
        "expected_steps": steps,
        "expected_point_steps": point_steps,
        "memory_bytes": int(solver.memory_bytes()),
        "point_steps_per_second": rate,
        "expected_seconds": point_steps / rate,
    }


def _of_scene(scene, threads, elements, asked):
    """What a plan says without a mesh; `asked` are the threads that were asked for."""
    time = expected_time(scene)
    return {
        "scene": scene.name,
        "features": features(scene, threads, _why_alone(elements, asked)),
        "initial_k0": initial_k0(scene),
        "stop_time": scene.stop.time,
        "stop_inflow_mass": scene.stop.inflow_mass,
        "expected_time": time,
        "records": 1 + _intervals(scene.output.interval, time)[0],
        "free_memory_bytes": free_memory_bytes(),
    }


def _checked(scene: Scene | str | Path, warn: Callable[[str], None] | None) -> Scene:
    """A valid scene that fits into the memory, what is unusual in it told."""
    scene = as_scene(scene)
    for warning in warnings_of(scene):
        (warn if warn is not None else warn_in_python)(warning)
    check_memory(scene)
    return scene


def _intervals(interval, time):
    """Number of output intervals until a time, and the length of the last [s]."""
    count = max(math.ceil(time / interval * (1 - 1e-12)), 1)
    return count, time - (count - 1) * interval


def _work(solver, dt, interval, time):
    """Steps of the smallest elements, and updates of one point by one step, until a time."""
    count, last = _intervals(interval, time)
    full, rest = (np.array(_work_within(solver, length / dt)) for length in (interval, last))
    steps, point_steps = (count - 1) * full + rest
    return int(steps), int(point_steps)


def _work_within(solver, steps):
    """The same within one interval, `steps` times the critical step of the smallest elements long."""
    from mpm.time_step.clock import choose_periods

    points = np.diff(solver.start[solver.levels.element_cuts]).astype(np.int64)
    periods = np.ones(len(points), np.int64)
    made = updates = 0
    several = 2
    while several > 1:  # how to go on is chosen after each step of the coarsest level
        several = choose_periods(points, float(steps), periods)
        made += int(periods[-1])
        updates += int(np.sum(points * (periods[-1] // periods)))
        steps -= min(steps / several, float(periods[-1]))
    return made, updates


def _why_alone(elements, asked):
    """Why a mesh of so many elements is computed by one thread; empty where it is not."""
    from mpm.solver import SMALLEST_PARALLEL, cores

    if elements < SMALLEST_PARALLEL:
        return f"{elements:.0f} elements, a second thread pays from {SMALLEST_PARALLEL}"
    return "one was asked for" if asked == 1 else "one core" if asked is None and cores() == 1 else ""


def rough_plan(
    scene: Scene | str | Path, threads: int | None = None, warn: Callable[[str], None] | None = None
) -> dict[str, Any]:
    """What a run would do and cost, from formulas alone: no mesh, no points, some milliseconds.

    Parameters are those of :func:`plan`.

    Returns: keys of :func:`plan` that need no mesh: scene, features, initial_k0, elements, points, dt [s], stop_time
    [s], stop_inflow_mass [kg/m], steps_to_stop_time, expected_time [s], expected_steps, records, memory_bytes,
    free_memory_bytes. Elements, points and dt are right within a factor of three where the mesh is regular.

    Raises coupling.refused.Refused: too little memory.
    """
    from mpm.machine.threads import check_threads
    from mpm.memory import estimated_bytes, estimated_elements
    from mpm.solver import threads_used

    scene = _checked(scene, warn)
    check_threads(threads)
    elements, interval, stop = estimated_elements(scene), scene.output.interval, scene.stop.time
    sizes = [scene.discretisation.element_size] + [scene.discretisation.element_size_lining] * bool(scene.tunnels)
    if scene.gate is not None:
        sizes.append(scene.gate.width / scene.discretisation.elements_across_gate)
    # between the altitude of an equilateral triangle and the flattest that the mesher lets pass
    dt = scene.numerics.courant * 0.6 * min(sizes) / max(_wave_speed(soil, scene) for soil in scene.soils)
    return {
        **_of_scene(scene, threads_used(elements, threads), elements, threads),
        "elements": math.ceil(elements),
        "points": math.ceil(elements * scene.discretisation.points_per_element),
        "dt": dt,
        "steps_to_stop_time": None if stop is None else _rough_steps(dt, interval, stop),
        "expected_steps": _rough_steps(dt, interval, expected_time(scene)),
        "memory_bytes": math.ceil(estimated_bytes(scene)),
    }


def _rough_steps(dt, interval, time):
    """Steps until a time where each output interval takes a whole number of them."""
    count, last = _intervals(interval, time)
    return (count - 1) * math.ceil(interval / dt) + math.ceil(last / dt)


def _wave_speed(soil, scene):
    from mpm.time_step.wave_speed import dry_wave_speed, fast_wave_speed

    nu, water = soil.poissons_ratio, scene.water
    modulus = soil.youngs_modulus_at(scene.vertical_stress(scene.box.depth)) * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    if water is None:
        return dry_wave_speed(modulus, soil.porosity, soil.grain_density)
    return fast_wave_speed(modulus, water.bulk_modulus, soil.porosity, soil.grain_density, water.density)


def expected_time(mpm_scene: MpmScene) -> float | None:
    """Simulated time until the run stops [s]; a rough guess where an inflow mass stops it."""
    stop = mpm_scene.stop
    if stop.inflow_mass is None or mpm_scene.gate is None:
        return stop.time
    tunnel = mpm_scene.tunnels[mpm_scene.gate.tunnel]
    depth = tunnel.axis_depth - tunnel.outer_radius * math.cos(math.radians(mpm_scene.gate.angle))
    # dry grains fall out freely from about one gate width above it
    water = mpm_scene.water
    head = max(depth - water.table_depth, 0.1 * depth) if water is not None else mpm_scene.gate.width
    soil = [layer for layer in mpm_scene.soils if layer.top_depth <= depth][-1]
    velocity = DISCHARGE_SHARE * math.sqrt(2 * mpm_scene.gravity * head)
    inflow_rate = velocity * mpm_scene.gate.width * (1 - soil.porosity) * soil.grain_density
    if inflow_rate == 0:
        return stop.time
    # the rate grows evenly for twice the delay, in which grains fall freely up to that velocity
    delay, steady = velocity / (2 * mpm_scene.gravity), stop.inflow_mass / inflow_rate
    time = steady + delay if steady > delay else 2 * math.sqrt(delay * steady)
    return time if stop.time is None else min(time, stop.time)


def _measured_rate(solver):
    """Point-steps per second of wall time with the gate closed: the best of some short spells."""
    for _ in range(WARM_UP_STEPS):
        solver.step()
    rates = []
    for _ in range(MEASURED_SPELLS):
        before, begin = solver.point_steps, clock.monotonic()
        while clock.monotonic() - begin < SECONDS_A_SPELL:
            solver.step()
        rates.append((solver.point_steps - before) / (clock.monotonic() - begin))
    return max(rates)
