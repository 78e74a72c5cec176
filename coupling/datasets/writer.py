"""The writer that appends to a run file while the run goes on."""

import contextlib
import io
import math
import time as clock
from pathlib import Path

import h5netcdf
import numpy as np

from coupling.datasets.additions import CHECKED_FORMAT, append_to
from coupling.datasets.geometry import geometry_attributes
from coupling.datasets.open_run import OpenRun
from coupling.datasets.schema import (
    BALANCES,
    BOLT_STATES,
    DT_LIMITS,
    ERRORS,
    HISTORY,
    INFLOW,
    INTEGERS,
    JOINT_STATES,
    JOINTS,
    MOTION,
    POINTS,
    PRESSURES,
    PROGRESS,
    RING_FORCES,
)  # fmt: skip
from coupling.datasets.theta_grid import cell_bounds, cell_centres, cell_mean_weights
from coupling.files.replace import replace_file
from mpm.laws.law import history_of

SECONDS_BETWEEN_WRITES = 1.0


class RunWriter:
    """Appends records to a run file that any reader can open at any moment, also after a kill.

    Each batch opens the file, grows the dimensions, writes the data, the times last, and closes it; it reaches the
    file as a whole or not at all (see `coupling.files.journal`). h5netcdf makes and grows what netCDF knows; values are
    written through h5py, without its look-ups.

    Parameters
    ----------
    path : str or path
        Written anew.
    attributes : dict
        Root attributes, from :func:`coupling.files.provenance.root_attributes`.
    scene : mpm.scene.Scene
        For the geometry that figures need.
    mesh : mpm.mesh.Mesh or None
        Stored in `/mesh` when given.
    """

    def __init__(self, path, attributes, scene, mesh=None):
        self._start(path, scene, 0, 0)
        self._create(attributes, geometry_attributes(scene), mesh)

    @classmethod
    def continued(cls, path, scene, records, snapshots, **attributes):
        """Writer for a file of which so many records and snapshots are kept; rows behind them stay until written again.

        **attributes : of the root, to set.
        """
        writer = cls.__new__(cls)
        writer._start(path, scene, records, snapshots)
        writer.attributes = {"status": "running", "status_message": "", **attributes}
        return writer

    def _start(self, path, scene, records, snapshots):
        self.path = Path(path)
        self._waiting, self._last_write = [], -math.inf
        self._weights = {}
        self.attributes = {}  # of the root, written with the next batch
        self._count, self._snapshots = records, snapshots
        self._n_tunnels = len(scene.tunnels)
        self._points = POINTS | {name: (unit, meaning) for name, unit, meaning in history_of(scene)}
        kinds = {scene.lining_of(tunnel) for tunnel in scene.tunnels}
        deforms = kinds & {"elastic", "jointed"}
        self._on_theta = PRESSURES | (MOTION if kinds - {"fixed"} else {}) | (RING_FORCES if deforms else {})
        self._joints = scene.ring.joint_angles if "jointed" in kinds else ()
        bolted = self._joints and scene.ring.bolts
        self._at_joints = (JOINT_STATES if self._joints else {}) | (BOLT_STATES if bolted else {})

    @property
    def written(self):
        """Records and snapshots that are in the file for good."""
        return {"records": self._count, "snapshots": self._snapshots}

    def append(self, record):
        """Take one `mpm.Record`; it reaches the file at once or with the next batch, within about a second."""
        self._waiting.append(record)
        if clock.monotonic() - self._last_write >= SECONDS_BETWEEN_WRITES:
            self.flush()

    def flush(self):
        """Write what waits."""
        if self._waiting:
            with self._written_batch():
                pass

    def close(self, status, message="", judged=None, **attributes):
        """Write what waits and how the run ended, and return the pressures on the lining.

        status : "finished", "failed" or "interrupted";  judged : takes the whole `/history` and gives more attributes;
        **attributes : of the root, to set.
        """
        with self._written_batch() as (file, content):
            run = OpenRun(self.path, content)
            if judged is not None:
                attributes |= judged(run.group("history"))
            file.attrs.update({"status": status, "status_message": message, **attributes})
            return run.group("lining")

    @contextlib.contextmanager
    def _written_batch(self):
        """Write what waits, and attributes that wait, with what else the block writes."""
        batch = list(self._waiting)
        snapshots = [record for record in batch if record.points is not None]
        with append_to(self.path) as (file, content):
            file.attrs.update(self.attributes)
            if snapshots:
                self._write_points(file["points"], content["points"], snapshots)
            if batch:
                self._write_lining(file["lining"], content["lining"], batch)
                self._write_history(file["history"], content["history"], batch)
            yield file, content
        # only now: a write that Ctrl-C cut short is repeated in the same rows
        del self._waiting[: len(batch)]
        self.attributes = {}
        self._count += len(batch)
        self._snapshots += len(snapshots)
        self._last_write = clock.monotonic()

    def _create(self, attributes, geometry, mesh):
        image = io.BytesIO()
        with h5netcdf.File(image, "w", libver=CHECKED_FORMAT) as file:
            file.attrs.update({**attributes, "status": "running", "status_message": ""})
            lining = self._create_group(file, "lining", geometry)
            if self._n_tunnels > 0:
                self._create_angles(lining)
            for name, meaning in PROGRESS.items():
                _variable(lining, name, ("time",), "f8", meaning, (256,))
            history = self._create_group(file, "history", {})
            for name, meaning in HISTORY.items():
                kind = "i8" if name in INTEGERS else "i1" if name == "dt_limit" else "f8"
                _variable(history, name, ("time",), kind, meaning, (256,))
            flags = {"flag_values": np.arange(len(DT_LIMITS), dtype="i1"), "flag_meanings": " ".join(DT_LIMITS)}
            history["dt_limit"].attrs.update(flags)
            for group in (lining, history):
                for variable in group.variables.values():
                    if variable.dimensions[0] == "time" and variable.name.rpartition("/")[2] not in ("time", INFLOW):
                        variable.attrs["coordinates"] = INFLOW
            points = self._create_group(file, "points", geometry)
            points.attrs["comment"] = "values of one time are in no particular order; padded with NaN"
            if mesh is not None:
                _write_mesh(file.create_group("mesh"), mesh, geometry)
        replace_file(self.path, image.getbuffer())

    def _create_angles(self, lining):
        """Cells of the theta grid, and what is written on them."""
        tunnels = {"tunnel": self._n_tunnels} if self._n_tunnels > 1 else {}
        lining.dimensions.update({"theta": 360, "bounds": 2, **tunnels})
        lining.attrs["coordinates"] = "theta_bnds"
        for name, count in tunnels.items():
            _variable(lining, name, (name,), "i4", ("1", "tunnel, counted from 0"))[:] = np.arange(count)
        theta = _variable(lining, "theta", ("theta",), "f8", ("degree", "angle from the crown, clockwise"))
        theta[:] = cell_centres()
        theta.attrs["bounds"] = "theta_bnds"
        lining.create_variable("theta_bnds", ("theta", "bounds"), "f8", fletcher32=True)[:] = cell_bounds()
        for name, meaning in self._on_theta.items():
            chunk = (16, *tunnels.values(), 360)
            variable = _variable(lining, name, ("time", *tunnels, "theta"), "f8", meaning, chunk)
            kind = "mean" if name in PRESSURES else "point"
            variable.attrs["cell_methods"] = f"time: {kind} theta: {kind}"
        if self._joints:
            lining.dimensions["joint"] = len(self._joints)
            _variable(lining, "joint", ("joint",), "i4", JOINTS["joint"])[:] = 1 + np.arange(len(self._joints))
            _variable(lining, "joint_angle", ("joint",), "f8", JOINTS["joint_angle"])[:] = self._joints
            lining.attrs["coordinates"] += " joint_angle"
        for name, meaning in self._at_joints.items():
            chunk = (64, *tunnels.values(), len(self._joints))
            variable = _variable(lining, name, ("time", *tunnels, "joint"), "f8", meaning, chunk)
            variable.attrs["cell_methods"] = "time: point"

    @staticmethod
    def _create_group(file, name, attributes):
        group = file.create_group(name)
        group.attrs.update(attributes)
        group.dimensions["time"] = None
        time = _variable(group, "time", ("time",), "f8", ("s", "time since the gate opened"), (256,), fill=np.nan)
        del time.attrs["_FillValue"]  # CF knows no missing coordinates: rows without a time are not there yet
        return group

    def _write_lining(self, group, stored, batch):
        rows = slice(self._count, self._count + len(batch))
        _grow_to(group, rows.stop)
        for name in self._on_theta if self._n_tunnels else ():
            values = np.array([[self._resample(t, part, name) for t, part in enumerate(r.lining)] for r in batch])
            stored[name][rows] = values if self._n_tunnels > 1 else values[:, 0]
        for name in self._at_joints:
            none = np.full(len(self._joints), np.nan)  # of a lining that is not jointed, beside one that is
            values = np.array([[part.get(name, none) for part in record.lining] for record in batch])
            stored[name][rows] = values if self._n_tunnels > 1 else values[:, 0]
        for name in PROGRESS:
            stored[name][rows] = [getattr(record, name) for record in batch]
        stored["time"][rows] = [record.time for record in batch]

    def _resample(self, tunnel, part, name):
        if name not in PRESSURES:  # none of a lining that does not deform, beside one that does
            return part.get(name, np.full(360, np.nan))
        if tunnel not in self._weights:
            self._weights[tunnel] = cell_mean_weights(part["theta"])
        return self._weights[tunnel] @ part[name]

    def _write_history(self, group, stored, batch):
        rows = slice(self._count, self._count + len(batch))
        _grow_to(group, rows.stop)
        for name in HISTORY:
            stored[name][rows] = np.array([_history_value(record, name) for record in batch])
        stored["time"][rows] = [record.time for record in batch]

    def _write_points(self, group, stored, snapshots):
        most = max(len(record.points["x"]) for record in snapshots)
        if "point" not in group.dimensions:
            group.dimensions["point"] = None
            for name, meaning in self._points.items():
                if name in snapshots[0].points:
                    _variable(group, name, ("time", "point"), "f4", meaning, (1, most), fill=np.nan, compress=True)
        group.resize_dimension("point", max(most, group.dimensions["point"].size))
        rows = slice(self._snapshots, self._snapshots + len(snapshots))
        _grow_to(group, rows.stop)
        for k, record in enumerate(snapshots, start=self._snapshots):
            present = ~record.points.get("removed", np.zeros(len(record.points["x"]), bool))
            for name in self._points:
                if name in stored and name in record.points:
                    values = np.asarray(record.points[name])[present]
                    stored[name][k, : len(values)] = values.astype("f4")
        stored["time"][rows] = [record.time for record in snapshots]


def _history_value(record, name):
    if name.startswith("clamp_"):
        return record.clamp_counts.get(name.removeprefix("clamp_"), 0)
    if name == "dt_limit":
        return DT_LIMITS.index(record.dt_limit) if record.dt_limit in DT_LIMITS else len(DT_LIMITS) - 1
    home = record.balances if name in BALANCES else record.errors if name in ERRORS else None
    return getattr(record, name) if home is None else home[name]


def _write_mesh(group, mesh, geometry):
    group.attrs.update({**geometry, "Conventions": "CF-1.11 UGRID-1.0", "coordinates": "x y"})
    group.dimensions.update({"node": len(mesh.nodes), "element": len(mesh.elements), "corner": 3})
    group.create_variable("topology", (), "i4").attrs.update({
        "cf_role": "mesh_topology", "long_name": "triangles of the mesh", "topology_dimension": np.int32(2),
        "node_coordinates": "x y", "face_node_connectivity": "element_nodes", "face_dimension": "element",
    })  # fmt: skip
    for axis, name, k in (("horizontal", "x", 0), ("vertical", "y", 1)):
        _variable(group, name, ("node",), "f8", ("m", f"{axis} position of the node"))[:] = mesh.nodes[:, k]
    corners = _variable(group, "element_nodes", ("element", "corner"), "i4", ("1", "nodes, counter-clockwise, from 0"))
    corners[:] = mesh.elements
    corners.attrs.update({"cf_role": "face_node_connectivity", "start_index": np.int32(0)})
    region = _variable(group, "region", ("element",), "i1", ("1", "part of the mesh"))
    region[:] = mesh.region
    region.attrs.update({
        "mesh": "topology", "location": "face", "flag_values": np.arange(4, dtype="i1"),
        "flag_meanings": "soil channel interior headroom",
    })  # fmt: skip


def _variable(group, name, dimensions, kind, meaning, chunks=None, fill=None, compress=False):
    options = {"compression": "gzip", "compression_opts": 1, "shuffle": True} if compress else {}
    variable = group.create_variable(name, dimensions, kind, chunks=chunks, fillvalue=fill, fletcher32=True, **options)
    variable.attrs["units"], variable.attrs["long_name"] = meaning
    return variable


def _grow_to(group, rows):
    # never shrinks: a continued run may find records that it is about to compute again
    group.resize_dimension("time", max(rows, group.dimensions["time"].size))
