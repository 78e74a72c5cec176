"""What `gush stability` does: the linear map and the extremes; page, picture and data of both."""

from dataclasses import asdict
from pathlib import Path

import numpy as np

from mpm.scene import Numerics
from verification.pages import Page, made_by, provenance, table, write_data
from verification.stability.cases import chosen
from verification.stability.linear import WAYS, critical_map
from verification.stability.map_figure import draw_map
from verification.stability.verdicts import BUG, REFUSED, STABLE, judge_apart

ALLOWED = (0.7, 1.0)  # predicted over actual


def stability(names, linear, out, tell, say=lambda text: None):
    """Run what is asked for.

    names : list of str, cases; `*` stands for any ending; all, and the linear analysis, when empty;
    linear : bool, only the linear analysis;
    out : pathlib.Path or None, folder to write to;
    tell : callable, called with a line of text for every part;
    say : callable, called with a text about what is being computed.

    Returns a dict: date, revision, machine; linear: `families` of the map, None when not run; extremes: list of dicts;
    files: list of paths;  faults: list of sentences.
    """
    todo = [] if linear else chosen(names)
    page = None if out is None else Page(Path(out) / "stability.md", "Stability", ("made", "map", "extremes"))
    found = None if names else critical_map(progress=lambda n, of: say(f"linear analysis: {n} of {of}"))
    verdicts = []
    for case in todo:
        say(case.name)
        verdicts.append(judge_apart(case))
        tell(f"{case.name}: {verdicts[-1].verdict}, {verdicts[-1].seconds:.1f} s")
    data = {**provenance(), "linear": found if found is None else families(found),
            "extremes": [asdict(verdict) for verdict in verdicts]}  # fmt: skip
    faults = [f"{v.name}: {v.reason}" for v in verdicts if v.verdict == BUG]
    faults += [
        f"{row['family']}: spectral step is {row['spectral_min']:.2f} .. {row['spectral_max']:.2f} of the critical one"
        for row in data["linear"] or []
        if row["spectral_max"] > ALLOWED[1] or row["spectral_min"] < ALLOWED[0]
    ]
    return data | {"files": [] if page is None else write(page, data, found), "faults": faults}


def write(page, data, linear):
    """Write stability.json, the map as stability.nc and a picture, and the page of what was run; returns the paths."""
    folder = page.path.parent
    folder.mkdir(parents=True, exist_ok=True)
    paths, blocks = [write_data(folder / "stability.json", data)], {"made": made_by("gush stability --out docs")}
    if linear is not None:
        paths += [str(folder / "stability.nc"), str(folder / "images" / "stability-map.png")]
        linear.to_netcdf(paths[-2], engine="h5netcdf")
        draw_map(linear, paths[-1])
        blocks["map"] = [*_families(data["linear"]), "", "![Critical Courant number](images/stability-map.png)", "",
                         *_reading(linear)]  # fmt: skip
    if data["extremes"]:
        blocks["extremes"] = extremes_block(data["extremes"])
    return sorted([*paths, page.fill(blocks)])


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


def _families(rows):
    parts = [f"{way}_{name}" for way in reversed(WAYS) for name in ("min", "median", "max")]
    head = ("spectral/actual: least", "median", "most", "altitude/actual: least", "median", "most", "growth", "leak")
    return table(("family", "columns", *head), (
        (r["family"], r["configurations"], *(f"{r[part]:.2f}" for part in parts), f"{r['excess_max']:.0e}",
         f"{r['leak_max']:.0e}") for r in rows
    ))  # fmt: skip


def _reading(linear):
    """What the numbers of the map say, one list item a line."""
    courant = Numerics().courant
    low, high = (float(getattr(linear.spectral_ratio, name)()) for name in ("min", "max"))
    kept = ALLOWED[0] <= low and high <= ALLOWED[1]
    above = linear.isel(configuration=(linear.altitude_ratio > 1).values)
    usual = linear.isel(configuration=((linear.positions == "layout") & (linear["skew"] == 0)).values)
    growing = linear.isel(configuration=(linear.excess > 1e-5).values)
    return [
        f"- Spectral: {low:.3f} .. {high:.3f} of the actual critical step in all {linear.sizes['configuration']} "
        f"columns; required are {ALLOWED[0]:g} .. {ALLOWED[1]:g}: {'kept' if kept else '**not kept**'}.",
        f"- Altitude: {float(linear.altitude_ratio.min()):.2f} .. {float(linear.altitude_ratio.max()):.2f}. Where the "
        f"program places the points, on straight cells, the median is {float(usual.altitude_ratio.median()):.2f}.",
        f"- Altitude above the actual step in {above.sizes['configuration']} columns: {_described(above)}. At a "
        f"Courant number of {courant:g} {int((courant * linear.altitude_ratio > 1).sum())} columns are unstable.",
        f"- Growth of more than 1e-5 a step at half the actual step in {growing.sizes['configuration']} columns: "
        f"{_described(growing)}.",
    ]


def _described(part):
    names = ("points", "positions", "aspect", "skew", "bulk_modulus", "stress_damping", "excess")
    rows = [
        f"{int(p)} points an element at {place}, aspect {a:g}, skew {k:g}, {'wet' if np.isfinite(m) else 'dry'}"
        f"{'' if s else ', undamped'} ({e:.1e})"
        for p, place, a, k, m, s, e in zip(*(part[name].values for name in names), strict=True)
    ]
    return "; ".join(rows[:4]) + ("; .." if len(rows) > 4 else "") if rows else "none"


def extremes_block(verdicts):
    """Lines about the verdicts, dicts of :class:`verification.stability.verdicts.Verdict`."""
    counts = {name: sum(v["verdict"] == name for v in verdicts) for name in (STABLE, REFUSED, BUG)}
    said = ", ".join(f"{counts[name]} {name}{'s' * (name == BUG)}" for name in counts)
    rows = []
    for v in verdicts:
        m, cells = v["measures"], [""] * 5
        if m:
            share = m["most_stress"] / m["stress_bound"] if m["stress_bound"] > 0 else 0.0
            cells = [f"{m['time']:.3g}", f"{m['steps']:.0f}", f"{m['energy_created']:.1%}", f"{share:.2f}",
                     f"{m['mass_error']:.0e}"]  # fmt: skip
        rows.append([v["name"], v["title"], v["verdict"], *cells, v["reason"]])
    head = ("time [s]", "steps", "energy from nothing", "largest stress/bound", "mass error", "reason")
    seconds = sum(v["seconds"] for v in verdicts)
    return [f"{len(verdicts)} cases in {seconds:.0f} s: {said}.", "", *table(("case", "what", "verdict", *head), rows)]


def shown_tables(data):
    """Tables of both parts for the terminal: list of rich.table.Table."""
    from rich.table import Table

    made = []
    if data["linear"]:
        made.append(Table("family", "columns", "spectral", "altitude", title="predicted / actual critical step"))
        for row in data["linear"]:
            ratios = (f"{row[f'{way}_min']:.2f} .. {row[f'{way}_max']:.2f}" for way in ("spectral", "altitude"))
            made[-1].add_row(row["family"], str(row["configurations"]), *ratios)
    if data["extremes"]:
        made.append(Table("case", "verdict", "s", "energy from nothing", "reason"))
        for v in data["extremes"]:
            share = f"{v['measures']['energy_created']:.1%}" if "energy_created" in v["measures"] else ""
            made[-1].add_row(v["name"], v["verdict"], f"{v['seconds']:.1f}", share, v["reason"])
    return made
