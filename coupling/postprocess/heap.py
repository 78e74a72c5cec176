"""The heap of material that has landed inside the tunnel."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.datasets.geometry import tunnel_of
from coupling.postprocess.elements import element_areas, element_of_points

RESTING_SPEED = 0.5  # m/s; material falling onto the heap moves with several m/s


def heap(points: xr.Dataset, mesh: xr.Dataset) -> dict[str, float]:
    """Material that has landed inside the gate's tunnel.

    Returns
    -------
    dict
        area: of the tunnel that material fills (:func:`filled`), the jet left out where it is thinner than an element
        [m2]; porosity: one minus the area of the grains there over that area [-]; grain_mass: of all grains inside the
        tunnel [kg/m]; resting_share: of this mass, what moves slower than 0.5 m/s [-]; speed: median by mass of all
        grains inside [m/s].
    """
    tunnel = tunnel_of(mesh)
    inside = tunnel.distance(points["x"].values, points["y"].values) < tunnel.inner
    speed = np.hypot(points["velocity_solid_x"].values, points["velocity_solid_y"].values)
    mass, volume = points["grain_mass"].values, points["volume"].values
    element = element_of_points(points, mesh)
    rows = inside & (element >= 0)
    nodes, area = mesh["element_nodes"].values, element_areas(mesh)
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


def filled(
    volume: NDArray[np.float64], area: NDArray[np.float64], element_nodes: NDArray[np.integer], least: float = 0.5
) -> NDArray[np.bool_]:
    """Elements below the surface of some material: at least half full on the mean of their nodes.

    A few points an element make the content of a single one jump by a third; around a node it is even.

    Parameters
    ----------
    volume, area : (n_elements,) float64
        Of the material in an element, and of the element [m2].
    element_nodes : (n_elements, 3) int
    least : float
        Share of the area around a node that counts as full [-].

    Returns
    -------
    (n_elements,) bool
    """
    corners = element_nodes.ravel()
    held = np.bincount(corners, np.repeat(volume, 3))
    share = held / np.maximum(np.bincount(corners, np.repeat(area, 3)), 1e-300)
    return share[element_nodes].mean(axis=1) >= least
