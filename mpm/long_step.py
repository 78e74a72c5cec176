"""One long step in compiled code: all its substeps, pass by pass, by threads that meet between the passes.

Every thread calls the same kernel and shares the passes with the others (`mpm.meeting`). The parts are those of the
mesh, whatever the number of threads, and so are the bits.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import types

from mpm.contact import smooth_rates
from mpm.jit import kernel, kernel_part
from mpm.meeting import next_part, next_stage, take_part
from mpm.points import cut_by_points, update_order
from mpm.variables import MASS, V_GX

#: Of the process, in microseconds (POSIX).
processor_time = types.ExternalFunction("clock", types.int64())
#: Passes of a substep, in their order. A range of them may be run alone.
PASSES = ("solve_nodes", "advance_points", "remap_nodes", "element_rates", "smooth_rates", "update_points", "relocate")
(SOLVE, ADVANCE, REMAP, RATES, SMOOTH, UPDATE, FOLLOW) = range(len(PASSES))
#: What the passes count, beside the arrays: places in `Tally.counts`.
(OCCUPIED, ACTIVE, SUSPENDED, BAD, SUBSTEPS, POINT_STEPS) = range(6)
#: And in `Tally.measures`: the largest time step over the critical one it led to, mass of the points taken out.
LARGEST_COURANT, REMOVED_MASS = range(2)


class Ground(NamedTuple):
    """Points by element, and the soils: arrays of :class:`mpm.Solver`."""

    occupied: np.ndarray
    start: np.ndarray
    order: np.ndarray
    points: np.ndarray
    element_of_point: np.ndarray
    soil_of_point: np.ndarray
    soils: np.ndarray


class Net(NamedTuple):
    """Elements and the rows of their nodes."""

    rows: np.ndarray
    geometry: np.ndarray
    neighbours: np.ndarray
    level_of_element: np.ndarray
    element_cuts: np.ndarray  # of the levels
    ahead: np.ndarray
    volume: np.ndarray
    fill: np.ndarray
    rates: np.ndarray
    which_node: np.ndarray
    next_row: np.ndarray
    level_of_row: np.ndarray
    which_row: np.ndarray
    mirrored: np.ndarray  # (n_rows,) bool, or empty where no row lies on a mirror line
    nodes: np.ndarray
    tied_means: np.ndarray
    status: np.ndarray
    sums: np.ndarray
    momenta: np.ndarray
    nodal_means: np.ndarray


class Walls(NamedTuple):
    """Constraints of the nodes, and what they felt."""

    fixed: np.ndarray
    contact_of_node: np.ndarray
    normal: np.ndarray
    active: np.ndarray
    friction: np.ndarray
    velocity: np.ndarray | None
    impulse: np.ndarray


class Cuts(NamedTuple):
    """Where the lists of occupied elements, nodes and rows of each level are cut: (n_levels, n_parts + 1) int64."""

    elements: np.ndarray
    nodes: np.ndarray
    rows: np.ndarray


class Clock(NamedTuple):
    """Time steps of the levels [s], their shares of FLIP and of the filter of the pore pressure.

    `begun`, `finished`: the coarsest levels that begin and end a step in each substep; `smallest`: step of level 0.
    """

    dt_of_level: np.ndarray
    flip_of_level: np.ndarray
    filter_of_level: np.ndarray
    begun: np.ndarray
    finished: np.ndarray
    smallest: float


class Medium(NamedTuple):
    """Numbers of the scene, and the wave speed that stands for its critical step [m/s]."""

    gravity: float
    density_liquid: float
    bulk_liquid: float
    wave_speed: float


class Tally(NamedTuple):
    """What the passes count and leave for each other."""

    counts: np.ndarray
    measures: np.ndarray
    limits: np.ndarray  # (n_parts + 1, 2): of the time step, by part and of points that were relocated
    suspended: np.ndarray  # (n_parts,)
    bad: np.ndarray  # (n_parts,)
    n_left: np.ndarray  # (n_parts,)
    clamps: np.ndarray
    ledger: np.ndarray
    left: np.ndarray
    moved_point: np.ndarray
    moved_from: np.ndarray
    spare_start: np.ndarray
    spare_order: np.ndarray
    used: np.ndarray  # (n_passes,) processor time of each pass [microseconds], or empty: not measured


@kernel_part
def lap(used, which, thread, mark):
    """Add the processor time since `mark` to that of a pass; returns the time now. Nothing where it is not measured."""
    if used.size == 0 or thread > 0:
        return mark
    now = processor_time()
    used[which] += now - mark
    return now


@cache
def long_step_kernel(solve_nodes, advance_points, remap_nodes, element_rates, update_points, relocate):
    """Kernel `long_step` of the kernels that a scene needs."""

    @kernel_part
    def follow(ground, net, cuts, medium, clock, finished, tally):
        """Note what the update found; move points that left their element to where they are."""
        counts, limits = tally.counts, tally.limits
        counts[SUSPENDED] = tally.suspended.sum()
        for part in range(tally.bad.size):
            if tally.bad[part] >= 0:
                counts[BAD] = tally.bad[part]
                return
        critical = np.inf
        for part in range(tally.n_left.size):
            critical = min(critical, limits[part, 0])
        limits[-1, 0], limits[-1, 1] = np.inf, 0.0
        tally.measures[LARGEST_COURANT] = max(tally.measures[LARGEST_COURANT], clock.smallest / critical)
        if tally.n_left.sum() == 0:
            return
        n_moved, removed, limits[-1, 0], limits[-1, 1] = relocate(
            tally.left, tally.n_left, ground.element_of_point, ground.points, ground.soil_of_point, ground.soils,
            medium.density_liquid, net.rows, net.geometry, net.neighbours, net.nodes, medium.wave_speed, net.volume,
            net.level_of_element, finished, net.sums[0], tally.clamps[0], tally.moved_point, tally.moved_from,
        )  # fmt: skip
        if removed > 0:
            for k in range(n_moved):
                i = tally.moved_point[k]
                if ground.element_of_point[i] == -1:
                    tally.measures[REMOVED_MASS] += ground.points[i, MASS]
        if n_moved > 0:
            counts[OCCUPIED], counts[ACTIVE] = update_order(
                ground.element_of_point, tally.moved_point, tally.moved_from, n_moved, ground.start, ground.order,
                ground.occupied, counts[OCCUPIED], tally.spare_start, tally.spare_order,
            )  # fmt: skip
            cut_by_points(ground.start, ground.occupied, counts[OCCUPIED], net.element_cuts, cuts.elements)

    @kernel
    def long_step(
        thread, meeting, stage, first_pass, last_pass, advance, ground, net, walls, cuts, clock, medium, tally
    ):  # fmt: skip
        """Do what other threads leave of a range of passes of all substeps; `advance` False maps the points only."""
        parts, mark = net.sums.shape[0], processor_time()
        for k in range(clock.begun.size):
            begun, finished = clock.begun[k], clock.finished[k]
            if first_pass <= SOLVE:
                part = take_part(meeting, stage, thread, parts)
                while part >= 0:
                    for level in range(begun + 1):
                        solve_nodes(
                            cuts.nodes[level, part], cuts.nodes[level, part + 1], net.which_node, net.next_row,
                            net.level_of_row, begun, clock.dt_of_level, net.sums, net.tied_means, medium.gravity,
                            medium.density_liquid, walls.fixed, walls.contact_of_node, walls.normal, walls.active,
                            walls.friction, walls.velocity, net.nodes, net.status, walls.impulse, tally.ledger[part],
                        )  # fmt: skip
                    part = next_part(meeting, stage, thread, parts)
                stage = next_stage(meeting, stage, parts)
                mark = lap(tally.used, SOLVE, thread, mark)
            if first_pass <= ADVANCE <= last_pass:
                part = take_part(meeting, stage, thread, parts)
                while part >= 0:
                    for level in range(finished + 1):
                        advance_points(
                            cuts.elements[level, part], cuts.elements[level, part + 1], ground.occupied, ground.start,
                            ground.order, ground.points, ground.soil_of_point, ground.soils, medium.density_liquid,
                            net.rows, net.geometry, net.nodes, net.tied_means, net.level_of_element,
                            clock.dt_of_level, clock.flip_of_level, clock.filter_of_level, net.momenta[part],
                        )  # fmt: skip
                    part = next_part(meeting, stage, thread, parts)
                stage = next_stage(meeting, stage, parts)
                mark = lap(tally.used, ADVANCE, thread, mark)
            if first_pass <= REMAP <= last_pass:
                part = take_part(meeting, stage, thread, parts)
                while part >= 0:
                    for level in range(finished + 1):
                        remap_nodes(
                            cuts.nodes[level, part], cuts.nodes[level, part + 1], net.which_node, net.next_row,
                            net.level_of_row, finished, clock.dt_of_level, net.momenta, net.sums, net.tied_means,
                            walls.fixed, walls.contact_of_node, walls.normal, walls.active, walls.velocity, net.nodes,
                            net.status,
                        )  # fmt: skip
                    part = next_part(meeting, stage, thread, parts)
                stage = next_stage(meeting, stage, parts)
                mark = lap(tally.used, REMAP, thread, mark)
            if first_pass <= RATES <= last_pass:
                part = take_part(meeting, stage, thread, parts)
                while part >= 0:
                    for level in range(finished + 1):
                        element_rates(
                            cuts.elements[level, part], cuts.elements[level, part + 1], ground.occupied, net.rows,
                            net.geometry, net.nodes, net.volume, net.fill, net.rates, net.nodal_means[part],
                        )  # fmt: skip
                    part = next_part(meeting, stage, thread, parts)
                stage = next_stage(meeting, stage, parts)
                mark = lap(tally.used, RATES, thread, mark)
            if first_pass <= SMOOTH <= last_pass:
                part = take_part(meeting, stage, thread, parts)
                while part >= 0:
                    for level in range(finished + 1):
                        first, last = cuts.rows[level, part], cuts.rows[level, part + 1]
                        smooth_rates(
                            first, last, net.which_row, net.nodal_means, net.momenta, net.sums, net.nodes, net.fill
                        )
                        if net.mirrored.size > 0:
                            for j in range(first, last):
                                if net.mirrored[net.which_row[j]]:
                                    net.nodes[net.which_row[j], V_GX] = 0.0
                    part = next_part(meeting, stage, thread, parts)
                stage = next_stage(meeting, stage, parts)
                mark = lap(tally.used, SMOOTH, thread, mark)
            if first_pass <= UPDATE <= last_pass:
                part = take_part(meeting, stage, thread, parts)
                while part >= 0:
                    left, suspended, bad, limit, limit_speed = 0, 0, -1, np.inf, 0.0
                    for level in range(finished + 1):
                        more, wrong, loose, local, speed = update_points(
                            cuts.elements[level, part], cuts.elements[level, part + 1], ground.occupied, ground.start,
                            ground.order, ground.points, ground.soil_of_point, ground.soils, medium.density_liquid,
                            medium.bulk_liquid, net.rows, net.geometry, net.nodes, net.rates, net.volume,
                            net.fill, net.level_of_element, clock.dt_of_level, net.ahead, advance, medium.wave_speed,
                            ground.element_of_point, tally.clamps[part], net.sums[part], tally.left[part, left:],
                        )  # fmt: skip
                        left += more
                        suspended += loose
                        bad = wrong if bad < 0 else bad
                        if local < limit:
                            limit, limit_speed = local, speed
                    tally.n_left[part], tally.suspended[part], tally.bad[part] = left, suspended, bad
                    tally.limits[part, 0], tally.limits[part, 1] = limit, limit_speed
                    part = next_part(meeting, stage, thread, parts)
                stage = next_stage(meeting, stage, parts)
                mark = lap(tally.used, UPDATE, thread, mark)
            if last_pass >= FOLLOW:
                part = take_part(meeting, stage, thread, parts)
                while part >= 0:
                    if part == 0:
                        tally.counts[SUBSTEPS] += 1
                        tally.counts[POINT_STEPS] += ground.start[net.element_cuts[finished + 1]]
                        follow(ground, net, cuts, medium, clock, finished, tally)
                    part = next_part(meeting, stage, thread, parts)
                stage = next_stage(meeting, stage, parts)
                mark = lap(tally.used, FOLLOW, thread, mark)
                if tally.counts[BAD] >= 0:
                    return

    return long_step
