"""A whole event: initial state, gate opens, records of interval means until the stop criterion."""

from __future__ import annotations

import json
import math
import time as clock
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mpm.errors import errors, largest_so_far
from mpm.fields import CLAMPS, values
from mpm.mesh.build import build_mesh
from mpm.solver import RunFailed, Solver
from mpm.state import restore_solver, solver_state
from mpm.time_step.clock import ALMOST_ALL

if TYPE_CHECKING:
    from mpm.mesh import Mesh
    from mpm.scene import Scene

STEPS_BETWEEN_CHECKS = 50
BEYOND_REASON = 5.0  # times the speed that weight and pressure can give: a run with such a point is unstable
SECONDS_BETWEEN_REPORTS = 0.25


@dataclass(frozen=True)
class Record:
    """What happened in one output interval: means over it, and the state at its end.

    `dt` and `steps` are those of the smallest elements. Pressures [Pa], compression positive; `lining` has one dict a
    tunnel with theta [degrees from the crown, clockwise], arc [m], soil_pressure (effective), water_pressure,
    soil_shear (clockwise traction on the lining) and the standard deviation of the first two within the interval;
    of a lining that moves also its displacement at the end, and of one that deforms its forces, at whole degrees
    (`mpm.walls.moving_lining.MovingLinings.motion_at`).
    `balances` are those of :meth:`mpm.Solver.balances`, `errors` those of :func:`mpm.errors.errors`.
    """

    time: float
    dt: float
    dt_limit: str
    steps: int
    lining: list = field(repr=False)
    inflow_mass: float
    flow_zone_area: float
    disturbed_area: float
    grain_mass: float
    suspended_fraction: float
    tip_fraction: float
    kinetic_energy: float
    max_velocity: float
    clamp_counts: dict = field(repr=False)
    balances: dict = field(repr=False)
    errors: dict = field(repr=False)
    point_steps: int
    cpu_seconds: float
    points: dict | None = field(repr=False)


def simulate(
    scene: Scene,
    mesh: Mesh | None = None,
    threads: int | None = None,
    progress: Callable[[dict[str, Any]], None] | None = None,
) -> Iterator[Record]:
    """Run a scene and yield one `Record` per output interval, the relaxed initial state first.

    Parameters and errors as of :class:`Simulation`.
    """
    simulation = Simulation(scene, mesh, threads, progress)
    yield simulation.begin()
    while not simulation.done:
        yield simulation.advance()


class Simulation:
    """An event that goes on interval by interval, and can be stored and continued between any two of its steps.

    Parameters
    ----------
    scene : mpm.scene.Scene
    mesh : mpm.mesh.Mesh or None
        Built from the scene when None.
    threads : int or None
    progress : callable or None
        Called a few times a second with a dict: stage, time, inflow_mass, dt, dt_limit, point_steps_per_second, step,
        share (of what the stop criterion asks for, by which the event is nearest to its end), residual.

    Attributes
    ----------
    done : bool
        Whether the stop criterion is reached and the last record returned.
    unborne_shear : float
        Share of the shear on the linings in the bonded initial state that friction does not bear, so that the ground
        slips along them before the gate opens [-]; known after `begin`, 0 where `initial_contact` is "frictional".
    """

    def __init__(
        self,
        scene: Scene,
        mesh: Mesh | None = None,
        threads: int | None = None,
        progress: Callable[[dict[str, Any]], None] | None = None,
    ) -> None:
        self.scene = scene
        self.solver = Solver(scene, mesh if mesh is not None else build_mesh(scene), threads)
        self.done, self.unborne_shear = False, 0.0
        self._cpu_begin = clock.process_time()
        self._interval, self._inside = 0, False  # number of the interval at hand; whether it has begun
        self._reached = False  # whether the last interval is at hand
        self._begin, self._begin_substeps, self._limits = 0.0, 0, {}
        self._next_snapshot = scene.output.snapshot_interval or np.inf
        self._inflow, self._checked = 0.0, -STEPS_BETWEEN_CHECKS  # kg/m, and when
        self._near = False  # whether the inflow may reach its stop before it is checked again
        self._largest = {}  # departures and amounts of the balances at the records so far
        self._progress = progress
        self._last_report = clock.monotonic(), 0

    def begin(self) -> Record:
        """Settle the initial state, open the gate, and return the `Record` of the state before that.

        Raises
        ------
        RunFailed
            When the initial state does not settle.
        """
        solver, numerics = self.solver, self.scene.numerics

        def report(step, residual):
            if self._progress is not None:
                self._progress({"stage": "relax", "step": step, "residual": residual, "time": 0.0, "inflow_mass": 0.0})

        steps, residual = solver.relax(report)
        if self.scene.initial_contact == "bonded" and residual <= numerics.relaxation_tolerance:
            self.unborne_shear = solver.unborne_shear()
            if self.unborne_shear > 0:
                steps, residual = solver.let_slip(report)
        if residual > numerics.relaxation_tolerance:
            raise RunFailed(
                f"the initial state did not settle: residual {residual:.2g} after {steps} steps, "
                f"tolerance {numerics.relaxation_tolerance:.2g}; raise numerics.max_relaxation_steps",
                0.0,
                solver.mesh.nodes.mean(axis=0),
            )
        record = self._record(1.0, *solver.time_step_estimate(), True)
        solver.open_gate()
        self._last_report = clock.monotonic(), solver.point_steps
        return record

    def advance(self, pause: Callable[[], bool] | None = None) -> Record | None:
        """Step to the end of the interval at hand and return its `Record`, or None where `pause` asked to stop.

        Parameters
        ----------
        pause : callable or None
            Asked after every step; when it returns True the state can be stored, and `advance` called again.

        Raises
        ------
        RunFailed
            When a point becomes non-finite, or faster than weight and pressure can make it; what was returned stays
            valid.
        """
        solver, stop, output = self.solver, self.scene.stop, self.scene.output
        if not self._inside:
            self._interval += 1
            self._begin, self._begin_substeps, self._limits, self._inside = solver.time, solver.step_count, {}, True
            solver.impulse[:] = 0.0
        end = self._interval * output.interval
        if stop.time is not None:
            end = min(end, stop.time)
        while solver.time < end * ALMOST_ALL and not self._reached:
            if solver.step_count - self._checked >= STEPS_BETWEEN_CHECKS:
                self._check()
            to, most = (
                (self._step_to(end), solver.step_count + 1)
                if self._near
                else (end, self._checked + STEPS_BETWEEN_CHECKS)
            )
            for limit in solver.advance(to, most - solver.step_count):
                self._limits[limit] = self._limits.get(limit, 0) + 1
            if self._near:
                self._inflow = solver.inflow_mass()
                self._reached = self._inflow >= stop.inflow_mass
            self._report(limit)
            if pause is not None and pause():
                return None
        self.done = self._reached or (stop.time is not None and solver.time >= stop.time * ALMOST_ALL)
        snapshot = self.done or solver.time >= self._next_snapshot * ALMOST_ALL
        if snapshot:
            self._next_snapshot = solver.time + (output.snapshot_interval or np.inf)
        self._inside = False
        duration, count = solver.time - self._begin, solver.step_count - self._begin_substeps
        limits = {name: steps for name, steps in self._limits.items() if name != "output"} or self._limits
        return self._record(duration, duration / count, max(limits, key=limits.get), snapshot)

    def _step_to(self, end):
        """The time [s] that the next step of all levels may lead to, so that a short one passes the inflow's stop."""
        solver, target = self.solver, self.scene.stop.inflow_mass
        shortest, longest = self._steps_of_levels()
        duration = min(end - solver.time, longest)
        while duration > shortest and solver.inflow_mass(duration) >= target:
            duration = max(duration / 2, shortest)
            end = solver.time + duration
        return end

    def _steps_of_levels(self):
        """Time step of the smallest elements, and the longest step of all levels [s]."""
        shortest = self.solver.time_step_estimate()[0]
        return shortest, shortest * 2 ** (self.solver.levels.count - 1)

    def _check(self):
        solver, target = self.solver, self.scene.stop.inflow_mass
        shortest, longest = self._steps_of_levels()
        self._checked, self._inflow = solver.step_count, solver.inflow_mass()
        ahead = STEPS_BETWEEN_CHECKS * shortest + longest
        self._near = target is not None and solver.inflow_mass(ahead) >= target
        self._refuse_the_impossible()

    def _refuse_the_impossible(self):
        """Stop a run with a point several times faster than the weight of all grains makes water that it presses out.

        An unstable run would go on for hours in ever shorter steps.
        """
        solver, scene = self.solver, self.scene
        densest = max(soil.grain_density for soil in scene.soils)
        lightest = scene.water.density if scene.water is not None else densest
        possible = math.sqrt(2 * scene.gravity * scene.box.depth * (1 + densest / lightest))
        if not 0 < BEYOND_REASON * possible < solver.speed_at_limit:
            return
        speeds = np.maximum(solver.speeds("solid"), solver.speeds("liquid")) * (solver.element_of_point >= 0)
        fastest = int(speeds.argmax())
        raise RunFailed(
            f"a material point moves at {speeds[fastest]:.0f} m/s, where weight and pressure give at most "
            f"{possible:.0f}: the computation is unstable; try numerics.courant = 0.4 or more points_per_element",
            solver.time,
            values(solver.points[fastest], ("x", "y")),
        )

    def state(self) -> dict[str, Any]:
        """All that decides how the simulation goes on, and its processor time so far.

        Returns
        -------
        dict of str to array, float, int, bool or str
            The arrays are the solver's own: store them before the next step.
        """
        return {
            **solver_state(self.solver),
            "interval": self._interval,
            "inside_interval": self._inside,
            "interval_begin": self._begin,
            "interval_begin_substeps": self._begin_substeps,
            "interval_limits": json.dumps(self._limits),  # in the order met, which decides between equals
            "next_snapshot": self._next_snapshot,
            "inflow_mass": self._inflow,
            "checked": self._checked,
            "near": self._near,
            "reached": self._reached,
            "largest": json.dumps(self._largest),
            "unborne_shear": self.unborne_shear,
            "done": self.done,
            "cpu_seconds": self.cpu_seconds,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state` of the same scene and mesh, in place of `begin`: the same bits from here on.

        Raises
        ------
        ValueError
            When the state is that of another scene or mesh.
        """
        restore_solver(self.solver, state)
        self._interval, self._inside = int(state["interval"]), bool(state["inside_interval"])
        self._begin, self._limits = float(state["interval_begin"]), json.loads(state["interval_limits"])
        self._begin_substeps = int(state["interval_begin_substeps"])
        self._next_snapshot, self._inflow = float(state["next_snapshot"]), float(state["inflow_mass"])
        self._checked, self._near = int(state["checked"]), bool(state.get("near", True))
        self._reached, self.done = bool(state["reached"]), bool(state["done"])
        self._largest = json.loads(state["largest"])
        self.unborne_shear = float(state.get("unborne_shear", 0.0))
        self._cpu_begin = clock.process_time() - float(state["cpu_seconds"])
        self._last_report = clock.monotonic(), self.solver.point_steps

    @property
    def cpu_seconds(self) -> float:
        """Processor time of the simulation, that before it was restored included [s]."""
        return clock.process_time() - self._cpu_begin

    def _record(self, duration, dt, limit, snapshot):
        solver = self.solver
        balances = solver.balances()
        self._largest = largest_so_far(self._largest, balances)
        return Record(
            time=solver.time,
            dt=dt,
            dt_limit=limit,
            steps=solver.step_count,
            lining=solver.lining_pressures(duration),
            clamp_counts={name: int(solver.clamps[name].sum()) for name in CLAMPS},
            balances=balances,
            errors=errors(self._largest),
            point_steps=solver.point_steps,
            cpu_seconds=self.cpu_seconds,
            points=solver.points_by_name() if snapshot and self.scene.output.points else None,
            **solver.measures(),
        )

    def _report(self, limit):
        now, (last, point_steps) = clock.monotonic(), self._last_report
        if self._progress is None or now - last <= SECONDS_BETWEEN_REPORTS:
            return
        self._last_report = now, self.solver.point_steps
        self._progress(
            {
                "stage": "gush",
                "time": self.solver.time,
                "inflow_mass": self._inflow,
                "dt": (self.solver.time - self._begin) / (self.solver.step_count - self._begin_substeps),
                "dt_limit": limit,
                "step": self.solver.step_count,
                "share": self._share(),
                "point_steps_per_second": (self.solver.point_steps - point_steps) / (now - last),
            }
        )

    def _share(self):
        stop = self.scene.stop
        pairs = ((self.solver.time, stop.time), (self._inflow, stop.inflow_mass))
        return max(done / target for done, target in pairs if target is not None)
