"""Points averaged in the elements of the mesh or other cells, and how much neighbouring elements differ."""

from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.datasets.geometry import gate_position
from mpm.mesh import areas

#: Quantities of points that are shown: name to (units, long_name).
QUANTITIES = {
    "soil_stress_vertical": ("Pa", "vertical effective stress, compression positive"),
    "soil_stress_horizontal": ("Pa", "horizontal effective stress, compression positive"),
    "pore_pressure": ("Pa", "pore pressure, compression positive"),
    "displacement": ("m", "displacement since the start"),
}
STRAIN = {"deviatoric_strain": ("1", "accumulated equivalent deviatoric strain")}


def point_quantities(points: xr.Dataset) -> dict[str, NDArray[np.float64]]:
    """Quantities of :data:`QUANTITIES` and `STRAIN` of every point; missing water counts as no pressure."""
    return {
        "soil_stress_vertical": -points["stress_yy"].values,
        "soil_stress_horizontal": -points["stress_xx"].values,
        "pore_pressure": np.maximum(points["pore_pressure"].values, 0.0),
        "displacement": np.hypot(points["displacement_x"].values, points["displacement_y"].values),
        **{name: points[name].values for name in STRAIN if name in points},
    }


def means_in_cells(
    points: xr.Dataset, cells: Callable[[xr.Dataset], NDArray], count: int, dim: str, about: dict[str, tuple[str, str]]
) -> xr.Dataset:
    """Means by volume of the points in some cells, for every snapshot: the variables of `about` (time, dim).

    cells : takes one snapshot and gives the number of every point's cell, see :func:`cell_means`.
    """
    if "time" not in points.dims:
        points = points.expand_dims("time")
    rows = []
    for k in range(points.sizes["time"]):
        now = points.isel(time=k)
        cell, values = cells(now), point_quantities(now)
        rows.append([cell_means(cell, now["volume"].values, values[name], count) for name in about])
    return xr.Dataset(
        {
            name: (("time", dim), np.array(row), {"units": units, "long_name": text})
            for row, (name, (units, text)) in zip(zip(*rows, strict=True), about.items(), strict=True)
        },
        coords={"time": points["time"]},
    )


def element_fields(points: xr.Dataset, mesh: xr.Dataset) -> xr.Dataset:
    """Means by volume of the points in every element, for every snapshot.

    Points have no lasting order in a run file, elements have: fields of elements can be compared between snapshots and
    interpolated in time.

    Parameters
    ----------
    points : xarray.Dataset
        `/points` of a run, all snapshots or one.
    mesh : xarray.Dataset
        `/mesh` of the run.

    Returns
    -------
    xarray.Dataset
        Variables of :data:`QUANTITIES` and deviatoric_strain [-] (time, element), NaN in empty elements; x, y
        (element): centres [m]. Attributes of the mesh.
    """
    centre = element_centres(mesh)
    fields = means_in_cells(
        points, lambda now: element_of_points(now, mesh), len(centre), "element", QUANTITIES | STRAIN
    )
    return fields.assign_coords(x=("element", centre[:, 0]), y=("element", centre[:, 1])).assign_attrs(mesh.attrs)


def element_means(
    points: xr.Dataset, mesh: xr.Dataset, name: str | NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Volume-weighted mean of a variable of the points in every element; NaN where there is none.

    Parameters
    ----------
    points : xarray.Dataset
        One snapshot.
    mesh : xarray.Dataset
    name : str or (n_points,) array

    Returns
    -------
    mean : (n_elements,) float64
    volume : (n_elements,) float64
        Volume of the material in the element [m2].
    """
    element, count = element_of_points(points, mesh), mesh.sizes["element"]
    values = points[name].values if isinstance(name, str) else name
    inside, weight = element >= 0, points["volume"].values
    volume = np.bincount(element[inside], weight[inside], count)
    return cell_means(element, weight, values, count), volume


def cell_means(
    cell: NDArray[np.integer], weight: NDArray[np.floating], values: NDArray[np.floating], count: int
) -> NDArray[np.float64]:
    """Weighted means of values by their cells, from 0 to `count` - 1; NaN in empty ones. Other cells do not count."""
    inside = (cell >= 0) & (cell < count)
    cell, weight = cell[inside], weight[inside].astype(float)
    total = np.bincount(cell, weight, count)
    summed = np.bincount(cell, weight * values[inside], count)
    return np.where(total > 0, summed / np.where(total > 0, total, 1.0), np.nan)


def element_of_points(points: xr.Dataset, mesh: xr.Dataset) -> NDArray[np.int64]:
    """Number of the element that holds each point, -1 for points outside of the mesh or padded."""
    from matplotlib.tri import Triangulation

    triangulation = Triangulation(mesh["x"].values, mesh["y"].values, mesh["element_nodes"].values)
    x, y = points["x"].values, points["y"].values
    valid = np.isfinite(x) & np.isfinite(y)
    element = np.full(len(x), -1)
    element[valid] = triangulation.get_trifinder()(x[valid], y[valid])
    return element


def pore_pressure_steps(
    points: xr.Dataset, mesh: xr.Dataset, nearest: float, furthest: float
) -> dict[str, NDArray[np.float64]]:
    """How much the pore pressure of the ground jumps between neighbouring elements around the gate.

    Parameters
    ----------
    points, mesh : xarray.Dataset
        One snapshot and the mesh of a run.
    nearest, furthest : float
        Distance of the elements from the gate's middle on the outer face [m].

    Returns
    -------
    dict
        jump: |p1 - p2| over their mean, for every pair of neighbours; deviation: |p - p_fit| over p_fit, p_fit from a
        plane through the elements around (those that share a node), so that a physical gradient does not count.
        Each an array. A negative pore pressure counts as zero: it carries nothing.
    """
    mean, _ = element_means(points, mesh, np.maximum(points["pore_pressure"].values, 0.0))
    centre = element_centres(mesh)
    near = np.hypot(*(centre - gate_position(mesh)).T)
    ground = (mesh["region"].values == 0) & np.isfinite(mean)
    chosen = ground & (near >= nearest) & (near <= furthest)
    nodes = mesh["element_nodes"].values
    touching = {}
    for e in np.flatnonzero(ground & (near <= furthest + 5)):
        for node in nodes[e].tolist():
            touching.setdefault(node, []).append(int(e))
    jumps, deviations = [], []
    for e in np.flatnonzero(chosen):
        around = set().union(*(touching[n] for n in nodes[e].tolist())) - {int(e)}
        for other in around:
            if other > e and len(set(nodes[other]) & set(nodes[e])) == 2:
                jumps.append(abs(mean[other] - mean[e]) / max(0.5 * (mean[other] + mean[e]), 1e-9))
        if len(around) >= 5:
            rows = np.array(sorted(around))
            plane = np.column_stack([np.ones(len(rows)), centre[rows] - centre[e]])
            fit = np.linalg.lstsq(plane, mean[rows], rcond=None)[0][0]
            deviations.append(abs(mean[e] - fit) / max(abs(fit), 1e-9))
    return {"jump": np.array(jumps), "deviation": np.array(deviations)}


def element_centres(mesh: xr.Dataset) -> NDArray[np.float64]:
    """Centres of all elements, (n_elements, 2) float64 [m]."""
    nodes = mesh["element_nodes"].values
    return np.column_stack([mesh["x"].values[nodes].mean(1), mesh["y"].values[nodes].mean(1)])


def element_areas(mesh: xr.Dataset) -> NDArray[np.float64]:
    """Areas of all elements, (n_elements,) float64 [m2]."""
    return np.abs(areas(np.stack([mesh["x"].values, mesh["y"].values], axis=1), mesh["element_nodes"].values))
