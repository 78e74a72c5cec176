"""How pictures look, and the figure that they are drawn on."""

import io
import math
from collections.abc import Iterator
from contextlib import contextmanager

import matplotlib
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

STYLE = {
    "font.size": 8,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "grid.linewidth": 0.4,
    "grid.color": "0.85",
    "lines.linewidth": 1.4,
    "figure.dpi": 100,
}
RESOLUTION = 200  # dots per inch of saved pictures
INITIAL, NOW, GATE, SECOND = "0.45", "#0b5394", "#c1272d", "#d98200"
CONCRETE = "0.82"


class Picture(Figure):
    """A matplotlib figure outside of pyplot: nothing global knows it, so only Jupyter's display of a value shows it."""

    def _repr_png_(self):
        image = io.BytesIO()
        self.savefig(image, format="png")
        return image.getvalue()


@contextmanager
def styled(width: float, height: float, layout: str | None = "constrained") -> Iterator[Picture]:
    """A picture of so many inches, in the style of all while the block draws it."""
    with matplotlib.rc_context(STYLE):
        yield Picture(figsize=(width, height), layout=layout)


def logarithmic_axis(axis: Axis) -> None:
    """Scale of an axis that is drawn on already, with labels that do not overlap: at 1 and 3 of few decades."""
    getattr(axis.axes, f"set_{axis.axis_name}scale")("log")
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1, 3) if high < 1e4 * low else (1,)))
    axis.set_major_formatter(LogFormatterSciNotation(labelOnlyBase=False, minor_thresholds=(math.inf, math.inf)))
    axis.set_minor_formatter(NullFormatter())


def legend_outside(picture: Figure, axis: Axes, place: str = "lower", columns: int | None = None) -> None:
    """The legend of an axis beside all of them, "lower" or "upper", in one row or so many columns."""
    handles, labels = axis.get_legend_handles_labels()
    picture.legend(handles, labels, loc=f"outside {place} center", ncols=columns or len(labels))
