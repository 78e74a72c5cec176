"""Figure, dataset and page of `gush stability`."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from verification.pages import made_by, provenance
from verification.stability.extremes import BUG, REFUSED, STABLE
from verification.stability.linear import WAYS
from verification.stability.text import EXTREMES, FOUND, LINEAR, READING

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
    """Write stability.nc, .json, .md and images/stability-map.png into a folder; returns the paths."""
    out = Path(out)
    (out / "images").mkdir(parents=True, exist_ok=True)
    paths = [out / "stability.json"]
    paths[0].write_text(json.dumps(summary(linear, verdicts), indent=1) + "\n", encoding="utf-8")
    if linear is not None:
        from verification.stability.figures import critical_courant

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
    """Range of predicted over actual critical step, for both ways of predicting, of every family: list of dicts."""
    rows = []
    for family in dict.fromkeys(linear.family.values):
        part = linear.isel(configuration=(linear.family == family).values)
        row = {"family": str(family), "configurations": int(part.sizes["configuration"])}
        for way in WAYS:
            ratio = part[f"{way}_ratio"]
            within = (ratio >= ALLOWED[0]) & (ratio <= ALLOWED[1])
            row |= {f"{way}_{name}": float(getattr(ratio, name)()) for name in ("min", "median", "max")}
            row[f"{way}_within"] = float(within.mean())
        rows.append(row | {"excess_max": float(part.excess.max()), "leak_max": float(part.leak.max())})
    return rows


def page(linear, verdicts):
    """The report docs/stability.md as Markdown."""
    counts = {name: sum(v.verdict == name for v in verdicts) for name in (STABLE, REFUSED, BUG)}
    seconds = sum(v.seconds for v in verdicts)
    lines = [
        "# Stability: critical time step and extremes",
        "",
        f"{made_by('gush stability --out docs')}.",
        "",
        *LINEAR.strip().splitlines(),
        "",
        "| family | columns | spectral/actual: least | median | most | altitude/actual: least | median | most "
        "| growth | leak |",
        "|---|---|---|---|---|---|---|---|---|---|",
        *(
            f"| {r['family']} | {r['configurations']} | "
            + " | ".join(f"{r[f'{way}_{name}']:.2f}" for way in reversed(WAYS) for name in ("min", "median", "max"))
            + f" | {r['excess_max']:.0e} | {r['leak_max']:.0e} |"
            for r in families(linear)
        ),
        "",
        "![Critical Courant number](images/stability-map.png)",
        "",
        *_reading(linear),
        *READING.strip().splitlines(),
        "",
        "## Extremes",
        "",
        *EXTREMES.strip().splitlines(),
        "",
        f"{len(verdicts)} cases in {seconds:.0f} s: {counts[STABLE]} stable, {counts[REFUSED]} refused, "
        f"{counts[BUG]} bugs.",
        "",
        "| case | what | verdict | time [s] | steps | energy from nothing | largest stress/bound | mass error "
        "| reason |",
        "|---|---|---|---|---|---|---|---|---|",
        *(_row(v) for v in verdicts),
        "",
        *FOUND.strip().splitlines(),
    ]
    return "\n".join(lines) + "\n"


def _reading(linear):
    """What the numbers of the map say, one list item a line."""
    from mpm.scene import Numerics

    courant = Numerics().courant
    low, high = (float(getattr(linear.spectral_ratio, name)()) for name in ("min", "max"))
    kept = ALLOWED[0] <= low and high <= ALLOWED[1]
    above = linear.isel(configuration=(linear.altitude_ratio > 1).values)
    usual = linear.isel(configuration=((linear.positions == "layout") & (linear["skew"] == 0)).values)
    growing = linear.isel(configuration=(linear.excess > 1e-5).values)
    lines = [
        f"- Spectral: {low:.3f} .. {high:.3f} of the actual critical step in all {linear.sizes['configuration']} "
        f"columns; required are {ALLOWED[0]:g} .. {ALLOWED[1]:g}: {'kept' if kept else '**not kept**'}.",
        f"- Altitude: {float(linear.altitude_ratio.min()):.2f} .. {float(linear.altitude_ratio.max()):.2f}. Where the "
        f"program places the points, on straight cells, the median is {float(usual.altitude_ratio.median()):.2f}.",
        f"- Altitude above the actual step in {above.sizes['configuration']} columns: {_described(above)}. At a "
        f"Courant number of {courant:g} {int((courant * linear.altitude_ratio > 1).sum())} columns are unstable.",
        f"- Growth of more than 1e-5 a step at half the actual step in {growing.sizes['configuration']} columns: "
        f"{_described(growing)}.",
    ]
    return lines


def _described(part):
    rows = [
        f"{int(p)} points an element at {place}, aspect {a:g}, skew {k:g}, {'wet' if np.isfinite(m) else 'dry'}"
        f"{'' if s else ', undamped'} ({e:.1e})"
        for p, place, a, k, m, s, e in zip(
            *(part[n].values for n in ("points", "positions", "aspect", "skew", "bulk_modulus")),
            *(part[n].values for n in ("stress_damping", "excess")),
            strict=True,
        )
    ]
    return "; ".join(rows[:4]) + ("; .." if len(rows) > 4 else "") if rows else "none"


def _row(v):
    m = v.measures
    if not m:
        return f"| {v.name} | {v.title} | {v.verdict} | | | | | | {v.reason} |"
    share = m["most_stress"] / m["stress_bound"] if m["stress_bound"] > 0 else 0.0
    return (
        f"| {v.name} | {v.title} | {v.verdict} | {m['time']:.3g} | {m['steps']:.0f} | {m['energy_created']:.1%} | "
        f"{share:.2f} | {m['mass_error']:.0e} | {v.reason} |"
    )
