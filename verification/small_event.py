"""The smallest event that still has everything: contact, channel, inflow, sorting; 1000 steps in half a second."""

import coupling

COARSE = {
    "element_size": 5.0,
    "element_size_lining": 0.9,
    "element_size_interior": 0.6,
    "elements_across_gate": 2,
    "gate_radius": 0.5,
    "size_growth": 0.5,
    "points_per_element_gate": 3,
}


def small_scene(**changes):
    """The quick scene on a mesh far too coarse for its numbers to mean anything."""
    changes = {
        "discretisation": COARSE,
        "numerics": {"relaxation_tolerance": 1e-3},
        "stop": {"inflow_mass": 60.0, "time": 0.3},
        "output": {"interval": 0.005, "snapshot_interval": 0.02},
        **changes,
    }
    return coupling.load_scene("quick", **changes)
