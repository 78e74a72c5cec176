"""The threads of a solver: idle between uses, and never more of them at work than asked for."""

import numbers
from concurrent.futures import ThreadPoolExecutor, wait

import numpy as np

from mpm.machine.team import Team, meeting_width, stage_at_hand


def check_threads(threads):
    """Refuse what is no number of threads; None stands for all cores.

    Raises
    ------
    ValueError
    """
    if threads is None:
        return
    if isinstance(threads, bool) or not isinstance(threads, numbers.Integral) or threads < 1:
        raise ValueError(f"threads: must be a whole number from 1, got {threads!r}; leave it out (None) for all cores")


class Threads:
    """Threads that run compiled code without the interpreter's lock.

    Parameters
    ----------
    count : int
        With the thread that calls.
    most_parts : int
        Of a stage of the kernels that they share.
    """

    def __init__(self, count, most_parts):
        self.count = count
        self._pool = ThreadPoolExecutor(count - 1) if count > 1 else None
        self._meeting = np.zeros(meeting_width(most_parts), np.int64)

    def together(self, kernel, *arguments):
        """Run a kernel of many stages by all threads: kernel(team, *arguments).

        One that is late finds all done by the others (`mpm.machine.team`), so nobody waits for its end.

        Returns
        -------
        list of concurrent.futures.Future
            The other threads.
        """
        stage, others = stage_at_hand(self._meeting), []
        teams = [Team(thread, self._meeting, np.array([stage])) for thread in range(self.count)]
        try:
            for team in teams[1:]:
                others.append(self._pool.submit(kernel, team, *arguments))
            kernel(teams[0], *arguments)
        except BaseException:  # an interrupt: the others would go on behind the caller's back
            wait(others)
            raise
        return [other for other in others if not other.cancel()]

    def over(self, cuts, kernel, *arguments, per_range=()):
        """Run a kernel once for each range between two `cuts`: kernel(first, last, *arguments, *own).

        Each range gets its own of the `per_range` arrays.
        """
        ranges = range(len(cuts) - 1)

        def call(r):
            kernel(cuts[r], cuts[r + 1], *arguments, *(a[r] for a in per_range))

        if self._pool is None:
            for r in ranges:
                call(r)
        else:
            others = self._pool.map(call, ranges[1:])
            call(0)
            list(others)  # waits, and raises what they raised
