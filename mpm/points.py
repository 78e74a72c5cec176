"""Material points: elements filled with them in the initial state, and what is asked of all of them."""

import math
from functools import cache

import numpy as np

from mpm.fields import POINT, record
from mpm.k0_procedure import set_initial_stress
from mpm.laws.law import history_of, moduli_kernel
from mpm.machine.compile import LINE, kernel


def barycentric_layout(count):
    """Barycentric coordinates of equally weighted points with their centroid at the element's.

    Parameters
    ----------
    count : int
        Points per element: k^2 or 3 k^2 (the element divided into k^2 similar ones with one or
        three points each), or 6.

    Returns
    -------
    (count, 3) float64
        A stress field linear in space is integrated exactly by these points with equal weights.

    Raises
    ------
    ValueError
        For a count that has no such layout.
    """
    if count == 6:
        a = np.array([0.091576213509771, 0.445948490915965])
        return np.array([np.roll([1 - 2 * s, s, s], k) for s in a for k in range(3)])
    for per, local in ((1, [[1 / 3] * 3]), (3, [[2 / 3, 1 / 6, 1 / 6], [1 / 6, 2 / 3, 1 / 6], [1 / 6, 1 / 6, 2 / 3]])):
        k = math.isqrt(count // per)
        if per * k * k == count and k > 0:
            corners = []
            for i in range(k):
                for j in range(k - i):
                    corners.append([(i, j), (i + 1, j), (i, j + 1)])
                    if i + j < k - 1:
                        corners.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
            points = [np.array(b) @ np.array(c) / k for c in corners for b in local]
            return np.array([[1 - p[0] - p[1], p[0], p[1]] for p in points])
    raise ValueError(f"points_per_element must be k^2, 3 k^2 or 6, got {count}; use 3, 4, 6 or 12")


def on_cache_lines(rows):
    """Copy of an array of records whose first begins with a cache line; so do all where they are of 64 bytes, 128 .."""
    memory = np.empty(rows.nbytes + LINE, np.uint8)
    first = -memory.ctypes.data % LINE
    copy = memory[first : first + rows.nbytes].view(rows.dtype).reshape(rows.shape)
    copy[:] = rows
    return copy


def fill(mesh, scene):
    """Place points in the soil elements with the K0 and hydrostatic initial state.

    Parameters
    ----------
    mesh : mpm.mesh.Mesh
    scene : mpm.scene.Scene

    Returns
    -------
    points : (n_points,) records of the history of the soils' laws and `mpm.fields.POINT`
    element_of_point, soil_of_point : (n_points,) int32
    """
    nodes, elements = mesh.nodes, mesh.elements
    corners = nodes[elements]
    centre = corners.mean(axis=1)
    area = _area(corners)
    soil_elements = np.flatnonzero(mesh.region == 0)
    tops = np.array([soil.top_depth for soil in scene.soils])
    soil_of_element = np.maximum(np.searchsorted(tops, -centre[:, 1], side="right") - 1, 0)  # heaps: the top soil
    near_gate = np.zeros(len(elements), bool)
    d = scene.discretisation
    if scene.gate is not None:
        tunnel = scene.tunnels[scene.gate.tunnel]
        angle = math.radians(scene.gate.angle)
        gate = np.array(
            [
                tunnel.x + tunnel.outer_radius * math.sin(angle),
                -tunnel.axis_depth + tunnel.outer_radius * math.cos(angle),
            ]
        )
        of_cell = centre.reshape(-1, 4, 2).mean(axis=1)
        near_gate = np.repeat(np.hypot(*(of_cell - gate).T) < d.gate_radius, 4)
    parts, owner, kind = [], [], record([*(name for name, _, _ in history_of(scene)), *POINT])
    for count, chosen in (
        (d.points_per_element, soil_elements[~near_gate[soil_elements]]),
        (d.points_per_element_gate, soil_elements[near_gate[soil_elements]]),
    ):
        layout = barycentric_layout(count)
        rows = np.zeros((len(chosen), count), kind)
        rows["x"], rows["y"] = np.moveaxis(np.einsum("pk,ekd->epd", layout, corners[chosen]), -1, 0)
        soil = soil_of_element[chosen]
        porosity = np.array([s.porosity for s in scene.soils])[soil]
        density = np.array([s.grain_density for s in scene.soils])[soil]
        rows["porosity"] = porosity[:, None]
        rows["grain_mass"] = (density * (1 - porosity) * area[chosen] / count)[:, None]
        parts.append(rows.ravel())
        owner.append(np.repeat(chosen, count))
    points = np.concatenate(parts)
    element_of_point = np.concatenate(owner).astype(np.int32)
    by_element = np.argsort(element_of_point, kind="stable")
    points, element_of_point = on_cache_lines(points[by_element]), element_of_point[by_element]
    soil_of_point = soil_of_element[element_of_point].astype(np.int32)
    points["x_initial"], points["y_initial"] = points["x"], points["y"]
    set_initial_stress(scene, points, soil_of_point)
    return points, element_of_point, soil_of_point


def _area(corners):
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


@cache
def extremes_kernel(laws):
    """Kernel `extremes_of_soils` for the laws of a scene's soils."""
    moduli = moduli_kernel(laws)

    @kernel
    def extremes_of_soils(ground):
        """Smallest and largest porosity, and largest constrained modulus [Pa], of the points of each soil in elements.

        Returns
        -------
        (n_soils, 3) float64
            inf, -inf, 0 where no point is left.
        """
        found = np.empty((ground.soils.size, 3))
        found[:, 0], found[:, 1], found[:, 2] = np.inf, -np.inf, 0.0
        for i in range(ground.element_of_point.size):
            if ground.element_of_point[i] < 0:
                continue
            s, point = ground.soil_of_point[i], ground.points[i]
            lame, shear = moduli(point, ground.soils[s])
            found[s, 0], found[s, 1] = min(found[s, 0], point.porosity), max(found[s, 1], point.porosity)
            found[s, 2] = max(found[s, 2], lame + 2.0 * shear)
        return found

    return extremes_of_soils


@kernel
def mass_inside(points, element_of_point, x, y, radius, duration, acceleration):
    """Grains of the points in elements that are inside of a circle, or may come within a duration [kg/m].

    x, y, radius : float [m];  duration : float [s];  acceleration : float [m/s2]
        A point comes from no farther than twice its speed times the duration and acceleration times its square.
    """
    total = 0.0
    for i in range(element_of_point.size):
        point = points[i]
        speed = np.sqrt(point.velocity_solid_x**2 + point.velocity_solid_y**2)
        reach = 2.0 * duration * speed + acceleration * duration**2
        if element_of_point[i] >= 0 and (point.x - x) ** 2 + (point.y - y) ** 2 < (radius + reach) ** 2:
            total += point.grain_mass
    return total
