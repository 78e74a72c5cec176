"""What `gush accuracy` does."""

from __future__ import annotations

import difflib
from pathlib import Path

from coupling.refused import Refused

#: Shares of the last inflow mass at which a mesh ladder is compared; 0 is the initial state.
SHARES = (0.0, 0.1, 0.25, 0.5, 1.0)


def problem_ladders(names, only_fast, out, tell):
    """Measure verification problems and write their page.

    Raises
    ------
    coupling.refused.Refused
        Unknown problem.
    """
    from verification.accuracy.ladders import measure
    from verification.accuracy.report import write
    from verification.problems import problems

    known = problems()
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise Refused(f"problem: must be a verification problem, got {name!r}; {hint}known: {', '.join(known)}")
    rows = []
    for name in names or known:
        rows += measure(known[name], only_fast, tell)
    return write(rows, known, Path(out))


def scene_ladder(name, inflow_mass, out, tell):
    """Run a scene on a ladder of meshes and write its page; runs finished in OUT/runs are not repeated."""
    import coupling
    from verification.accuracy.ladder_report import write_ladder
    from verification.accuracy.mesh_ladder import ladder_dataset, run_ladder

    scene = coupling.load_scene(name)
    if scene.gate is None or scene.ring is None:
        raise Refused(f"scene: a mesh ladder needs a gate and a ring, got {name!r} without; add [gate] and [ring]")
    if not inflow_mass > 0:
        raise Refused(f"inflow_mass: must be above 0 kg/m, got {inflow_mass:g}; 1000 is the published one")
    runs = run_ladder(name, Path(out) / "runs", inflow_mass, progress=tell)
    ladder = ladder_dataset(runs, [share * inflow_mass for share in SHARES])
    return write_ladder(ladder, scene.name, runs, Path(out))
