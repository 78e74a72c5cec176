"""All runs of the published study: its cases and twin tunnels, on several meshes, and what it does not state."""

from __future__ import annotations

from pathlib import Path

#: How much coarser than that of case 3 the meshes are: a second one of case 3, that of the other cases, of the unknowns.
MIDDLE, COARSE, COARSEST = 1.4, 2.0, 3.0
#: Where most cases end, and where case 3 and the twin tunnels do: inflow masses that the source looks at [kg/m].
COMPARED, LAST = 1000.0, 2000.0
OUTPUT = {"output.interval": 0.02, "output.snapshot_interval": 0.1}
TOGETHER = (
    {"hydraulic_conductivity": 1e-2, "dilatancy_angle": 5.0},
    {"hydraulic_conductivity": 1e-5, "dilatancy_angle": 5.0},
)
#: The source's ring in the soil computation, one layer of linear triangles of 0.75 m: `linings.one_layer`.
ONE_LAYER = {"lining": "elastic", "lining_modulus": 8.0 * 34.5e9}
#: As near as our mesh comes to the source's, with its 0.2 m at a gate of 0.2 m.
SOURCE_MESH = {"element_size": 0.75, "element_size_lining": 0.75, "element_size_interior": 0.2, "size_growth": 0.25,
               "elements_across_gate": 2}  # fmt: skip


def sizes(factor: float) -> dict:
    """Sizes of the mesh of case 3, all of them `factor` times as large."""
    from coupling.scenes.scene import load_scene

    mesh = load_scene("case-3").discretisation
    names = ("element_size", "element_size_lining", "element_size_interior", "size_growth")
    across = max(2, round(mesh.elements_across_gate / factor))
    return {name: factor * getattr(mesh, name) for name in names} | {"elements_across_gate": across}


def plans(quick: bool = False) -> list[dict]:
    """Definitions of the studies, in the order in which they run; see :class:`coupling.studies.design.Study`.

    Case 3 is on the mesh of its scene and on two others, the other cases are on one that is :data:`COARSE` times as
    coarse, which moves forces by a hundredth; case 5, the twin tunnels and all unknowns on a still coarser one.

    Parameters
    ----------
    quick : bool
        The cases alone, on the coarse mesh: a look; nothing is said of errors and unknowns.
    """
    whole, part = {"inflow_mass": LAST, "time": 20.0}, {"inflow_mass": COMPARED, "time": 10.0}
    others = [f"case-{k}" for k in (5, 1, 2, 4, 9, 10, 7, 8, 6)]
    scenes = ["case-3", *others, "twin-tunnels"]
    meshes = [sizes(COARSE if quick else 1.0)] + [sizes(COARSE)] * (len(scenes) - 1)
    cases = {"name": "cases", "design": "list", "backends": ["beam-spring", "continuum"], "fixed": OUTPUT,
             "parameters": {"scene": scenes, "stop": [whole, *[part] * len(others), whole],
                            "discretisation": meshes}}  # fmt: skip
    if quick:
        return [cases]
    coarsest = {f"discretisation.{k}": v for k, v in sizes(COARSEST).items()}
    coarsest |= OUTPUT | {"stop.inflow_mass": COMPARED, "stop.time": 30.0, "output.snapshot_interval": 0.25}
    return [
        cases,
        {"name": "meshes", "design": "list", "fixed": OUTPUT,
         "parameters": {"scene": ["case-3", "case-3", "case-5", "twin-tunnels"], "stop": [part] * 4,
                        "discretisation": [sizes(MIDDLE), sizes(COARSE), sizes(COARSEST), sizes(COARSEST)]}},
        {"name": "unknowns", "design": "one-at-a-time", "scene": "case-3", "fixed": coarsest,
         "parameters": {
             "soils.0.loose_porosity": [0.5, 0.6], "gate.corners": ["slipping"],
             "discretisation": [{"elements_across_gate": 2}, {"elements_across_gate": 8}, SOURCE_MESH],
             "lining": ["floating", "elastic"], "tunnels.0": [ONE_LAYER],
             "soils.0.hydraulic_conductivity": [1e-3, 1e-2, 1e-5], "soils.0.dilatancy_angle": [5.0, 2.0],
             "soils.0": list(TOGETHER)}},
        {"name": "twin-unknowns", "design": "one-at-a-time", "scene": "twin-tunnels", "fixed": coarsest,
         "parameters": {"gate.angle": [90.0], "soils.0.hydraulic_conductivity": [1e-2],
                        "soils.0.dilatancy_angle": [5.0]}},
    ]  # fmt: skip


def run_all(out: str | Path, quick=False, workers=None, scheduler=None, console=None) -> list[dict]:
    """Run all studies into folders of their names; what is there already is not run again.

    Returns
    -------
    list of dict
        Of :func:`coupling.studies.stored.run_study`, one a study.
    """
    from rich.console import Console

    from coupling.studies.design import load_study
    from coupling.studies.stored import run_study

    said = console if console is not None else Console(stderr=True, quiet=True)
    return [run_study(load_study(plan), Path(out) / plan["name"], workers, scheduler, said) for plan in plans(quick)]
