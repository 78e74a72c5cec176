"""A run from scene to files: mesh, simulation written as it goes, response of the ring, pictures."""

import contextlib
import logging

from coupling.checkpoint import remove_checkpoints
from coupling.datasets import read_attributes, read_pressures, write_response
from coupling.plausibility import warnings_of
from coupling.quality import poor_errors, stored_quality
from coupling.recorded_simulation import RecordedSimulation, write_quality
from coupling.resume import find_remains
from coupling.run_folder import FIGURES, LOG_FILE, RUN_FILE, RunRefused, claimed, default_folder, reopened
from coupling.scene import SceneError, ring_of
from structure.models import model_name

BYTES_PER_ELEMENT = 2000  # points, buffers and the copy made while sorting, of a case with 3 points an element

log = logging.getLogger(__name__)


def run(
    scene=None, out=None, overwrite=False, progress=None, threads=None, figures=False, resume=False,
    checkpoint_interval=60.0, warn=None,
):  # fmt: skip
    """Simulate a scene and return the pressures on the lining through time.

    Parameters
    ----------
    scene : coupling.Scene or None
        From :func:`coupling.load_scene`. None: that of the run to resume.
    out : str, path or None
        Folder for `run.nc` (written as the run goes on), `mesh.vtu`, `scene.toml`, `run.log` and `figures/`.
        None: `runs/<scene>` in the current folder, numbered when that one is taken.
    overwrite : bool
        Replace an earlier run in `out`.
    progress : callable or None
        Called a few times a second with a dict: stage ("mesh", "relax", "gush", "respond", "figures"), time [s],
        inflow_mass [kg/m], dt [s], dt_limit, point_steps_per_second, step, residual.
    threads : int or None
        None: all cores. The result does not depend on it.
    figures : bool
        Also compute the response of the scene's ring into `/structure/beam-spring` and draw all pictures.
    resume : bool
        Continue the run in `out`, however it was stopped, to the bits that it would have had uninterrupted.
    checkpoint_interval : float
        Wall time between checkpoints [s].
    warn : callable or None
        Called with what a user should know and the log says too: unusual numbers, damaged files, another processor.

    Returns
    -------
    xarray.Dataset
        See :func:`coupling.datasets.read_pressures`; `attrs["run"]` is the folder.

    Raises
    ------
    RunRefused
        Before anything starts: folder in use, not writable, not empty; too little memory; nothing to resume, or with
        another scene or version.
    mpm.RunFailed
        Non-finite values or no initial equilibrium; the file stays readable, with status 'failed'.
    KeyboardInterrupt
        Ctrl-C, SIGTERM; the file stays readable, with status 'interrupted', and the run can be resumed.
    OSError
        Disk full, for instance; the same.
    """
    if resume and (out is None or overwrite):
        raise RunRefused("--resume: needs the folder of the run, and no --overwrite; give it as --out DIR")
    if not resume:
        if scene is None:
            raise RunRefused("scene: must be given unless a run is resumed; load one with coupling.load_scene")
        check_memory(scene.mpm)
        out = default_folder(scene.name) if out is None else out
    report = progress if progress is not None else lambda state: None
    held = reopened(out) if resume else claimed(out, overwrite)
    with held as folder, _logged_to(folder / LOG_FILE):
        remains = find_remains(folder, scene, _teller(warn)) if resume else None
        if remains is not None:
            scene = remains.scene
            check_memory(scene.mpm)
        else:
            for warning in warnings_of(scene):
                _teller(warn)(warning)
        if remains is not None and remains.finished:
            remove_checkpoints(folder)
        else:
            RecordedSimulation(scene, folder, report, threads, checkpoint_interval, remains).run()
        try:
            if figures:
                finish(scene, folder, report)
        finally:
            for warning in poor_errors(stored_quality(read_attributes(folder))):
                _teller(warn)(warning)
        pressures = read_pressures(folder)
    pressures.attrs |= {"run": str(folder), "scene_name": scene.name}
    return pressures


def _teller(warn):
    def tell(message):
        log.warning("%s", message)
        if warn is not None:
            warn(message)

    return tell


def finish(scene, folder, progress):
    """Response of the ring to a run's pressures and all pictures; returns the paths of the pictures.

    Raises
    ------
    RunRefused, structure.LiningFailure
        As :func:`respond`, once the pictures of the ground are drawn.
    """
    from coupling.figures import draw_run
    from structure import LiningFailure

    failure = None
    if scene.ring is not None and scene.mpm.tunnels:
        progress({"stage": "respond"})
        try:
            response = respond(scene, read_pressures(folder))
            write_response(folder / RUN_FILE, response)
            write_quality(folder / RUN_FILE, response)
            respond_beside(scene, folder)
        except (RunRefused, LiningFailure) as problem:
            log.error("ring: %s", problem)
            failure = problem
    progress({"stage": "figures"})
    pictures = draw_run(folder, folder / FIGURES)
    if failure is not None:
        failure.add_note(f"the ground is computed and drawn in {folder}; change the ring, then: gush respond {folder}")
        raise failure
    return pictures


def respond(scene, pressures, backend="beam-spring", tunnel=None):
    """Response of the scene's ring to the pressures on a tunnel, by the lining model of that name.

    tunnel : int or None, None: the one with the gate.

    Raises
    ------
    RunRefused
        No ring, no such model, or pressures or ring that the model does not take.
    structure.LiningFailure
        No equilibrium.
    """
    number = gate_tunnel(scene) if tunnel is None else tunnel
    if "tunnel" in pressures.dims:
        pressures = pressures.isel(tunnel=number, drop=True)
    try:
        ring = ring_of(scene, number)
    except SceneError as problem:
        raise RunRefused(str(problem)) from None
    return respond_by_name(ring, pressures, backend)


def gate_tunnel(scene):
    """Number of the tunnel with the gate, 0 without one."""
    return scene.mpm.gate.tunnel if scene.mpm.gate else 0


def respond_beside(scene, folder, backend="beam-spring"):
    """Store the responses of the tunnels without the gate, each of its own ring; returns their numbers."""
    if scene.ring is None:
        return []
    others = [k for k in range(len(scene.mpm.tunnels)) if k != gate_tunnel(scene)]
    for k in others:
        response = respond(scene, read_pressures(folder), backend, k)
        write_response(folder / RUN_FILE, response, model_name(backend), tunnel=k)
    return others


def respond_by_name(ring, pressures, backend, **options):
    """Response of a ring by the lining model of that name; `options` go to the model.

    Raises
    ------
    RunRefused, structure.LiningFailure
        As :func:`respond`.
    """
    from structure import lining_model
    from structure.lining import at_whole_degrees

    try:
        return at_whole_degrees(lining_model(backend)(ring, **options).respond(pressures))
    except ValueError as problem:
        raise RunRefused(str(problem)) from problem


def check_memory(mpm_scene):
    """Refuse a scene whose mesh and points would not fit into the memory that is free."""
    free, need = free_memory_bytes(), mpm_scene.estimated_elements * BYTES_PER_ELEMENT
    if free is not None and need > 0.8 * free:
        raise RunRefused(
            f"discretisation: about {mpm_scene.estimated_elements:.2g} elements need about {need / 1e9:.1f} GB, "
            f"{free / 1e9:.1f} GB of memory are free; raise element_size, element_size_lining or size_growth"
        )


def free_memory_bytes():
    """Memory that a new process can use without swapping; None where the system does not tell."""
    with contextlib.suppress(OSError, ValueError), open("/proc/meminfo", encoding="ascii") as lines:
        for line in lines:
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    return None


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


__all__ = ["RunRefused", "check_memory", "finish", "free_memory_bytes", "respond", "respond_by_name", "run"]
