"""What users compute from a run: states at equal inflow mass, ratios to the initial state, smoothness, the heap inside.

Plain functions of the datasets that :mod:`coupling.datasets` reads; each returns a dataset, a float or a dict.
"""

import numpy as np

RESTING_SPEED = 0.5  # m/s; material falling onto the heap moves with several m/s


def at_inflow(dataset, inflow_mass):
    """State at an inflow mass, linear between the records around its first crossing.

    Parameters
    ----------
    dataset : xarray.Dataset
        With `inflow_mass` (time) [kg/m]: pressures, history or response.
    inflow_mass : float
        [kg/m]

    Returns
    -------
    xarray.Dataset
        Without time dimension; `time` as a scalar coordinate.

    Raises
    ------
    ValueError
        When the run did not get there.

    Examples
    --------
    >>> import xarray as xr
    >>> run = xr.Dataset({"inflow_mass": ("time", [0.0, 40.0])}, coords={"time": [0.0, 2.0]})
    >>> at_inflow(run, 10.0).time.item()
    0.5
    """
    mass = dataset["inflow_mass"].values
    reached = np.flatnonzero(mass >= inflow_mass)
    if not reached.size:
        raise ValueError(
            f"inflow_mass: {inflow_mass:g} kg/m was not reached, the run ends at {mass[-1]:.4g} kg/m; ask for less"
        )
    after = int(reached[0])
    if after == 0:
        return dataset.isel(time=0)
    share = (inflow_mass - mass[after - 1]) / (mass[after] - mass[after - 1])
    time = dataset["time"].values
    return dataset.interp(time=time[after - 1] + share * (time[after] - time[after - 1]), assume_sorted=True)


def ratio_to_initial(pressures, name, inflow_mass, angles):
    """Mean of a pressure over some angles at an inflow mass, over the same mean of the initial state [-].

    angles : sequence of float, degrees from the crown, clockwise; cells of the theta grid nearest to them.
    """
    field = pressures[name].sel(theta=np.asarray(angles, float) % 360, method="nearest").mean("theta")
    now = at_inflow(field.to_dataset().assign(inflow_mass=pressures["inflow_mass"]), inflow_mass)[name]
    return float(now) / float(field.isel(time=0))


def inflow_linearity(history, first, last):
    """Straight-line fit of inflow mass over time between two inflow masses [kg/m].

    Returns
    -------
    rate : float
        [kg/m/s]
    r_squared : float
        Coefficient of determination.
    """
    mass = history["inflow_mass"].values
    inside = (mass >= first) & (mass <= last)
    if inside.sum() < 3:
        raise ValueError(
            f"inflow_mass: only {inside.sum()} records between {first:g} and {last:g} kg/m; record more often"
        )
    time, mass = history["time"].values[inside], mass[inside]
    slope, offset = np.polyfit(time, mass, 1)
    left = mass - slope * time - offset
    return float(slope), float(1 - left @ left / np.sum((mass - mass.mean()) ** 2))


def element_means(points, mesh, name):
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
    element = element_of_points(points, mesh)
    values = points[name].values if isinstance(name, str) else name
    inside = element >= 0
    count = mesh.sizes["element"]
    weight = points["volume"].values[inside]
    volume = np.bincount(element[inside], weight, count)
    with np.errstate(invalid="ignore"):
        return np.bincount(element[inside], weight * values[inside], count) / np.where(
            volume > 0, volume, np.nan
        ), volume


def element_of_points(points, mesh):
    """Number of the element that holds each point, -1 for points outside of the mesh or padded."""
    from matplotlib.tri import Triangulation

    triangulation = Triangulation(mesh["x"].values, mesh["y"].values, mesh["element_nodes"].values)
    x, y = points["x"].values, points["y"].values
    valid = np.isfinite(x) & np.isfinite(y)
    element = np.full(len(x), -1)
    element[valid] = triangulation.get_trifinder()(x[valid], y[valid])
    return element


def pore_pressure_steps(points, mesh, nearest, furthest):
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
    centre = _centres(mesh)
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


def heap(points, mesh):
    """Material that has landed inside the gate's tunnel.

    Returns
    -------
    dict
        area: of the tunnel that material fills (:func:`filled`), the jet left out where it is thinner than an element
        [m2]; porosity: one minus the area of the grains there over that area [-]; grain_mass: of all grains inside the
        tunnel [kg/m]; resting_share: of this mass, what moves slower than 0.5 m/s [-]; speed: median by mass of all
        grains inside [m/s].
    """
    tunnel = int(mesh.attrs["gate_tunnel"])
    x0, depth, radius = (
        float(np.atleast_1d(mesh.attrs[name])[tunnel])
        for name in ("tunnel_x", "tunnel_axis_depth", "tunnel_inner_radius")
    )
    inside = np.hypot(points["x"].values - x0, points["y"].values + depth) < radius
    speed = np.hypot(points["velocity_solid_x"].values, points["velocity_solid_y"].values)
    mass, volume = points["grain_mass"].values, points["volume"].values
    element = element_of_points(points, mesh)
    rows = inside & (element >= 0)
    nodes, area = mesh["element_nodes"].values, _areas(mesh)
    dense = filled(np.bincount(element[rows], volume[rows], len(area)), area, nodes)
    solid = np.bincount(element[rows], (volume * (1 - points["porosity"].values))[rows], len(area))
    total = mass[rows].sum()
    if not total:
        return {"area": 0.0, "porosity": np.nan, "grain_mass": 0.0, "resting_share": np.nan, "speed": np.nan}
    by_speed = np.argsort(speed[rows])
    return {
        "area": float(area[dense].sum()),
        "porosity": float(1 - solid[dense].sum() / area[dense].sum()) if dense.any() else np.nan,
        "grain_mass": float(total),
        "resting_share": float(mass[rows & (speed < RESTING_SPEED)].sum() / total),
        "speed": float(speed[rows][by_speed][np.searchsorted(np.cumsum(mass[rows][by_speed]), total / 2)]),
    }


def filled(volume, area, element_nodes):
    """Elements below the surface of some material: at least half full on the mean of their nodes.

    A few points an element make the content of a single one jump by a third; around a node it is even.

    Parameters
    ----------
    volume, area : (n_elements,) float64
        Of the material in an element, and of the element [m2].
    element_nodes : (n_elements, 3) int

    Returns
    -------
    (n_elements,) bool
    """
    corners = element_nodes.ravel()
    held = np.bincount(corners, np.repeat(volume, 3))
    share = held / np.maximum(np.bincount(corners, np.repeat(area, 3)), 1e-300)
    return share[element_nodes].mean(axis=1) >= 0.5


def gate_position(mesh):
    """Middle of the gate on the outer face, (x, y) [m]."""
    tunnel = int(mesh.attrs["gate_tunnel"])
    x, depth, radius = (
        float(np.atleast_1d(mesh.attrs[name])[tunnel])
        for name in ("tunnel_x", "tunnel_axis_depth", "tunnel_outer_radius")
    )
    angle = np.radians(float(mesh.attrs["gate_angle"]))
    return np.array([x + radius * np.sin(angle), -depth + radius * np.cos(angle)])


def _centres(mesh):
    nodes = mesh["element_nodes"].values
    return np.column_stack([mesh["x"].values[nodes].mean(1), mesh["y"].values[nodes].mean(1)])


def _areas(mesh):
    nodes = mesh["element_nodes"].values
    x, y = mesh["x"].values[nodes], mesh["y"].values[nodes]
    return 0.5 * np.abs((x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0]))
