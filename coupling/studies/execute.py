"""Running the cases of a study: in this process, in several of this machine, or on a scheduler that is there."""

from __future__ import annotations

import json
import numbers
import os
import time as clock
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coupling.files.replace import replace_file
from coupling.studies.case import run_case
from coupling.studies.cases import cases, check_backends
from coupling.studies.design import Study, StudyError, is_folder, load_study
from coupling.studies.folder import CASES, STATUS_FILE, STUDY_FILE, case_file
from coupling.studies.progress import StudyState, watching

if TYPE_CHECKING:
    import xarray as xr

#: Times that a case may lose its worker, the last ones with nothing beside it.
LOSSES = 3
#: Workers that were lost are started again within seconds [s].
LONGEST_WITHOUT_WORKERS = 60.0
#: What collecting and storing the cases loads; loaded while the workers load what they need.
COLLECTING = ("coupling.studies.collect", "structure.lining", "pint", "dask.array")


def study(
    what: str | Path | dict | Study,
    out: str | Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[str], None] | None = None,
    watch: Callable[[StudyState], None] | None = None,
) -> xr.Dataset:
    """Run a study and return its dataset.

    Cases that are in `out` already are not run again: each has a folder named after everything that decides its
    result. A case that fails, or whose worker is lost three times, costs only itself.

    Parameters
    ----------
    what : str, path, dict or Study
        Built-in study, TOML file, the folder of a study that is to go on, or the same as a dictionary.
    out : str or path, optional
        Folder; the one that is to go on, or studies/NAME, when left out. Studies may share one, and then equal cases.
    workers : int, optional
        Processes on this machine, which share its cores; number of cores when left out; 0 runs in this process.
    scheduler : str, optional
        Address of a dask scheduler to use instead; its workers must see `out` under the same path.
    progress : callable, optional
        Called with one line of text whenever a case ends.
    watch : callable, optional
        Called every second, from a thread of its own, with a :class:`coupling.studies.progress.StudyState`.

    Returns
    -------
    xarray.Dataset
        See :func:`coupling.studies.collect.collect`.

    Raises
    ------
    StudyError
        Before anything runs: an invalid study or scene, or a folder that cannot be used.
    """
    _check_arguments(out, workers)
    plan = load_study(what)
    todo = cases(plan)
    check_backends(plan, todo)
    folder = study_folder(what, plan, out)
    tell = progress if progress is not None else lambda line: None
    try:
        (folder / CASES).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"study folder '{folder}': cannot be used: {error.strerror}; choose another --out") from None
    _write_json(folder / STUDY_FILE, plan.model_dump(mode="json"))
    missing = {case.key: case for case in todo if not case_file(folder, case).is_file()}
    tell(f"{plan.name}: {len(todo)} cases, {len(todo) - sum(c.key in missing for c in todo)} of them are there already")
    failures: dict[str, str] = {}
    with watching(folder / CASES, {case.key: case.index for case in todo}, failures, watch):
        outcomes = _run(plan, list(missing.values()), folder, workers, scheduler)
        try:
            for count, (case, failure) in enumerate(outcomes, start=1):
                if failure:
                    failures[case.key] = failure
                outcome = f"failed: {failure}" if failure else "done"
                tell(f"{count} of {len(missing)}: {case.name}: {outcome}")
        except KeyboardInterrupt as stop:
            stop.add_note(f"what is done is kept; go on with: gush study {folder}")
            raise
    failed = {key: {"status": "failed", "message": message} for key, message in failures.items()}
    finished = {"status": "finished", "message": ""}
    status = {case.key: {"parameters": case.parameters, **failed.get(case.key, finished)} for case in todo}
    _write_json(folder / STATUS_FILE, status)
    from coupling.studies.collect import collect  # by now loaded beside the workers

    return collect(plan, todo, folder, failures)


def study_folder(what: str | Path | dict | Study, plan: Study, out: str | Path | None) -> Path:
    """Where a study is written: `out`, the folder that it was read from, or studies/NAME."""
    if out is not None:
        return Path(out)
    return Path(what) if is_folder(what) else Path("studies") / plan.name


def _check_arguments(out, workers):
    if out is not None and not isinstance(out, str | os.PathLike):
        raise StudyError(f"out: must be the path of a folder, got {out!r}; leave it out for studies/NAME")
    whole = isinstance(workers, numbers.Integral) and not isinstance(workers, bool)
    if workers is not None and not (whole and workers >= 0):
        raise StudyError(f"workers: must be a whole number from 0, got {workers!r}; leave it out for one a core")


def _run(plan, missing, folder, workers, scheduler):
    if not missing:
        return
    cores = os.cpu_count() or 1
    count = min(cores if workers is None else workers, len(missing))
    if scheduler is not None:
        yield from _on_cluster(plan, missing, folder, scheduler)
    elif count > 1:
        yield from _in_processes(plan, missing, folder, count, max(1, cores // count))
    else:
        yield from _in_this_process(plan, missing, folder, cores)


def _arguments(plan, case, folder, threads=1):
    return case.scene.source, str((folder / CASES / case.key).absolute()), plan.backends, plan.records, threads


def _in_this_process(plan, missing, folder, threads):
    for case in missing:
        try:
            run_case(*_arguments(plan, case, folder, threads))
        except Exception as failure:  # whatever goes wrong in a case is reported and costs only that case
            yield case, _text(failure)
        else:
            yield case, ""


def _in_processes(plan, missing, folder, count, threads):
    from coupling.studies.pool import Pool
    from coupling.studies.worker import WorkerLost

    def run(cases):
        found = {case.key: case for case in cases}
        calls = {key: _arguments(plan, case, folder, threads) for key, case in found.items()}
        with Pool(min(count, len(cases))) as pool:
            for module in COLLECTING:
                import_module(module)
            for key, ended in pool.run(run_case, calls):
                yield found[key], ended, isinstance(ended, WorkerLost)

    yield from _outlasting_losses(run, missing)


def _outlasting_losses(run, missing):
    """Cases and their failures as they end; `run` yields of some cases also whether their worker was lost.

    What lost its worker is run again with nothing beside it, so that a further loss is its own doing.
    """
    again = []
    for case, failure, lost in run(missing):
        if lost:
            again.append(case)
        else:
            yield case, failure
    for case in again:
        for _ in range(LOSSES - 1):
            ((_, failure, lost),) = run([case])
            if not lost:
                break
        yield case, failure


def _on_cluster(plan, missing, folder, scheduler):
    import dask
    from distributed import Client

    # Every loss of a worker comes back here at once: the scheduler would blame all cases that waited on it.
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}), Client(scheduler) as client:
        at_once = sum(worker["nthreads"] for worker in client.scheduler_info(n_workers=-1)["workers"].values())
        yield from _outlasting_losses(lambda cases: _submitted(client, plan, cases, folder, max(at_once, 1)), missing)


def _submitted(client, plan, todo, folder, at_once):
    """Cases, their failures and whether their worker was lost, never more of them in work than there are threads."""
    from distributed import CancelledError, KilledWorker, as_completed

    waiting = list(reversed(todo))
    running = {}
    pool = as_completed()

    def submit():
        case = waiting.pop()
        future = client.submit(run_case, *_arguments(plan, case, folder), key=f"{case.key}-{os.urandom(4).hex()}")
        running[future] = case
        pool.add(future)

    for _ in range(min(at_once, len(waiting))):
        submit()
    while running:
        _wait(client, pool)
        future = next(pool)
        case = running.pop(future)
        failure = future.exception()
        if waiting:
            submit()
        yield case, _text(failure), isinstance(failure, KilledWorker | CancelledError)


def _wait(client, pool):
    """Until a case has ended.

    Raises StudyError: when no worker has been there for a while: a case that was given to none would be waited for in
    vain.
    """
    seen = clock.monotonic()
    while not pool.has_ready():
        clock.sleep(0.1)
        if client.scheduler_info(n_workers=-1)["workers"]:
            seen = clock.monotonic()
        elif clock.monotonic() - seen > LONGEST_WITHOUT_WORKERS:
            raise StudyError(
                f"study: no worker has been there for {LONGEST_WITHOUT_WORKERS:g} s; what is done is kept, repeat the "
                "command to go on"
            )


def _text(failure):
    return "" if failure is None else f"{type(failure).__name__}: {failure}"


def _write_json(path: Path, data: Any):
    replace_file(path, json.dumps(data, indent=1) + "\n")
