"""Error against processor time, one picture a problem and one of all of them; mesh ladders of a scene."""

from __future__ import annotations

import math
from pathlib import Path


def _figure(width, height):
    from coupling.figures.picture import Picture

    return Picture(figsize=(width, height), layout="constrained")


def problem_figure(title: str, norm: str, rows: list[dict]):
    """Error over processor time: a line a setting, its values beside the points, the default as a ring."""
    import matplotlib

    from coupling.figures import STYLE

    with matplotlib.rc_context(STYLE):
        figure = _figure(5.2, 3.6)
        axes = figure.subplots()
        settings = dict.fromkeys(row["setting"] for row in rows if row["value"] is not None)
        for setting in settings:
            mine = sorted(
                (row for row in rows if row["setting"] == setting and math.isfinite(row["error"])),
                key=lambda row: row["cpu_seconds"],
            )
            (line,) = axes.plot(
                [row["cpu_seconds"] for row in mine],
                [_shown(row["error"]) for row in mine],
                "o-", ms=3.5, lw=1, label=setting,
            )  # fmt: skip
            for row in mine:
                axes.annotate(
                    f"{row['value']:g}" if isinstance(row["value"], float) else str(row["value"]),
                    (row["cpu_seconds"], _shown(row["error"])), (4, 3), textcoords="offset points", fontsize=6.5,
                    color=line.get_color(),
                )  # fmt: skip
        default = rows[0]
        axes.plot(default["cpu_seconds"], _shown(default["error"]), "o", ms=9, mfc="none", mec="black", label="default")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("processor time of stepping [s]")
        axes.set_ylabel(f"error: {norm}" if len(norm) < 40 else "error [-]")
        axes.set_title(title)
        axes.grid(True)
        axes.legend(fontsize=7)
    return figure


def overview_figure(rows: list[dict], limits: dict[str, float]):
    """Default of every problem, a line each: error with its limit, and processor time.

    limits : largest error that a problem's test allows, by its name.
    """
    import matplotlib

    from coupling.figures import STYLE

    defaults = [row for row in rows if row["setting"] == "default"][::-1]
    with matplotlib.rc_context(STYLE):
        figure = _figure(7.0, 1.0 + 0.19 * len(defaults))
        error, cost = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
        at = range(len(defaults))
        error.plot([_shown(row["error"]) for row in defaults], at, "o", ms=4, color="#0b5394", label="error")
        error.plot([limits[row["problem"]] for row in defaults], at, "|", ms=8, color="0.3", label="limit of the test")
        cost.plot([row["cpu_seconds"] for row in defaults], at, "o", ms=4, color="#b45f06")
        for axes in (error, cost):
            axes.set_xscale("log")
            axes.grid(True)
        error.set_yticks(at, [row["problem"] for row in defaults], fontsize=7)
        error.set_xlabel("error in the problem's norm [-]")
        error.legend(fontsize=7, loc="lower left")
        cost.set_xlabel("processor time of stepping [s]")
    return figure


def ladder_figure(ladder, inflow_mass: float, names: list[str]):
    """Some quantities over mesh size at an inflow mass, with the fit to mesh size zero and its error bar."""
    import matplotlib
    import numpy as np

    from coupling.figures import STYLE

    state = ladder.sel(inflow_mass=inflow_mass)
    with matplotlib.rc_context(STYLE):
        columns = 3
        figure = _figure(7.4, 2.0 * math.ceil(len(names) / columns))
        grid = figure.subplots(math.ceil(len(names) / columns), columns, squeeze=False, sharex=True)
        for axes, name in zip(grid.flat, names, strict=False):
            one = state.sel(quantity=name)
            factor = ladder["factor"].values
            end, bar = float(one["extrapolated"]), float(one["error_bar"])
            axes.plot(factor, one["value"].values, "o", ms=3.5, color="#0b5394")
            slope = np.polyfit(factor, one["value"].values, 1)[0] if np.ptp(factor) else 0.0
            axes.plot([0, factor.max()], [end, end + slope * factor.max()], "-", lw=0.8, color="0.5")
            axes.errorbar([0], [end], [bar], fmt="s", ms=3.5, color="#c1272d", capsize=3)
            axes.set_title(f"{name} [{one['unit'].values!s}]", fontsize=8)
            axes.grid(True)
        for axes in grid.flat[len(names) :]:
            axes.set_visible(False)
        for axes in grid[-1]:
            axes.set_xlabel("mesh size over the scene's")
        figure.suptitle(f"{inflow_mass:g} kg/m", fontsize=9)
    return figure


def _shown(error):
    """Errors of zero cannot be shown on a logarithmic axis: drawn at round-off."""
    return max(error, 1e-16)


def save(figure, path: Path):
    from coupling.figures import RESOLUTION

    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=RESOLUTION)
