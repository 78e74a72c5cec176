"""All runs of the published study: Table 2, the twin tunnels, case 3 mirrored, and the sensitivity of case 3."""

from __future__ import annotations

from pathlib import Path

STUDIES = ("table-2", "twin-and-mirror", "sensitivity")
#: Inflow mass at which a coarse rehearsal ends [kg/m].
REHEARSAL = 100.0


def plans(coarse: bool = False, changes: dict | None = None):
    """The studies, in the order in which they run.

    Parameters
    ----------
    coarse : bool
        A rehearsal: the mesh of the scene `quick` and 100 kg/m; its numbers say little.
    changes : dict, optional
        Dotted names to values for all of them, after those of the rehearsal.

    Returns
    -------
    list of coupling.studies.design.Study
    """
    from coupling.scenes.scene import load_scene
    from coupling.studies.design import load_study

    fixed = {}
    if coarse:
        mesh = load_scene("quick").discretisation.model_dump()
        fixed = {f"discretisation.{name}": value for name, value in mesh.items()}
        fixed |= {"stop.inflow_mass": REHEARSAL, "output.interval": 0.005, "output.snapshot_interval": 0.02}
    fixed |= changes or {}
    result = []
    for name in STUDIES:
        plan = load_study(name)
        mine = {key: value for key, value in {**plan.fixed, **fixed}.items() if key not in plan.parameters}
        result.append(plan.model_copy(update={"fixed": mine}))
    return result


def run_all(out: str | Path, coarse=False, workers=None, scheduler=None, console=None, changes=None) -> list[dict]:
    """Run all studies into folders of their names; what is there already is not run again.

    Returns
    -------
    list of dict
        Of :func:`coupling.studies.stored.run_study`, one a study.
    """
    from rich.console import Console

    from coupling.studies.stored import run_study

    told = console if console is not None else Console(stderr=True, quiet=True)
    return [run_study(plan, Path(out) / plan.name, workers, scheduler, told) for plan in plans(coarse, changes)]
