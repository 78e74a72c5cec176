"""Runs at the edge of what a scene can ask for, each with a verdict: stable, refused or a bug."""

import math
import multiprocessing
import queue
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

STABLE, REFUSED, BUG = "stable", "refused", "bug"
LIMIT = 240.0  # wall seconds of a case; more is a hang


@dataclass(frozen=True)
class Case:
    """One extreme.

    Parameters
    ----------
    name : str
    title : str
        What is extreme about it.
    run : callable
        run(**settings) -> (faults, measures), of `verification.stability.monitor.Monitor`.
    settings : dict
    representative : bool
        One of those that the tests run.
    """

    name: str
    title: str
    run: Callable[..., tuple[list[str], dict[str, float]]]
    settings: dict[str, Any] = field(default_factory=dict)
    representative: bool = False


@dataclass(frozen=True)
class Verdict:
    """Outcome of a case: verdict, its reason, the numbers behind it and the wall time [s]."""

    name: str
    title: str
    verdict: str
    reason: str
    measures: dict[str, float]
    seconds: float


def judge(case):
    """Run a case here; whatever it raises becomes part of the verdict."""
    import warnings

    from mpm.mesh import MeshError
    from mpm.solver import RunFailed

    begin, measures = clock.monotonic(), {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            faults, measures = case.run(**case.settings)
        verdict, reason = (BUG, "; ".join(faults)) if faults else (STABLE, "")
    except RunFailed as failure:
        verdict, reason = BUG, f"run failed: {failure}"
    except (ValueError, MeshError) as error:  # a scene that is refused says so with a ValueError before it runs
        refused = getattr(error, "title", "") == "Scene" or isinstance(error, MeshError)
        verdict, reason = (REFUSED if refused else BUG), _message(error)
    except Exception as error:  # a traceback in a user's face
        verdict, reason = BUG, f"{type(error).__name__}: {error}"
    return Verdict(case.name, case.title, verdict, reason, measures, clock.monotonic() - begin)


def judge_apart(case, limit=LIMIT):
    """Run a case in a process of its own, which ends after `limit` seconds; a crash or a hang is a bug."""
    context = multiprocessing.get_context("spawn")
    results = context.Queue()
    process = context.Process(target=_send, args=(case, results))
    begin = clock.monotonic()
    process.start()
    outcome = None
    while outcome is None and clock.monotonic() - begin < limit and (process.is_alive() or not results.empty()):
        try:
            outcome = results.get(timeout=0.2)
        except queue.Empty:
            continue
    if process.is_alive() and outcome is None:
        process.terminate()
    process.join()
    if outcome is None:
        seconds = clock.monotonic() - begin
        reason = f"not done after {limit:g} s" if seconds >= limit else f"process ended with {process.exitcode}"
        return Verdict(case.name, case.title, BUG, reason, {}, seconds)
    return outcome


def _send(case, results):
    results.put(judge(case))


def _message(error):
    details = getattr(error, "errors", None)
    if details is None:
        return str(error)
    found = details()
    # a soil that is refused also leaves the list of soils empty: the second message is an echo
    told = [d for d in found if d["type"] != "too_short"] or found
    return "; ".join(f"{_place(d)}{d['msg'].removeprefix('Value error, ')}" for d in told)


def _place(detail):
    return "" if detail["type"] == "value_error" else f"{detail['loc'][-1]} = {detail['input']:g}: "


def follow(monitor, seconds, most_steps=200_000, events=()):
    """Step until `seconds` of simulated time; events: (time, callable) in order of time.

    Returns (faults, measures). More than `most_steps` is a fault: a time step that dies is a hang.
    """
    solver, pending = monitor.solver, list(events)
    while solver.time < seconds * (1 - 1e-12):
        while pending and solver.time >= pending[0][0] * (1 - 1e-12):
            pending.pop(0)[1]()
        target = min(seconds, pending[0][0]) if pending else seconds
        monitor.step(target - solver.time)
        if solver.step_count > most_steps:
            return [f"only {solver.time:.3g} s after {most_steps} steps", *monitor.faults()], monitor.measures()
    return monitor.faults(), monitor.measures()


def decades(low, high):
    """Powers of ten from low to high, both included."""
    first, last = round(math.log10(low)), round(math.log10(high))
    return [10.0**k for k in range(first, last + 1)]
