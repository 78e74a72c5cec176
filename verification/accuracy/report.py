"""The page about accuracy: one table of all problems, one picture and one table a problem."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path

from coupling.files.provenance import revision
from verification.accuracy import figures
from verification.accuracy.ladders import assess, dataset
from verification.pages import made_by

READING = """
## What it says

- **Where theory is smooth the orders are its own**: two for undamped waves, vibrations and the lining's pressures over
  mesh size, one for rotation and flight over the time step, one for consolidation from a jump.
- **`pressure_filter`** takes out only what no node feels: forces, flow and the water in an element are the same before
  and after. What it is for is the pressure that points bring along into other elements.
- **`stress_damping`** is a viscosity whose time vanishes with the mesh: it takes the flutter of flow without dilatancy,
  and costs a factor of sqrt(1 + 2 `stress_damping`) in the critical step. Waves become first order in the mesh with it;
  their problems are stated without.
- **`pic_rate`** is the only choice that draws velocities together; the tables of the flows say what it costs there.
- **The lining's motion** (`lining = "floating"`, `"elastic"`) is no numerical choice where the ring is lighter than the
  ground or gives way: another answer, whose size and cost in case 3 stand in [lining-in-mpm.md](lining-in-mpm.md).
  At rest, with the weight of the ground it stands for and as stiff as a scene may ask, a ring keeps the pressures of a
  held one; it costs the local time steps, and the half model.
- **Off the front.** Where a coarser mesh beats the default (walls, trapdoor, water column) errors of opposite sign
  cancel on it; more elements do not make these errors smaller, since the references idealise (a front without
  thickness, slip planes where the soil has a shear band). Fewer points an element are cheaper in flows and let the
  material run into itself, which the norm does not see.
- **What does not converge.** Collapses into the open (column, dam, water column) and the water's mass in the splashing
  closed box keep errors that a finer mesh does not take: points carry the water of their pores, and what seeps from
  point to point follows from divergences. Walls in soil without dilatancy leave Rankine's strength for Davis' the finer
  the mesh is: both bound the answer (numerics).
"""


def write(rows: list[dict], problems: dict, folder: Path) -> dict:
    """Write accuracy.md, accuracy.nc and images/ into a folder.

    Parameters
    ----------
    rows : list of dict
        Of :func:`verification.accuracy.ladders.measure`, all problems.
    problems : dict
        Name to :class:`verification.problems.Problem`.
    folder : path

    Returns
    -------
    dict
        page, data : paths as text;  problems : name to default error, its limit, within (bool), cpu_seconds, orders,
        excess (see :func:`verification.accuracy.ladders.assess`).
    """
    folder = Path(folder)
    (folder / "images").mkdir(parents=True, exist_ok=True)
    by_name = {
        name: [row for row in rows if row["problem"] == name] for name in dict.fromkeys(r["problem"] for r in rows)
    }
    limits = {name: problems[name].limit for name in by_name}
    summary = {name: _summary(mine, problems[name]) for name, mine in by_name.items()}
    figures.save(
        figures.overview_figure(rows, limits),
        folder / "images" / "accuracy-overview.png",
    )
    page = [
        "# Error against run time",
        "",
        f"{made_by('gush accuracy')}.",
        "Errors are in the norm of each problem, times are processor time of stepping, one thread, without compiling.",
        "",
        "![overview](images/accuracy-overview.png)",
        "",
        "Observed orders are slopes over mesh size or time step. The last column is the error of the default over the",
        "best error of what costs no more: 1 on the Pareto front.",
        "",
        "| problem | error | limit | CPU s | observed orders | default over the front |",
        "|---|---|---|---|---|---|",
    ]
    for name, entry in summary.items():
        orders = ", ".join(
            f"{setting} {order:.2f}" for setting, order in entry["orders"].items() if math.isfinite(order)
        )
        page.append(
            f"| [{name}](#{name.lower()}) | {entry['error']:.2e} | {entry['limit']:.2g} | {entry['cpu_seconds']:.2f} |"
            f" {orders or '-'} | {entry['excess']:.2f} |"
        )
    page += ["", *READING.strip().splitlines()]
    for name, mine in by_name.items():
        page += _section(problems[name], mine, folder)
    (folder / "accuracy.md").write_text("\n".join(page) + "\n", encoding="utf-8")
    data = dataset(rows)
    data.attrs = {"title": "error against run time", "revision": revision(), "created": f"{datetime.now(UTC):%Y-%m-%d}"}
    data.to_netcdf(folder / "accuracy.nc", engine="h5netcdf")
    return {"page": str(folder / "accuracy.md"), "data": str(folder / "accuracy.nc"), "problems": summary}


def _summary(rows, problem):
    verdict = assess(rows)
    default = rows[0]
    return {
        "error": default["error"],
        "limit": problem.limit,
        "within": bool(default["error"] <= problem.limit),
        "cpu_seconds": default["cpu_seconds"],
        "orders": verdict["orders"],
        "excess": verdict["excess"],
    }


def _section(problem, rows, folder):
    lines = [
        "",
        f"## {problem.name}",
        "",
        f"{problem.title}. Reference: {problem.source}. Error: {problem.norm}. Limit {problem.limit:g}: {problem.why}",
    ]
    if len(rows) > 1:
        figures.save(
            figures.problem_figure(problem.title, problem.norm, rows),
            folder / "images" / f"accuracy-{problem.name}.png",
        )
        lines += ["", f"![{problem.name}](images/accuracy-{problem.name}.png)"]
    front = assess(rows)["front"]
    lines += [
        "",
        "| setting | value | error | CPU s | steps | points | on the front |",
        "|---|---|---|---|---|---|---|",
    ]
    for row, best in zip(rows, front, strict=True):
        if row["failure"]:
            lines.append(f"| {row['setting']} | {row['value']} | failed: {row['failure']} | | | | |")
            continue
        value = ", ".join(f"{k} = {v}" for k, v in problem.fast.items()) if row["value"] is None else row["value"]
        lines.append(
            f"| {row['setting']} | {value} | {row['error']:.2e} | {row['cpu_seconds']:.2f} | {row['steps']} |"
            f" {row['points']} | {'yes' if best else ''} |"
        )
    return lines
