"""What becomes of an extreme: stable, refused or a bug; judged here, or in a process of its own."""

import time as clock
import warnings
from dataclasses import dataclass

from mpm.mesh import MeshError
from mpm.solver import RunFailed
from verification.child import in_a_process

STABLE, REFUSED, BUG = "stable", "refused", "bug"
LIMIT = 240.0  # processor seconds of a case; more is a hang


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
    """Run a case in a process of its own, which ends after `limit` processor seconds; a crash or a hang is a bug."""
    begin = clock.monotonic()
    how, outcome = in_a_process(lambda: judge(case), limit)
    if how == "returned":
        return outcome
    late = how == "killed" and outcome in ("SIGPROF", "SIGALRM")
    reason = f"not done after {limit:g} s" if late else f"process ended with {outcome}"
    return Verdict(case.name, case.title, BUG, reason, {}, clock.monotonic() - begin)


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
