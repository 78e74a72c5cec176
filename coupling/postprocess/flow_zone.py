"""The stages in which the flow zone grows: slowly, rapidly, hardly any more."""

from typing import NamedTuple

import numpy as np
import xarray as xr

#: Places at which the line may bend, evenly over the record; 60 of them decide a bend to 1.7 % of the record.
BENDS = 60


class Stages(NamedTuple):
    """Where the flow zone changes its pace.

    over : name of the abscissa;  bends : its values at the end of the initial and of the rapid stage;
    rates : growth in the initial, rapid and stable stage [m2 per unit of the abscissa];
    appear : whether the rapid stage is at least twice as fast as both others;
    areas : of the fitted line at the start, at both bends and at the end [m2];  r_squared : of that line [-].
    """

    over: str
    bends: tuple[float, float]
    rates: tuple[float, float, float]
    appear: bool
    areas: tuple[float, float, float, float]
    r_squared: float


def flow_zone_stages(history: xr.Dataset, over: str = "time") -> Stages:
    """Stages of the flow zone: the continuous line of three straight pieces closest to its area (least squares).

    Parameters
    ----------
    history : xarray.Dataset
        With `flow_zone_area` (time) [m2] and the abscissa.
    over : str
        "time" [s] or "inflow_mass" [kg/m].

    Returns
    -------
    Stages

    Raises
    ------
    ValueError
        Fewer than twelve records.
    """
    x, area = history[over].values.astype(float), history["flow_zone_area"].values.astype(float)
    if len(x) < 12 or not x[-1] > x[0]:
        raise ValueError(f"flow_zone_stages: needs at least 12 records over {over}, got {len(x)}; record more often")
    grid = np.linspace(x[0], x[-1], BENDS + 2)
    best = None
    for first in range(1, BENDS):
        for second in range(first + 2, BENDS + 1):
            nodes = np.array([x[0], grid[first], grid[second], x[-1]])
            hats = np.column_stack([np.interp(x, nodes, unit) for unit in np.eye(4)])
            height = np.linalg.lstsq(hats, area, rcond=None)[0]
            left = float(np.sum((hats @ height - area) ** 2))
            if best is None or left < best[0]:
                best = left, nodes, height
    left, nodes, height = best
    rates = np.diff(height) / np.diff(nodes)
    total = float(np.sum((area - area.mean()) ** 2))
    return Stages(
        over,
        (float(nodes[1]), float(nodes[2])),
        tuple(map(float, rates)),
        bool(rates[1] > 2 * max(rates[0], rates[2]) and rates[1] > 0),
        tuple(map(float, height)),
        1 - left / total if total > 0 else 1.0,
    )
