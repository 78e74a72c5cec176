"""A run from scene to files: mesh, simulation written as it goes, response of the ring, pictures."""

import contextlib
import logging
import time as clock

from coupling.datasets import RunWriter, read_history, read_pressures, write_attributes, write_response
from coupling.provenance import root_attributes
from coupling.quality import quality, quality_attributes, quality_line
from coupling.run_folder import (
    FIGURES,
    LOG_FILE,
    MESH_FILE,
    RUN_FILE,
    SCENE_FILE,
    RunRefused,
    claimed,
    default_folder,
)

BYTES_PER_ELEMENT = 2000  # points, buffers and the copy made while sorting, of a case with 3 points an element

log = logging.getLogger(__name__)


def run(scene, out=None, overwrite=False, progress=None, threads=None, figures=False):
    """Simulate a scene and return the pressures on the lining through time.

    Parameters
    ----------
    scene : coupling.Scene
        From :func:`coupling.load_scene`.
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

    Returns
    -------
    xarray.Dataset
        See :func:`coupling.datasets.read_pressures`; `attrs["run"]` is the folder.

    Raises
    ------
    RunRefused
        Before anything starts: folder in use, not writable, not empty; too little memory.
    mpm.RunFailed
        Non-finite values or no initial equilibrium; the file stays readable, with status 'failed'.
    KeyboardInterrupt
        Ctrl-C; the file stays readable, with status 'interrupted'.
    """
    check_memory(scene.mpm)
    report = progress if progress is not None else lambda state: None
    out = default_folder(scene.name) if out is None else out
    with claimed(out, overwrite) as folder, _logged_to(folder / LOG_FILE):
        _simulate(scene, folder, report, threads)
        if figures:
            finish(scene, folder, report)
        pressures = read_pressures(folder)
    pressures.attrs |= {"run": str(folder), "scene_name": scene.name}
    return pressures


def finish(scene, folder, progress):
    """Response of the ring to a run's pressures and all pictures; returns the paths of the pictures."""
    from coupling.figures import draw_run

    if scene.ring is not None and scene.mpm.tunnels:
        progress({"stage": "respond"})
        response = respond(scene, read_pressures(folder))
        write_response(folder / RUN_FILE, response)
        _write_quality(folder / RUN_FILE, response)
    progress({"stage": "figures"})
    return draw_run(folder, folder / FIGURES)


def respond(scene, pressures, backend="beam-spring"):
    """Response of the scene's ring to the pressures on the tunnel with the gate, by the lining model of that name.

    Raises
    ------
    RunRefused
        No ring, no such model, or pressures or ring that the model does not take.
    structure.LiningFailure
        No equilibrium.
    """
    if scene.ring is None:
        raise RunRefused(f"scene '{scene.name}': has no [ring]; add one to get internal forces")
    if "tunnel" in pressures.dims:
        pressures = pressures.isel(tunnel=scene.mpm.gate.tunnel if scene.mpm.gate else 0, drop=True)
    return respond_by_name(scene.ring, pressures, backend)


def respond_by_name(ring, pressures, backend, **options):
    """Response of a ring by the lining model of that name; `options` go to the model.

    Raises
    ------
    RunRefused, structure.LiningFailure
        As :func:`respond`.
    """
    from structure import lining_model

    try:
        return lining_model(backend)(ring, **options).respond(pressures)
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


def _simulate(scene, folder, report, threads):
    import mpm

    attributes = root_attributes(scene)
    (folder / SCENE_FILE).write_text(attributes["scene"], encoding="utf-8")
    wall, cpu = clock.monotonic(), clock.process_time()
    log.info("scene %s, %s, revision %s", scene.name, attributes["source"], attributes["revision"] or "unknown")
    report({"stage": "mesh"})
    mesh = mpm.build_mesh(scene.mpm)
    mesh.save(folder / MESH_FILE)
    log.info("mesh: %s", ", ".join(f"{name} {value:.4g}" for name, value in mesh.quality.items()))
    writer = RunWriter(folder / RUN_FILE, attributes, scene.mpm, mesh)

    def close(status, message=""):
        writer.close(
            status, message, wall_seconds=clock.monotonic() - wall, cpu_seconds=clock.process_time() - cpu,
        )  # fmt: skip
        _write_quality(folder / RUN_FILE)

    try:
        for record in mpm.simulate(scene.mpm, mesh, threads, report):
            writer.append(record)
            log.info(
                "t %.6g s  inflow %.6g kg/m  flow zone %.5g m2  dt %.3g s (%s)  steps %d",
                *(record.time, record.inflow_mass, record.flow_zone_area, record.dt, record.dt_limit, record.steps),
            )
    except mpm.RunFailed as failure:
        log.error("failed: %s", failure)
        close("failed", str(failure))
        failure.add_note(f"what was computed until then is in {folder}")
        raise
    except KeyboardInterrupt:
        log.warning("interrupted")
        close("interrupted", "stopped by the user")
        raise
    except BaseException as error:
        log.exception("failed")
        close("failed", f"{type(error).__name__}: {error}")
        raise
    close("finished")
    log.info("finished in %.1f s", clock.monotonic() - wall)


def _write_quality(file, response=None):
    history = read_history(file)
    if history.sizes["time"]:
        values = quality(history, response)
        write_attributes(file, **quality_attributes(values))
        log.info("quality: %s", quality_line(values))


@contextlib.contextmanager
def _logged_to(path):
    handler = logging.FileHandler(path, encoding="utf-8")
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
