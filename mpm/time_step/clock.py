"""The clock of a long step: how the levels step on the way to a time, at the least work, within the critical step."""

from typing import NamedTuple

import numpy as np

from mpm.machine.compile import allocating_part, kernel
from mpm.time_step.levels import MOST_LEVELS

ALMOST = 1.1  # a step shortened by less to meet an output time counts as limited by what limited it before
ALMOST_ALL = 1 - 1e-12  # of the time until the end: what is left is rounding
LIMITS = ("acoustic", "advective", "output")  # what a time step may be limited by
(ACOUSTIC, ADVECTIVE, OUTPUT) = range(len(LIMITS))
#: Places in `Clock.times` [s]: now, until when, length of the long step, step of level 0, where now and end count from.
(NOW, END, SPAN, SMALLEST, ORIGIN) = range(5)


class Clock(NamedTuple):
    """Time steps of the levels, and what of the scene depends on them."""

    times: np.ndarray  # (5,) [s]
    periods: np.ndarray  # (n_levels,) int64, steps of the finest level that holds points in one of each
    dt_of_level: np.ndarray  # (n_levels,) [s]
    flip_of_level: np.ndarray  # (n_levels,) share of FLIP
    filter_of_level: np.ndarray  # (n_levels,) share of the filter of the pore pressure
    begun: np.ndarray  # (most substeps,) the coarsest level that begins a step in each substep
    finished: np.ndarray  # (most substeps,) and that ends one
    finest_around: np.ndarray  # (n_elements,) int8, finest level at the nodes of an element
    ahead: np.ndarray  # (n_elements,) `damping`, and what `mpm.time_step.levels.Levels.ahead` adds where levels meet
    damping: float  # see `mpm.scene.Numerics.stress_damping`

    @classmethod
    def of(cls, levels, damping):
        """A clock that stands still.

        Parameters
        ----------
        levels : mpm.time_step.levels.Levels
        damping : float
        """
        n, most = levels.count, 2 ** (MOST_LEVELS - 1)
        return cls(
            np.zeros(5), np.ones(n, np.int64), *np.zeros((3, n)), *np.zeros((2, most), np.int64),
            levels.finest_around, np.full(len(levels.of_element), damping), damping,
        )  # fmt: skip

    @property
    def time(self):
        """Simulated time [s]."""
        return float(self.times[ORIGIN] + self.times[NOW])

    def map_only(self):
        """One substep of no length, of all levels."""
        self.times[SPAN] = self.times[SMALLEST] = 0.0
        self.dt_of_level[:] = 0.0
        self.begun[0] = self.finished[0] = len(self.periods) - 1


class Pace(NamedTuple):
    """What of scene and state decides about the time step: see `mpm.scene.Numerics` and `mpm.time_step.spectrum`."""

    courant: float
    pic_rate: float
    pressure_filter: float
    longest_step: float  # of level 0, from the spectrum [s]
    wave_speed: float  # that stands for the critical step [m/s]


@kernel
def longest_time_step(limits, pace):
    """Largest stable time step of level 0, from the limits of the parts of the mesh and the spectrum.

    Parameters
    ----------
    limits : (n, 2) float64
        Per part the smallest altitude / (wave speed + point speed) [s] and that point speed [m/s].
    pace : Pace

    Returns
    -------
    dt : float
        [s]
    limit : int
        Place in `LIMITS`: ADVECTIVE if the point speed is above the wave speed where dt is smallest, or ACOUSTIC.
    """
    limit, speed = pace.longest_step, 0.0
    for k in range(limits.shape[0]):
        if limits[k, 0] < limit or (limits[k, 0] == limit and limits[k, 1] < speed):
            limit, speed = limits[k, 0], limits[k, 1]
    return pace.courant * limit, ADVECTIVE if speed > pace.wave_speed else ACOUSTIC


@kernel
def choose_periods(points, most, periods):
    """How the levels step on the way to the next output time, at the least work.

    Parameters
    ----------
    points : (n_levels,) int
        Points held by each level.
    most : float
        Time until then over the step of the finest level that holds points [-]; may be infinite.
    periods : (n_levels,) int64
        Written: steps of the finest level that holds points in one step of each level, powers of two, ascending.

    Returns
    -------
    steps : int
        Steps of the coarsest level until then, all of one length; 1 where there is no such time.
    """
    count = points.size
    first, last = 0, 0
    for level in range(count - 1, -1, -1):
        if points[level] > 0:
            first = level
            last = max(last, level)
    best, steps, least = first, 1, np.inf
    for top in range(first, last + 1):
        longest = 1 << (top - first)
        several = max(np.ceil(most / longest - 1e-9), 1.0) if most < np.inf else 1.0
        work = 0.0
        for level in range(count):
            work += points[level] * several * (1 << (top - min(max(level, first), top)))
        if most == np.inf:
            work /= longest
        if work <= least:
            best, steps, least = top, np.int64(several), work
    for level in range(count):
        periods[level] = 1 << (min(max(level, first), best) - first)
    return steps


@allocating_part
def plan_step(clock, pace, limits, start, occupied, n_occupied, element_cuts, level_of_element):
    """Set the clock for a long step that does not lead beyond `times[END]`.

    Parameters
    ----------
    limits : (n, 2) float64, of `longest_time_step`
    start, occupied, n_occupied : of the points by element
    element_cuts, level_of_element : of :class:`mpm.time_step.levels.Levels`

    Returns
    -------
    substeps, limit : int
        Number of steps of the finest level that holds points; place in `LIMITS`.
    """
    levels, times = clock.periods.size, clock.times
    smallest, limit = longest_time_step(limits, pace)
    finest = 1 << level_of_element[occupied[0]] if n_occupied > 0 else 1
    smallest *= finest
    points, periods = np.empty(levels, np.int64), np.empty(levels, np.int64)
    for level in range(levels):
        points[level] = start[element_cuts[level + 1]] - start[element_cuts[level]]
    remaining = times[END] - times[NOW]
    steps = choose_periods(points, remaining / smallest, periods)
    count = periods[-1]
    if steps * count * smallest > remaining:
        if steps * count * smallest > ALMOST * remaining:
            limit = OUTPUT
        smallest = remaining / (steps * count)
    changed = False
    for level in range(levels):
        changed = changed or periods[level] != clock.periods[level]
        clock.periods[level] = periods[level]
        clock.dt_of_level[level] = smallest * periods[level]
        clock.flip_of_level[level] = np.exp(-pace.pic_rate * clock.dt_of_level[level])
        # as often as those of the finest level
        clock.filter_of_level[level] = 1.0 - (1.0 - pace.pressure_filter) ** periods[level]
    if changed:
        for e in range(clock.ahead.size):
            share = periods[clock.finest_around[e]] / periods[level_of_element[e]]
            clock.ahead[e] = clock.damping + 0.5 * (1.0 - share)
    for k in range(count):
        clock.begun[k] = clock.finished[k] = -1
        for level in range(levels):
            clock.begun[k] += k % periods[level] == 0
            clock.finished[k] += (k + 1) % periods[level] == 0
    times[SPAN], times[SMALLEST] = smallest * count, smallest / finest
    return count, limit
