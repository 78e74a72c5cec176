"""All runs of the published study: its cases and twin tunnels, on several meshes, and what it does not state."""

from pathlib import Path

#: How much coarser than that of case 3 meshes are: its second one, the others', that of the unknowns and of a look.
MIDDLE, COARSE, COARSEST = 1.4, 2.0, 3.0
#: Where most cases end, and where case 3 does: inflow masses that the source looks at [kg/m].
COMPARED, LAST = 1000.0, 2000.0
OUTPUT = {"output.interval": 0.02, "output.snapshot_interval": 0.1}
SELDOM = {"output.interval": 0.05, "output.snapshot_interval": 0.25}
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
    from verification.sensitivity.variants import meshes

    changes = meshes(load_scene("case-3"), factor)
    return {name.removeprefix("discretisation."): value for name, value in changes.items()}


def plans(quick: bool = False) -> list[dict]:
    """Definitions of the studies, in the order in which they run; see :class:`coupling.studies.design.Study`.

    All cases are on the meshes of their scenes, case 3 also on two others, case 5 and the twin tunnels on one; unknowns
    are varied on a mesh :data:`COARSEST` times as coarse.

    quick : a look: case 3 on a mesh :data:`COARSE` times as coarse, all the rest on one that is :data:`COARSEST`; one
    lining model.
    """
    whole, part = {"inflow_mass": LAST, "time": 20.0}, {"inflow_mass": COMPARED, "time": 10.0}
    scenes = ["case-3", "twin-tunnels", *(f"case-{k}" for k in (1, 2, 4, 5, 6, 7, 8, 9, 10))]
    own, other, varied = (COARSE, COARSEST, COARSEST) if quick else (1.0, 1.0, COARSEST)
    again = [("case-3", COARSEST)] if quick else [
        ("case-3", MIDDLE), ("case-3", COARSE), ("twin-tunnels", COARSE), ("case-5", COARSE)
    ]  # fmt: skip
    unknowns = {f"discretisation.{name}": value for name, value in sizes(varied).items()} | SELDOM
    unknowns |= {"stop.inflow_mass": COMPARED, "stop.time": 12.0 if quick else 30.0}
    return [
        {"name": "cases", "design": "list", "fixed": SELDOM if quick else OUTPUT,
         "backends": ["beam-spring"] if quick else ["beam-spring", "continuum"],
         "parameters": {"scene": scenes, "stop": [whole, *[part] * (len(scenes) - 1)],
                        "discretisation": [sizes(own), *[sizes(other)] * (len(scenes) - 1)]}},
        {"name": "meshes", "design": "list", "fixed": SELDOM,
         "parameters": {"scene": [name for name, _ in again], "stop": [part] * len(again),
                        "discretisation": [sizes(size) for _, size in again]}},
        {"name": "unknowns", "design": "one-at-a-time", "scene": "case-3", "fixed": unknowns,
         "parameters": {
             "soils.0.loose_porosity": [0.5, 0.6], "gate.corners": ["slipping"],
             "discretisation": [{"elements_across_gate": 2}, {"elements_across_gate": 8}, SOURCE_MESH],
             "lining": ["floating", "elastic"], "tunnels.0": [ONE_LAYER],
             "soils.0.hydraulic_conductivity": [1e-3, 1e-2, 1e-5], "soils.0.dilatancy_angle": [5.0, 2.0],
             "soils.0": list(TOGETHER)}},
        {"name": "twin-unknowns", "design": "one-at-a-time", "scene": "twin-tunnels", "fixed": unknowns,
         "parameters": {"gate.angle": [90.0], "soils.0.hydraulic_conductivity": [1e-2],
                        "soils.0.dilatancy_angle": [5.0]}},
    ]  # fmt: skip


def run_all(out: str | Path, quick=False, workers=None, scheduler=None, console=None) -> list[dict]:
    """Run all studies into folders of their names; what is there already is not run again.

    Returns: of :func:`coupling.studies.stored.run_study`, one a study.
    """
    from rich.console import Console

    from coupling.studies.design import load_study
    from coupling.studies.stored import run_study

    said = console if console is not None else Console(stderr=True, quiet=True)
    return [run_study(load_study(plan), Path(out) / plan["name"], workers, scheduler, said) for plan in plans(quick)]
