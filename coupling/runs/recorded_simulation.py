"""A simulation written as it goes, with checkpoints, and stopped by Ctrl-C between two steps."""

import errno
import hashlib
import logging
import math
import time as clock
from datetime import UTC, datetime

import numpy as np

import mpm
from coupling.datasets import RunWriter
from coupling.files.checkpoint import remove_checkpoints, write_checkpoint
from coupling.files.folder import MESH_FILE, RUN_FILE, SCENE_FILE, how_to_go_on
from coupling.files.provenance import root_attributes, with_history
from coupling.files.replace import replace_file
from coupling.postprocess.quality import quality, quality_attributes, states_line
from coupling.refused import Refused
from coupling.runs.stop_signals import stop_signals
from mpm.k0_procedure import bond_friction

MOST_TIME_FOR_CHECKPOINTS = 0.02  # share of the wall time that writing them may take
# Share of the bonded shear that may slip away without a warning: a third raises the largest initial moment of `quick`
# by 4 %, as much as another mesh does. The built-in scenes (K0 0.429, friction 0.2) would lose 36 %: they ask for
# friction.
MOST_UNBORNE = 0.25
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
log = logging.getLogger("coupling.runs")


class RecordedSimulation:
    """Runs a scene into a folder that is held, from the beginning or from what an earlier run left.

    Arguments are those of :func:`coupling.runs.run.run`; `report` is called with progress dicts, `warn` with what a
    user should know, and `remains` is None or a :class:`coupling.runs.resume.Remains` to continue.
    """

    def __init__(self, scene, folder, report, threads, checkpoint_interval, remains, warn):
        self.scene, self.folder, self.report, self.threads = scene, folder, report, threads
        self.checkpoint_interval, self.remains, self.warn = checkpoint_interval, remains, warn
        self.attributes = root_attributes(scene)
        self.writer = self.simulation = self._initial = None
        self._used_before = {"wall_seconds": 0.0, "cpu_seconds": 0.0}
        self._begin = clock.monotonic(), clock.process_time()

    def run(self):
        """Simulate to the end and return the pressures on the lining.

        Whatever stops it, what was computed stays readable and the run can be continued.

        Raises RunFailed, KeyboardInterrupt, OSError, MemoryError: with a note that says how to go on.
        """
        try:
            self._prepare()
            asked = self._advance()
        except mpm.RunFailed as failure:
            log.error("failed: %s", failure)
            self._close("failed", str(failure))
            failure.add_note(f"what was computed until then is in {self.folder}")
            raise
        except Refused:
            raise
        except (KeyboardInterrupt, OSError, MemoryError) as error:
            reason = str(error) or type(error).__name__
            log.warning("interrupted: %s", reason)
            full = isinstance(error, OSError) and error.errno in FULL
            room = f"make room on the disk of '{self.folder}', then " if full else ""
            error.add_note(f"what was computed is kept; {room}continue with: {how_to_go_on(self.folder)}")
            self._close_if_possible(f"stopped by {reason}")
            raise
        except BaseException as error:
            log.exception("failed")
            self._close_if_possible(f"{type(error).__name__}: {error}", "failed")
            raise
        pressures = self._close("finished")
        remove_checkpoints(self.folder)
        log.info("finished in %.1f s", clock.monotonic() - self._begin[0])
        if asked is not None:
            interrupt = KeyboardInterrupt(asked)
            interrupt.add_note(f"the simulation is finished; ring response and pictures: {how_to_go_on(self.folder)}")
            raise interrupt
        return pressures

    def _prepare(self):
        """Mesh, run file, and the simulation at its initial state or at its last checkpoint."""
        attributes, scene = self.attributes, self.scene
        log.info("scene %s, %s, revision %s", scene.name, attributes["source"], attributes["revision"] or "unknown")
        replace_file(self.folder / SCENE_FILE, attributes["scene"])
        self.report({"stage": "mesh"})
        mesh = mpm.build_mesh(scene)
        mesh.save(self.folder / MESH_FILE)
        log.info("mesh: %s", ", ".join(f"{name} {value:.4g}" for name, value in mesh.quality.items()))
        self.mesh_sha256 = mesh_sha256(mesh)
        path, remains = self.folder / RUN_FILE, self.remains
        state, about = (remains.state, remains.about) if remains is not None else (None, None)
        if about is not None and about["mesh_sha256"] != self.mesh_sha256:
            raise Refused(
                f"run '{self.folder}': the mesher must give the mesh that the run began with, its hash was "
                f"{about['mesh_sha256'][:12]} and is {self.mesh_sha256[:12]}; go back to the run's versions "
                f"({remains.attributes['versions']}), or start a new run"
            )
        self.simulation = mpm.Simulation(scene, mesh, self.threads, self.report)
        if remains is None or remains.attributes is None:
            self.writer = RunWriter(path, attributes, scene, mesh)
        else:
            kept = {"records": 0, "snapshots": 0} if about is None else about
            resumed = [
                *filter(None, [remains.attributes.get("resumed")]),
                datetime.now(UTC).isoformat(timespec="seconds"),
            ]
            history = with_history(remains.attributes.get("history", ""), f"resumed after {kept['records']} records")
            self.writer = RunWriter.continued(
                path, scene, kept["records"], kept["snapshots"], resumed=", ".join(resumed), history=history
            )
        if about is None:
            remove_checkpoints(self.folder)
            self._initial = self.simulation.begin()
            self._note_slip()
        else:
            self.simulation.restore(state)
            self._used_before = {name: about[name] for name in self._used_before}
            log.info("continued from step %d, t %.6g s", state["step_count"], state["time"])

    def _note_slip(self):
        """Store and tell what of the bonded initial state the lining's friction does not bear."""
        share, scene = self.simulation.unborne_shear, self.scene
        self.writer.attributes["initial_unborne_shear"] = share
        if share > MOST_UNBORNE:
            asked = max(bond_friction(scene, tunnel) for tunnel in scene.tunnels)
            rougher = f"give a coefficient of {math.ceil(100 * asked) / 100:g} or more, or " if asked <= 2 else ""
            self.warn(
                "initial_contact = 'bonded' must be borne by tunnels.friction_coefficient, which bears "
                f"{1 - share:.0%} of its shear: the ground has slipped along the lining before the gate opens; "
                f"{rougher}write initial_contact = 'frictional' if slip is meant"
            )
        elif share > 0:
            log.info("initial state: friction does not bear %.1f %% of the bonded shear, which is let go", 100 * share)

    def _advance(self):
        simulation = self.simulation
        cost, due = 0.0, clock.monotonic() + self.checkpoint_interval
        with stop_signals() as stop:

            def pause():
                return stop.asked is not None or clock.monotonic() >= due

            if self._initial is not None:
                self._append(self._initial)
                self._store()
            while not simulation.done:
                record = simulation.advance(pause)
                if record is not None:
                    self._append(record)
                if pause() and not simulation.done:
                    begin = clock.monotonic()
                    self._store()
                    cost = clock.monotonic() - begin
                    due = clock.monotonic() + max(self.checkpoint_interval, cost / MOST_TIME_FOR_CHECKPOINTS)
                    if stop.asked is not None:
                        raise KeyboardInterrupt(stop.asked)
            return stop.asked

    def _append(self, record):
        self.writer.append(record)
        log.info(
            "t %.6g s  inflow %.6g kg/m  flow zone %.5g m2  dt %.3g s (%s)  steps %d",
            *(record.time, record.inflow_mass, record.flow_zone_area, record.dt, record.dt_limit, record.steps),
        )

    def _store(self):
        self.writer.flush()
        about = {
            **self.writer.written, **self._used(),
            "scene_sha256": self.attributes["scene_sha256"], "mesh_sha256": self.mesh_sha256,
        }  # fmt: skip
        write_checkpoint(self.folder, self.simulation.state(), about)

    def _used(self):
        wall, cpu = self._begin
        used = {"wall_seconds": clock.monotonic() - wall, "cpu_seconds": clock.process_time() - cpu}
        return {name: value + self._used_before[name] for name, value in used.items()}

    def _close(self, status, message=""):
        if self.writer is None:
            return None
        return self.writer.close(status, message, _judged, **self._used())

    def _close_if_possible(self, message, status="interrupted"):
        try:
            self._close(status, message)
        except (OSError, MemoryError) as error:
            log.warning("the end could not be written: %s", error)


def _judged(history):
    """Errors of a run as its attributes, {} without a record; its states are told to the log."""
    if not history.sizes["time"]:
        return {}
    values = quality(history)
    log.info("states: %s", states_line(values))
    return quality_attributes(values)


def mesh_sha256(mesh):
    """Hash of nodes, elements and regions of a mesh."""
    digest = hashlib.sha256()
    for array in (mesh.nodes, mesh.elements, mesh.region):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
