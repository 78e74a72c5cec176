"""What users compute from a run: plain functions of the datasets that :mod:`coupling.datasets` reads.

States at equal inflow mass and their ratios to the initial state, extremes, the stages of the flow zone, stresses along
the axes through the gate, the settlement trough, fields on the mesh, the heap inside. Examples: docs/postprocessing.md.
"""

from coupling.datasets.geometry import gate_diameter, gate_position, tunnels
from coupling.postprocess.at_inflow import (
    additional_at_inflow,
    at_inflow,
    by_inflow,
    inflow_linearity,
    pressure_ratio,
    ratio_to_initial,
    with_inflow,
)
from coupling.postprocess.elements import (
    element_areas,
    element_centres,
    element_fields,
    element_means,
    element_of_points,
    pore_pressure_steps,
)
from coupling.postprocess.extremes import extremes
from coupling.postprocess.flow_zone import Stages, flow_zone_stages
from coupling.postprocess.ground_axes import arch, influence_distance, profile, stress_variation
from coupling.postprocess.heap import filled, heap
from coupling.postprocess.settlement import share_within, surface_settlement, trough

__all__ = [
    "Stages", "additional_at_inflow", "arch", "at_inflow", "by_inflow", "element_areas", "element_centres",
    "element_fields", "element_means", "element_of_points", "extremes", "filled", "flow_zone_stages", "gate_diameter",
    "gate_position", "heap", "inflow_linearity", "influence_distance", "pore_pressure_steps", "pressure_ratio",
    "profile", "ratio_to_initial", "share_within", "stress_variation", "surface_settlement", "trough", "tunnels",
    "with_inflow",
]  # fmt: skip
