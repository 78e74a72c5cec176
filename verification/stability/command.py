"""What `gush stability` does: the linear map, the extremes, their files and tables."""

from coupling.refused import SceneError
from verification.stability.cases import cases
from verification.stability.extremes import BUG, judge_apart
from verification.stability.linear import critical_map
from verification.stability.report import ALLOWED, summary, write


class CaseUnknown(SceneError):
    """A name that is no case of `gush stability`."""


def stability(names, linear, out, tell, say=lambda text: None):
    """Run what is asked for.

    Parameters
    ----------
    names : list of str
        Cases; `*` stands for any ending; all, and the linear analysis, when empty.
    linear : bool
        Only the linear analysis.
    out : pathlib.Path or None
        Folder to write to.
    tell : callable
        Called with a line of text for every part.
    say : callable
        Called with a text about what is being computed.

    Returns
    -------
    dict
        Of `verification.stability.report.summary`, with files: list of paths, and faults: list of sentences.
    """
    chosen = [] if linear else _chosen(names, cases())
    found = None
    if not names:
        found = critical_map(progress=lambda n, of: say(f"linear analysis: {n} of {of}"))
    verdicts = []
    for one in chosen:
        say(f"{one.name}")
        verdicts.append(judge_apart(one))
        tell(f"{one.name}: {verdicts[-1].verdict}, {verdicts[-1].seconds:.1f} s")
    data = summary(found, verdicts)
    faults = [f"{v.name}: {v.reason}" for v in verdicts if v.verdict == BUG]
    faults += [
        f"{row['family']}: spectral step is {row['spectral_min']:.2f} .. {row['spectral_max']:.2f} of the critical one"
        for row in data["linear"] or []
        if row["spectral_max"] > ALLOWED[1] or row["spectral_min"] < ALLOWED[0]
    ]
    return data | {"files": [] if out is None else [str(p) for p in write(out, found, verdicts)], "faults": faults}


def _chosen(names, known):
    if not names:
        return list(known.values())
    chosen = []
    for name in names:
        some = [c for k, c in known.items() if k == name or (name.endswith("*") and k.startswith(name[:-1]))]
        if not some:
            raise CaseUnknown(f"case '{name}': must be one of {', '.join(known)}; or a beginning of one followed by *")
        chosen += [c for c in some if c not in chosen]
    return chosen


def tables(data):
    """Tables of both parts: list of rich.table.Table."""
    from rich.table import Table

    made = []
    if data["linear"]:
        table = Table("family", "columns", "spectral", "altitude", title="predicted / actual critical step")
        for row in data["linear"]:
            ratios = (f"{row[f'{way}_min']:.2f} .. {row[f'{way}_max']:.2f}" for way in ("spectral", "altitude"))
            table.add_row(row["family"], str(row["configurations"]), *ratios)
        made.append(table)
    if data["extremes"]:
        table = Table("case", "verdict", "s", "energy from nothing", "reason")
        for v in data["extremes"]:
            created = v["measures"].get("energy_created")
            share = "" if created is None else f"{created:.1%}"
            table.add_row(v["name"], v["verdict"], f"{v['seconds']:.1f}", share, v["reason"])
        made.append(table)
    return made
