"""Filling elements with points, and keeping points with the element that holds them."""

import math
from functools import cache

import numpy as np

from mpm.jit import kernel, kernel_part
from mpm.transfer import map_kernel
from mpm.variables import C_RETURNED, MASS, POINT_WIDTH, SXX, SYY, SZZ, X0, Y0, N, P, X, Y


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


def fill(mesh, scene):
    """Place points in the soil elements with the K0 and hydrostatic initial state.

    Parameters
    ----------
    mesh : mpm.mesh.Mesh
    scene : mpm.scene.Scene

    Returns
    -------
    points : (n_points, 16) float64
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
        near_gate = np.hypot(*(centre - gate).T) < d.gate_radius
    parts, owner = [], []
    for count, chosen in (
        (d.points_per_element, soil_elements[~near_gate[soil_elements]]),
        (d.points_per_element_gate, soil_elements[near_gate[soil_elements]]),
    ):
        layout = barycentric_layout(count)
        position = np.einsum("pk,ekd->epd", layout, corners[chosen])
        rows = np.zeros((len(chosen), count, POINT_WIDTH))
        rows[:, :, X : Y + 1] = position
        soil = soil_of_element[chosen]
        porosity = np.array([s.porosity for s in scene.soils])[soil]
        density = np.array([s.grain_density for s in scene.soils])[soil]
        rows[:, :, N] = porosity[:, None]
        rows[:, :, MASS] = (density * (1 - porosity) * area[chosen] / count)[:, None]
        parts.append(rows.reshape(-1, POINT_WIDTH))
        owner.append(np.repeat(chosen, count))
    points = np.concatenate(parts)
    element_of_point = np.concatenate(owner).astype(np.int32)
    by_element = np.argsort(element_of_point, kind="stable")
    points, element_of_point = np.ascontiguousarray(points[by_element]), element_of_point[by_element]
    soil_of_point = soil_of_element[element_of_point].astype(np.int32)
    points[:, X0 : Y0 + 1] = points[:, X : Y + 1]
    vertical, pressure = initial_stress(scene, -points[:, Y])
    k0 = np.array([s.k0 for s in scene.soils])[soil_of_point]
    points[:, P] = pressure
    points[:, SYY] = -vertical
    points[:, SXX] = points[:, SZZ] = -k0 * vertical
    return points, element_of_point, soil_of_point


def _area(corners):
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


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


@kernel
def sort_by_element(element_of_point, n_elements, start, order, occupied):
    """Counting sort: points of element e become order[start[e]:start[e + 1]], in ascending point number.

    Points with a negative element are left out. Returns the number of occupied elements and of points.
    """
    for e in range(n_elements + 1):
        start[e] = 0
    for i in range(element_of_point.size):
        if element_of_point[i] >= 0:
            start[element_of_point[i] + 1] += 1
    filled = 0
    for e in range(n_elements):
        if start[e + 1] > 0:
            occupied[filled] = e
            filled += 1
        start[e + 1] += start[e]
    for i in range(element_of_point.size):
        e = element_of_point[i]
        if e >= 0:
            order[start[e]] = i
            start[e] += 1
    for e in range(n_elements, 0, -1):
        start[e] = start[e - 1]
    start[0] = 0
    return filled, start[n_elements]


@kernel
def cut_by_points(start, occupied, n_occupied, element_cuts, cuts):
    """Cut the occupied elements of each level into parts of about as many points.

    Parameters
    ----------
    element_cuts : (n_levels + 1,) int
        First element of each level.
    cuts : (n_levels, n_parts + 1) int64
        Written: places in the list of occupied elements.
    """
    held = occupied[:n_occupied]
    parts = cuts.shape[1] - 1
    for level in range(cuts.shape[0]):
        first, last = element_cuts[level], element_cuts[level + 1]
        count = start[last] - start[first]
        for part in range(parts):
            sought = start[first] + part * count // parts
            element = first + np.searchsorted(start[first : last + 1], sought, side="right") - 1
            cuts[level, part] = np.searchsorted(held, element)
        cuts[level, parts] = np.searchsorted(held, last)


@kernel
def update_order(
    element_of_point, moved_point, moved_from, n_moved, start, order, occupied, n_occupied, new_start, new_order
):
    """Repair the sorting by element in place after a few points have moved, copying what lies between their elements.

    Equal to `sort_by_element` to the last entry, at the cost of a copy.

    moved_point, moved_from : (n,) int32
        The first n_moved entries: points, ascending, and the elements that they have left.
    new_start, new_order
        As `start` and `order`, for what is being sorted.
    Returns the number of occupied elements and of points.
    """
    n_elements = start.size - 1
    touched = np.zeros(2 * n_moved, np.int32)
    n_touched = 0
    gone = 0
    for k in range(n_moved):
        touched[n_touched] = moved_from[k]
        n_touched += 1
        e = element_of_point[moved_point[k]]
        if e >= 0:
            touched[n_touched] = e
            n_touched += 1
        else:
            gone += 1
    touched = touched[:n_touched]
    touched.sort()
    stayed = np.zeros((n_touched + 1, 2), np.int32)  # ranges of `order` between touched elements that stay in place
    n_stayed = 0
    # elements outside of these keep their points where they are, unless some are gone
    lowest, highest = touched[0], n_elements if gone > 0 else touched[-1] + 1
    for e in range(lowest, highest):
        new_start[e + 1] = start[e + 1] - start[e]
    for k in range(n_moved):
        new_start[moved_from[k] + 1] -= 1
        e = element_of_point[moved_point[k]]
        if e >= 0:
            new_start[e + 1] += 1
    arriving = np.argsort(element_of_point[moved_point[:n_moved]], kind="mergesort")
    read = write = start[lowest]  # everything of `order` between them is already copied or dropped
    a = 0
    last = -1
    for e in touched:
        if e == last:
            continue
        last = e
        if read == write:
            stayed[n_stayed, 0], stayed[n_stayed, 1] = read, start[e]
            n_stayed += 1
            write = start[e]
        else:
            for j in range(read, start[e]):
                new_order[write] = order[j]
                write += 1
        read = start[e]
        while a < n_moved and element_of_point[moved_point[arriving[a]]] < e:
            a += 1
        while read < start[e + 1] or (a < n_moved and element_of_point[moved_point[arriving[a]]] == e):
            incoming = a < n_moved and element_of_point[moved_point[arriving[a]]] == e
            if read < start[e + 1] and (not incoming or order[read] < moved_point[arriving[a]]):
                i = order[read]
                read += 1
                if element_of_point[i] == e:
                    new_order[write] = i
                    write += 1
            else:
                i = moved_point[arriving[a]]
                a += 1
                if read < start[e + 1] and order[read] == i:
                    read += 1  # it left and came back within the search
                new_order[write] = i
                write += 1
    for j in range(read, start[highest]):
        new_order[write] = order[j]
        write += 1
    held = occupied[:n_occupied]
    first, after = np.searchsorted(held, lowest), np.searchsorted(held, highest)
    filled = 0
    for e in range(lowest, highest):
        if new_start[e + 1] > 0:
            filled += 1
    change = first + filled - after
    if change > 0:
        for k in range(n_occupied - 1, after - 1, -1):
            occupied[k + change] = occupied[k]
    elif change < 0:
        for k in range(after, n_occupied):
            occupied[k + change] = occupied[k]
    copied = start[lowest]
    for k in range(n_stayed):
        for j in range(copied, stayed[k, 0]):
            order[j] = new_order[j]
        copied = stayed[k, 1]
    for j in range(copied, write):
        order[j] = new_order[j]
    for e in range(lowest, highest):
        if new_start[e + 1] > 0:
            occupied[first] = e
            first += 1
        start[e + 1] = start[e] + new_start[e + 1]
    return n_occupied + change, start[n_elements]


@cache
def relocate_kernel(wet, undrained, tied):
    """Kernel `relocate` for points with pore water or without, on levels tied to each other or on one."""
    map_point = map_kernel(wet, undrained, tied)

    @kernel_part
    def relocate(
        left, n_left, element_of_point, points, soil_of_point, soils, density_liquid, rows, geometry, neighbours,
        nodes, wave_speed, volume, level_of_element, finished, sums, clamps, moved_point, moved_from,
    ):  # fmt: skip
        """Find the new element of every point that left its own, walking over neighbours, and map it there.

        A point that would cross the boundary of the mesh is put back on it (and counted); one that
        crosses an outflow edge (neighbour -2) is taken out: element -1. A point on its way to an element of a
        level above `finished`, whose step is not over, waits in its own as if on the edge.

        left, n_left : (n_parts, n_points) int32, (n_parts,) int64
            Points that left their element, of `update_points`, and how many.
        moved_point, moved_from : (n_points,) int32
            Written: the points that changed their element, ascending, and the elements that they left.

        Returns
        -------
        n_moved, removed : int
            Number of points that changed their element, and of points taken out.
        limit, limit_speed : float
            As of `update_points`, over the points relocated.
        """
        limit = np.inf
        limit_speed = 0.0
        removed = 0
        n_moved = 0
        found = 0
        for part in range(left.shape[0]):
            for k in range(n_left[part]):
                moved_point[found] = left[part, k]
                found += 1
        moved_point[:found].sort()
        for k in range(found):
            i = moved_point[k]
            e = -2 - element_of_point[i]
            origin = e
            for _ in range(10000):
                g1x, g1y, g2x, g2y = geometry[e, 0], geometry[e, 1], geometry[e, 2], geometry[e, 3]
                dx = points[i, X] - geometry[e, 4]
                dy = points[i, Y] - geometry[e, 5]
                n1 = g1x * dx + g1y * dy
                n2 = g2x * dx + g2y * dy
                n0 = 1.0 - n1 - n2
                worst = 0
                low = n0
                if n1 < low:
                    worst, low = 1, n1
                if n2 < low:
                    worst, low = 2, n2
                if low >= 0.0:
                    break
                following = neighbours[e, worst]
                if following < 0:
                    # try to leave through the other violated edge first
                    other = -1
                    for corner in range(3):
                        value = n0 if corner == 0 else (n1 if corner == 1 else n2)
                        if corner != worst and value < 0.0 and neighbours[e, corner] >= 0:
                            other = neighbours[e, corner]
                    if other >= 0:
                        following = other
                if following >= 0:
                    e = following
                    continue
                if following == -2:
                    e = -1
                    removed += 1
                    break
                n0, n1, n2 = max(n0, 1e-9), max(n1, 1e-9), max(n2, 1e-9)
                total = n0 + n1 + n2
                n1 /= total
                n2 /= total
                det = g1x * g2y - g1y * g2x
                points[i, X] = geometry[e, 4] + (n1 * g2y - n2 * g1y) / det
                points[i, Y] = geometry[e, 5] + (n2 * g1x - n1 * g2x) / det
                clamps[C_RETURNED] += 1
                break
            if tied and e >= 0 and level_of_element[e] > finished:
                e = origin
            element_of_point[i] = e
            if e != origin:
                moved_point[n_moved] = i
                moved_from[n_moved] = origin
                n_moved += 1
            if e >= 0:
                added, fastest = map_point(
                    points[i], soils[soil_of_point[i]], density_liquid, rows[e], geometry[e], nodes, sums
                )
                volume[e, 0] += added
                if points[i, P] > 0.0:
                    volume[e, 1] += added
                fastest = np.sqrt(fastest)
                local = geometry[e, 7] / ((wave_speed + fastest) * (1 << level_of_element[e]))
                if local < limit:
                    limit = local
                    limit_speed = fastest
        return n_moved, removed, limit, limit_speed

    return relocate
