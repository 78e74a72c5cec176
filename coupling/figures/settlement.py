"""The settlement trough and the Gauss curve of Peck through it."""

import numpy as np
import xarray as xr

from coupling.figures.picture import GATE, INITIAL, NOW, Picture, styled
from coupling.postprocess.settlement import gauss

WIDTHS = 6.0  # at most half the width of the view, in widths i of the trough; it ends where the surface does
MARGIN = 0.02  # of the view, on each side


def settlement_trough(settlement: xr.DataArray, trough: xr.Dataset) -> Picture:
    """Settlement of the surface at the last time, with the Gauss curve, its width i, its error, and the volume loss.

    Parameters
    ----------
    settlement : xarray.DataArray
    trough : xarray.Dataset
        Both as of :func:`coupling.postprocess.answer.settled`.
    """
    now = settlement.isel(time=-1).dropna("x")
    x, down = now["x"].values, 1e3 * now.values
    last = {name: float(trough[name][-1]) for name in trough.data_vars}
    told = f"largest {1e3 * last['largest']:.3g} mm, volume loss {100 * last['volume_loss']:.3g} %"
    with styled(5.6, 3.2) as figure:
        axis = figure.subplots()
        axis.plot(x, down, "o", ms=3, color=NOW, label="points of the surface")
        if np.isfinite(last["width"]):
            centre, width = last["centre"], last["width"]
            along = np.linspace(x[0], x[-1], 400)
            curve = 1e3 * gauss(along, last["peak"], centre, width)
            axis.plot(along, curve, "-", color=GATE, lw=1.2, label="Gauss curve (Peck 1969)")
            axis.axvspan(centre - width, centre + width, color="0.94", lw=0, label=f"width i = {width:.3g} m", zorder=0)
            left, right = max(x[0], centre - WIDTHS * width), min(x[-1], centre + WIDTHS * width)
            axis.set_xlim(left - MARGIN * (right - left), right + MARGIN * (right - left))
            told += f"\ni is {last['width_over_depth']:.2g} of the depth of the axis; curve off by "
            told += f"{1e3 * last['error']:.2g} mm (root mean square), R² {last['r_squared']:.2f}"
        axis.axhline(0.0, color=INITIAL, lw=0.6)
        axis.invert_yaxis()
        axis.set_xlabel("x [m]")
        axis.set_ylabel("settlement [mm]")
        axis.set_title(f"{float(settlement['time'][-1]):.3g} s: {told}")
        axis.grid(True)
        axis.legend(loc="lower right")
    return figure
