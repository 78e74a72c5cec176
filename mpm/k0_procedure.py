"""The K0 procedure: the stress of level ground, from its weight, water at rest and K0 of each soil."""

import math

import numpy as np

#: Share of k0 that its bounds give, so that 1 - sin(phi) over 1 + sin(phi) itself is borne.
ROUNDING = 1e-9


def set_initial_stress(scene, points, soil_of_point):
    """Give points the vertical stress above them, K0 times as much sideways, the water's pressure, their history.

    points : (n_points,) records, written;  soil_of_point : (n_points,) int
    """
    vertical, pressure = initial_stress(scene, -points["y"])
    points["pore_pressure"] = pressure
    points["stress_yy"] = -vertical
    for number, soil in enumerate(scene.soils):
        here = soil_of_point == number
        points["stress_xx"][here] = -soil.lateral_pressure_coefficient(vertical[here]) * vertical[here]
    points["stress_zz"] = points["stress_xx"]
    for number, soil in enumerate(scene.soils):
        mine = points[soil_of_point == number]
        soil.initial_history(mine)
        points[soil_of_point == number] = mine


def initial_stress(scene, depth):
    """Vertical effective stress and pore pressure of level ground [Pa], compression positive.

    Parameters
    ----------
    depth : float or (n,) float64
        Depth below the ground surface [m].

    Notes
    -----
    Without water the soil is dry. Else it is saturated throughout: above the table its water hangs at zero pressure.
    """
    g, water = scene.gravity, scene.water
    water_density = water.density if water is not None else 0.0
    total = np.zeros(np.shape(depth))
    tops = [s.top_depth for s in scene.soils] + [math.inf]
    for soil, top, bottom in zip(scene.soils, tops[:-1], tops[1:], strict=True):
        weight = g * ((1 - soil.porosity) * soil.grain_density + soil.porosity * water_density)
        total += weight * np.clip(np.minimum(depth, bottom) - top, 0.0, None)
    if water is None:
        return total, np.zeros(np.shape(depth))
    pressure = g * water.density * np.clip(depth - water.table_depth, 0.0, None)
    return total - pressure, pressure


def lateral_pressure_range(scene, soil, top=0.0, bottom=math.inf):
    """Lowest and highest K0 [-] of the initial state in a soil's layer, between two depths [m]."""
    depths = _turning_depths(scene, soil, top, bottom)
    found = [soil.lateral_pressure_coefficient(scene.vertical_stress(depth)) for depth in depths]
    return min(found), max(found)


def bond_friction(scene, tunnel):
    """Friction coefficient that bears the K0 stress on a bonded, held lining [-].

    The largest shear over pressure at a circle, where tan(theta)^2 = 1 / K0: |1 - K0| / (2 sqrt(K0)). Infinite where
    nothing presses from the side.
    """
    crown, invert = tunnel.cover, tunnel.cover + tunnel.outer_diameter
    beside = [
        k0
        for soil, bottom in zip(scene.soils, _bottoms(scene), strict=True)
        if soil.top_depth < invert and bottom > crown
        for k0 in lateral_pressure_range(scene, soil, crown, invert)
    ]
    return max(abs(1 - k0) / (2 * math.sqrt(k0)) if k0 > 0 else math.inf for k0 in beside)


def yield_depth(scene, soil, k0):
    """Depth from which a soil's layer yields under a K0 [m]; None where it bears it throughout."""

    def borne(depth):
        lowest, highest = soil.admissible_k0(scene.vertical_stress(depth))
        return lowest * (1 - ROUNDING) <= k0 <= highest * (1 + ROUNDING)

    # what cohesion adds fades with the stress, which is linear between these depths
    shallow, deep = soil.top_depth, _deepest(scene, soil)
    if borne(deep):
        return None
    while deep - shallow > 0.01:
        middle = (shallow + deep) / 2
        shallow, deep = (middle, deep) if borne(middle) else (shallow, middle)
    return shallow


def check_k0(scene):
    """Refuse a k0 that the soil does not bear in all of its layer: it would yield before the gate opens.

    Raises ValueError.
    """
    for soil in scene.soils:
        yielding = None if soil.k0 is None else yield_depth(scene, soil, soil.k0)
        if yielding is None:
            continue
        depth = _deepest(scene, soil)
        lowest, highest = soil.admissible_k0(scene.vertical_stress(depth))
        at_rest = 1 - math.sin(math.radians(soil.strength[1]))
        raise ValueError(
            f"soil '{soil.name}': k0 must lie in {max(lowest, 0):.3f} .. {highest:.3f}, what {soil.limits} bear at "
            f"{depth:g} m, got {soil.k0:g}, which yields from a depth of {yielding:.3g} m; give more strength, or "
            f"a k0 that it bears: 1 - sin(friction_angle) = {at_rest:.3g} where the ground was never loaded more, "
            "or leave k0 out: gravity loading within the strength"
        )


def _bottoms(scene):
    """Depths of the lower ends of the soil layers [m]."""
    return [below.top_depth for below in scene.soils[1:]] + [scene.box.depth]


def _turning_depths(scene, soil, top=0.0, bottom=math.inf):
    """Depths [m] between which the vertical effective stress in a soil's layer is linear, within two depths."""
    top, bottom = max(top, soil.top_depth), min(bottom, _bottoms(scene)[scene.soils.index(soil)])
    table = top if scene.water is None else min(max(scene.water.table_depth, top), bottom)
    return top, table, bottom


def _deepest(scene, soil):
    """Where the vertical effective stress in a soil's layer is largest [m]."""
    return max(_turning_depths(scene, soil), key=scene.vertical_stress)
