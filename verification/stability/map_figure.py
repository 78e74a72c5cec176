"""The map of the critical Courant number, drawn from its dataset."""

import numpy as np

from coupling.figures import GATE, NOW, SECOND
from verification.pages import picture

PLACES = ("layout", "random", "edges", "vertices")
SETS = (("spectral", True, NOW), ("spectral", False, "0.45"), ("altitude", True, SECOND), ("altitude", False, GATE))


def draw_map(linear, path):
    """Predicted over actual critical time step over moduli, permeability and mesh size, positions, and element shape.

    linear : xarray.Dataset, of :func:`verification.stability.linear.critical_map`.
    """
    with picture(path, 8.4, 7.6) as figure:
        axes = figure.subplots(3, 2)
        moduli, permeability = _family(linear, "moduli"), _family(linear, "permeability")
        moduli = moduli.isel(configuration=np.isfinite(moduli.bulk_modulus.values))
        for column, way in enumerate(("spectral", "altitude")):
            _heat(axes[0, column], moduli, way, "youngs_modulus", "bulk_modulus",
                  "Young's modulus [Pa]", "bulk modulus of the water [Pa]")  # fmt: skip
            image = _heat(axes[1, column], permeability, way, "hydraulic_conductivity", "size",
                          "hydraulic conductivity [m/s]", "height of a cell [m]")  # fmt: skip
            axes[0, column].set_title(way)
        figure.colorbar(image, ax=axes[:2], label="predicted / actual critical step [-]", shrink=0.6)
        _positions(axes[2, 0], _family(linear, "positions"))
        _shapes(axes[2, 1], _family(linear, "mesh"))


def _family(linear, name):
    return linear.isel(configuration=(linear.family == name).values)


def _heat(axis, part, way, x, y, x_label, y_label):
    xs, ys = np.unique(part[x]), np.unique(part[y])
    values = np.full((len(ys), len(xs)), np.nan)
    values[np.searchsorted(ys, part[y]), np.searchsorted(xs, part[x])] = part[f"{way}_ratio"]
    image = axis.imshow(values, origin="lower", aspect="auto", vmin=0.0, vmax=1.0, cmap="viridis")
    axis.set_xticks(range(len(xs)), [f"{v:.0e}" for v in xs], rotation=60)
    axis.set_yticks(range(len(ys)), [f"{v:.1e}" for v in ys])
    size = 5 if len(xs) < 9 else 4
    for (j, i), value in np.ndenumerate(values):
        colour = "white" if value < 0.6 else "black"
        axis.text(i, j, f"{value:.2f}", ha="center", va="center", fontsize=size, color=colour)
    axis.set(xlabel=x_label, ylabel=y_label)
    return image


def _positions(axis, part):
    rng = np.random.default_rng(0)
    for offset, (way, damped, colour) in enumerate(SETS):
        chosen = part.isel(configuration=((part.stress_damping > 0) == damped).values)
        at = np.array([PLACES.index(p) for p in chosen.positions.values]) + 0.2 * (offset - 1.5)
        at = at + rng.uniform(-0.06, 0.06, len(at))
        axis.plot(at, chosen[f"{way}_ratio"], ".", ms=4, color=colour, label=_label(way, damped))
    _limits(axis)
    axis.set_xticks(range(len(PLACES)), PLACES)
    axis.set_xlabel("positions of the points")


def _shapes(axis, part):
    for way, damped, colour in SETS:
        for place, marker in (("layout", "o"), ("vertices", "^")):
            chosen = part.isel(configuration=((part.positions == place) & ((part.stress_damping > 0) == damped)).values)
            at = np.array([0.3, 1.0, 3.0]).searchsorted(chosen.aspect) + 0.3 * (chosen["skew"] > 0)
            axis.plot(at, chosen[f"{way}_ratio"], marker, ms=4, color=colour, mfc="none")
    for way, damped, colour in SETS:
        axis.plot([], [], "s", ms=4, color=colour, label=_label(way, damped))
    for place, marker in (("layout", "o"), ("vertices", "^")):
        axis.plot([], [], marker, ms=4, color="0.3", mfc="none", label=f"points: {place}")
    _limits(axis)
    axis.set_xticks([0, 0.3, 1, 1.3, 2, 2.3], ["0.3", "skew", "1", "skew", "3", "skew"])
    axis.set(xlabel="width over height of a cell [-]; skew: nodes moved", ylim=(0.0, 2.9))
    axis.legend(loc="upper left", fontsize=5, ncols=3, columnspacing=0.8, handletextpad=0.2)


def _label(way, damped):
    return way if damped else f"{way}, undamped"


def _limits(axis):
    axis.axhline(1.0, color="0.3", lw=0.8)
    axis.axhline(0.7, color="0.3", lw=0.8, ls="--")
    axis.set(ylim=(0.0, 2.1), ylabel="predicted / actual critical step [-]")
    axis.grid(True)
