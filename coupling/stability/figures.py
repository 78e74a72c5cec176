"""The map of the critical Courant number, drawn from its dataset."""

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from coupling.figures import GATE, NOW, SECOND, STYLE

PLACES = ("layout", "random", "edges", "vertices")


def critical_courant(linear):
    """Predicted over actual critical time step over moduli, permeability and mesh size, positions, and element shape.

    Parameters
    ----------
    linear : xarray.Dataset
        Of :func:`coupling.stability.linear.critical_map`.
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.4, 6.0), layout="constrained")
        axes = figure.subplots(2, 2)
        moduli = _family(linear, "moduli")
        moduli = moduli.isel(configuration=np.isfinite(moduli.bulk_modulus.values))
        image = _heat(axes[0, 0], moduli, "youngs_modulus", "bulk_modulus", "Young's modulus [Pa]", "water's bulk modulus [Pa]")
        _heat(axes[0, 1], _family(linear, "permeability"), "hydraulic_conductivity", "size",
              "hydraulic conductivity [m/s]", "cell [m]")  # fmt: skip
        figure.colorbar(image, ax=axes[0], label="predicted / actual critical step [-]")
        _positions(axes[1, 0], _family(linear, "positions"))
        _shapes(axes[1, 1], _family(linear, "mesh"))
    return figure


def _family(linear, name):
    return linear.isel(configuration=(linear.family == name).values)


def _heat(axis, part, x, y, x_label, y_label):
    xs, ys = np.unique(part[x]), np.unique(part[y])
    values = np.full((len(ys), len(xs)), np.nan)
    values[np.searchsorted(ys, part[y]), np.searchsorted(xs, part[x])] = part.ratio
    image = axis.imshow(values, origin="lower", aspect="auto", vmin=0.0, vmax=1.0, cmap="viridis")
    axis.set_xticks(range(len(xs)), [f"{v:.0e}" for v in xs], rotation=60)
    axis.set_yticks(range(len(ys)), [f"{v:.1e}" for v in ys])
    for (j, i), value in np.ndenumerate(values):
        axis.text(i, j, f"{value:.2f}", ha="center", va="center", fontsize=5, color="white" if value < 0.6 else "black")
    axis.set_xlabel(x_label)
    axis.set_ylabel(y_label)
    return image


def _positions(axis, part):
    rng = np.random.default_rng(0)
    for offset, (wet, smooth) in enumerate(((True, 1), (True, 0), (False, 1), (False, 0))):
        chosen = part.isel(
            configuration=((np.isfinite(part.bulk_modulus) == wet) & (part.volumetric_smoothing == smooth)).values
        )
        at = np.array([PLACES.index(p) for p in chosen.positions.values]) + 0.18 * (offset - 1.5)
        label = f"{'water' if wet else 'dry'}, {'smoothed' if smooth else 'not smoothed'}"
        colour = (NOW, SECOND, "0.45", GATE)[offset]
        axis.plot(at + rng.uniform(-0.05, 0.05, len(at)), chosen.ratio, ".", color=colour, label=label)
    _limits(axis)
    axis.set_xticks(range(len(PLACES)), PLACES)
    axis.set_xlabel("positions of the points")
    axis.legend(loc="upper left")


def _shapes(axis, part):
    for place, colour in (("layout", NOW), ("vertices", GATE)):
        for smooth, marker in ((1, "o"), (0, "^")):
            chosen = part.isel(
                configuration=((part.positions == place) & (part.volumetric_smoothing == smooth)).values
            )
            shift = 1.0 + 0.12 * (chosen["skew"] > 0)
            axis.plot(chosen.aspect * shift, chosen.ratio, marker, ms=4, color=colour, mfc="none",
                      label=f"{place}, {'smoothed' if smooth else 'not smoothed'}")  # fmt: skip
    _limits(axis)
    axis.set_xscale("log")
    axis.set_xticks([0.3, 1.0, 3.0], ["0.3", "1", "3"])
    axis.minorticks_off()
    axis.set_xlabel("width over height of a cell; right of each: inner nodes shifted by up to a fifth")
    axis.legend(loc="upper left")


def _limits(axis):
    axis.axhline(1.0, color="0.3", lw=0.8)
    axis.axhline(0.7, color="0.3", lw=0.8, ls="--")
    axis.set_ylim(bottom=0.0)
    axis.set_ylabel("predicted / actual critical step [-]")
    axis.grid(True)
