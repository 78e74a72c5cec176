"""The run file: its schema, the writer that appends while a run goes on, and readers with clear errors.

One netCDF-4 file a run, SI units, angles in degrees from the crown, clockwise. Groups: `/lining` (pressures on a
uniform theta grid), `/history` (inflow, zones, balances, time step), `/points` (snapshots), `/mesh` (UGRID), and
`/structure/<model>` (responses; those of tunnels without the gate in `/structure_tunnel_<k>/<model>`). The root
carries attributes only: provenance and `status`.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import math
import os
import re
import shutil
import time as clock
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from coupling.journal import changed, put_in_place, readable, recover, replace_file
from coupling.netcdf_group import read_group_at_once
from coupling.own_content import ForeignContent, require_own_content
from coupling.provenance import with_history
from coupling.run_folder import RUN_FILE, how_to_go_on, in_use
from mpm.variables import CLAMPS, POINT_VARIABLES

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from mpm.scene import Scene as MpmScene

STATUSES = ("running", "finished", "failed", "interrupted")
AXES = {"time": "T", "x": "X", "y": "Y"}
INFLOW = "inflow_mass"  # a coordinate along time, beside the time itself
DT_LIMITS = ("acoustic", "advective", "output", "other")
SECONDS_BETWEEN_WRITES = 1.0
#: HDF5 format with checksums on its structure, read by netCDF-C too; those of the data are asked for by each variable.
CHECKED_FORMAT = ("v110", "v110")

#: Variables on (time, [tunnel,] theta): name to (units, long_name). Interval means, resampled conservatively.
PRESSURES = {
    "soil_pressure": ("Pa", "effective soil pressure on the lining, compression positive"),
    "water_pressure": ("Pa", "water pressure on the lining, compression positive"),
    "soil_shear": ("Pa", "shear traction of the soil on the lining, clockwise positive"),
    "soil_pressure_std": ("Pa", "standard deviation of the soil pressure within the output interval"),
    "water_pressure_std": ("Pa", "standard deviation of the water pressure within the output interval"),
}
#: The same for linings that move in the soil computation: at the end of the interval, since the undisturbed ground.
MOTION = {
    "displacement_radial": ("m", "displacement of the lining's outer face, outward positive"),
    "displacement_tangential": ("m", "displacement of the lining's outer face, clockwise positive"),
}
#: And for elastic ones: the ring's own forces, per metre of tunnel.
RING_FORCES = {
    "axial_force": ("N/m", "axial force of the elastic lining, compression positive"),
    "shear_force": ("N/m", "shear force of the elastic lining, -dM/ds"),
    "bending_moment": ("N m/m", "bending moment of the elastic lining, tension on the outer face positive"),
}
#: Variables on (time,) that `/lining` repeats from `/history`, so that pressures can be compared at equal inflow.
PROGRESS = {
    "inflow_mass": ("kg/m", "grains inside the tunnel, per metre of tunnel"),
    "flow_zone_area": ("m^2", "area of soil displaced by more than 50 mm"),
    "disturbed_area": ("m^2", "area of soil displaced by 10 to 50 mm"),
}
#: Errors, largest so far: see :func:`mpm.errors.errors`.
ERRORS = {
    "water_lost": ("1", "water lost or made, over the water that came through the gate"),
    "momentum_error": (
        "1",
        "departure of the points' momentum from what the nodes received, over that of the flow zone",
    ),
    "energy_error": ("1", "kinetic energy that transfers took or gave, over that of the flow zone"),
    "overlap": ("1", "share of all material that stands where there is no room"),
    "flow_overlap": ("1", "share of the flow zone's material that stands where there is no room"),
}
#: What they come from, and the balances: see :meth:`mpm.Solver.balances`.
BALANCES = {
    "momentum_departure": ("N s/m", "momentum of the points less what the nodes received, size"),
    "flow_momentum": ("N s/m", "sum of the sizes of the momenta of grains and water in the flow zone"),
    "water_missing": ("kg/m", "water at the start less that now"),
    "water_inflow": ("kg/m", "water that came through the outer face of the gate, that taken out included"),
    "flow_water": ("kg/m", "water of the flow zone"),
    "work_gravity": ("J/m", "work of gravity on grains and water since the gate opened"),
    "work_stress": ("J/m", "work of stresses and pore pressure since the gate opened, positive where it accelerates"),
    "work_drag": ("J/m", "work of the drag between water and grains since the gate opened"),
    "kinetic_energy_change": ("J/m", "change of the kinetic energy of grains and water since the gate opened"),
    "transfer_loss": ("J/m", "kinetic energy lost between points and nodes since the gate opened"),
    "moving_energy": ("J/m", "kinetic energy, and what the fall from the gate gave to what came in"),
    "material_volume": ("m^2", "area of all material in the mesh"),
    "flow_volume": ("m^2", "area of the material of the flow zone in the mesh"),
    "overlap_volume": ("m^2", "area of material that cells hold beyond their own"),
    "flow_overlap_volume": ("m^2", "the flow zone's part of the area of material that cells hold beyond their own"),
    "contact_error": ("1", "momentum at the lining that the recorded reactions do not explain, over their sum"),
    "largest_courant": ("1", "largest time step so far over the critical one of the state it led to"),
}
#: Variables on (time,) of `/history`.
HISTORY = {
    **PROGRESS,
    "grain_mass": ("kg/m", "mass of all grains, those taken out included; constant"),
    "suspended_fraction": ("1", "share of points whose grains do not touch"),
    "tip_fraction": (
        "1",
        "share of points at the tip of the Mohr-Coulomb cone: grains touch, unpressed, and bear nothing",
    ),
    "kinetic_energy": ("J/m", "kinetic energy of the grains"),
    "max_velocity": ("m/s", "largest velocity of the grains"),
    **ERRORS,
    **BALANCES,
    "dt": ("s", "mean time step in the interval"),
    "steps": ("1", "time steps since the gate opened"),
    "point_steps": ("1", "updates of one point by one step since the gate opened"),
    "cpu_seconds": ("s", "processor time since the simulation started"),
    "dt_limit": ("1", "what limited the time step most often in the interval"),
    **{f"clamp_{name}": ("1", f"point-steps that ended so since the start: {label}") for name, label in CLAMPS.items()},
}
INTEGERS = {"steps", "point_steps", *(f"clamp_{name}" for name in CLAMPS)}
#: Variables on (time, point) of `/points`, from the solver's own table.
POINTS = {
    **{name: (unit, meaning) for name, unit, meaning in POINT_VARIABLES if not name.endswith("_initial")},
    "displacement_x": ("m", "horizontal displacement since the start"),
    "displacement_y": ("m", "vertical displacement since the start, upward positive"),
    "volume": ("m^2", "area that the point stands for, per metre of tunnel"),
    "soil": ("1", "number of the soil layer, from 0"),
}


class RunFileError(ValueError):
    """A run file that cannot be used: which one, why, and what to do."""


# -- the theta grid -------------------------------------------------------------------------------


def cell_centres() -> NDArray[np.float64]:
    """Centres of the 360 one-degree cells: 0, 1, .. 359 [degree]."""
    return np.arange(360.0)


def cell_bounds() -> NDArray[np.float64]:
    """Lower and upper bound of every cell, (360, 2) float64 [degree]; the first is -0.5 .. 0.5."""
    return cell_centres()[:, None] + np.array([-0.5, 0.5])


def cell_mean_weights(theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights that turn nodal values into cell means of their piecewise linear periodic interpolation.

    The interpolation is integrated exactly over every cell, so the integral around the ring is kept.

    Parameters
    ----------
    theta : (n,) float64
        Angles of the nodes [degree], ascending in [0, 360), at least two.

    Returns
    -------
    (360, n) float64
        Rows sum to 1.
    """
    theta = np.asarray(theta, float)
    n = len(theta)
    if n < 2 or theta[0] < 0 or theta[-1] >= 360 or np.any(np.diff(theta) <= 0):
        raise ValueError(f"theta: at least two ascending angles in [0, 360) degrees, got {n} between {theta.min():g} "
                         f"and {theta.max():g}; sort them and drop repeated ones")  # fmt: skip
    edges = cell_bounds()[:, 0]
    breaks = np.unique(np.concatenate([edges, edges[:1] + 360.0, theta, theta - 360.0]))
    breaks = breaks[(breaks >= edges[0]) & (breaks <= edges[0] + 360.0)]
    middle, length = 0.5 * (breaks[1:] + breaks[:-1]), np.diff(breaks)
    cell = np.floor(middle + 0.5).astype(int)
    # on a piece without a break inside, the mean of a linear function is its value in the middle
    wrapped = np.concatenate([theta[-1:] - 360.0, theta, theta[:1] + 360.0])
    left = np.searchsorted(wrapped, middle) - 1
    share = (middle - wrapped[left]) / (wrapped[left + 1] - wrapped[left])
    weights = np.zeros((360, n))
    np.add.at(weights, (cell, (left - 1) % n), length * (1 - share))
    np.add.at(weights, (cell, left % n), length * share)
    return weights


# -- writing --------------------------------------------------------------------------------------


class RunWriter:
    """Appends records to a run file that any reader can open at any moment, also after a kill.

    Each batch opens the file, grows the dimensions, writes the data, the times last, and closes it; it reaches the
    file as a whole or not at all (see `coupling.journal`).

    Parameters
    ----------
    path : str or path
        Written anew.
    attributes : dict
        Root attributes, from :func:`coupling.provenance.root_attributes`.
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
        """Writer for a file that holds at least so many records and snapshots; what follows is written over.

        Parameters
        ----------
        path, scene
            As of the class.
        records, snapshots : int
            Rows that are kept; rows behind them stay until they are written again.
        **attributes
            Root attributes to set.
        """
        writer = cls.__new__(cls)
        writer._start(path, scene, records, snapshots)
        write_attributes(path, status="running", status_message="", **attributes)
        return writer

    def _start(self, path, scene, records, snapshots):
        self.path = Path(path)
        self._waiting, self._last_write = [], -math.inf
        self._weights = {}
        self._count, self._snapshots = records, snapshots
        self._n_tunnels = len(scene.tunnels)
        kinds = {scene.lining_of(tunnel) for tunnel in scene.tunnels}
        self._on_theta = PRESSURES | (MOTION if kinds - {"fixed"} else {}) | (RING_FORCES if "elastic" in kinds else {})

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
        if not self._waiting:
            return
        batch = list(self._waiting)
        snapshots = [record for record in batch if record.points is not None]
        with _append_to(self.path) as file:
            if snapshots:
                self._write_points(file["points"], snapshots)
            self._write_lining(file["lining"], batch)
            self._write_history(file["history"], batch)
        # only now: a write that Ctrl-C cut short is repeated in the same rows
        del self._waiting[: len(batch)]
        self._count += len(batch)
        self._snapshots += len(snapshots)
        self._last_write = clock.monotonic()

    def close(self, status, message="", **attributes):
        """Write what waits and how the run ended: 'finished', 'failed' or 'interrupted'."""
        self.flush()
        write_attributes(self.path, status=status, status_message=message, **attributes)

    def _create(self, attributes, geometry, mesh):
        import h5netcdf

        image = io.BytesIO()
        with h5netcdf.File(image, "w", libver=CHECKED_FORMAT) as file:
            for name, value in {**attributes, "status": "running", "status_message": ""}.items():
                file.attrs[name] = value
            space = ("tunnel", "theta") if self._n_tunnels > 1 else ("theta",)
            lining = self._create_group(file, "lining", geometry)
            if self._n_tunnels > 0:
                lining.dimensions.update({"theta": 360, "bounds": 2})
                lining.attrs["coordinates"] = "theta_bnds"
                if self._n_tunnels > 1:
                    lining.dimensions["tunnel"] = self._n_tunnels
                    _variable(lining, "tunnel", ("tunnel",), "i4", ("1", "tunnel, counted from 0"))[:] = np.arange(
                        self._n_tunnels
                    )
                theta = _variable(lining, "theta", ("theta",), "f8", ("degree", "angle from the crown, clockwise"))
                theta[:] = cell_centres()
                theta.attrs["bounds"] = "theta_bnds"
                lining.create_variable("theta_bnds", ("theta", "bounds"), "f8", fletcher32=True)[:] = cell_bounds()
                shape = (16, *([self._n_tunnels] if self._n_tunnels > 1 else []), 360)
                for name, meaning in self._on_theta.items():
                    variable = _variable(lining, name, ("time", *space), "f8", meaning, shape)
                    when = "mean" if name in PRESSURES else "point"
                    variable.attrs["cell_methods"] = f"time: {when} theta: mean"
            for name, meaning in PROGRESS.items():
                _variable(lining, name, ("time",), "f8", meaning, (256,))
            history = self._create_group(file, "history", {})
            for name, meaning in HISTORY.items():
                kind = "i8" if name in INTEGERS else "i1" if name == "dt_limit" else "f8"
                _variable(history, name, ("time",), kind, meaning, (256,))
            history["dt_limit"].attrs["flag_values"] = np.arange(len(DT_LIMITS), dtype="i1")
            history["dt_limit"].attrs["flag_meanings"] = " ".join(DT_LIMITS)
            for group in (lining, history):
                for variable in group.variables.values():
                    if variable.dimensions[0] == "time" and variable.name.rpartition("/")[2] not in ("time", INFLOW):
                        variable.attrs["coordinates"] = INFLOW
            points = self._create_group(file, "points", geometry)
            points.attrs["comment"] = "values of one time are in no particular order; padded with NaN"
            if mesh is not None:
                _write_mesh(file.create_group("mesh"), mesh, geometry)
        replace_file(self.path, image.getbuffer())

    @staticmethod
    def _create_group(file, name, attributes):
        group = file.create_group(name)
        for key, value in attributes.items():
            group.attrs[key] = value
        group.dimensions["time"] = None
        time = _variable(group, "time", ("time",), "f8", ("s", "time since the gate opened"), (256,), fill=np.nan)
        del time.attrs["_FillValue"]  # CF knows no missing coordinates: rows without a time are not there yet
        return group

    def _write_lining(self, group, batch):
        rows = slice(self._count, self._count + len(batch))
        _grow_to(group, rows.stop)
        for name in self._on_theta if self._n_tunnels else ():
            values = np.array([[self._resample(t, part, name) for t, part in enumerate(r.lining)] for r in batch])
            group[name][rows] = values if self._n_tunnels > 1 else values[:, 0]
        for name in PROGRESS:
            group[name][rows] = [getattr(record, name) for record in batch]
        group["time"][rows] = [record.time for record in batch]

    def _resample(self, tunnel, part, name):
        if tunnel not in self._weights:
            self._weights[tunnel] = cell_mean_weights(part["theta"])
        if name not in part:  # of a lining that is not elastic, beside one that is
            return np.full(360, np.nan)
        return self._weights[tunnel] @ part[name]

    def _write_history(self, group, batch):
        rows = slice(self._count, self._count + len(batch))
        _grow_to(group, rows.stop)
        for name in HISTORY:
            if name.startswith("clamp_"):
                values = [record.clamp_counts.get(name.removeprefix("clamp_"), 0) for record in batch]
            elif name in BALANCES:
                values = [record.balances[name] for record in batch]
            elif name in ERRORS:
                values = [record.errors[name] for record in batch]
            elif name == "dt_limit":
                values = [_limit_flag(record.dt_limit) for record in batch]
            else:
                values = [getattr(record, name) for record in batch]
            group[name][rows] = np.array(values)
        group["time"][rows] = [record.time for record in batch]

    def _write_points(self, group, snapshots):
        most = max(len(record.points["x"]) for record in snapshots)
        if "point" not in group.dimensions:
            group.dimensions["point"] = None
            for name, meaning in POINTS.items():
                if name in snapshots[0].points:
                    _variable(group, name, ("time", "point"), "f4", meaning, (1, most), fill=np.nan, compress=True)
        group.resize_dimension("point", max(most, group.dimensions["point"].size))
        rows = slice(self._snapshots, self._snapshots + len(snapshots))
        _grow_to(group, rows.stop)
        for k, record in enumerate(snapshots, start=self._snapshots):
            present = ~record.points.get("removed", np.zeros(len(record.points["x"]), bool))
            for name in POINTS:
                if name in group.variables and name in record.points:
                    values = np.asarray(record.points[name])[present]
                    group[name][k, : len(values)] = values.astype("f4")
        group["time"][rows] = [record.time for record in snapshots]


def geometry_attributes(scene: MpmScene) -> dict[str, Any]:
    """Tunnels and gate as attributes [m, degree], for figures that read datasets only."""
    attributes = {}
    if scene.tunnels:
        attributes |= {
            "tunnel_x": np.array([t.x for t in scene.tunnels]),
            "tunnel_axis_depth": np.array([t.axis_depth for t in scene.tunnels]),
            "tunnel_outer_radius": np.array([t.outer_radius for t in scene.tunnels]),
            "tunnel_inner_radius": np.array([t.inner_radius for t in scene.tunnels]),
        }
    if scene.gate is not None:
        attributes |= {
            "gate_tunnel": np.int64(scene.gate.tunnel),
            "gate_angle": float(scene.gate.angle),
            "gate_width": float(scene.gate.width),
        }
    return attributes


def write_attributes(path: str | Path, **attributes: Any) -> None:
    """Set root attributes of a run file."""
    with _append_to(path) as file:
        for name, value in attributes.items():
            file.attrs[name] = value


def structure_group(model: str, tunnel: int | None = None) -> str:
    """Group of a response: `structure/<model>` for the tunnel with the gate, `structure_tunnel_<k>/<model>` for others.

    The model's name is made an identifier, so that it can be an attribute of a tree: "beam-spring" is `beam_spring`.

    tunnel : int or None, None: the one with the gate.
    """
    return f"{'structure' if tunnel is None else f'structure_tunnel_{tunnel}'}/{identifier(model)}"


def identifier(name: str) -> str:
    """A name as an identifier: every character that it may not have becomes `_`."""
    return re.sub(r"\W|^(?=\d)", "_", name)


def write_response(
    path: str | Path, response: xr.Dataset, model: str = "beam-spring", tunnel: int | None = None
) -> None:
    """Write the response of a lining model to its :func:`structure_group`, in place of an earlier one, as a whole."""
    import h5py

    group = structure_group(model, tunnel)
    response = response.assign_attrs(model=model)
    path = Path(path).resolve()
    recover(path)
    beside = path.with_name(f"{path.name}.tmp")
    try:
        shutil.copy(path, beside)
        with _damage_named(path):
            with h5py.File(beside, "a", locking=False, libver=CHECKED_FORMAT) as file:
                for name in (group, group.partition("/")[0] + f"/{model}"):  # the latter in files of earlier versions
                    if name in file:
                        del file[name]
            write_dataset(beside, response, group)
        put_in_place(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def write_dataset(path: str | Path, dataset: xr.Dataset, group: str | None = None) -> None:
    """Write a dataset with checksums: into a new file, or as a group more into one whose history gets a line."""
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    mode, options = "w" if group is None else "a", {"driver_kwds": {"libver": CHECKED_FORMAT}}
    # CF knows no missing coordinates, and a missing value is NaN here without being told
    encoding = {
        name: {"fletcher32": variable.ndim > 0 and variable.dtype.kind not in "OSU", "_FillValue": None}
        for name, variable in dataset.variables.items()
    }
    if "time" in dataset.coords:
        dataset = dataset.assign_coords(time=dataset["time"].copy())
        dataset["time"].attrs.pop("axis", None)
    # h5py has a lock of its own; looking for one of dask's loads all of its scheduler
    with H5NetCDFStore.open(path, mode=mode, group=group, lock=False, **options) as store:
        dataset.dump_to_store(store, encoding=encoding)
    if group is not None:
        with h5netcdf.File(path, "r+", libver=CHECKED_FORMAT) as file:
            file.attrs["history"] = with_history(file.attrs.get("history", ""), f"/{group} computed")


def _write_mesh(group, mesh, geometry):
    for key, value in geometry.items():
        group.attrs[key] = value
    group.attrs["Conventions"], group.attrs["coordinates"] = "CF-1.11 UGRID-1.0", "x y"
    group.dimensions.update({"node": len(mesh.nodes), "element": len(mesh.elements), "corner": 3})
    topology = group.create_variable("topology", (), "i4")
    topology.attrs.update({
        "cf_role": "mesh_topology", "long_name": "triangles of the mesh", "topology_dimension": np.int32(2),
        "node_coordinates": "x y", "face_node_connectivity": "element_nodes", "face_dimension": "element",
    })  # fmt: skip
    for axis, name, k in (("horizontal", "x", 0), ("vertical", "y", 1)):
        node = _variable(group, name, ("node",), "f8", ("m", f"{axis} position of the node"))
        node[:] = mesh.nodes[:, k]
    corners = _variable(group, "element_nodes", ("element", "corner"), "i4", ("1", "nodes, counter-clockwise, from 0"))
    corners[:] = mesh.elements
    corners.attrs["cf_role"], corners.attrs["start_index"] = "face_node_connectivity", np.int32(0)
    region = _variable(group, "region", ("element",), "i1", ("1", "part of the mesh"))
    region[:] = mesh.region
    region.attrs["mesh"], region.attrs["location"] = "topology", "face"
    region.attrs["flag_values"] = np.arange(4, dtype="i1")
    region.attrs["flag_meanings"] = "soil channel interior headroom"


def _variable(group, name, dimensions, kind, meaning, chunks=None, fill=None, compress=False):
    options = {"compression": "gzip", "compression_opts": 1, "shuffle": True} if compress else {}
    variable = group.create_variable(name, dimensions, kind, chunks=chunks, fillvalue=fill, fletcher32=True, **options)
    variable.attrs["units"], variable.attrs["long_name"] = meaning
    return variable


@contextlib.contextmanager
def _append_to(path):
    import h5netcdf

    with _damage_named(path), changed(path) as whole, h5netcdf.File(whole, "r+", libver=CHECKED_FORMAT) as file:
        yield file


@contextlib.contextmanager
def _damage_named(path):
    """Turn what the HDF5 library raises in a damaged file into a message; the file is as it was."""
    try:
        yield
    except (OSError, RuntimeError, KeyError) as error:
        if getattr(error, "errno", None) is not None:
            raise  # a full disk, a missing right
        raise RunFileError(_why_unreadable(Path(path), None, error)) from error


def _grow_to(group, rows):
    # never shrinks: a continued run may find records that it is about to compute again
    group.resize_dimension("time", max(rows, group.dimensions["time"].size))


def _limit_flag(name):
    return DT_LIMITS.index(name) if name in DT_LIMITS else len(DT_LIMITS) - 1


# -- reading --------------------------------------------------------------------------------------


def run_file(path: str | Path) -> Path:
    """The run file for a run folder or a file; raises `RunFileError` when there is none."""
    path = Path(path)
    file = path / "run.nc" if path.is_dir() else path
    if not file.is_file():
        raise RunFileError(f"run '{path}': there is no {'run.nc in it' if path.is_dir() else 'such file or folder'}; "
                           "give the folder that `gush run` wrote")  # fmt: skip
    return file


def read_run(path: str | Path) -> xr.DataTree:
    """All groups of a run as an `xarray.DataTree`, in memory; groups as in the module's description."""
    import xarray as xr

    file = run_file(path)
    try:
        names = _group_names(file)
    except Exception as error:
        raise RunFileError(_why_unreadable(file, None, error)) from error
    shown = {name: "/".join(map(identifier, name.split("/"))) for name in names}
    return xr.DataTree.from_dict({"/": _read(file, None), **{f"/{shown[name]}": _read(file, name) for name in names}})


def _group_names(file):
    import h5netcdf

    from structure.models import in_order

    with _shown(file) as shown, h5netcdf.File(shown, "r") as content:
        answered = [name for name in content.groups if name.startswith("structure")]
        names = [name for name in content.groups if name not in answered]
        for name in answered:
            models = {str(group.attrs.get("model", key)): key for key, group in content[name].groups.items()}
            names += [f"{name}/{models[model]}" for model in in_order(models)]
        return names


def stored_title(path: str | Path) -> str:
    """Title of a netCDF-4 file, by which its kind is known; empty where there is no such file or it has none."""
    try:
        return str(_read(Path(path), None).attrs.get("title", ""))
    except RunFileError:
        return ""


def read_attributes(path: str | Path) -> dict[str, Any]:
    """Root attributes of a run: provenance, scene text, status ('interrupted' also where its process was killed)."""
    return dict(_read(run_file(path), None).attrs)


def read_pressures(path: str | Path) -> xr.Dataset:
    """Pressures on the lining through time: `/lining`, in memory.

    Returns
    -------
    xarray.Dataset
        soil_pressure, water_pressure, soil_shear and spreads (time, [tunnel,] theta) [Pa]; inflow_mass [kg/m],
        flow_zone_area and disturbed_area [m2] on time.

    Raises
    ------
    RunFileError
        When the file is missing, not netCDF, truncated, or not a run.
    """
    return read_group(path, "lining")


def read_history(path: str | Path) -> xr.Dataset:
    """Inflow, zones, balances and time step through time: `/history`, in memory."""
    return read_group(path, "history")


def read_points(path: str | Path, snapshot: int | None = None) -> xr.Dataset:
    """Snapshots of all points: `/points`, in memory; one of them when its number is given (-1: the last)."""
    return read_group(path, "points", snapshot)


def raw_groups(
    path: str | Path, groups: Sequence[str] = ("mesh", "history", "lining", "points")
) -> dict[str, dict[str, NDArray[Any]]]:
    """Arrays of a run file as they lie in it, complete records only: group to name to array.

    Raises
    ------
    RunFileError
        As :func:`read_pressures`.
    """
    import h5py

    file, arrays = run_file(path), {}
    try:
        with _shown(file) as shown, h5py.File(shown, "r") as content:
            for group in groups:
                own = content[group] if group in content else {}
                complete = np.isfinite(own["time"][()]) if "time" in own else None
                # a scale without values stands for a dimension only
                own = {name: data for name, data in own.items() if b"not a netCDF" not in data.attrs.get("NAME", b"")}
                arrays[group] = {
                    name: data[()][complete] if data.maxshape[:1] == (None,) else data[()] for name, data in own.items()
                }
    except Exception as error:
        raise RunFileError(_why_unreadable(file, None, error)) from error
    return arrays


def read_mesh(path: str | Path) -> xr.Dataset:
    """The mesh: `/mesh`, in memory."""
    return read_group(path, "mesh")


def read_response(path: str | Path, model: str = "beam-spring", tunnel: int | None = None) -> xr.Dataset:
    """The response of the lining of the tunnel with the gate, or of another `tunnel` by its number, in memory.

    It is at the angles of the pressures; what an earlier version stored between them is interpolated.
    """
    from structure.lining import at_whole_degrees

    group, file = structure_group(model, tunnel), run_file(path)
    with contextlib.suppress(Exception):  # what cannot be read is told below
        before = f"{group.partition('/')[0]}/{model}"
        group = before if before in _group_names(file) else group
    return at_whole_degrees(read_group(file, group))


def read_group(path: str | Path, group: str | None, row: int | None = None) -> xr.Dataset:
    """One group of a run file, in memory, with complete records only; `row` picks one of them.

    `inflow_mass` is a coordinate along `time`. Bounds of cells stay in the file: their dimension would repeat every
    row of `to_dataframe`; ``ds.cf.add_bounds("theta")`` of cf_xarray gives them again.
    """
    return _read(run_file(path), group, row)


def _read(file, group, row=None):
    def complete(time):
        # a batch cut short by a kill has no time yet: it was written last; no run has records in its root
        rows = np.arange(len(time)) if group is None else np.flatnonzero(np.isfinite(time))
        if row is None:
            return rows
        if not len(rows):
            raise RunFileError(f"run file '{file}': group '{group}' has no complete record yet")
        return int(rows[row])

    try:
        with _shown(file) as shown:
            dataset = read_group_at_once(shown, group, complete)
        if "scene_sha256" in dataset.attrs:
            _check_scene(file, dataset.attrs)
        return _with_true_status(file, _as_used(dataset))
    except RunFileError:
        raise
    except Exception as error:
        raise RunFileError(_why_unreadable(file, group, error)) from error


def _as_used(dataset):
    """Coordinates as such, also of files of earlier versions, and no bounds of cells."""
    bounds = [variable.attrs.pop("bounds") for variable in dataset.coords.values() if "bounds" in variable.attrs]
    dataset = dataset.drop_vars([name for name in bounds if name in dataset])
    # not in the file, where CF asks a time axis for a date and space for latitudes; these are elapsed time and metres
    for name, axis in AXES.items():
        if name in dataset.coords:
            dataset[name].attrs["axis"] = axis
    if INFLOW in dataset and "time" in dataset.coords and dataset[INFLOW].dims == dataset["time"].dims:
        dataset = dataset.set_coords(INFLOW)
    return dataset


def _with_true_status(file, dataset):
    """The root's status, which a process that was killed could not correct any more."""
    if dataset.attrs.get("status") != "running" or in_use(file.parent):
        return dataset
    go_on = f"; continue with: {how_to_go_on(file.parent)}" if file.name == RUN_FILE else ""
    return dataset.assign_attrs(status="interrupted", status_message=f"its process is gone{go_on}")


def _check_scene(file, attributes):
    # texts are the one thing that HDF5 keeps without a checksum
    if hashlib.sha256(str(attributes.get("scene", "")).encode()).hexdigest() != attributes["scene_sha256"]:
        raise RunFileError(
            f"run file '{file}': damaged, its scene does not match scene_sha256; copy it again or repeat the run"
        )


@contextlib.contextmanager
def _shown(file):
    """The file, complete also where a kill left its last change in the journal."""
    shown = readable(file)
    try:
        require_own_content(shown)
        if not isinstance(shown, Path):
            shown.seek(0)
        yield shown
    finally:
        if not isinstance(shown, Path):
            shown.close()


def _why_unreadable(file, group, error):
    # a library's message may quote what it met in the file
    said = "".join(c if c.isprintable() else "?" for c in str(error))[:200]
    try:
        size = os.path.getsize(file)
        with open(file, "rb") as stream:
            signature = stream.read(8)
    except OSError as reason:
        return f"run file '{file}': cannot be read: {reason.strerror}; check its permissions"
    if signature != b"\x89HDF\r\n\x1a\n":
        return f"run file '{file}': not a netCDF-4 file ({size} bytes); give the run.nc that `gush run` wrote"
    if isinstance(error, ForeignContent):
        return f"run file '{file}': must hold its own content, {error}; give the file that `gush run` wrote"
    if "truncated" in str(error) or "eof" in str(error).lower():
        return (
            f"run file '{file}': truncated, its end is missing ({size} bytes are left); copy it again or repeat the run"
        )
    if group is not None and ("group not found" in str(error).lower() or isinstance(error, KeyError)):
        return f"run file '{file}': has no group '/{group}'; " + (
            "run `gush respond` first" if group.startswith("structure") else "it is not a run file, or it is damaged"
        )
    return f"run file '{file}': damaged ({type(error).__name__}: {said}); copy it again or repeat the run"
