"""A whole event: initial state, gate opens, records of interval means until the stop criterion."""

import time as clock
from dataclasses import dataclass

import numpy as np

from mpm.mesh import build_mesh
from mpm.solver import RunFailed, Solver
from mpm.variables import CLAMPS

STEPS_BETWEEN_CHECKS = 50
SECONDS_BETWEEN_REPORTS = 0.25


@dataclass(frozen=True)
class Record:
    """What happened in one output interval: means over it, and the state at its end.

    Pressures [Pa], compression positive; `lining` has one dict a tunnel with theta [degrees from the
    crown, clockwise], arc [m], soil_pressure (effective), water_pressure, soil_shear (clockwise
    traction on the lining) and the standard deviation of the first two within the interval.
    `balances` are those of :meth:`mpm.Solver.balances`.
    """

    time: float
    dt: float
    dt_limit: str
    steps: int
    lining: list
    inflow_mass: float
    flow_zone_area: float
    disturbed_area: float
    grain_mass: float
    suspended_fraction: float
    kinetic_energy: float
    max_velocity: float
    clamp_counts: dict
    balances: dict
    point_steps: int
    cpu_seconds: float
    points: dict | None


def simulate(scene, mesh=None, threads=None, progress=None):
    """Run a scene and yield one `Record` per output interval, the relaxed initial state first.

    Parameters
    ----------
    scene : mpm.scene.Scene
    mesh : mpm.mesh.Mesh or None
        Built from the scene when None.
    threads : int or None
    progress : callable or None
        Called a few times a second with a dict: stage, time, inflow_mass, dt, dt_limit,
        point_steps_per_second, step, residual.

    Raises
    ------
    RunFailed
        When a point becomes non-finite or the initial state does not settle; what was yielded stays valid.
    """
    solver = Solver(scene, mesh if mesh is not None else build_mesh(scene), threads)
    cpu_start = clock.process_time()

    def report_relaxation(step, residual):
        if progress is not None:
            progress({"stage": "relax", "step": step, "residual": residual, "time": 0.0, "inflow_mass": 0.0})

    steps, residual = solver.relax(report_relaxation)
    if residual > scene.numerics.relaxation_tolerance:
        raise RunFailed(
            f"the initial state did not settle: residual {residual:.2g} after {steps} steps, "
            f"tolerance {scene.numerics.relaxation_tolerance:.2g}; raise numerics.max_relaxation_steps",
            0.0,
            solver.mesh.nodes.mean(axis=0),
        )

    def record(duration, dt, limit, snapshot):
        return Record(
            time=solver.time,
            dt=dt,
            dt_limit=limit,
            steps=solver.step_count,
            lining=solver.lining_pressures(duration),
            clamp_counts=dict(zip(CLAMPS, solver.clamps.sum(axis=0).tolist(), strict=True)),
            balances=solver.balances(),
            point_steps=solver.point_steps,
            cpu_seconds=clock.process_time() - cpu_start,
            points=solver.points_by_name() if snapshot else None,
            **solver.measures(),
        )

    yield record(1.0, *solver.time_step_estimate(), True)
    solver.open_gate()
    stop, output = scene.stop, scene.output
    interval_index, last_report, next_snapshot = 0, clock.monotonic(), output.snapshot_interval or np.inf
    report_time, report_steps = clock.monotonic(), 0
    inflow = 0.0
    while True:
        interval_index += 1
        begin, end = solver.time, interval_index * output.interval
        if stop.time is not None:
            end = min(end, stop.time)
        solver.impulse[:] = 0.0
        count, limits, done = 0, {}, False
        while solver.time < end * (1 - 1e-12) and not done:
            _, limit = solver.step(end - solver.time)
            count += 1
            limits[limit] = limits.get(limit, 0) + 1
            if solver.step_count % STEPS_BETWEEN_CHECKS == 0:
                inflow = solver.inflow_mass()
                done = stop.inflow_mass is not None and inflow >= stop.inflow_mass
            now = clock.monotonic()
            if progress is not None and now - last_report > SECONDS_BETWEEN_REPORTS:
                rate = (solver.point_steps - report_steps) / (now - report_time)
                report_time, report_steps, last_report = now, solver.point_steps, now
                progress(
                    {
                        "stage": "gush",
                        "time": solver.time,
                        "inflow_mass": inflow,
                        "dt": (solver.time - begin) / count,
                        "dt_limit": limit,
                        "step": solver.step_count,
                        "point_steps_per_second": rate,
                    }
                )
        done = done or (stop.time is not None and solver.time >= stop.time * (1 - 1e-12))
        snapshot = done or solver.time >= next_snapshot * (1 - 1e-12)
        if snapshot:
            next_snapshot = solver.time + (output.snapshot_interval or np.inf)
        duration = solver.time - begin
        limits.pop("output", None) if len(limits) > 1 else None
        yield record(duration, duration / count, max(limits, key=limits.get), snapshot)
        if done:
            return
