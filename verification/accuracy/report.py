"""What `gush accuracy` does with problems: measure their ladders; a page with one table of all, a picture a problem."""

import difflib
import math
from pathlib import Path

from coupling.figures.picture import logarithmic_axis
from coupling.refused import Refused
from verification.accuracy.ladders import assess, dataset, measure
from verification.pages import made_by, picture, provenance, rendered, templated_page


def problem_ladders(names, only_fast, out, tell):
    """Measure verification problems (all without names) and write accuracy.md, accuracy.nc and images/ into a folder.

    Returns a dict: page, data : paths as text;  problems : name to default error, its limit, within (bool),
    cpu_seconds, orders, excess (see :func:`verification.accuracy.ladders.assess`).

    Raises coupling.refused.Refused: unknown problem.
    """
    from verification.problems import problems

    known, folder = problems(), Path(out)
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise Refused(f"problem: must be a verification problem, got {name!r}; {hint}known: {', '.join(known)}")
    page = templated_page(folder, "accuracy")
    rows = {name: measure(known[name], only_fast, tell) for name in names or known}
    return write(rows, known, page)


def write(rows, problems, page):
    """Write page, pictures and data of rows by problem, those of :func:`verification.accuracy.ladders.measure`."""
    folder, images = page.path.parent, page.path.parent / "images"
    summary = {name: _summary(mine, problems[name]) for name, mine in rows.items()}
    overview(summary, images / "accuracy-overview.png")
    runs = []
    for name, mine in rows.items():
        if len(mine) > 1:
            draw(problems[name], mine, images / f"accuracy-{name}.png")
        front = assess(mine)["front"]
        shown = [row | {"on_front": best} for row, best in zip(mine, front, strict=True)]
        runs.append((problems[name], shown))
    page.fill({"made": made_by("gush accuracy"), **rendered("accuracy", problems=summary, runs=runs)})
    data = dataset([row for mine in rows.values() for row in mine])
    made = provenance()
    data.attrs = {"title": "error against run time", "revision": made["revision"], "created": made["date"]}
    data.to_netcdf(folder / "accuracy.nc", engine="h5netcdf")
    return {"page": str(page.path), "data": str(folder / "accuracy.nc"), "problems": summary}


def _summary(rows, problem):
    verdict, default = assess(rows), rows[0]
    return {
        "error": default["error"], "limit": problem.limit, "within": bool(default["error"] <= problem.limit),
        "cpu_seconds": default["cpu_seconds"], "orders": verdict["orders"], "excess": verdict["excess"],
    }  # fmt: skip


def draw(problem, rows, path):
    """Error over processor time: a line a setting, its values beside the points, the default as a ring."""
    with picture(path, 5.2, 3.6) as figure:
        axes = figure.subplots()
        for setting in dict.fromkeys(row["setting"] for row in rows if row["value"] is not None):
            mine = [row for row in rows if row["setting"] == setting and math.isfinite(row["error"])]
            mine = sorted((row["cpu_seconds"], _shown(row["error"]), _value(row["value"])) for row in mine)
            (line,) = axes.plot([m[0] for m in mine], [m[1] for m in mine], "o-", ms=3.5, lw=1, label=setting)
            for seconds, error, value in mine:
                if value == _value(problem.fast.get(setting)):
                    continue  # the default, at the ring
                axes.annotate(value, (seconds, error), (4, 3), textcoords="offset points", fontsize=6.5,
                              color=line.get_color())  # fmt: skip
        place = rows[0]["cpu_seconds"], _shown(rows[0]["error"])
        axes.plot(*place, "o", ms=9, mfc="none", mec="black", label="default")
        logarithmic_axis(axes.xaxis)
        logarithmic_axis(axes.yaxis)
        what = f"error: {problem.norm}" if len(problem.norm) < 40 else "error [-]"
        axes.set(xlabel="processor time of stepping [s]", ylabel=what, title=problem.title)
        axes.grid(True)
        axes.legend(fontsize=7)


def overview(summary, path):
    """Default of every problem, a line each: error with the limit of its test, and processor time."""
    rows = list(summary.values())[::-1]
    with picture(path, 7.0, 1.0 + 0.19 * len(rows)) as figure:
        error, cost = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
        at = range(len(rows))
        error.plot([_shown(row["error"]) for row in rows], at, "o", ms=4, color="#0b5394", label="error")
        error.plot([row["limit"] for row in rows], at, "|", ms=8, color="0.3", label="limit of the test")
        cost.plot([row["cpu_seconds"] for row in rows], at, "o", ms=4, color="#b45f06")
        for axes in (error, cost):
            axes.set_xscale("log")
            axes.grid(True)
        error.set_yticks(at, list(summary)[::-1], fontsize=7)
        error.set_xlabel("error in the problem's norm [-]")
        error.legend(fontsize=7, loc="lower left")
        cost.set_xlabel("processor time of stepping [s]")


def _value(value):
    return f"{value:g}" if isinstance(value, float) else str(value)


def _shown(error):
    """Errors of zero cannot be shown on a logarithmic axis: drawn at round-off."""
    return max(error, 1e-16)
