"""Stresses and pore pressure along the horizontal and vertical axis through the gate, and how far the gate reaches."""

import numpy as np
import xarray as xr

from coupling.datasets.geometry import gate_diameter, gate_of, gate_position, tunnel_list
from coupling.postprocess.elements import QUANTITIES, means_in_cells

#: Initial stresses below this share of the largest on the axis are left out of ratios: those at the ground surface.
SMALLEST_INITIAL = 0.05


def profile(points: xr.Dataset, direction: str, spacing: float = 0.5, half_width: float = 0.5) -> xr.Dataset:
    """Means of the ground's points over cells along an axis through the gate.

    Parameters
    ----------
    points : xarray.Dataset
        `/points` of a run, all snapshots or one.
    direction : {"horizontal", "vertical"}
    spacing, half_width : float
        Length of a cell along the axis and half its width across [m].

    Returns
    -------
    xarray.Dataset
        Means by volume (time, distance) of :data:`coupling.postprocess.elements.QUANTITIES`; NaN where there is no
        ground. `distance` [m]
        from the gate's middle on the outer face, to the right or upward positive. Attributes of the points.

    Raises
    ------
    ValueError
        Neither direction.
    """
    if direction not in ("horizontal", "vertical"):
        raise ValueError(f"profile: direction must be 'horizontal' or 'vertical', got {direction!r}")
    gate = gate_position(points)
    horizontal = direction == "horizontal"
    reach = float(np.nanmax(np.abs(points["x" if horizontal else "y"].values))) + 20.0
    count = int(np.ceil(reach / spacing))
    edges = spacing * (np.arange(-count, count + 1) - 0.5)

    def cells(now):
        x, y = now["x"].values, now["y"].values
        along, across = (x - gate[0], y - gate[1]) if horizontal else (y - gate[1], x - gate[0])
        ground = np.isfinite(x) & (np.abs(across) <= half_width)
        for tunnel in tunnel_list(points):
            ground &= tunnel.distance(x, y) > tunnel.outer
        return np.where(ground, np.digitize(along, edges) - 1, -1)

    axis = means_in_cells(points, cells, len(edges) - 1, "distance", QUANTITIES)
    distance = ("distance", 0.5 * (edges[1:] + edges[:-1]), {"units": "m", "long_name": "from the gate"})
    axis = axis.assign_coords(distance=distance).assign_attrs({**points.attrs, "direction": direction})
    return axis.dropna("distance", how="all")


def stress_variation(now: xr.DataArray, initial: xr.DataArray) -> xr.DataArray:
    """Stress variation ratio R_sigma = (sigma' - sigma'_0)/sigma'_0; NaN where the initial value is next to none.

    Parameters
    ----------
    now, initial : xarray.DataArray
        [Pa]; of the same cells, elements or angles.

    Returns
    -------
    xarray.DataArray
        [-]

    Source: Xie, Zhang & Zhou, Eq. 10.
    """
    known = np.abs(initial) > SMALLEST_INITIAL * np.abs(initial).max()
    ratio = (now - initial.where(known)) / initial.where(known)
    return ratio.assign_attrs(units="1", long_name="change of the stress over the initial one")


def influence_distance(axis: xr.Dataset, name: str, threshold: float = 0.05, window: float = 1.5) -> xr.DataArray:
    """How far from the gate a quantity has changed by more than a threshold, on the ground's side of the gate.

    Rule: the furthest cell where the change of the initial value, as the running mean over `window`, exceeds the
    threshold.

    Parameters
    ----------
    axis : xarray.Dataset
        Of :func:`profile`, the initial state first.
    name : str
        "soil_stress_vertical", "soil_stress_horizontal" or "pore_pressure".
    threshold : float
        Share of the initial value [-].
    window : float
        [m]

    Returns
    -------
    xarray.DataArray
        (time) [m]; 0 where nothing has changed by so much.
    """
    change = _on_ground_side(stress_variation(axis[name], axis[name].isel(time=0, drop=True)), axis)
    far = np.abs(_smoothed(change, window)) > threshold
    reach = np.abs(change["distance"]).where(far).max("distance").fillna(0.0)
    return reach.rename("influence_distance").assign_attrs(
        units="m", long_name=f"distance from the gate within which {name} changes by more than {threshold:.0%}"
    )


def arch(axis: xr.Dataset, name: str = "soil_stress_vertical", window: float = 1.5) -> xr.Dataset:
    """Where raised soil stress stands: the largest running mean of sigma'/sigma'_0 along an axis, beside the gate.

    Parameters
    ----------
    axis : xarray.Dataset
        Of :func:`profile`, the initial state first.
    name : str
        Stress across the axis: vertical on the horizontal axis, horizontal on the vertical one.
    window : float
        [m]

    Returns
    -------
    xarray.Dataset
        distance (time) [m] from the gate, diameters (time) [D], ratio (time) [-]; the first two NaN where the stress is
        raised by less than 2 %, twice what averages over a cell scatter by at rest.
    """
    change = _on_ground_side(stress_variation(axis[name], axis[name].isel(time=0, drop=True)), axis)
    ratio = 1.0 + _smoothed(change, window)
    largest = ratio.max("distance")
    place = np.abs(ratio["distance"].isel(distance=ratio.fillna(-np.inf).argmax("distance"))).drop_vars("distance")
    place = place.where(largest > 1.02)
    return xr.Dataset(
        {
            "distance": place.assign_attrs(units="m", long_name="distance of the arch from the gate"),
            "diameters": (place / gate_diameter(axis)).assign_attrs(units="1", long_name="the same in diameters"),
            "ratio": largest.assign_attrs(units="1", long_name="largest soil stress over the initial one"),
        }
    )


def _on_ground_side(values, axis):
    """Values on the side of the gate away from its lining, on both sides where the axis only touches it."""
    angle = np.radians(gate_of(axis).angle)
    outward = np.sin(angle) if axis.attrs["direction"] == "horizontal" else np.cos(angle)
    if abs(outward) < 0.1:
        return values
    return values.isel(distance=np.flatnonzero(values["distance"].values * np.sign(outward) > 0))


def _smoothed(values, window):
    if values.sizes["distance"] < 2:
        return values
    step = float(np.diff(values["distance"].values).min())
    count = max(1, 2 * int(0.5 * window / step) + 1)
    return values.rolling(distance=count, center=True, min_periods=1).mean()
