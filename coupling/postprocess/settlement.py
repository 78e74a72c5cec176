"""The settlement of the ground surface and the trough it makes."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.postprocess.elements import cell_means


def surface_settlement(points: xr.Dataset, spacing: float = 1.0, depth: float = 1.0) -> xr.DataArray:
    """Settlement of the ground surface: mean of the points that started in its uppermost layer.

    Parameters
    ----------
    points : xarray.Dataset
        `/points` of a run, all snapshots or one.
    spacing : float
        Width of the cells along the surface [m].
    depth : float
        Thickness of the layer whose points count [m].

    Returns
    -------
    xarray.DataArray
        (time, x) [m], downward positive, over where the points started; NaN where there is none.

    Raises
    ------
    ValueError
        No point in the layer.
    """
    if "time" not in points.dims:
        points = points.expand_dims("time")
    x_start = points["x"].values - points["displacement_x"].values
    y_start = points["y"].values - points["displacement_y"].values
    near = np.isfinite(x_start) & (y_start > -depth)
    if not near.any():
        raise ValueError(
            f"surface_settlement: no point within {depth:g} m of the surface, the highest starts at "
            f"{np.nanmax(y_start):g} m; raise depth"
        )
    half = spacing * np.ceil(np.abs(x_start[near]).max() / spacing)
    edges = np.arange(-half, half + 0.5 * spacing, spacing)
    rows = []
    for k in range(points.sizes["time"]):
        x = x_start[k, near[k]]
        weight, down = points["volume"].values[k, near[k]], -points["displacement_y"].values[k, near[k]]
        cell = np.clip(np.digitize(x, edges) - 1, 0, len(edges) - 2)
        rows.append(cell_means(cell, weight, down, len(edges) - 1))
    return xr.DataArray(
        np.array(rows),
        dims=("time", "x"),
        coords={
            "time": points["time"],
            "x": ("x", 0.5 * (edges[1:] + edges[:-1]), {"units": "m", "long_name": "horizontal position"}),
        },
        name="settlement",
        attrs={"units": "m", "long_name": "settlement of the ground surface, downward positive"},
    )


def gauss(x: NDArray[np.float64], peak: float, centre: float, width: float) -> NDArray[np.float64]:
    """Settlement of the trough at x, in the unit of its peak. Source: Peck (1969)."""
    return peak * np.exp(-((x - centre) ** 2) / (2 * width**2))


def trough(settlement: xr.DataArray) -> xr.Dataset:
    """Gauss curve s = s_max exp(-(x - x_0)^2/(2 i^2)) closest to the settlement of every time.

    Parameters
    ----------
    settlement : xarray.DataArray
        (time, x) [m], of :func:`surface_settlement`.

    Returns
    -------
    xarray.Dataset
        Over time: largest, that of the settlement itself [m]; peak s_max, centre, width i [m], r_squared [-] of the
        curve and error, the root mean square of what it leaves [m], NaN where the surface has not settled by a
        hundredth of a millimetre or no curve is found; volume [m2], the area of the trough.

    Source of the curve: Peck (1969).
    """
    from scipy.optimize import curve_fit

    x = settlement["x"].values
    rows = []
    for values in settlement.transpose("time", "x").values:
        known = np.isfinite(values)
        here, down = x[known], values[known]
        largest, volume = float(down.max()), float(np.trapezoid(down, here))
        row = [largest, *[np.nan] * 5, volume]
        if largest > 1e-5:
            start = (largest, float(here[down.argmax()]), 0.2 * (here[-1] - here[0]))
            limits = ((0.0, here[0], 0.5), (10 * largest, here[-1], 2 * (here[-1] - here[0])))
            try:
                found, _ = curve_fit(gauss, here, down, start, bounds=limits)
            except RuntimeError:
                found = None
            if found is not None:
                left = down - gauss(here, *found)
                spread = np.sum((down - down.mean()) ** 2)
                row[1:6] = *found, 1 - float(left @ left / spread), float(np.sqrt(np.mean(left**2)))
        rows.append(row)
    names = (
        ("largest", "m", "largest settlement"),
        ("peak", "m", "largest settlement of the Gauss curve"),
        ("centre", "m", "middle of the trough"),
        ("width", "m", "distance i from the middle of the trough to its inflection"),
        ("r_squared", "1", "coefficient of determination of the Gauss curve"),
        ("error", "m", "root mean square of what the Gauss curve leaves"),
        ("volume", "m^2", "area of the trough"),
    )
    columns = np.array(rows).T
    return xr.Dataset(
        {name: ("time", column, {"units": unit, "long_name": text})
         for (name, unit, text), column in zip(names, columns, strict=True)},
        coords={"time": settlement["time"]},
    )  # fmt: skip


def share_within(settlement: xr.DataArray, distance: float, centre: float = 0.0) -> xr.DataArray:
    """Share of the trough's settlement that lies within a distance of a vertical line [-], over time.

    Upward movement counts as none.
    """
    down = settlement.clip(min=0.0)
    inside = down.where(np.abs(down["x"] - centre) <= distance).sum("x")
    total = down.sum("x")
    return (inside / total.where(total > 0)).assign_attrs(
        units="1", long_name=f"share of the settlement within {distance:g} m"
    )
