"""All runs of the published study: its cases and twin tunnels, other meshes of three of them, and what it does not state."""

from __future__ import annotations

from pathlib import Path

#: How much coarser than the scenes the mesh is on which unknowns are varied.
COARSE = 2.0
#: Where cases end: the last inflow mass [kg/m] that the source looks at in most of them, and in case 3 and the twin tunnels.
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

    mesh = load_scene("case-3").mpm.discretisation
    names = ("element_size", "element_size_lining", "element_size_interior", "size_growth")
    across = max(2, round(mesh.elements_across_gate / factor))
    return {name: factor * getattr(mesh, name) for name in names} | {"elements_across_gate": across}


def plans(quick: bool = False) -> list[dict]:
    """Definitions of the studies, in the order in which they run; see :class:`coupling.studies.design.Study`.

    Parameters
    ----------
    quick : bool
        The cases alone, on the coarse mesh: a look; nothing is said of errors and unknowns.
    """
    whole, part = {"inflow_mass": LAST, "time": 20.0}, {"inflow_mass": COMPARED, "time": 10.0}
    others = [f"case-{k}" for k in (5, 1, 2, 4, 9, 10, 7, 8, 6)]
    scenes, coarse = ["case-3", *others, "twin-tunnels"], {f"discretisation.{k}": v for k, v in sizes(COARSE).items()}
    cases = {"name": "cases", "design": "list", "backends": ["beam-spring", "continuum"],
             "fixed": OUTPUT | (coarse if quick else {}),
             "parameters": {"scene": scenes, "stop": [whole, *[part] * len(others), whole]}}  # fmt: skip
    if quick:
        return [cases]
    coarse |= {"stop.inflow_mass": LAST, "stop.time": 60.0, "output.interval": 0.02, "output.snapshot_interval": 0.25}
    ground = {
        "soils.0.hydraulic_conductivity": [1e-3, 1e-2, 1e-5],
        "soils.0.dilatancy_angle": [5.0, 2.0],
        "soils.0": list(TOGETHER),
    }
    return [
        cases,
        {"name": "meshes", "design": "list", "fixed": OUTPUT,
         "parameters": {"scene": ["case-3", "case-3", "twin-tunnels", "case-5"], "stop": [whole] * 3 + [part],
                        "discretisation": [sizes(1.4), sizes(COARSE), sizes(1.4), sizes(1.4)]}},
        {"name": "unknowns", "design": "one-at-a-time", "scene": "case-3", "fixed": coarse,
         "parameters": {
             "soils.0.loose_porosity": [0.5, 0.6], "gate.corners": ["slipping"],
             "discretisation": [{"elements_across_gate": 2}, {"elements_across_gate": 8}, SOURCE_MESH],
             "lining": ["floating", "elastic"], "tunnels.0": [ONE_LAYER], **ground}},
        {"name": "twin-unknowns", "design": "one-at-a-time", "scene": "twin-tunnels", "fixed": coarse,
         "parameters": {"gate.angle": [90.0], "soils.0.hydraulic_conductivity": [1e-2],
                        "soils.0.dilatancy_angle": [5.0]}},
    ]  # fmt: skip
