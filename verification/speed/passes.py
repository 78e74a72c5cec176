"""Processor time of the passes of a step, looked at from outside: which stage its threads are in, time and again."""

import itertools
import threading
import time as clock

import numpy as np

from mpm.machine.team import stage_at_hand
from mpm.step.substep import ADVANCE, PASSES
from verification.speed.stepping import steps, timed

LOOK = 2e-4  # s between two looks
#: Methods of the solver that a step calls only now and then, and what they are called in the table.
OCCASIONAL = {"_sort_physically": "sorting", "_update_wave_speed": "spectrum"}
PLANNING, SORTING = "follow_points, plan_step", "follow_points"


def kernel_times(solver, seconds):
    """Processor time of each pass per point-step [s], the rest of a step as "python", of a solver on one thread."""
    spent, looks = dict.fromkeys(OCCASIONAL.values(), 0.0), {}
    together, inner, running, done = solver.workers.together, [0.0], [None], threading.Event()

    def measured(function, name):
        def call(*arguments):
            inner.append(0.0)
            begin = clock.thread_time()
            result = function(*arguments)
            used = clock.thread_time() - begin
            spent[name] = spent.get(name, 0.0) + used - inner.pop()
            inner[-1] += used
            return result

        return call

    def stepping(kernel, *arguments):
        if kernel is not solver._long_step:
            return together(kernel, *arguments)
        batch, begin, found = arguments[3], stage_at_hand(solver.workers._meeting), []
        running[0] = found
        result = measured(together, "step")(kernel, *arguments)
        running[0] = None
        names, parts = zip(*stages(batch.substeps, solver.parts), strict=True)
        places = np.searchsorted(np.cumsum(parts), np.array(found, np.int64) - begin, side="right")
        for place in places:
            name = names[min(place, len(names) - 1)]
            looks[name] = looks.get(name, 0) + 1
        return result

    def look():
        while not done.is_set():
            found = running[0]
            if found is not None:
                found.append(stage_at_hand(solver.workers._meeting))
            clock.sleep(LOOK)

    for method, name in OCCASIONAL.items():
        setattr(solver, method, measured(getattr(solver, method), name))
    solver.workers.together, watch, points = stepping, threading.Thread(target=look, daemon=True), solver.point_steps
    try:
        watch.start()
        begin = clock.thread_time()
        timed(lambda: steps(solver), seconds)
        total = clock.thread_time() - begin
    finally:
        done.set()
        watch.join()
        del solver.workers.together
        for method in OCCASIONAL:
            delattr(solver, method)
    step = spent.pop("step")
    used = {name: step * count / sum(looks.values()) for name, count in looks.items()}
    used |= {name: seconds for name, seconds in spent.items() if seconds > 0}
    used["python"] = total - sum(used.values())
    made = solver.point_steps - points
    return {name: seconds / made for name, seconds in sorted(used.items(), key=lambda item: -item[1])}


def stages(substeps, parts):
    """Pass and number of parts of each stage of long steps of so many substeps, as `mpm.step.substep` does them."""
    for count in itertools.takewhile(bool, substeps):
        yield PLANNING, 1
        for k in range(count):
            yield PASSES[ADVANCE - 1], parts
            if k > 0:
                yield SORTING, 1  # the last part of that stage
            for name in PASSES[ADVANCE:]:
                yield name, parts
    yield PLANNING, 1
