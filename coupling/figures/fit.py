"""Picture of a fit: parameters before and after measuring, what was measured, and bands of what follows."""

from collections.abc import Callable

import numpy as np
import xarray as xr

from coupling.figures.picture import GATE, INITIAL, NOW, Picture, legend_outside, logarithmic_axis, styled

COLUMNS = 3


def fit_bands(fit: xr.Dataset, names: list[str], shown: Callable[[str], tuple[str, str, float]]) -> Picture:
    """A panel for each parameter, one of the measurements, and one for each quantity over time.

    fit : of :func:`coupling.fits.fit.fit`;  names : list of str, quantities that are drawn;  shown : label, unit and
    factor to it of a quantity.
    """
    parameters = fit["parameter"].values.tolist()
    count = len(parameters) + 1 + len(names)
    rows = -(-count // COLUMNS)
    with styled(7.4, 0.5 + 1.9 * rows) as figure:
        axes = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
        for axis, name in zip(axes, parameters, strict=False):
            _parameter(axis, fit, name)
        _measurements(axes[len(parameters)], fit)
        for axis, name in zip(axes[len(parameters) + 1 :], names, strict=False):
            _band(axis, fit, name, shown(name))
        for axis in axes[:count]:
            axis.spines[["top", "right"]].set_visible(False)
        for axis in axes[count:]:
            axis.set_visible(False)
        legend_outside(figure, axes[len(parameters) + 1], "upper", 3)
    return figure


def _parameter(axis, fit, name):
    """Draws of the posterior, and the band of the prior as a grey line below."""
    one = fit.sel(parameter=name)
    prior = one["parameter_value"].sel(knowledge="prior").values
    values = one["draw_value"].values
    logarithmic = prior[0] > 0 and prior[-1] / prior[0] > 5
    low, high = min(prior[0], values.min()), max(prior[-1], values.max())
    edges = np.geomspace(low, high, 41) if logarithmic else np.linspace(low, high, 41)
    axis.hist(values, edges, color=NOW, alpha=0.75)
    axis.axvspan(prior[0], prior[-1], ymax=0.03, color=INITIAL)
    if logarithmic:
        logarithmic_axis(axis.xaxis)
    unit = str(one["unit_of_parameter"].values)
    axis.set_xlabel(name if unit == "1" else f"{name} [{unit}]")
    axis.set_yticks([])
    axis.spines["left"].set_visible(False)


def _measurements(axis, fit):
    """Every measurement against its band of 90 %, both from the median in errors of the measurement."""
    error = np.hypot(fit["error"], fit["common_error"])
    middle = fit["computed"]
    number = np.arange(fit.sizes["measurement"])
    low, high = ((fit["computed_band"].isel(level=end) - middle) / error for end in (0, -1))
    axis.vlines(number, low, high, color=NOW, alpha=0.35, lw=3)
    axis.errorbar(number, (fit["measured"] - middle) / error, 1.0, fmt="o", ms=2.5, elinewidth=0.7, color="0.15")
    axis.axhline(0.0, color="0.2", lw=0.6)
    axis.set_xlabel("measurement")
    axis.set_ylabel("off the fit [errors]")


def _band(axis, fit, name, shown):
    """Bands before and after measuring over time."""
    label, unit, scale = shown
    time = fit["time"].values
    before, after = (scale * fit[name].sel(knowledge=each).values for each in ("prior", "posterior"))
    axis.fill_between(time, before[:, 0], before[:, -1], color="0.88", lw=0, label="before measuring, 90 %")
    axis.fill_between(time, after[:, 0], after[:, -1], color=NOW, alpha=0.35, lw=0, label="after, 90 %")
    axis.plot(time, after[:, after.shape[1] // 2], color=NOW, label="after, median")
    if name.endswith("_utilisation"):
        axis.axhline(1.0, color=GATE, lw=1.0, ls=(0, (4, 2)))
    axis.set_xlim(time[0], time[-1])
    axis.set_xlabel("time since the gate opened [s]")
    axis.set_title(label if unit == "-" else f"{label} [{unit}]", fontsize=7, loc="left", wrap=True)
