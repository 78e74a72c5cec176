"""The K0 procedure: the stress of level ground, from its weight, water at rest and K0 of each soil."""

import math

import numpy as np


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
    depth : (n,) float64
        Depth below the ground surface [m].

    Notes
    -----
    Without water the soil is dry. Else it is saturated throughout: above the table its water hangs at zero pressure.
    """
    g, water = scene.gravity, scene.water
    water_density = water.density if water is not None else 0.0
    total = np.zeros_like(depth)
    tops = [s.top_depth for s in scene.soils] + [math.inf]
    for soil, top, bottom in zip(scene.soils, tops[:-1], tops[1:], strict=True):
        weight = g * ((1 - soil.porosity) * soil.grain_density + soil.porosity * water_density)
        total += weight * np.clip(np.minimum(depth, bottom) - top, 0.0, None)
    if water is None:
        return total, np.zeros_like(depth)
    pressure = g * water.density * np.clip(depth - water.table_depth, 0.0, None)
    return total - pressure, pressure
