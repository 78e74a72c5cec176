"""How many elements a scene will have and how much memory its run takes, before anything is meshed."""

import math


def estimated_elements(scene) -> float:
    """Rough number of elements that are computed, from the integral of the inverse cell area, four a cell [-]."""
    d = scene.discretisation
    growth = d.growth
    cells = scene.box.width * (scene.box.depth + (scene.box.headroom or d.element_size)) / d.element_size**2
    for t in scene.tunnels:
        cells += _graded(2 * math.pi * t.outer_radius, d.element_size_lining, d.element_size, growth)
    if scene.gate is not None:
        t = scene.tunnels[scene.gate.tunnel]
        size = scene.gate.width / d.elements_across_gate
        cells += (t.outer_radius - t.inner_radius) * scene.gate.width / size**2
        cells += _fanned(scene.gate.width, size, min(d.element_size_lining, d.element_size), growth)
        if scene.interior == "resolved":
            cells += math.pi * t.inner_radius**2 / d.element_size_interior**2
            cells += _fanned(scene.gate.width, size, d.element_size_interior, growth)
    return 2 * cells if scene.is_half else 4 * cells


def estimated_bytes(scene) -> float:
    """Memory of a run [bytes]: an element's mesh, adjacency and buffers, a point's state and two copies."""
    return estimated_elements(scene) * (1500 + 600 * scene.discretisation.points_per_element)


def _graded(length, small, large, growth):
    """Integral of 1/size^2 - 1/large^2 beside a circle of the given length whose size grows away from it.

    The area grows with the distance as well: that of a circle of this length.
    """
    if small >= large:
        return 0.0
    reach = (large - small) / growth
    curved = 2 * math.pi / growth**2 * (math.log(large / small) + small / large - 1)
    return length * (1 / small - 1 / large) / growth + curved - (length + math.pi * reach) * reach / large**2


def _fanned(width, small, large, growth):
    """Integral of 1/size^2 - 1/large^2 over the half plane before a gap whose size grows away from it."""
    if small >= large:
        return 0.0
    reach = (large - small) / growth
    fan = math.pi / growth**2 * (math.log(large / small) + small / large - 1)
    strip = width * ((1 / small - 1 / large) / growth - reach / large**2)
    return fan - 0.5 * math.pi * reach**2 / large**2 + strip
