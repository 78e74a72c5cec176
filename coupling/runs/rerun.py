"""A run repeated from what its file says, and compared bit for bit with it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from coupling.datasets import raw_groups, read_attributes, run_file
from coupling.files.folder import default_folder
from coupling.files.provenance import DECISIVE, differences, root_attributes
from coupling.refused import Refused
from coupling.runs.run import run
from coupling.scenes.plausibility import warn_in_python
from coupling.scenes.scene import parse_scene

#: Measured by the clock, not computed.
NOT_COMPARED = {"cpu_seconds"}


def rerun(
    first: str | Path,
    out: str | Path | None = None,
    progress: Callable[[dict[str, Any]], None] | None = None,
    threads: int | None = None,
    warn: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Repeat a run, finished or not, in another folder and compare all that was simulated.

    Further arguments are those of :func:`coupling.run`; `out` is ``runs/<scene>-rerun``, numbered, when None. `warn` is
    also told what differs between then and now that the bits may depend on.

    Returns: run, rerun (folders), changed (name to [then, now]), and the keys of :func:`compare_bits`.

    Raises Refused, mpm.RunFailed, KeyboardInterrupt, OSError: as :func:`coupling.run`; and a run without a record.
    """
    file = run_file(first)
    attributes = read_attributes(file)
    if not len(raw_groups(file, ("history",))["history"]["time"]):
        raise Refused(f"run '{first}': must hold a record to compare with, it has none; repeat it with gush run")
    scene = parse_scene(attributes["scene"], str(file))
    changed = differences(attributes, root_attributes(scene), (*DECISIVE, "gmsh", "processor"))
    for name, (before, now) in changed.items():
        (warn if warn is not None else warn_in_python)(f"{name}: {before} then, {now} now; results may differ")
    out = default_folder(f"{scene.name}-rerun") if out is None else out
    folder = run(scene, out, progress=progress, threads=threads, warn=warn).attrs["run"]
    return {"run": str(first), "rerun": folder, "changed": changed, **compare_bits(file, folder)}


def compare_bits(first: str | Path, second: str | Path) -> dict[str, Any]:
    """Compare mesh, pressures, history and points of two runs over the records that both have.

    Returns: identical : bool; records : int, how many were compared; records_run, records_rerun : int;
    differences : list of {variable, time [s] of the first record that differs or None, largest: largest absolute
    difference or None}.
    """
    one, other = raw_groups(first), raw_groups(second)
    found = []
    for group in one:
        found += _different(group, one[group], other[group])
    sizes = [len(run["history"]["time"]) for run in (one, other)]
    return {
        "identical": not found,
        "records": min(sizes),
        "records_run": sizes[0],
        "records_rerun": sizes[1],
        "differences": found,
    }


def _different(group, one, other):
    """Variables of a group whose bits differ; records that only one of the two has are left out."""
    found = []
    sizes = len(one.get("time", ())), len(other.get("time", ()))
    for name in sorted((one.keys() | other.keys()) - NOT_COMPARED):
        entry = {"variable": f"{group}/{name}", "time": None, "largest": None}
        if name not in one or name not in other:
            if min(sizes) or "time" not in one:
                found.append(entry)
            continue
        a, b = one[name], other[name]
        through_time = "time" in one and (len(a), len(b)) == sizes and name not in ("theta", "theta_bnds", "tunnel")
        if through_time:
            a, b = a[: min(sizes)], b[: min(sizes)]
        if _same_bits(a, b):
            continue
        if through_time:
            entry["time"] = float(next(t for t, x, y in zip(one["time"], a, b, strict=False) if not _same_bits(x, y)))
        if a.shape == b.shape and a.dtype.kind in "fi":
            entry["largest"] = float(np.nanmax(np.abs(a.astype(float) - b.astype(float))))
        found.append(entry)
    return found


def _same_bits(a, b):
    return a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()
