"""Long steps in compiled code: all their substeps, pass by pass, by threads that meet between the passes.

Every thread calls the same kernel and shares the passes with the others (`mpm.machine.team`). The parts are those of
the mesh, whatever the number of threads, and so are the bits.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from mpm.machine.compile import inline_kernel, kernel_part, step_kernel
from mpm.machine.team import shared
from mpm.step.find import follow_points, locate_kernel, total
from mpm.step.nodes import remap_kernel, solve_kernel
from mpm.step.nodes_to_points import advance_kernel
from mpm.step.points_to_nodes import update_kernel
from mpm.step.sort import cut_by_work
from mpm.time_step.clock import ALMOST_ALL, END, NOW, SMALLEST, SPAN, plan_step

#: Passes of a substep, in their order, after one that plans the long step. A range of them may be run alone.
PASSES = ("plan_step", "solve_nodes", "advance_points", "remap_nodes", "update_points")
(PLAN, SOLVE, ADVANCE, REMAP, UPDATE) = range(len(PASSES))
#: What the passes count, beside the arrays: places in `Tally.counts` of `mpm.step.system`.
(OCCUPIED, ACTIVE, SUSPENDED, SUBSTEPS, POINT_STEPS) = range(5)
#: And in `Tally.measures`: the largest time step over the critical one it led to, mass of the points taken out.
LARGEST_COURANT, REMOVED_MASS = range(2)


class Batch(NamedTuple):
    """Long steps one after the other: of each its substeps and what limited it, and when there are enough.

    The arrays are of this batch alone: a thread that is late may still read them when the next one has begun.
    """

    substeps: np.ndarray  # (most + 1,) int64; 0 ends the batch
    limits: np.ndarray  # (most,) int64, places in `mpm.time_step.clock.LIMITS`
    most_substeps: int  # no further long step begins after so many of the finest level
    most_point_steps: int
    first_substep: int = 0  # of the first long step

    @classmethod
    def one_substep(cls, k, of):
        """Substep `k` of a long step that is planned and has so many, with what ends the step after the last one."""
        return cls(np.array([k + 1, 0] if k + 1 == of else [k + 1]), np.zeros(0, np.int64), 0, 0, k)


@kernel_part
def all_good(bad):
    """Whether no part has a bad point."""
    for part in range(bad.size):
        if bad[part] >= 0:
            return False
    return True


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


@inline_kernel
def follow(system, finished):
    """Note what the update of a substep found, and repair the list of points."""
    ground, tally, layout = system.ground, system.tally, system.net.layout
    counts = tally.counts
    counts[SUBSTEPS] += 1
    counts[POINT_STEPS] += ground.start[layout.element_cuts[finished + 1]]
    counts[SUSPENDED] = total(tally.suspended)
    critical = np.inf
    for part in range(tally.n_left.size):
        critical = min(critical, tally.limits[part, 0])
    courant = system.clock.times[SMALLEST] / critical
    tally.measures[LARGEST_COURANT] = max(tally.measures[LARGEST_COURANT], courant)
    if total(tally.n_left) > 0:
        counts[OCCUPIED], counts[ACTIVE], removed = follow_points(system, counts[OCCUPIED])
        tally.measures[REMOVED_MASS] += removed
        cut_by_work(ground.start, ground.occupied, counts[OCCUPIED], layout, finished + 1, system.cuts)


@inline_kernel
def finish(system):
    """The end of a long step."""
    follow(system, system.net.layout.element_cuts.size - 2)
    system.clock.times[NOW] += system.clock.times[SPAN]


@inline_kernel
def plan(number, batch, system):
    """Begin a long step, if there shall be one more."""
    ground, net, cuts, counts, times = system.ground, system.net, system.cuts, system.tally.counts, system.clock.times
    enough = number == batch.limits.size
    if number > 0:
        enough = enough or counts[SUBSTEPS] >= batch.most_substeps or times[NOW] >= times[END] * ALMOST_ALL
        enough = enough or counts[POINT_STEPS] >= batch.most_point_steps
    if not enough:
        batch.substeps[number], batch.limits[number] = plan_step(
            system.clock, system.pace, system.tally.limits, ground.start, ground.occupied, counts[OCCUPIED],
            net.layout.element_cuts, net.level_of_element,
        )  # fmt: skip
        for level in range(cuts.nodes.shape[0]):
            for part in range(cuts.nodes.shape[1]):
                cuts.solved[level, part] = cuts.nodes[level, part]


@cache
def long_step_kernel(needs):
    """Kernel `long_step` for what a scene needs (`mpm.step.system.Needs`)."""
    solve_nodes, advance_points, remap_nodes = solve_kernel(needs), advance_kernel(needs), remap_kernel(needs)
    update_points, locate = update_kernel(needs), locate_kernel(needs)

    @inline_kernel
    def update(team, part, finished, advance, system):
        """`update_points` and `locate` of all levels of a part."""
        tally, cuts = system.tally, system.cuts.elements
        moved, suspended, bad, limit, limit_speed = 0, 0, -1, np.inf, 0.0
        base = points_before(system.ground, system.net.layout.element_cuts, cuts, finished, part)
        for level in range(finished + 1):
            more, wrong, loose, local, speed = update_points(
                cuts[level, part], cuts[level, part + 1], part, tally.left[base + moved :], advance, system
            )
            moved += more
            suspended += loose
            bad = wrong if bad < 0 else bad
            if local < limit:
                limit, limit_speed = local, speed
        tally.first_left[part], tally.n_left[part] = base, moved
        tally.suspended[part], tally.bad[part] = suspended, bad
        tally.limits[part, 0], tally.limits[part, 1] = limit, limit_speed
        if bad < 0:
            parts = system.net.sums.shape[0]
            tally.limits[parts + part, 0], tally.limits[parts + part, 1] = locate(
                tally.left[base:], moved, tally.origin[base:], part, finished, system
            )

    @inline_kernel
    def substep(team, k, first_pass, last_pass, advance, system):
        """A range of passes of substep `k` of the long step; False where a point went bad.

        Momentum of the nodes, velocities and places of the points, velocities of the nodes from theirs (MUSL), strains,
        stresses and pressures, masses and forces at the nodes.
        """
        parts, cuts = system.net.sums.shape[0], system.cuts
        begun, finished = system.clock.begun, system.clock.finished
        if first_pass <= SOLVE:
            # the list of points after the substep before is not needed by the nodes: one part more
            behind = 1 if k > 0 and last_pass == UPDATE else 0
            for part in shared(team, parts + behind):
                if part == parts:
                    follow(system, finished[k - 1])
                    continue
                for level in range(begun[k] + 1):
                    solve_nodes(cuts.solved[level, part], cuts.solved[level, part + 1], part, begun[k], system)
        if first_pass <= ADVANCE <= last_pass:
            for part in shared(team, parts):
                for level in range(finished[k] + 1):
                    advance_points(cuts.elements[level, part], cuts.elements[level, part + 1], part, system)
        if first_pass <= REMAP <= last_pass:
            for part in shared(team, parts):
                for level in range(finished[k] + 1):
                    remap_nodes(cuts.nodes[level, part], cuts.nodes[level, part + 1], finished[k], system)
        if last_pass == UPDATE:
            for part in shared(team, parts):
                update(team, part, finished[k], advance, system)
            return all_good(system.tally.bad)
        return True

    @step_kernel
    def long_step(team, first_pass, last_pass, advance, batch, system):
        """Do what other threads leave of a range of passes of all substeps; `advance` False maps the points only."""
        for number in range(batch.substeps.size):
            if number > 0 or first_pass == PLAN:
                for _ in shared(team, 1):
                    if number > 0:
                        finish(system)
                    if first_pass == PLAN:
                        plan(number, batch, system)
            if last_pass == PLAN:
                return
            for k in range(batch.first_substep if number == 0 else 0, batch.substeps[number]):
                if not substep(team, k, first_pass, last_pass, advance, system):
                    return
            if batch.substeps[number] == 0 or last_pass < UPDATE:
                return

    return long_step
