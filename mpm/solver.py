"""The two-phase solver: arrays, threads, and a step that reads as the algorithm."""

import math
import os
from concurrent.futures import ThreadPoolExecutor, wait

import numpy as np

from mpm import stages
from mpm.contact import (
    FIXED_X,
    FIXED_Y,
    MIRROR_X,
    one_velocity_kernel,
    remap_kernel,
    solve_nodes,
)
from mpm.contact_nodes import contact_nodes
from mpm.half_model import right_half, with_mirrored_points
from mpm.levels import element_levels, sorted_by_level, tie
from mpm.long_step import (
    ACTIVE,
    BAD,
    FOLLOW,
    LARGEST_COURANT,
    OCCUPIED,
    POINT_STEPS,
    RATES,
    REMOVED_MASS,
    SOLVE,
    SUBSTEPS,
    SUSPENDED,
    Clock,
    Cuts,
    Ground,
    Medium,
    Net,
    Tally,
    Walls,
    long_step_kernel,
)
from mpm.meeting import meeting_width
from mpm.points import cut_by_points, fill, initial_stress, relocate_kernel, sort_by_element
from mpm.spectrum import spectral_time_step
from mpm.tables import element_geometry, element_neighbours, outflow_nodes, soil_table
from mpm.time_step import critical_time_step, dry_wave_speed, fast_wave_speed
from mpm.transfer import advance_kernel, rates_kernel, update_kernel
from mpm.variables import (
    BUFFER_WIDTH,
    CLAMPS,
    LEDGER,
    MASS,
    NODAL_MEANS,
    NODAL_MOMENTA,
    NODE_WIDTH,
    POINT_VARIABLES,
    RATE_WIDTH,
    S_G,
    S_LAMBDA,
    V_P,
    VLX,
    VLY,
    VSX,
    VSY,
    X0,
    Y0,
    N,
    P,
    X,
    Y,
)
from mpm.wall import MovingLinings

PARTS = 2  # parts of the mesh that sum at the nodes on their own: fixed, so the bits do not depend on threads
STEPS_BETWEEN_SORTS = 100
# Long steps between spectra, each of which costs about half a dozen: soon again where the critical step has fallen, as
# when points have left the places they began in.
FEWEST_BETWEEN_SPECTRA, MOST_BETWEEN_SPECTRA, MOST_BETWEEN_SPECTRA_OF_LEVELS = 5, 200, 25
ALMOST = 1.1  # a step shortened by less to meet an output time counts as limited by what limited it before
# Of the spectral step over that of the altitude. Beyond, a few points resist nothing where they are: no estimate.
MOST_OVER_ALTITUDE = 4.0
LEAST_OVER_ALTITUDE = 1e-3  # without remapping a node that a point hardly touches takes less: the run would stand still
SMALLEST_PARALLEL = 4000  # elements; below it a second thread costs more than it brings


class RunFailed(RuntimeError):
    """A run that went wrong: `cause`, simulated `time` [s] and `place` (x, y) [m] of the first bad point."""

    def __init__(self, cause, time, place):
        self.cause, self.time, self.place = cause, time, place
        super().__init__(f"{cause} at t = {time:.6g} s, x = {place[0]:.3f} m, y = {place[1]:.3f} m")


class Solver:
    """Two-phase MPM on a body-fitted triangle mesh; linings are held or move (`mpm.wall`).

    Parameters
    ----------
    scene : mpm.scene.Scene
    mesh : mpm.mesh.Mesh
        Of the whole scene, also for a half model.
    threads : int or None
        Threads of the kernels; the result has the same bits for any number. None: all cores.
    """

    def __init__(self, scene, mesh, threads=None):
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
        self.fixed = np.zeros(n, np.int8)
        self.fixed[mesh.left] |= FIXED_X
        self.fixed[mesh.right] |= FIXED_X
        self.fixed[mesh.bottom] |= FIXED_X | FIXED_Y
        self.mirror_line = mesh.left if scene.is_half else mesh.left[:0]
        self.fixed[self.mirror_line] |= MIRROR_X
        mirrored = np.isin(self.levels.node_of_row, self.mirror_line)
        self._mirrored = mirrored if scene.is_half else mirrored[:0]
        self._build_contact()
        cuts = np.zeros((self.levels.count, PARTS + 1), np.int64)
        self._cuts = Cuts(cuts, _cut_evenly(self.levels.node_cuts), _cut_evenly(self.levels.row_cuts))
        self._meeting, self._counts, self._measures = (
            np.zeros(meeting_width(PARTS), np.int64),
            np.zeros(6, np.int64),
            np.zeros(2),
        )
        self._limits, self._found = np.zeros((PARTS + 1, 2)), np.zeros((3, PARTS), np.int64)
        self._used = np.zeros(0, np.int64)  # processor time of the passes: not measured
        self.start = np.zeros(m + 1, np.int32)
        self.order = np.zeros(len(self.points), np.int32)
        self.occupied = np.zeros(m, np.int32)
        self.sums = np.zeros((PARTS, n_rows, BUFFER_WIDTH))
        self.momenta = np.zeros((PARTS, n_rows, NODAL_MOMENTA))
        self.nodal_means = np.zeros((PARTS, n_rows, NODAL_MEANS))
        self.nodes = np.zeros((n_rows, NODE_WIDTH))
        self.tied_means = np.zeros((n_rows - n, 6))
        self.status = np.zeros(n, np.int8)
        self.rates = np.zeros((m, RATE_WIDTH))
        self.volume = np.zeros((m, 2))
        self.fill = np.zeros(n_rows)
        self.ahead, self._periods = np.zeros(m), np.ones(self.levels.count, np.int64)  # equal steps: nothing runs ahead
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
        self.threads = 1 if m < SMALLEST_PARALLEL else max(1, min(threads or cores, PARTS))
        self._pool = ThreadPoolExecutor(self.threads - 1) if self.threads > 1 else None
        self.clamps = np.zeros((PARTS, len(CLAMPS)), np.int64)
        self.ledger = np.zeros((PARTS, len(LEDGER)))
        self.largest_courant = 0.0
        self.time, self.long_step_count, self.step_count, self.point_steps = 0.0, 0, 0, 0
        self.initial_volume = self._volumes()
        self.initial_grain_mass = float(np.sum(self.points[:, MASS]))
        self.initial = self.sums_over_points()
        self._spare = self.start.copy(), self.order.copy()
        self._left = np.zeros((PARTS, len(self.points)), np.int32)
        self._moved = np.zeros(len(self.points), np.int32), np.zeros(len(self.points), np.int32)
        self.longest_step, self.mode = math.inf, None  # spectral step [s] and its mode
        self.estimate_interval, self.next_estimate = STEPS_BETWEEN_SORTS, 0  # long steps between estimates of the step
        self._sort()
        self._update_wave_speed()
        # the projection of the initial pore pressure: hydrostatic, exact for linear functions
        _, pressure = initial_stress(scene, -mesh.nodes[:, 1])
        self.set_projected_pressure(pressure)
        self._mapped = False  # whether `sums` holds the points as they are
        self.removed_mass = 0.0
        self.suspended = 0
        self.gate_open = False

    # -- set-up ---------------------------------------------------------------------------------

    def _cut_into_levels(self, mesh):
        """Sort the elements by level, finest first, and tie the levels; one level without local time stepping."""
        altitude = element_geometry(mesh)[:, 7]
        level = np.zeros(len(altitude), np.int8)
        # a lining that moves is solved together with all nodes on it, which then step together
        held = all(self.scene.lining_of(tunnel) == "fixed" for tunnel in self.scene.tunnels)
        if self.scene.numerics.local_time_stepping and held:
            weight = np.full(len(altitude), float(self.scene.discretisation.points_per_element))
            level = element_levels(mesh.elements, len(mesh.nodes), altitude, weight)
        mesh, level = sorted_by_level(mesh, level)
        self.levels = tie(mesh.elements, len(mesh.nodes), level)
        self.geometry = element_geometry(mesh)
        return mesh

    def set_projected_pressure(self, pressure):
        """Start the projection of the pore pressure from values at the nodes, (n_nodes,) float64 [Pa]."""
        self.nodes[:, V_P] = pressure[self.levels.node_of_row]

    def _choose_kernels(self):
        """Kernels compiled for what the scene has, and nothing else."""
        scene = self.scene
        wet = scene.water is not None
        plastic = any(soil.model == "mohr-coulomb" for soil in scene.soils)
        tied = self.levels.count > 1
        undrained = scene.is_undrained
        dilatant = plastic and any(soil.dilatancy_angle > 0 for soil in scene.soils if soil.model != "elastic")
        self._long_step = long_step_kernel(
            solve_nodes if wet and not undrained else one_velocity_kernel(undrained),
            advance_kernel(wet, undrained, tied, scene.numerics.remapping),
            remap_kernel(wet and not undrained, scene.numerics.remapping),
            rates_kernel(wet, undrained),
            update_kernel(wet, undrained, plastic, scene.numerics.volumetric_smoothing, dilatant, tied),
            relocate_kernel(wet, undrained, tied),
        )
        self._water_density = scene.water.density if wet else 0.0
        self._water_modulus = scene.water.bulk_modulus if wet else 0.0

    def _build_contact(self):
        mesh, scene = self.mesh, self.scene
        contact = contact_nodes(scene, mesh)
        self.n_contact = len(contact.node)
        self.contact_of_node = np.full(len(mesh.nodes), -1, np.int32)
        self.contact_of_node[contact.node] = np.arange(self.n_contact, dtype=np.int32)
        self.normal, self._normal_open = contact.normal, contact.normal_open
        self.active, self._active_open = contact.active, contact.active_open
        self._closed = self.normal, self.active
        self.friction, self.lining = contact.friction, contact.lining
        on_mirror_line = np.isin(contact.node, self.mirror_line)
        for normal in (self.normal, self._normal_open):
            normal[on_mirror_line, 0] = 0.0
        self.impulse = np.zeros((self.n_contact, 5))
        self.moving, self.wall = None, None  # compiles the motion of the walls out
        self.lining_displacement = self.lining_velocity = self.lining_impulse = np.zeros(0)
        if any(scene.lining_of(tunnel) != "fixed" for tunnel in scene.tunnels):
            self.moving = moving = MovingLinings(scene, mesh, self.contact_of_node, contact.moved_by)
            self.wall = moving.wall
            self.lining_displacement, self.lining_velocity = moving.displacement, moving.velocity
            self.lining_impulse = moving.left

    def _volumes(self):
        rho = np.array([s.grain_density for s in self.scene.soils])[self.soil_of_point]
        return self.points[:, MASS] / (rho * (1 - self.points[:, N]))

    def _sort(self):
        self.n_occupied, self.n_active = sort_by_element(
            self.element_of_point, len(self.mesh.elements), self.start, self.order, self.occupied
        )
        cut_by_points(self.start, self.occupied, self.n_occupied, self.levels.element_cuts, self._cuts.elements)

    def _sort_physically(self):
        inside = self.order[: self.n_active]
        outside = np.flatnonzero(self.element_of_point < 0)
        new = np.concatenate([inside, outside])
        self.points = np.ascontiguousarray(self.points[new])
        self.element_of_point = self.element_of_point[new]
        self.soil_of_point = self.soil_of_point[new]
        self.initial_volume = self.initial_volume[new]
        self._sort()

    def _update_wave_speed(self):
        speeds = []
        for k, soil in enumerate(self.scene.soils):
            mine = (self.soil_of_point == k) & (self.element_of_point >= 0)
            if mine.any():
                modulus = self.soils[k, S_LAMBDA] + 2 * self.soils[k, S_G]
                porosity = self.points[mine, N]
                if self.scene.water is None:
                    loosest = min(float(porosity.max()), soil.loose_porosity)
                    speeds.append(dry_wave_speed(modulus, loosest, soil.grain_density))
                else:
                    speeds.append(
                        fast_wave_speed(
                            modulus, self._water_modulus, float(porosity.min()), soil.grain_density, self._water_density
                        )
                    )
        self.wave_speed = self.limit_speed = max(speeds)
        if self.scene.numerics.critical_step == "spectral" and self.n_occupied:
            held = self.occupied[: self.n_occupied]
            shortest = float((self.geometry[held, 7] / 2.0 ** self.levels.of_element[held]).min())
            certain = 0.5 * shortest / self.wave_speed if self.mode is None else 0.8 * self.longest_step
            step, self.mode = spectral_time_step(self, certain, self.mode)
            if step > MOST_OVER_ALTITUDE * shortest / self.wave_speed:
                step = 0.5 * shortest / self.wave_speed
            if step < LEAST_OVER_ALTITUDE * shortest / self.wave_speed and not self.scene.numerics.remapping:
                components = 4 if self.scene.is_two_phase else 2
                raise RunFailed(
                    f"the time step fell to {step:.2g} s, which nodes that points hardly touch need without remapping; "
                    "set remapping = true in [numerics]",
                    self.time,
                    self.mesh.nodes[int(np.argmax(np.abs(self.mode))) // components],
                )
            most = MOST_BETWEEN_SPECTRA if self.levels.count == 1 else MOST_BETWEEN_SPECTRA_OF_LEVELS
            fallen = step < 0.9 * self.longest_step
            self.estimate_interval = FEWEST_BETWEEN_SPECTRA if fallen else min(2 * self.estimate_interval, most)
            self.limit_speed = shortest / step
            self.longest_step = step
        self.next_estimate = self.long_step_count + self.estimate_interval

    # -- threads --------------------------------------------------------------------------------

    def over_elements(self, kernel, *arguments, per_range=()):
        """Run a kernel over all occupied elements; returns the list of the ranges' results.

        Each range gets its own of the `per_range` arrays; the ranges do not depend on the number of threads.
        """
        first = [np.searchsorted(self.start, self.n_active * k // PARTS, side="right") - 1 for k in range(1, PARTS)]
        held = self.occupied[: self.n_occupied]
        return self._over([0, *np.searchsorted(held, first).tolist(), self.n_occupied], kernel, arguments, per_range)

    def over_nodes(self, kernel, *arguments, per_range=()):
        """Run a kernel over all nodes, as `over_elements`."""
        return self._over(np.linspace(0, len(self.mesh.nodes), PARTS + 1).astype(int), kernel, arguments, per_range)

    def _over(self, cuts, kernel, arguments, per_range):
        def call(r):
            return kernel(cuts[r], cuts[r + 1], *arguments, *(a[r] for a in per_range))

        if self._pool is None:
            return [call(r) for r in range(PARTS)]
        others = [self._pool.submit(call, r) for r in range(1, PARTS)]
        return [call(0), *(o.result() for o in others)]

    def together(self, kernel, *arguments):
        """Run a kernel of many stages by all threads: kernel(thread, meeting, first stage, *arguments).

        One that is late finds all done by the others (`mpm.meeting`), so nobody waits for its end.

        Returns
        -------
        list of concurrent.futures.Future
            The other threads.
        """
        stage = int(self._meeting[0])
        others = []
        try:
            for thread in range(1, self.threads):
                others.append(self._pool.submit(kernel, thread, self._meeting, stage, *arguments))
            kernel(0, self._meeting, stage, *arguments)
        except BaseException:  # an interrupt: the others would go on behind the caller's back
            wait(others)
            raise
        return [other for other in others if not other.cancel()]

    # -- information ----------------------------------------------------------------------------

    @property
    def n_points(self):
        """Number of material points, those taken out included."""
        return len(self.points)

    def nodal_sums(self):
        """What the points were last mapped to at the nodes: (n_nodes, 13) float64, columns `B_` of variables."""
        rows, n = self.sums.sum(axis=0), len(self.mesh.nodes)
        np.add.at(rows, self.levels.node_of_row[n:], rows[n:])
        return rows[:n]

    def memory_bytes(self):
        """Bytes held in the arrays of the solver."""
        return sum(a.nbytes for a in vars(self).values() if isinstance(a, np.ndarray))

    def time_step_estimate(self):
        """Time step of the smallest elements that hold points [s] and the name of what limits it."""
        if not self._mapped:
            self.map_points()
        limits = [*self._limits.tolist(), [self.longest_step, 0.0]]
        dt, limit = critical_time_step(limits, self.limit_speed, self.scene.numerics.courant)
        return dt * self._finest_step, limit

    @property
    def _finest_step(self):
        """Steps of level 0 in one of the finest level that holds points."""
        return 2.0 ** int(self.levels.of_element[self.occupied[0]]) if self.n_occupied else 1.0

    def points_by_name(self):
        """Copy of the state of all points, one array a variable, with volume, displacement and soil number."""
        data = {name: self.points[:, k].copy() for k, (name, _, _) in enumerate(POINT_VARIABLES)}
        data["displacement_x"] = data["x"] - data.pop("x_initial")
        data["displacement_y"] = data["y"] - data.pop("y_initial")
        data["volume"] = self._volumes()
        data["soil"] = self.soil_of_point.copy()
        data["removed"] = self.element_of_point < 0
        return with_mirrored_points(data) if self.scene.is_half else data

    # -- stages ---------------------------------------------------------------------------------

    def map_points(self):
        """Sum the points at the nodes without advancing anything; sets the limits of the time step."""
        inside = self.element_of_point >= 0
        element, volume = self.element_of_point[inside], self._volumes()[inside]
        self.volume[:, 0] = np.bincount(element, volume, len(self.volume))
        self.volume[:, 1] = np.bincount(element, volume * (self.points[inside, P] > 0), len(self.volume))
        top, still = np.array([self.levels.count - 1]), np.zeros(self.levels.count)
        self._run(Clock(still, still, still, top, top, 0.0), RATES, FOLLOW, advance=False)
        self._mapped = True

    def relax(self, progress=None):
        """Drained initial equilibrium; returns (steps, residual) and leaves the reactions in `impulse`."""
        numerics = self.scene.numerics
        friction = self.friction
        if self.scene.initial_contact == "bonded":
            friction = np.full_like(friction, np.inf)
        steps, residual, reaction = stages.relax(
            self, friction, numerics.relaxation_tolerance, numerics.max_relaxation_steps, progress
        )
        self._mapped = False
        self.impulse[:] = 0.0
        self.impulse[:, 0:3] = reaction
        self.impulse[:, 3:5] = reaction[:, 0:2] ** 2
        return steps, residual

    def open_gate(self):
        """Take the plug away: the opening is free, its corners stand still or belong to the channel walls."""
        self.normal = self._normal_open
        self.active = self._active_open
        if self.scene.gate.corners == "held":
            self.fixed[self.mesh.corner_nodes] |= FIXED_X | FIXED_Y
        self.gate_open = True

    def close_gate(self):
        """Put the plug back: what is in the channel stays there, and nothing follows through the face."""
        self.normal, self.active = self._closed
        self.fixed[self.mesh.corner_nodes] &= ~(FIXED_X | FIXED_Y)
        self.gate_open = False

    def step(self, dt_max=math.inf):
        """Advance by one step of the coarsest level, not longer than dt_max [s]; returns (dt, name of its limit)."""
        if not self._mapped:
            self.map_points()
        smallest, limit = self.time_step_estimate()
        points = np.diff(self.start[self.levels.element_cuts])
        periods, steps = self.levels.plan(points, dt_max / smallest)
        count = int(periods[-1])
        if steps * count * smallest > dt_max:
            if steps * count * smallest > ALMOST * dt_max:
                limit = "output"
            smallest = dt_max / (steps * count)
        dt_of_level = smallest * periods
        if not np.array_equal(periods, self._periods):
            self._periods, self.ahead[:] = periods, self.levels.ahead(periods)
        begun, finished = _last_multiples(periods, np.arange(count)), _last_multiples(periods, np.arange(1, count + 1))
        flip_of_level = np.exp(-self.scene.numerics.pic_rate * dt_of_level)
        # as often as those of the finest level
        filter_of_level = 1.0 - (1.0 - self.scene.numerics.pressure_filter) ** periods
        self._advance(Clock(dt_of_level, flip_of_level, filter_of_level, begun, finished, smallest / self._finest_step))
        self.time += smallest * count
        self.long_step_count += 1
        if self.long_step_count % STEPS_BETWEEN_SORTS == 0:
            self._sort_physically()
        if self.long_step_count >= self.next_estimate:
            self._update_wave_speed()
        return smallest * count, limit

    def _advance(self, clock):
        """All passes of a long step."""
        if self.moving is not None:  # all levels are one
            self.moving.advance(self.sums, float(clock.dt_of_level[0]), self.normal, self.active, self.friction)
        self._run(clock, SOLVE, FOLLOW)

    def _run(self, clock, first_pass, last_pass, advance=True):
        """Some passes (`mpm.long_step.PASSES`) of all substeps of a long step, by all threads."""
        levels, counts = self.levels, self._counts
        counts[:] = self.n_occupied, self.n_active, self.suspended, -1, 0, 0
        self._measures[:] = self.largest_courant, self.removed_mass
        arguments = (
            first_pass, last_pass, advance,
            Ground(
                self.occupied, self.start, self.order, self.points, self.element_of_point, self.soil_of_point,
                self.soils,
            ),
            Net(
                levels.rows, self.geometry, self.neighbours, levels.of_element, levels.element_cuts, self.ahead,
                self.volume, self.fill, self.rates, levels.nodes, levels.next_row, levels.of_row, levels.row_order,
                self._mirrored, self.nodes, self.tied_means, self.status, self.sums, self.momenta, self.nodal_means,
            ),
            Walls(
                self.fixed, self.contact_of_node, self.normal, self.active, self.friction, self.wall, self.impulse
            ),
            self._cuts, clock,
            Medium(
                self.scene.gravity, self._water_density, self._water_modulus,
                self.limit_speed,
            ),
            Tally(
                counts, self._measures, self._limits, *self._found, self.clamps, self.ledger, self._left,
                *self._moved, *self._spare, self._used,
            ),
        )  # fmt: skip
        others = self.together(self._long_step, *arguments)
        self.n_occupied, self.n_active, self.suspended = (int(counts[k]) for k in (OCCUPIED, ACTIVE, SUSPENDED))
        self.largest_courant = float(self._measures[LARGEST_COURANT])
        self.removed_mass = float(self._measures[REMOVED_MASS])
        if counts[BAD] >= 0:
            wait(others)
            raise RunFailed(
                "a material point became non-finite (velocity, stress or pore pressure)",
                self.time,
                self.points[counts[BAD], X : Y + 1],
            )
        if advance:
            self.step_count += int(counts[SUBSTEPS])
            self.point_steps += int(counts[POINT_STEPS])

    # -- measures -------------------------------------------------------------------------------

    def inflow_mass(self):
        """Grains inside the gate's tunnel, those taken out included [kg/m]."""
        if self.scene.gate is None:
            return 0.0
        tunnel = self.scene.tunnels[self.scene.gate.tunnel]
        r2 = (self.points[:, X] - tunnel.x) ** 2 + (self.points[:, Y] + tunnel.axis_depth) ** 2
        inside = (r2 < tunnel.inner_radius**2) & (self.element_of_point >= 0)
        return self.copies * (float(np.sum(self.points[inside, MASS])) + self.removed_mass)

    def sums_over_points(self):
        """Momentum (x, y) [N s] and kinetic energy [J] of grains and water, mass of the water [kg], per metre.

        Points taken out are left out. Water is counted with its compression, or with what is missing of it.
        """
        rows = self.points[self.element_of_point >= 0]
        mass = rows[:, MASS]
        # sums, no dot products: those of BLAS depend on its number of threads in the last bits
        momentum = np.array([np.sum(mass * rows[:, VSX]), np.sum(mass * rows[:, VSY])])
        kinetic = 0.5 * float(np.sum(mass * (rows[:, VSX] ** 2 + rows[:, VSY] ** 2)))
        water = 0.0
        if self.scene.water is not None:
            volume = self._volumes()[self.element_of_point >= 0]
            wet = self._water_density * rows[:, N] * volume
            momentum += np.array([np.sum(wet * rows[:, VLX]), np.sum(wet * rows[:, VLY])])
            kinetic += 0.5 * float(np.sum(wet * (rows[:, VLX] ** 2 + rows[:, VLY] ** 2)))
            water = float(wet.sum())
            if self._water_modulus > 0:
                water += float(np.sum(wet * rows[:, P])) / self._water_modulus
        return {"momentum": momentum, "kinetic": kinetic, "water": water}

    def balances(self):
        """How far the state of the points is from what was done to them, as a dict of floats.

        Returns
        -------
        dict
            momentum_error [-]: departure of the points' momentum from what the nodes received, over the impulse of
            gravity; water_mass_error [-]: change of the water's mass over the initial; work_gravity, work_stress,
            work_drag, kinetic_energy_change, transfer_loss [J/m]: energies since the start, the last what the way from
            points to nodes and back (PIC, MUSL) took; contact_error [-]: change of the momentum at the lining that the
            recorded reactions do not explain, over their sum; largest_courant [-]: time step over the critical one of
            the state it led to.

        With a sink momentum, energy and water leave with the points taken out, and count as errors.
        """
        ledger, now = dict(zip(LEDGER, self.ledger.sum(axis=0).tolist(), strict=True)), self.sums_over_points()
        received = np.array([ledger["momentum_x"], ledger["momentum_y"]])
        departure = np.abs(now["momentum"] - self.initial["momentum"] - received)
        if self.scene.is_half:
            departure = departure[1:]  # horizontal momentum comes from the mirror image, which takes as much
        departure = float(departure.max())
        weight = self.scene.gravity * (self.initial_grain_mass + self.initial["water"]) * self.time
        change = now["kinetic"] - self.initial["kinetic"]
        water = self.initial["water"]
        return {
            "momentum_error": departure / weight if weight > 0 else 0.0,
            "water_mass_error": now["water"] / water - 1 if water > 0 else 0.0,
            "work_gravity": self.copies * ledger["gravity"],
            "work_stress": self.copies * ledger["stress"],
            "work_drag": self.copies * ledger["drag"],
            "kinetic_energy_change": self.copies * change,
            "transfer_loss": self.copies * (ledger["kinetic"] - change),
            "contact_error": ledger["unexplained"] / ledger["reactions"] if ledger["reactions"] > 0 else 0.0,
            "largest_courant": self.largest_courant,
        }

    def measures(self):
        """Zones, balances and extremes of the state at hand, as a dict of floats."""
        moved = np.hypot(self.points[:, X] - self.points[:, X0], self.points[:, Y] - self.points[:, Y0])
        flow = moved > 0.05
        mass = self.points[:, MASS]
        speed2 = self.points[:, VSX] ** 2 + self.points[:, VSY] ** 2
        active = self.element_of_point >= 0
        return {
            "inflow_mass": self.inflow_mass(),
            "flow_zone_area": self.copies * float(np.sum(self.initial_volume[flow])),
            "disturbed_area": self.copies * float(np.sum(self.initial_volume[(moved > 0.01) & ~flow])),
            "grain_mass": self.copies * float(np.sum(mass)),
            "suspended_fraction": float(self.suspended) / max(self.n_active, 1),
            "kinetic_energy": self.copies * float(0.5 * np.sum((mass * speed2)[active])),
            "max_velocity": float(np.sqrt(speed2[active].max(initial=0.0))),
        }

    def lining_pressures(self, duration):
        """Mean pressures on every tunnel's lining since the impulses were last cleared [Pa].

        Parameters
        ----------
        duration : float
            Time over which impulses were summed [s]; 1.0 after `relax`.
        """
        result = []
        for part in self.lining:
            impulse = self.impulse[part.rows] * part.factors / duration
            bears = part.bears if self.gate_open else np.ones(len(part.arc), bool)
            arc = part.arc
            mean_s, mean_l, shear = (np.where(bears, impulse[:, k] / arc, 0.0) for k in range(3))
            spread = [
                np.where(bears, np.sqrt(np.maximum(impulse[:, k + 3] / arc**2 - mean**2, 0.0)), 0.0)
                for k, mean in ((0, mean_s), (1, mean_l))
            ]
            result.append(
                {
                    "theta": part.theta,
                    "arc": arc,
                    "soil_pressure": mean_s,
                    "water_pressure": mean_l,
                    "soil_shear": -shear,
                    "soil_pressure_std": spread[0],
                    "water_pressure_std": spread[1],
                }
            )
            if self.moving is not None:
                result[-1] |= self.moving.motion_at(len(result) - 1, part.theta)
        return result


def _cut_evenly(cuts):
    """Cut each range between two `cuts` (n + 1,) into parts of one size: (n, PARTS + 1) int64."""
    return np.linspace(cuts[:-1], cuts[1:], PARTS + 1, axis=1).astype(np.int64)


def _last_multiples(periods, numbers):
    """For each number the coarsest level whose period divides it, as all shorter ones then do: (n,) int64."""
    return (numbers[:, None] % periods == 0).sum(axis=1) - 1
