"""What `gush stability` does: the linear map and the extremes; page, picture and data of both."""

from dataclasses import asdict

import numpy as np

from mpm.scene import Numerics
from verification.pages import made_by, provenance, rendered, templated_page, write_data
from verification.stability.linear import WAYS, critical_map
from verification.stability.map_figure import draw_map
from verification.stability.trials import chosen
from verification.stability.verdicts import BUG, judge_apart

ALLOWED = (0.7, 1.0)  # predicted over actual


def stability(names, linear, out, tell, say=lambda text: None):
    """Run what is asked for.

    names : list of str, cases; `*` stands for any ending; all, and the linear analysis, when empty;
    linear : bool, only the linear analysis;
    out : pathlib.Path or None, folder to write to;
    tell : callable, called with a line of text for every part;
    say : callable, called with a text about what is being computed.

    Returns a dict: date, revision, machine; linear, reading: `families` and `reading` of the map, empty when not run;
    extremes: list of dicts;  files: list of paths;  faults: list of sentences.
    """
    todo = [] if linear else chosen(names)
    page = None if out is None else templated_page(out, "stability")
    found = None if names else critical_map(progress=lambda n, of: say(f"linear analysis: {n} of {of}"))
    verdicts = []
    for case in todo:
        say(case.name)
        verdicts.append(judge_apart(case))
        tell(f"{case.name}: {verdicts[-1].verdict}, {verdicts[-1].seconds:.1f} s")
    data = {**provenance(), "linear": [], "reading": {}, "extremes": [asdict(verdict) for verdict in verdicts]}
    if found is not None:
        data |= {"linear": families(found), "reading": reading(found)}
    faults = [f"{v.name}: {v.reason}" for v in verdicts if v.verdict == BUG]
    faults += [
        f"{row['family']}: spectral step is {row['spectral_min']:.2f} .. {row['spectral_max']:.2f} of the critical one"
        for row in data["linear"]
        if row["spectral_max"] > ALLOWED[1] or row["spectral_min"] < ALLOWED[0]
    ]
    return data | {"files": [] if page is None else write(page, data, found), "faults": faults}


def write(page, data, linear):
    """Write stability.json, the map as stability.nc and a picture, and the page of what was run; returns the paths."""
    folder = page.path.parent
    folder.mkdir(parents=True, exist_ok=True)
    paths = [write_data(folder / "stability.json", data)]
    if linear is not None:
        paths += [str(folder / "stability.nc"), str(folder / "images" / "stability-map.png")]
        linear.to_netcdf(paths[-2], engine="h5netcdf")
        draw_map(linear, paths[-1])
    return sorted([*paths, page.fill({"made": made_by("gush stability --out docs"), **rendered("stability", **data)})])


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


def reading(linear):
    """The map as a whole: ranges of predicted over actual critical step, and the columns that stand out."""

    def columns(chosen):
        return told.isel(configuration=chosen.values).to_dataframe().to_dict("records")

    courant, altitude = Numerics().courant, linear.altitude_ratio
    told = linear[["points", "positions", "aspect", "skew", "stress_damping", "excess"]]
    told = told.assign(wet=np.isfinite(linear.bulk_modulus))
    usual = (linear.positions == "layout") & (linear["skew"] == 0)
    return {
        "columns": linear.sizes["configuration"], "allowed": ALLOWED, "courant": courant,
        **{way: (float(linear[f"{way}_ratio"].min()), float(linear[f"{way}_ratio"].max())) for way in WAYS},
        "altitude_usual": float(altitude[usual.values].median()), "unstable": int((courant * altitude > 1).sum()),
        "above": columns(altitude > 1), "growing": columns(linear.excess > 1e-5),
    }  # fmt: skip
