"""A run from scene to files: mesh, simulation written as it goes, response of the ring, pictures."""

from __future__ import annotations

import contextlib
import logging
import numbers
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coupling.datasets import opened, read_attributes, read_pressures, write_responses
from coupling.files.checkpoint import remove_checkpoints
from coupling.files.folder import FIGURES, LOG_FILE, RUN_FILE, claimed, default_folder, reopened
from coupling.postprocess.quality import (
    lining_equilibrium,
    poor_errors,
    quality_attributes,
    quality_line,
    stored_quality,
)
from coupling.refused import Refused
from coupling.responses.respond import responses_on
from coupling.runs.memory import check_memory
from coupling.runs.progress_line import ProgressLine, in_notebook
from coupling.runs.recorded_simulation import RecordedSimulation
from coupling.runs.resume import find_remains
from coupling.scenes.plausibility import warn_in_python, warnings_of
from coupling.scenes.scene import as_scene
from mpm.threads import check_threads

if TYPE_CHECKING:
    import xarray as xr

    from coupling.scenes.scene import Scene


log = logging.getLogger("coupling.runs")


def run(
    scene: Scene | str | Path | None = None,
    out: str | Path | None = None,
    overwrite: bool = False,
    progress: Callable[[dict[str, Any]], None] | bool | None = None,
    threads: int | None = None,
    figures: bool = False,
    resume: bool = False,
    checkpoint_interval: float = 60.0,
    warn: Callable[[str], None] | None = None,
    response: bool | None = None,
) -> xr.Dataset:
    """Simulate a scene and return the pressures on the lining through time.

    Parameters
    ----------
    scene : coupling.Scene, str, path or None
        A scene, which is validated once more (`model_copy` does not), or what :func:`coupling.load_scene` takes: the
        name of a built-in one, or a file. None: that of the run to resume.
    out : str, path or None
        Folder for `run.nc` (written as the run goes on), `mesh.vtu`, `scene.toml`, `run.log` and `figures/`.
        None: `runs/<scene>` in the current folder, numbered when that one is taken.
    overwrite : bool
        Replace an earlier run in `out`.
    progress : callable, bool or None
        True: a line that says how far the run is (:class:`coupling.runs.progress_line.ProgressLine`); None: such a
        line in a notebook, and nothing elsewhere. A function is called a few times a second with a dict: stage ("mesh",
        "relax", "gush", "respond", "figures"), time [s], inflow_mass [kg/m], dt [s], dt_limit,
        point_steps_per_second, step, residual.
    threads : int or None
        None: all cores. The result does not depend on it.
    figures : bool
        Also draw all pictures.
    resume : bool
        Continue the run in `out`, however it was stopped, to the bits that it would have had uninterrupted.
    checkpoint_interval : float
        Wall time between checkpoints [s].
    warn : callable or None
        Called with what a user should know and the log says too: unusual numbers, damaged files, another processor.
        None: each is a Python warning, a :class:`structure.GushingWarning`.
    response : bool or None
        Also compute the forces in the scene's ring, into `/structure/beam_spring`; None: with the pictures.

    Returns
    -------
    xarray.Dataset
        See :func:`coupling.datasets.read_pressures`; `attrs["run"]` is the folder.

    Raises
    ------
    coupling.SceneError
        Not a scene, or one that can not be run.
    Refused
        Before anything starts: folder in use, not writable, not empty; too little memory; nothing to resume, or with
        another scene or version; arguments of a wrong type.
    mpm.RunFailed
        Non-finite values or no initial equilibrium; the file stays readable, with status 'failed'.
    KeyboardInterrupt
        Ctrl-C, SIGTERM; the file stays readable, with status 'interrupted', and the run can be resumed.
    OSError
        Disk full, for instance; the same.
    """
    _check_arguments(out, progress, threads, checkpoint_interval, warn)
    if resume and (out is None or overwrite):
        raise Refused("--resume: needs the folder of the run, and no --overwrite; give it as --out DIR")
    given = None if scene is None else as_scene(scene)
    if not resume:
        if given is None:
            raise Refused("scene: must be given unless a run is resumed; name a built-in one, as 'quick'")
        check_memory(given)
        out = default_folder(given.name) if out is None else out
    held = reopened(out) if resume else claimed(out, overwrite)
    with held as folder, _logged_to(folder / LOG_FILE), _shown(progress) as report:
        remains = find_remains(folder, given, _teller(warn)) if resume else None
        if remains is not None:
            chosen: Scene = remains.scene
            check_memory(chosen)
        else:
            chosen = given
            for warning in warnings_of(chosen):
                _teller(warn)(warning)
        if remains is not None and remains.finished:
            remove_checkpoints(folder)
            pressures = read_pressures(folder)
        else:
            simulation = RecordedSimulation(
                chosen, folder, report, threads, checkpoint_interval, remains, _teller(warn)
            )
            pressures = simulation.run()
        failure = None
        if (figures if response is None else response) and chosen.ring is not None and chosen.tunnels:
            report({"stage": "respond"})
            failure = _answered(chosen, folder / RUN_FILE, pressures)
        with opened(folder) as file:
            try:
                if figures:
                    from coupling.figures import draw_run

                    report({"stage": "figures"})
                    draw_run(file, folder / FIGURES)
            finally:
                errors = stored_quality(read_attributes(file))
                log.info("errors: %s", quality_line(errors))
                for warning in poor_errors(errors):
                    _teller(warn)(warning)
        if failure is not None:
            drawn = " and drawn" if figures else ""
            failure.add_note(f"the ground is computed{drawn} in {folder}; change the ring, then: gush respond {folder}")
            raise failure
    pressures.attrs |= {"run": str(folder), "scene_name": chosen.name}
    return pressures


def _check_arguments(out, progress, threads, checkpoint_interval, warn):
    try:
        check_threads(threads)
    except ValueError as problem:
        raise Refused(str(problem)) from None
    if out is not None and not isinstance(out, str | os.PathLike):
        raise Refused(f"out: must be the path of a folder, got {out!r}; leave it out for runs/SCENE")
    shown = None if isinstance(progress, bool) else progress
    for name, function in (("progress", shown), ("warn", warn)):
        if function is not None and not callable(function):
            raise Refused(f"{name}: must be a function, got {function!r}; give one that takes what it is told")
    if isinstance(checkpoint_interval, bool) or not isinstance(checkpoint_interval, numbers.Real):
        raise Refused(f"checkpoint_interval: must be a number of seconds, got {checkpoint_interval!r}; give e.g. 60")
    if not checkpoint_interval >= 0:
        raise Refused(f"checkpoint_interval: must not be negative, got {checkpoint_interval!r} s; give e.g. 60")


def _teller(warn):
    def tell(message):
        log.warning("%s", message)
        (warn if warn is not None else warn_in_python)(message)

    return tell


def _shown(progress):
    """What is told of the progress, as a context."""
    if callable(progress):
        return contextlib.nullcontext(progress)
    return ProgressLine(quiet=not (in_notebook() if progress is None else progress))


def _answered(scene, file, pressures):
    """Store the responses of the rings; returns what refused or failed, None for nothing."""
    from structure import LiningFailure

    answers, failure, attributes = {}, None, {}
    try:
        for key, response in responses_on(scene, pressures):
            answers[key] = response
    except (Refused, LiningFailure) as problem:
        log.error("no response of the ring: %s", problem)
        failure = problem
    for (_, tunnel), response in answers.items():
        if tunnel is None:
            attributes = quality_attributes({"lining_equilibrium": lining_equilibrium(response)})
    if answers:
        write_responses(file, answers, **attributes)
    return failure


@contextlib.contextmanager
def _logged_to(path):
    handler = logging.FileHandler(path, encoding="utf-8")
    handler.handleError = lambda record: None  # a full disk stops the run where it loses something
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    level = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)
        handler.close()
