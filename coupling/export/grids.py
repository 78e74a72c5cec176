"""Points, mesh and rings of a run as grids for ParaView and PyVista, with what they hold."""

from collections.abc import Iterable, Iterator
from typing import Any

import meshio
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.datasets.geometry import gate_tunnel, on_tunnel, tunnel_list
from coupling.datasets.tree import match_times
from coupling.postprocess.elements import cell_means, element_areas, element_of_points

TENSOR = "stress"
VECTORS = ("velocity_solid", "velocity_liquid", "displacement")
#: What elements show: means over the points in them, weighted with their volume.
ELEMENT_MEANS = (
    "pore_pressure", "porosity", "deviatoric_strain", "stress_xx", "stress_yy", "stress_zz", "stress_xy",
)  # fmt: skip


def point_grid(snapshot: xr.Dataset) -> meshio.Mesh:
    """Points of one time as vertices: a `meshio.Mesh` with every variable, vectors and the stress tensor as such.

    snapshot : xarray.Dataset, one time of `/points`.
    """
    here = np.isfinite(snapshot["x"].values)
    data = {name: snapshot[name].values[here] for name in snapshot.data_vars if snapshot[name].dims == ("point",)}
    position = _vector(data.pop("x"), data.pop("y"))
    for name in VECTORS:
        if f"{name}_x" in data:
            data[name] = _vector(data.pop(f"{name}_x"), data.pop(f"{name}_y"))
    if f"{TENSOR}_zz" in data:
        data[TENSOR] = _tensor(*(data.pop(f"{TENSOR}_{part}") for part in ("xx", "yy", "zz", "xy")))
    return meshio.Mesh(position, [("vertex", np.arange(len(position))[:, None])], point_data=data)


def mesh_grids(snapshots: Iterable[xr.Dataset], mesh: xr.Dataset) -> Iterator[meshio.Mesh]:
    """The mesh with what its elements hold, one `meshio.Mesh` a time.

    Cell data: region, displacement, the means of `ELEMENT_MEANS` (NaN where there is no material), and filled: area of
    the material over that of the element [-].

    snapshots : list of xarray.Dataset.
    """
    nodes, corners = _vector(mesh["x"].values, mesh["y"].values), mesh["element_nodes"].values
    area = element_areas(mesh)
    region, cells = mesh["region"].values, [("triangle", corners)]
    for snapshot in snapshots:
        element, weight = element_of_points(snapshot, mesh), snapshot["volume"].values
        volume = np.bincount(element[element >= 0], weight[element >= 0], len(corners))

        def mean(name, snapshot=snapshot, element=element, weight=weight):
            return cell_means(element, weight, snapshot[name].values, len(corners)).astype("f4")

        data = {name: mean(name) for name in ELEMENT_MEANS if name in snapshot}
        if "displacement_x" in snapshot:
            data["displacement"] = _vector(mean("displacement_x"), mean("displacement_y"))
        if f"{TENSOR}_zz" in data:
            data[TENSOR] = _tensor(*(data.pop(f"{TENSOR}_{part}") for part in ("xx", "yy", "zz", "xy")))
        data |= {"filled": (volume / area).astype("f4"), "region": region}
        yield meshio.Mesh(nodes, cells, cell_data={name: [values] for name, values in data.items()})


def ring_series(run: xr.DataTree, times: NDArray[np.float64]) -> Iterator[tuple[str, NDArray[np.float64], Any]]:
    """Pressures on the linings, and what every lining model made of them, as series of quadrilaterals.

    Parameters
    ----------
    run : xarray.DataTree
    times : (n,) float64
        [s]; those at which there is a record are written.

    Yields
    ------
    stem : str
        "lining", or "ring_" and the model.
    times : (m,) float64
    grids : iterator of meshio.Mesh
        A cell for each angle; cell data in SI units, `displacement` a vector, `tunnel` the number of the tunnel.
    """
    lining = run["lining"].to_dataset() if "lining" in run.children else None
    if lining is None or "soil_pressure" not in lining:
        return
    tunnels = tunnel_list(lining)
    parts = {"lining": [(k, on_tunnel(lining, k)) for k in range(len(tunnels))]}
    for name, group in run.children.items():
        if name.startswith("structure"):
            number = int(name.rpartition("_")[2]) if name != "structure" else gate_tunnel(lining)
            for model, response in group.children.items():
                parts.setdefault(f"ring_{model}", []).append((number, response.to_dataset()))
    for stem, of_tunnels in parts.items():
        rows, present = match_times(of_tunnels[0][1]["time"].values, times)
        if present.any():
            shape = _ring_shape(tunnels, of_tunnels)
            grids = (_ring_grid(shape, [(k, data.isel(time=row)) for k, data in of_tunnels]) for row in rows[present])
            yield stem, times[present], grids


def _ring_shape(tunnels, rings):
    """Nodes (n, 3) [m] and quadrilaterals (m, 4) of some rings: a cell for each angle, as thick as the lining."""
    nodes, cells, first = [], [], 0
    for k, ring in rings:
        angle = ring["theta"].values
        edge = angle - 0.5 * ((angle - np.roll(angle, 1)) % 360)
        for radius in (tunnels[k].outer, tunnels[k].inner):
            nodes.append(_vector(*tunnels[k].at(edge, radius)))
        n, number = len(angle), np.arange(len(angle))
        after = (number + 1) % n
        cells.append(first + np.column_stack([number, after, n + after, n + number]))
        first += 2 * n
    return np.concatenate(nodes), np.concatenate(cells)


def _ring_grid(shape, rings):
    """Rings at one time, with everything that they have for each angle."""
    data = {}
    for k, ring in rings:
        values = {name: ring[name].values for name in ring.data_vars if ring[name].dims == ("theta",)}
        angle = np.radians(ring["theta"].values)
        if "displacement_radial" in values:
            radial, tangential = values.pop("displacement_radial"), values.pop("displacement_tangential")
            sine, cosine = np.sin(angle), np.cos(angle)
            values["displacement"] = _vector(radial * sine + tangential * cosine, radial * cosine - tangential * sine)
        for name, of_cells in {**values, "tunnel": np.full(len(angle), k)}.items():
            data.setdefault(name, []).append(of_cells)
    cell_data = {name: [np.concatenate(parts)] for name, parts in data.items()}
    return meshio.Mesh(shape[0], [("quad", shape[1])], cell_data=cell_data)


def _vector(x, y):
    return np.column_stack([x, y, np.zeros_like(x)])


def _tensor(xx, yy, zz, xy):
    """A symmetric tensor of plane strain, row by row, (n, 9)."""
    zero = np.zeros_like(xx)
    return np.column_stack([xx, xy, zero, xy, yy, zero, zero, zero, zz])
