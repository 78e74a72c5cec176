"""The two-phase solver: arrays, threads, and a step that reads as the algorithm."""

import math
import os
from concurrent.futures import wait
from contextlib import contextmanager

import numpy as np

from mpm import relaxation
from mpm.fields import (
    CLAMP_RECORD,
    CONTENT_RECORD,
    LEDGER_RECORD,
    MOMENTUM_RECORD,
    NODE_RECORD,
    REACTION_RECORD,
    SUM_RECORD,
    TIED_RECORD,
    values,
)
from mpm.laws.law import laws_of, soil_table
from mpm.machine.threads import Threads, check_threads
from mpm.measures import Measures
from mpm.mesh.half import right_half
from mpm.points import extremes_kernel, fill
from mpm.scene import check_scene
from mpm.step.cells import fill_cells
from mpm.step.sort import cut_by_work, sort_by_element
from mpm.step.substep import (
    ACTIVE,
    LARGEST_COURANT,
    OCCUPIED,
    PLAN,
    POINT_STEPS,
    REMOVED_MASS,
    SOLVE,
    SUBSTEPS,
    SUSPENDED,
    UPDATE,
    Batch,
    long_step_kernel,
)
from mpm.step.system import Cuts, Ground, Layout, Medium, Needs, Net, System, Tally, Walls
from mpm.tables import element_geometry, element_neighbours, outflow_nodes
from mpm.time_step.clock import END, LIMITS, NOW, ORIGIN, SPAN, Clock, Pace, longest_time_step
from mpm.time_step.levels import element_levels, sorted_by_level, tie
from mpm.time_step.spectrum import Spectrum, spectral_time_step
from mpm.time_step.wave_speed import dry_wave_speed, fast_wave_speed
from mpm.walls.gate import open_corners, shut_corners
from mpm.walls.moving_lining import LiningLost, MovingLinings
from mpm.walls.nodes import contact_nodes, nodes_of_moving_linings
from mpm.walls.sides import sides_of

PARTS = 4  # parts of the mesh that sum at the nodes on their own: fixed, so the bits do not depend on threads
STEPS_BETWEEN_SORTS = 100
# Long steps between spectra, each of which costs about half a dozen: soon again where the critical step has fallen, as
# when points have left the places they began in.
FEWEST_BETWEEN_SPECTRA, MOST_BETWEEN_SPECTRA, MOST_BETWEEN_SPECTRA_OF_LEVELS = 5, 200, 25
MOST_AT_ONCE = 2_000_000  # point-steps after which compiled code comes back: some tenth of a second
# Of the spectral step over that of the altitude. Beyond, a few points resist nothing where they are: no estimate.
MOST_OVER_ALTITUDE = 4.0
LEAST_BEYOND = 1e-3  # of the soil pressure, by which shear must exceed friction to count: more than relaxation leaves
SMALLEST_PARALLEL = 4000  # elements; below it a second thread costs more than it brings


class RunFailed(RuntimeError):
    """A run that went wrong: `cause`, simulated `time` [s] and `place` (x, y) [m] of the first bad point."""

    def __init__(self, cause, time, place):
        self.cause, self.time, self.place = cause, time, place
        super().__init__(f"{cause} at t = {time:.6g} s, x = {place[0]:.3f} m, y = {place[1]:.3f} m")


def cores():
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


def threads_used(elements, asked=None):
    """Number of threads that a mesh of so many elements is computed by, of those asked for (None: all cores)."""
    return 1 if elements < SMALLEST_PARALLEL else max(1, min(asked or cores(), PARTS))


class Solver(Measures):
    """Two-phase MPM on a body-fitted triangle mesh; linings are held or move (`mpm.walls.moving_lining`).

    Parameters
    ----------
    scene : mpm.scene.Scene
    mesh : mpm.mesh.Mesh
        Of the whole scene, also for a half model.
    threads : int or None
        Threads of the kernels; the result has the same bits for any number. None: all cores.
    """

    def __init__(self, scene, mesh, threads=None):
        check_threads(threads)
        check_scene(scene)
        if scene.is_half:
            mesh = right_half(mesh)
        self.copies = 2 if scene.is_half else 1  # of what is computed, in the whole
        self.scene = scene
        mesh = self.mesh = self._cut_into_levels(mesh)
        self.points, self.element_of_point, self.soil_of_point = fill(mesh, scene)
        self.soils = soil_table(scene)
        self.parts = PARTS
        self._choose_kernels()
        m, n = len(mesh.elements), len(mesh.nodes)
        n_rows = len(self.levels.of_row)
        self.neighbours = element_neighbours(mesh, outflow_nodes(scene, mesh))
        self.mirror_line = mesh.left if scene.is_half else mesh.left[:0]
        self.fixed, self.sides = sides_of(scene, mesh, self.mirror_line)
        self._build_contact()
        self._layout = Layout(*(getattr(self.levels, name) for name in Layout._fields))
        self._cuts = Cuts(*np.zeros((3, self.levels.count, PARTS + 1), np.int64))
        self._counts, self._measures = np.zeros(5, np.int64), np.zeros(2)
        self._limits = np.zeros((2 * PARTS, 2))
        self._suspended, self._bad, self._n_left, self._first_left = np.zeros((4, PARTS), np.int64)
        self.start = np.zeros(m + 1, np.int32)
        self.order = np.zeros(len(self.points), np.int32)
        self.occupied = np.zeros(m, np.int32)
        self.touched = np.ones((PARTS, n_rows), np.uint8)  # which rows the parts may have added to
        self.sums = np.zeros((PARTS, n_rows), SUM_RECORD)
        self.momenta = np.zeros((PARTS, n_rows), MOMENTUM_RECORD)
        self.nodes = np.zeros(n_rows, NODE_RECORD)
        self.tied_means = np.zeros(n_rows - n, TIED_RECORD)
        self.status = np.zeros(n, np.int8)
        self._empty = np.zeros(1, SUM_RECORD), np.zeros(1, MOMENTUM_RECORD)
        self.contents = np.zeros(m, CONTENT_RECORD)
        self.clock = Clock.of(self.levels, float(scene.numerics.stress_damping))
        self.threads = threads_used(m, threads)
        self.workers = Threads(self.threads, PARTS + 1)
        self.clamps = np.zeros(PARTS, CLAMP_RECORD)
        self.ledger = np.zeros(PARTS, LEDGER_RECORD)
        self.largest_courant = 0.0
        self.time, self.long_step_count, self.step_count, self.point_steps = 0.0, 0, 0, 0
        self.initial_volume = self._volumes()
        self.initial_grain_mass = float(np.sum(self.points["grain_mass"]))
        self.initial = self.sums_over_points()
        self._spare = self.order.copy()
        # points that left their element, and that element
        self._left = np.zeros((2, len(self.points)), np.int32)
        self._spectrum, self.longest_step, self.mode = None, math.inf, None  # and the spectral step [s] and its mode
        self.estimate_interval, self.next_estimate = STEPS_BETWEEN_SORTS, 0  # long steps between estimates of the step
        self._sort()
        self._update_wave_speed()
        self._mapped = False  # whether `sums` holds the points as they are
        self.removed_mass = 0.0
        self.suspended = 0
        self.gate_open = False

    # -- set-up ---------------------------------------------------------------------------------

    def _cut_into_levels(self, mesh):
        """Sort the elements by level, finest first, and tie the levels; one level without local time stepping."""
        altitude = element_geometry(mesh)["altitude"]
        level = np.zeros(len(altitude), np.int8)
        if self.scene.numerics.local_time_stepping:
            weight = np.full(len(altitude), float(self.scene.discretisation.points_per_element))
            level = element_levels(
                mesh.elements, len(mesh.nodes), altitude, weight, nodes_of_moving_linings(self.scene, mesh)
            )
        mesh, level = sorted_by_level(mesh, level)
        self.levels = tie(mesh.elements, len(mesh.nodes), level)
        self.geometry = element_geometry(mesh)
        self._altitude = self.geometry["altitude"] / 2.0**level  # in steps of level 0
        return mesh

    def _choose_kernels(self):
        """Kernels compiled for what the scene has, and nothing else."""
        scene = self.scene
        wet = scene.water is not None
        self.needs = Needs(
            wet=wet,
            two_phase=scene.is_two_phase,
            tied=self.levels.count > 1,
            moving=any(scene.lining_of(tunnel) != "fixed" for tunnel in scene.tunnels),
            laws=laws_of(scene),
        )
        self._long_step = long_step_kernel(self.needs)
        self._extremes_of_soils = extremes_kernel(self.needs.laws)
        self._water_density = scene.water.density if wet else 0.0
        self._water_modulus = scene.water.bulk_modulus if wet else 0.0

    def _build_contact(self):
        mesh, scene = self.mesh, self.scene
        contact = contact_nodes(scene, mesh)
        self.n_contact = len(contact.node)
        self.contact_of_node = np.full(len(mesh.nodes), -1, np.int32)
        self.contact_of_node[contact.node] = np.arange(self.n_contact, dtype=np.int32)
        self.contact, self._contact_open = contact.closed, contact.open
        self._contact_closed = self.contact
        self.lining = contact.lining
        on_mirror_line = np.isin(contact.node, self.mirror_line)
        for records in (self.contact, self._contact_open):
            records["normal_x"][on_mirror_line] = 0.0
        self.impulse = np.zeros(self.n_contact, REACTION_RECORD)
        self.moving, self.wall = None, np.zeros((self.n_contact, 2))
        self.lining_displacement = self.lining_velocity = self.lining_impulse = self.joint_memory = np.zeros(0)
        if self.needs.moving:
            self.moving = moving = MovingLinings(scene, self.needs, mesh, self.contact_of_node, contact.moved_by)
            self.wall = moving.wall
            self.lining_displacement, self.lining_velocity = moving.displacement, moving.velocity
            self.lining_impulse, self.joint_memory = moving.left, moving.memory

    def _sort(self):
        self.n_occupied, self.n_active = sort_by_element(
            self.element_of_point, len(self.mesh.elements), self.start, self.order, self.occupied
        )
        cut_by_work(self.start, self.occupied, self.n_occupied, self._layout, self.levels.count, self._cuts)

    def _sort_physically(self):
        inside = self.order[: self.n_active]
        outside = np.flatnonzero(self.element_of_point < 0)
        new = np.concatenate([inside, outside])
        self.points[:] = self.points[new]
        self.element_of_point = self.element_of_point[new]
        self.soil_of_point = self.soil_of_point[new]
        self.initial_volume = self.initial_volume[new]
        self._sort()

    def extremes_of_soils(self):
        """Smallest and largest porosity, largest constrained modulus [Pa] of each soil's points: (n_soils, 3)."""
        return self._extremes_of_soils(self.ground)

    def _update_wave_speed(self):
        speeds = []
        for soil, (tightest, loosest, modulus) in zip(self.scene.soils, self.extremes_of_soils().tolist(), strict=True):
            if tightest > loosest:  # no point left
                continue
            if self.scene.water is None:
                speeds.append(dry_wave_speed(modulus, min(loosest, soil.loose_porosity), soil.grain_density))
            else:
                speeds.append(
                    fast_wave_speed(modulus, self._water_modulus, tightest, soil.grain_density, self._water_density)
                )
        self.wave_speed = self.limit_speed = max(speeds)
        if self.scene.numerics.critical_step == "spectral" and self.n_occupied:
            held = self.occupied[: self.n_occupied]
            shortest = float(self._altitude[held].min())
            certain = 0.5 * shortest / self.wave_speed if self.mode is None else 0.8 * self.longest_step
            if self._spectrum is None:
                self._spectrum = Spectrum(self)
            step, self.mode = spectral_time_step(self._spectrum.of_state(), certain, self.mode)
            if step > MOST_OVER_ALTITUDE * shortest / self.wave_speed:
                step = 0.5 * shortest / self.wave_speed
            most = MOST_BETWEEN_SPECTRA if self.levels.count == 1 else MOST_BETWEEN_SPECTRA_OF_LEVELS
            fallen = step < 0.9 * self.longest_step
            self.estimate_interval = FEWEST_BETWEEN_SPECTRA if fallen else min(2 * self.estimate_interval, most)
            self.limit_speed = shortest / step
            self.longest_step = step
        self.next_estimate = self.long_step_count + self.estimate_interval

    # -- stages ---------------------------------------------------------------------------------

    def time_step_estimate(self):
        """Time step of the smallest elements that hold points [s] and the name of what limits it."""
        if not self._mapped:
            self.map_points()
        dt, limit = longest_time_step(self._limits, self._pace)
        return dt * self._finest_step, LIMITS[limit]

    @property
    def speed_at_limit(self):
        """Largest speed of the points in the elements that limit the time step, one a part of the mesh [m/s]."""
        return float(self._limits[:, 1].max())

    @property
    def _pace(self):
        numerics = self.scene.numerics
        return Pace(
            float(numerics.courant), float(numerics.pic_rate), float(numerics.pressure_filter),
            float(self.longest_step), float(self.limit_speed),
        )  # fmt: skip

    @property
    def _finest_step(self):
        """Steps of level 0 in one of the finest level that holds points."""
        return 2.0 ** int(self.levels.of_element[self.occupied[0]]) if self.n_occupied else 1.0

    def map_points(self):
        """Sum the points at the nodes without advancing anything; sets the limits of the time step."""
        inside = self.element_of_point >= 0
        element, volume, points = self.element_of_point[inside], self._volumes()[inside], self.points[inside]
        pressure = np.maximum(points["pore_pressure"], 0.0)
        for name, weight in {"volume": 1.0, "pressure": pressure, "x": points["x"], "y": points["y"]}.items():
            self.contents[name] = np.bincount(element, volume * weight, len(self.contents))
        fill_cells(self.geometry, self.contents)
        self.sums[:] = 0.0
        self.clock.map_only()
        self._run(UPDATE, UPDATE, advance=False)
        self._mapped = True

    def relax(self, progress=None):
        """Drained initial equilibrium by `initial_contact`; returns (steps, residual), leaves reactions in `impulse`.

        Bonded ground may ask for more shear than friction bears (`unborne_shear`), which `let_slip` takes away.
        """
        bonded = self.scene.initial_contact == "bonded"
        friction = self.contact["friction"]
        return self._relax(np.full_like(friction, np.inf) if bonded else friction, progress)

    def unborne_shear(self):
        """Share of the shear on the linings in the initial equilibrium that is beyond their friction [-]."""
        beyond = total = 0.0
        for part, tunnel in zip(self.lining_pressures(1.0), self.scene.tunnels, strict=True):
            arc, pressure, shear = part["arc"], part["soil_pressure"], np.abs(part["soil_shear"])
            excess = shear - tunnel.friction_coefficient * pressure
            beyond += np.sum(arc * np.where(excess > LEAST_BEYOND * pressure, excess, 0.0))
            total += np.sum(arc * shear)
        return float(beyond / total) if beyond > 0.0 else 0.0

    def let_slip(self, progress=None):
        """Settle the equilibrium at hand once more, with the lining's friction instead of a bond; as `relax`."""
        return self._relax(self.contact["friction"], progress)

    def _relax(self, friction, progress):
        numerics = self.scene.numerics
        with self._linings_followed():
            steps, residual, self.impulse[:] = relaxation.relax(
                self, friction, numerics.relaxation_tolerance, numerics.max_relaxation_steps, progress
            )
        self._mapped = False
        for name in ("soil", "water"):
            self.impulse[f"{name}_squared"] = self.impulse[name] ** 2
        return steps, residual

    def open_gate(self):
        """Take the plug away: the opening is free, its corners stand still or belong to the channel walls.

        Without a gate in the scene the lining stays whole.
        """
        self.contact = self._contact_open
        open_corners(self.scene, self.mesh, self.fixed)
        self.gate_open = True

    def close_gate(self):
        """Put the plug back: what is in the channel stays there, and nothing follows through the face."""
        self.contact = self._contact_closed
        shut_corners(self.mesh, self.fixed)
        self.gate_open = False

    def step(self, dt_max=math.inf):
        """Advance by one step of the coarsest level, not longer than dt_max [s]; returns (dt, name of its limit)."""
        (limit,) = self._long_steps(self.time, 0.0, dt_max, 1, 1)
        return float(self.clock.times[SPAN]), limit

    def advance(self, end, most_substeps=math.inf):
        """Step towards the time `end` [s] until it is reached, or for about a tenth of a second by the clock.

        Parameters
        ----------
        end : float
            Absolute simulated time [s], above `time`.
        most_substeps : int
            No further step of the coarsest level begins after so many of the finest.

        Returns
        -------
        list of str
            What limited each step of the coarsest level. How many are done at once does not change a bit of them.
        """
        most = min(
            STEPS_BETWEEN_SORTS - self.long_step_count % STEPS_BETWEEN_SORTS, self.next_estimate - self.long_step_count
        )
        return self._long_steps(0.0, self.time, end, max(most, 1), most_substeps)

    def _long_steps(self, origin, now, end, most, most_substeps):
        times = self.clock.times
        times[ORIGIN], times[NOW], times[END] = origin, now, end
        if not self._mapped:
            self.map_points()
        batch = Batch(
            np.zeros(most + 1, np.int64), np.zeros(most, np.int64), int(min(most_substeps, MOST_AT_ONCE)), MOST_AT_ONCE
        )
        try:
            self._advance(batch)
        finally:
            self.time = self.clock.time
        done = int(np.count_nonzero(batch.substeps))
        self.long_step_count += done
        if self.long_step_count % STEPS_BETWEEN_SORTS == 0:
            self._sort_physically()
        if self.long_step_count >= self.next_estimate:
            self._update_wave_speed()
        return [LIMITS[k] for k in batch.limits[:done].tolist()]

    @property
    def ground(self):
        """Points by element, and the soils."""
        return Ground(
            self.occupied, self.start, self.order, self.points, self.element_of_point, self.soil_of_point, self.soils
        )

    @property
    def medium(self):
        """Gravity and water."""
        return Medium(self.scene.gravity, self._water_density, self._water_modulus)

    def system(self):
        """The arrays and numbers that the kernels of a step read and write, as they are now."""
        levels = self.levels
        return System(
            self.ground,
            Net(
                levels.rows, self.geometry, self.neighbours, levels.of_element, self._layout,
                self.contents, levels.nodes, levels.next_row, levels.of_row, self.nodes, self.tied_means, self.status,
                self.touched, self.sums, self.momenta, *self._empty,
            ),
            Walls(self.fixed, self.sides, self.contact_of_node, self.contact, self.wall, self.impulse),
            self._cuts, self.clock, self._pace, self.medium,
            Tally(
                self._counts, self._measures, self._limits, self._suspended, self._bad, self._n_left,
                self._first_left, self.clamps, self.ledger, *self._left, self._spare,
            ),
        )  # fmt: skip

    def _advance(self, batch):
        """All passes of long steps."""
        if self.moving is None:
            self._run(PLAN, UPDATE, batch)
            return
        self._run(PLAN, PLAN, batch)
        substeps = batch.substeps[0]
        for k in range(substeps):
            with self._linings_followed():
                self.moving.advance(self.system(), float(self.clock.dt_of_level[0]))  # that of all nodes on them
            self._run(SOLVE, UPDATE, Batch.one_substep(k, substeps))
        with self._linings_followed():
            self.moving.check()

    @contextmanager
    def _linings_followed(self):
        """Say where and when a moving lining can not be followed any further."""
        try:
            yield
        except LiningLost as problem:
            raise RunFailed(
                str(problem), self.clock.time, self.mesh.nodes[self.mesh.outer_nodes[problem.tunnel]].mean(axis=0)
            ) from problem

    def _run(self, first_pass, last_pass, batch=None, advance=True):
        """Some passes (`mpm.step.substep.PASSES`) of all substeps, by all threads; None: of a long step planned."""
        if batch is None:
            substeps = self.clock.periods[-1] if advance else 1
            batch = Batch(np.array([substeps, 0]), np.zeros(0, np.int64), 0, 0)
        counts = self._counts
        counts[:] = self.n_occupied, self.n_active, self.suspended, 0, 0
        self._measures[:] = self.largest_courant, self.removed_mass
        self._bad[:] = -1
        others = self.workers.together(self._long_step, first_pass, last_pass, advance, batch, self.system())
        self.n_occupied, self.n_active, self.suspended = (int(counts[k]) for k in (OCCUPIED, ACTIVE, SUSPENDED))
        self.largest_courant = float(self._measures[LARGEST_COURANT])
        self.removed_mass = float(self._measures[REMOVED_MASS])
        bad = self._bad.max()
        if bad >= 0:
            wait(others)
            raise RunFailed(
                "a material point became non-finite (velocity, stress or pore pressure)",
                self.clock.time,
                values(self.points[bad], ("x", "y")),
            )
        if advance:
            self.step_count += int(counts[SUBSTEPS])
            self.point_steps += int(counts[POINT_STEPS])
