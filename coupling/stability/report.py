"""Figure, dataset and page of `gush stability`."""

import json
import os
import platform
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from coupling.stability.extremes import BUG, REFUSED, STABLE

ALLOWED = (0.7, 1.0)  # predicted over actual


def extremes_dataset(verdicts):
    """Verdicts and measures of the extremes: xarray.Dataset over `case`."""
    import xarray as xr

    names = sorted({name for v in verdicts for name in v.measures})
    data = {
        "verdict": ("case", np.array([v.verdict for v in verdicts], dtype=object)),
        "title": ("case", np.array([v.title for v in verdicts], dtype=object)),
        "reason": ("case", np.array([v.reason for v in verdicts], dtype=object)),
        "seconds": ("case", [v.seconds for v in verdicts], {"units": "s"}),
    }
    for name in names:
        data[name] = ("case", [float(v.measures.get(name, np.nan)) for v in verdicts])
    return xr.Dataset(data, coords={"case": np.array([v.name for v in verdicts], dtype=object)})


def write(out, linear, verdicts):
    """Write stability.nc, stability.json, stability.md and images/stability-map.png into a folder; returns the paths."""
    out = Path(out)
    (out / "images").mkdir(parents=True, exist_ok=True)
    paths = [out / "stability.json"]
    paths[0].write_text(json.dumps(summary(linear, verdicts), indent=1) + "\n", encoding="utf-8")
    if linear is not None:
        from coupling.stability.figures import critical_courant

        paths += [out / "images" / "stability-map.png", out / "stability.nc"]
        critical_courant(linear).savefig(paths[-2], dpi=150)
        linear.to_netcdf(paths[-1], group="linear", engine="h5netcdf")
    if verdicts:
        mode = "w" if linear is None else "a"
        extremes_dataset(verdicts).to_netcdf(out / "stability.nc", mode=mode, group="extremes", engine="h5netcdf")
        paths.append(out / "stability.nc")
    if linear is not None and verdicts:
        paths.append(out / "stability.md")
        paths[-1].write_text(page(linear, verdicts), encoding="utf-8")
    return sorted(set(paths))


def summary(linear, verdicts):
    """Numbers of both parts: dict with provenance, linear (families, None when not run) and extremes (a list)."""
    return {
        **provenance(),
        "linear": None if linear is None else families(linear),
        "extremes": [asdict(v) for v in verdicts],
    }


def families(linear):
    """Range of predicted over actual critical step of every family: list of dicts."""
    rows = []
    for family in dict.fromkeys(linear.family.values):
        part = linear.isel(configuration=(linear.family == family).values)
        rows.append({
            "family": str(family),
            "configurations": int(part.sizes["configuration"]),
            "ratio_min": float(part.ratio.min()),
            "ratio_median": float(part.ratio.median()),
            "ratio_max": float(part.ratio.max()),
            "share_within": float(((part.ratio >= ALLOWED[0]) & (part.ratio <= ALLOWED[1])).mean()),
            "excess_max": float(part.excess.max()),
            "leak_max": float(part.leak.max()),
        })  # fmt: skip
    return rows


def provenance():
    """Machine, date and revision of a report."""
    from coupling.provenance import root_attributes
    from coupling.scene import load_scene

    return {
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "revision": root_attributes(load_scene("quick"))["revision"],
        "machine": f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}",
    }


def page(linear, verdicts):
    """The report docs/stability.md as Markdown."""
    made = provenance()
    counts = {name: sum(v.verdict == name for v in verdicts) for name in (STABLE, REFUSED, BUG)}
    seconds = sum(v.seconds for v in verdicts)
    lines = [
        "# Stability: critical time step and extremes",
        "",
        f"Made by `gush stability --out docs` on {made['date']}, revision {made['revision']}, {made['machine']}.",
        "",
        *TEXT_LINEAR.strip().splitlines(),
        "",
        "| family | configurations | predicted/actual: least | median | most | within 0.7 .. 1 | growth below the limit | leak |",
        "|---|---|---|---|---|---|---|---|",
        *(
            f"| {r['family']} | {r['configurations']} | {r['ratio_min']:.2f} | {r['ratio_median']:.2f} | "
            f"{r['ratio_max']:.2f} | {r['share_within']:.0%} | {r['excess_max']:.0e} | {r['leak_max']:.0e} |"
            for r in families(linear)
        ),
        "",
        "![Critical Courant number](images/stability-map.png)",
        "",
        *TEXT_READING.strip().splitlines(),
        "",
        "## Extremes",
        "",
        *TEXT_EXTREMES.strip().splitlines(),
        "",
        f"{len(verdicts)} cases in {seconds:.0f} s: {counts[STABLE]} stable, {counts[REFUSED]} refused, "
        f"{counts[BUG]} bugs.",
        "",
        "| case | what | verdict | time [s] | steps | energy from nothing | largest stress/bound | mass error | reason |",
        "|---|---|---|---|---|---|---|---|---|",
        *(_row(v) for v in verdicts),
        "",
        *TEXT_FOUND.strip().splitlines(),
    ]
    return "\n".join(lines) + "\n"


def _row(v):
    m = v.measures
    if not m:
        return f"| {v.name} | {v.title} | {v.verdict} | | | | | | {v.reason} |"
    share = m["most_stress"] / m["stress_bound"] if m["stress_bound"] > 0 else 0.0
    return (
        f"| {v.name} | {v.title} | {v.verdict} | {m['time']:.3g} | {m['steps']:.0f} | {m['energy_created']:.1%} | "
        f"{share:.2f} | {m['mass_error']:.0e} | {v.reason} |"
    )


TEXT_LINEAR = """
## The critical time step

A step of the solver is affine in the state about rest while points stay in their elements, soils are elastic and pore
pressures positive. Steps from perturbed states, run by the solver itself, are therefore the columns of its exact
amplification matrix; its spectral radius, bisected over the time step, gives the *actual* critical step. *Predicted* is
the step that the program takes at Courant number 1. The column is four cells high and two wide, of crossed triangles.
"Growth" is the largest excess of the spectral radius over 1 at half the critical step, "leak" the largest share of a
result outside the invariant space on which the matrix is formed: both are round-off.
"""

TEXT_READING = ""

TEXT_EXTREMES = """
Small scenes, each in a process of its own with a time limit: a block in a closed box that loses its support, a lump
thrown at a wall, a coarse tunnel with a gate. A run is *stable* when all hold at every step, or every 20 steps:

- the energy there is (kinetic, skeleton, water) never exceeds the initial one plus the work of gravity by more than 5 %
  of the largest energy in play;
- the mass at the nodes is that of the points to 1e-10;
- no stress and no pressure exceeds three times the static load plus the Joukowsky pressure of the fastest point;
- points stay in the mesh, porosities in their range, everything is finite;
- no more comes in through the gate than by free discharge under the total head, nothing while it is closed;
- weightless ground does not move, a full tunnel stays at rest, one point falls as far and as fast as it must.

*Refused* means that the scene is not accepted and says why. Everything else, a failed run included, is a bug.
"""

TEXT_FOUND = ""
