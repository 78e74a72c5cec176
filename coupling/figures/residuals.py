"""Pictures of a run against measurements."""

import numpy as np
import xarray as xr

from coupling.figures.picture import GATE, INITIAL, NOW, Picture, legend_outside, styled
from coupling.measurements import QUANTITIES


def residuals(misfit: xr.Dataset) -> Picture:
    """A row for each quantity, the worst first: measured and computed, and the residuals, over the run's time.

    Parameters
    ----------
    misfit : xarray.Dataset
        Of :func:`coupling.measurements.misfit`.
    """
    names = misfit["quantity"].values.tolist()
    with styled(7.4, 0.6 + 1.9 * len(names)) as figure:
        axes = figure.subplots(len(names), 2, squeeze=False)
        for (values, left), name in zip(axes, names, strict=True):
            own = misfit.isel(measurement=np.flatnonzero(misfit["name"].values == name))
            shown = QUANTITIES[name].shown
            _panels(values, left, own, shown.scale)
            values.set_ylabel(f"{name.replace('_', ' ')} [{shown.unit}]")
            chi_square = float(misfit["chi_square"].sel(quantity=name))
            left.set_title(f"χ² {chi_square:.3g} a measurement", loc="right")
        legend_outside(figure, axes[0, 0], "upper")
    return figure


def _panels(values, left, own, scale):
    """One quantity: values with their errors, and residuals between lines of one and two errors."""
    along = own["run_time"]
    style = {"color": INITIAL, "fmt": "o", "ms": 3, "elinewidth": 0.8, "label": "measured, one standard deviation"}
    values.errorbar(along, scale * own["measured"], scale * np.hypot(own["error"], own["common_error"]), **style)
    values.plot(along, scale * own["computed"], "x", color=GATE, ms=4, label="computed")
    for reach, shade in ((2, "0.94"), (1, "0.86")):
        left.axhspan(-reach, reach, color=shade, zorder=0)
    left.axhline(0.0, color="0.2", lw=0.6)
    left.plot(along, own["residual"], "o", color=NOW, ms=3)
    left.set_ylabel("residual [errors]")
    for axis in (values, left):
        axis.set_xlabel("time since the gate opened [s]")
        axis.spines[["top", "right"]].set_visible(False)
