"""Long steps in compiled code: all their substeps, pass by pass, by threads that meet between the passes.

Every thread calls the same kernel and shares the passes with the others (`mpm.meeting`). The parts are those of the
mesh, whatever the number of threads, and so are the bits.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import types

from mpm.clock import ALMOST_ALL, END, NOW, SMALLEST, SPAN, plan_step
from mpm.jit import kernel, kernel_part
from mpm.meeting import next_part, next_stage, take_part
from mpm.points import Layout, cut_by_work, follow_points

#: Of the process, in microseconds (POSIX).
processor_time = types.ExternalFunction("clock", types.int64())
#: Passes of a substep, in their order, after one that plans the long step. A range of them may be run alone.
PASSES = (
    "plan_step", "solve_nodes", "advance_points", "remap_nodes", "update_points", "locate", "follow_points",
)  # fmt: skip
(PLAN, SOLVE, ADVANCE, REMAP, UPDATE, LOCATE, FOLLOW) = range(len(PASSES))
#: What the passes count, beside the arrays: places in `Tally.counts`.
(OCCUPIED, ACTIVE, SUSPENDED, SUBSTEPS, POINT_STEPS) = range(5)
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
    layout: Layout
    contents: np.ndarray
    which_node: np.ndarray
    next_row: np.ndarray
    level_of_row: np.ndarray
    nodes: np.ndarray
    tied_means: np.ndarray
    status: np.ndarray
    touched: np.ndarray  # (n_parts, n_rows) uint8
    sums: np.ndarray
    momenta: np.ndarray


class Walls(NamedTuple):
    """Constraints of the nodes, and what they felt."""

    fixed: np.ndarray
    contact_of_node: np.ndarray
    normal: np.ndarray
    active: np.ndarray
    friction: np.ndarray
    velocity: np.ndarray | None
    impulse: np.ndarray


class Medium(NamedTuple):
    """Numbers of the scene."""

    gravity: float
    density_liquid: float
    bulk_liquid: float


class Batch(NamedTuple):
    """Long steps one after the other: of each its substeps and what limited it, and when there are enough.

    The arrays are of this batch alone: a thread that is late may still read them when the next one has begun.
    """

    substeps: np.ndarray  # (most + 1,) int64; 0 ends the batch
    limits: np.ndarray  # (most,) int64, places in `mpm.clock.LIMITS`
    most_substeps: int  # no further long step begins after so many of the finest level
    most_point_steps: int


class Tally(NamedTuple):
    """What the passes count and leave for each other."""

    counts: np.ndarray
    measures: np.ndarray
    limits: np.ndarray  # (2 n_parts, 2): of the time step, by part, and of the points that left their element
    suspended: np.ndarray  # (n_parts,)
    bad: np.ndarray  # (n_parts,)
    n_left: np.ndarray  # (n_parts,)
    first_left: np.ndarray  # (n_parts,) where the points of each part begin in the next two
    clamps: np.ndarray
    ledger: np.ndarray
    left: np.ndarray  # (n_points,) points that left their element
    origin: np.ndarray  # (n_points,) that element
    spare_start: np.ndarray
    spare_order: np.ndarray
    used: np.ndarray  # (n_passes,) processor time of each pass [microseconds], or empty: not measured


@kernel_part
def lap(used, which, thread, mark):
    """Add the processor time since `mark`, if any, to that of a pass; returns the time now. 0: it is not measured."""
    if used.size == 0 or thread > 0:
        return 0
    now = processor_time()
    if mark > 0:
        used[which] += now - mark
    return now


@kernel_part
def points_before(ground, element_cuts, cuts, finished, part):
    """Number of points that the parts before a part hold in the levels up to `finished`."""
    count = 0
    for level in range(finished + 1):
        place = cuts[level, part]
        if place < cuts[-1, -1]:
            count += ground.start[ground.occupied[place]] - ground.start[element_cuts[level]]
        else:
            count += ground.start[element_cuts[level + 1]] - ground.start[element_cuts[level]]
    return count


@cache
def long_step_kernel(solve_nodes, advance_points, remap_nodes, update_points, locate):
    """Kernel `long_step` of the kernels that a scene needs."""

    @kernel_part
    def follow(ground, net, cuts, clock, finished, tally):
        """Note what the update of a substep found, and repair the list of points."""
        counts = tally.counts
        counts[SUBSTEPS] += 1
        counts[POINT_STEPS] += ground.start[net.layout.element_cuts[finished + 1]]
        counts[SUSPENDED] = tally.suspended.sum()
        critical = np.inf
        for part in range(tally.n_left.size):
            critical = min(critical, tally.limits[part, 0])
        courant = clock.times[SMALLEST] / critical
        tally.measures[LARGEST_COURANT] = max(tally.measures[LARGEST_COURANT], courant)
        if tally.n_left.sum() > 0:
            counts[OCCUPIED], counts[ACTIVE], removed = follow_points(
                tally.left, tally.first_left, tally.n_left, tally.origin, ground.element_of_point, ground.points,
                ground.soil_of_point, ground.soils, net.contents, ground.start, ground.order, ground.occupied,
                counts[OCCUPIED], tally.spare_start, tally.spare_order,
            )  # fmt: skip
            tally.measures[REMOVED_MASS] += removed
            cut_by_work(ground.start, ground.occupied, counts[OCCUPIED], net.layout, finished + 1, cuts)

    @kernel_part
    def finish(ground, net, cuts, clock, tally):
        """The end of a long step."""
        follow(ground, net, cuts, clock, net.layout.element_cuts.size - 2, tally)
        clock.times[NOW] += clock.times[SPAN]

    @kernel_part
    def plan(number, batch, ground, net, cuts, clock, pace, tally):
        """Begin a long step, if there shall be one more."""
        counts, times = tally.counts, clock.times
        enough = number == batch.limits.size
        if number > 0:
            enough = enough or counts[SUBSTEPS] >= batch.most_substeps or times[NOW] >= times[END] * ALMOST_ALL
            enough = enough or counts[POINT_STEPS] >= batch.most_point_steps
        if not enough:
            batch.substeps[number], batch.limits[number] = plan_step(
                clock, pace, tally.limits, ground.start, ground.occupied, counts[OCCUPIED], net.layout.element_cuts,
                net.level_of_element,
            )  # fmt: skip
            for level in range(cuts.nodes.shape[0]):
                for part in range(cuts.nodes.shape[1]):
                    cuts.solved[level, part] = cuts.nodes[level, part]

    @kernel_part
    def do_part(
        which, part, k, thread, mark, advance, ground, net, walls, cuts, clock, pace, medium, tally
    ):  # fmt: skip
        """One part of a pass of substep `k`; returns the time now, as `lap`."""
        parts, begun, finished = net.sums.shape[0], clock.begun[k], clock.finished[k]
        if which == SOLVE and part == parts:
            follow(ground, net, cuts, clock, clock.finished[k - 1], tally)
            return lap(tally.used, FOLLOW, thread, mark)
        if which == SOLVE:
            for level in range(begun + 1):
                solve_nodes(
                    cuts.solved[level, part], cuts.solved[level, part + 1], net.which_node, net.next_row,
                    net.level_of_row, begun, clock.dt_of_level, net.touched, net.sums, net.tied_means,
                    medium.gravity, walls.fixed, walls.contact_of_node, walls.normal,
                    walls.active, walls.friction, walls.velocity, net.nodes, net.status, walls.impulse,
                    tally.ledger[part],
                )  # fmt: skip
        elif which == ADVANCE:
            for level in range(finished + 1):
                advance_points(
                    cuts.elements[level, part], cuts.elements[level, part + 1], ground.occupied, ground.start,
                    ground.order, ground.points, ground.soil_of_point, ground.soils, medium.density_liquid,
                    net.rows, net.geometry, net.nodes, net.tied_means, net.contents, net.level_of_element,
                    clock.dt_of_level, clock.flip_of_level, clock.filter_of_level, net.touched[part],
                    net.momenta[part],
                )  # fmt: skip
        elif which == REMAP:
            for level in range(finished + 1):
                remap_nodes(
                    cuts.nodes[level, part], cuts.nodes[level, part + 1], net.which_node, net.next_row,
                    net.level_of_row, finished, clock.dt_of_level, net.touched, net.momenta, net.sums,
                    net.tied_means, walls.fixed, walls.contact_of_node, walls.normal, walls.active, walls.velocity,
                    net.nodes, net.status,
                )  # fmt: skip
        elif which == UPDATE:
            left, suspended, bad, limit, limit_speed = 0, 0, -1, np.inf, 0.0
            base = points_before(ground, net.layout.element_cuts, cuts.elements, finished, part)
            for level in range(finished + 1):
                more, wrong, loose, local, speed = update_points(
                    cuts.elements[level, part], cuts.elements[level, part + 1], ground.occupied, ground.start,
                    ground.order, ground.points, ground.soil_of_point, ground.soils, medium.density_liquid,
                    medium.bulk_liquid, net.rows, net.geometry, net.nodes, net.contents,
                    net.level_of_element, clock.dt_of_level, clock.ahead, advance, pace.wave_speed,
                    ground.element_of_point, tally.clamps[part], net.touched[part], net.sums[part],
                    tally.left[base + left :],
                )  # fmt: skip
                left += more
                suspended += loose
                bad = wrong if bad < 0 else bad
                if local < limit:
                    limit, limit_speed = local, speed
            tally.first_left[part], tally.n_left[part] = base, left
            tally.suspended[part], tally.bad[part] = suspended, bad
            tally.limits[part, 0], tally.limits[part, 1] = limit, limit_speed
            mark = lap(tally.used, UPDATE, thread, mark)
            if bad < 0:
                tally.limits[parts + part, 0], tally.limits[parts + part, 1] = locate(
                    tally.left[base:], left, tally.origin[base:], ground.element_of_point, ground.points,
                    ground.soil_of_point, ground.soils, medium.density_liquid, net.rows, net.geometry,
                    net.neighbours, net.contents, pace.wave_speed, net.level_of_element, finished,
                    net.touched[part], net.sums[part], tally.clamps[part],
                )  # fmt: skip
            return lap(tally.used, LOCATE, thread, mark)
        return lap(tally.used, which, thread, mark)

    @kernel_part
    def substep(
        thread, meeting, stage, k, first_pass, last_pass, advance, ground, net, walls, cuts, clock, pace, medium, tally
    ):  # fmt: skip
        """A range of passes of substep `k` of the long step; returns the next stage, or -1 where a point went bad."""
        mark = lap(tally.used, SOLVE, thread, 0)
        for which in range(max(first_pass, SOLVE), min(last_pass, UPDATE) + 1):
            parts = net.sums.shape[0]
            if which == SOLVE and k > 0 and last_pass == FOLLOW:
                parts += 1  # the last: the list of points after the substep before, which nodes do not need
            part = take_part(meeting, stage, thread, parts)
            while part >= 0:
                mark = do_part(
                    which, part, k, thread, mark, advance, ground, net, walls, cuts, clock, pace, medium, tally
                )
                part = next_part(meeting, stage, thread, parts)
            stage = next_stage(meeting, stage, parts)
            mark = lap(tally.used, which, thread, mark)
            if which == UPDATE and tally.bad.max() >= 0:
                return -1
        return stage

    @kernel
    def long_step(
        thread, meeting, stage, first_pass, last_pass, advance, batch, ground, net, walls, cuts, clock, pace, medium,
        tally,
    ):  # fmt: skip
        """Do what other threads leave of a range of passes of all substeps; `advance` False maps the points only."""
        for number in range(batch.substeps.size):
            mark = lap(tally.used, PLAN, thread, 0)
            if first_pass == PLAN:
                part = take_part(meeting, stage, thread, 1)
                while part >= 0:
                    if number > 0:
                        finish(ground, net, cuts, clock, tally)
                        mark = lap(tally.used, FOLLOW, thread, mark)
                    plan(number, batch, ground, net, cuts, clock, pace, tally)
                    part = next_part(meeting, stage, thread, 1)
                stage = next_stage(meeting, stage, 1)
                lap(tally.used, PLAN, thread, mark)
            if last_pass == PLAN:
                return
            for k in range(batch.substeps[number]):
                stage = substep(
                    thread, meeting, stage, k, first_pass, last_pass, advance, ground, net, walls, cuts, clock, pace,
                    medium, tally,
                )  # fmt: skip
                if stage < 0:
                    return
            if batch.substeps[number] == 0 or last_pass < FOLLOW:
                return
        # the last one of those that were not planned here
        mark = lap(tally.used, FOLLOW, thread, 0)
        part = take_part(meeting, stage, thread, 1)
        while part >= 0:
            finish(ground, net, cuts, clock, tally)
            part = next_part(meeting, stage, thread, 1)
        stage = next_stage(meeting, stage, 1)
        lap(tally.used, FOLLOW, thread, mark)

    return long_step
