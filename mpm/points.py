"""Filling elements with points, and keeping points with the element that holds them."""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from mpm.jit import LINE, index, integer_kernel, kernel, kernel_part
from mpm.transfer import map_kernel
from mpm.variables import (
    C_RETURNED,
    E_FILL,
    E_PRESSURE,
    E_VOLUME,
    E_X,
    E_Y,
    MASS,
    POINT_WIDTH,
    S_RHO_S,
    SXX,
    SYY,
    SZZ,
    VSX,
    VSY,
    X0,
    Y0,
    N,
    P,
    X,
    Y,
)


class Layout(NamedTuple):
    """Where the levels lie in the lists of elements and nodes: see :class:`mpm.levels.Levels`."""

    element_cuts: np.ndarray
    node_cuts: np.ndarray
    first_of_node: np.ndarray


class Cuts(NamedTuple):
    """Where the lists of occupied elements and nodes of each level are cut: (n_levels, n_parts + 1) int64."""

    elements: np.ndarray
    nodes: np.ndarray
    solved: np.ndarray  # `nodes` at the beginning of the long step: the others change while nodes are solved


ELEMENT_WORK = 2  # what an element costs in a step beside its points, in points


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
    """Copy of an array (n, k) of float64 whose first row begins with a cache line; so do all where k is 8, 16, ..."""
    memory = np.empty(rows.nbytes + LINE, np.uint8)
    first = -memory.ctypes.data % LINE
    copy = memory[first : first + rows.nbytes].view(np.float64).reshape(rows.shape)
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
        of_cell = centre.reshape(-1, 4, 2).mean(axis=1)
        near_gate = np.repeat(np.hypot(*(of_cell - gate).T) < d.gate_radius, 4)
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
    points, element_of_point = on_cache_lines(points[by_element]), element_of_point[by_element]
    soil_of_point = soil_of_element[element_of_point].astype(np.int32)
    points[:, X0 : Y0 + 1] = points[:, X : Y + 1]
    vertical, pressure = initial_stress(scene, -points[:, Y])
    points[:, P] = pressure
    points[:, SYY] = -vertical
    for number, soil in enumerate(scene.soils):
        here = soil_of_point == number
        points[here, SXX] = -soil.lateral_pressure_coefficient(vertical[here]) * vertical[here]
    points[:, SZZ] = points[:, SXX]
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


@integer_kernel
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
def porosity_ranges(points, element_of_point, soil_of_point, n_soils):
    """Smallest and largest porosity of the points of each soil that are in an element: (n_soils, 2), else inf, -inf."""
    ranges = np.empty((n_soils, 2))
    ranges[:, 0], ranges[:, 1] = np.inf, -np.inf
    first = 0
    while first < element_of_point.size:  # points of one soil follow each other
        s, i, low, high = soil_of_point[first], first, np.inf, -np.inf
        while i < element_of_point.size and soil_of_point[i] == s:
            if element_of_point[i] >= 0:
                low, high = min(low, points[i, N]), max(high, points[i, N])
            i += 1
        ranges[s, 0], ranges[s, 1] = min(ranges[s, 0], low), max(ranges[s, 1], high)
        first = i
    return ranges


@kernel
def mass_inside(points, element_of_point, x, y, radius, duration, acceleration):
    """Grains of the points in elements that are inside of a circle, or may come within a duration [kg/m].

    x, y, radius : float [m];  duration : float [s];  acceleration : float [m/s2]
        A point comes from no farther than twice its speed times the duration and acceleration times its square.
    """
    total = 0.0
    for i in range(element_of_point.size):
        reach = 2.0 * duration * np.sqrt(points[i, VSX] ** 2 + points[i, VSY] ** 2) + acceleration * duration**2
        if element_of_point[i] >= 0 and (points[i, X] - x) ** 2 + (points[i, Y] - y) ** 2 < (radius + reach) ** 2:
            total += points[i, MASS]
    return total


@kernel_part
def place_of(value, ascending, low, high):
    """First place in a range of an array that is not below a value (numpy's takes two seconds to compile)."""
    while low < high:
        middle = (low + high) // 2
        if ascending[middle] < value:
            low = middle + 1
        else:
            high = middle
    return low


@integer_kernel
def cut_by_work(start, occupied, n_occupied, layout, n_levels, cuts):
    """Cut the occupied elements of the finest levels into parts of about as much work, and nodes with them.

    So whoever takes the same part of every pass finds most of what it needs where it left it, in its own cache.

    Parameters
    ----------
    layout : Layout
    cuts : Cuts
        Written, but for `solved`: places in the list of occupied elements and of nodes. The elements of further
        levels are shifted with the list.
    """
    parts = cuts.elements.shape[1] - 1
    change = n_occupied - cuts.elements[-1, -1]
    for level in range(n_levels, cuts.elements.shape[0]):
        for part in range(parts + 1):
            cuts.elements[level, part] += change
    end = 0
    for level in range(n_levels):
        begin, after = start[layout.element_cuts[level]], start[layout.element_cuts[level + 1]]
        first = low = end
        end = place_of(layout.element_cuts[level + 1], occupied, low, n_occupied)
        work = after - begin + ELEMENT_WORK * (end - first)
        node, last_node = layout.node_cuts[level], layout.node_cuts[level + 1]
        cuts.elements[level, 0], cuts.nodes[level, 0] = first, node
        for part in range(1, parts):
            high = end
            while low < high:
                middle = (low + high) // 2
                before = start[occupied[middle]] - begin + ELEMENT_WORK * (middle - first)
                if before * parts < part * work:
                    low = middle + 1
                else:
                    high = middle
            element = occupied[low] if low < end else layout.element_cuts[level + 1]
            node = place_of(element, layout.first_of_node, node, last_node)
            cuts.elements[level, part], cuts.nodes[level, part] = low, node
        cuts.elements[level, parts], cuts.nodes[level, parts] = end, last_node


@kernel_part
def shift_ranges(array, spare, ranges, count):
    """Move ranges of an array, which stay in their order, by so many places each.

    ranges : (n, 3) int64
        First and last place (exclusive) and shift of the first `count` ranges, ascending.
    spare : as `array`.
    """
    # What moves down never lands on what has yet to move up, nor the other way round.
    for k in range(count):
        if ranges[k, 2] < 0:
            shift_range(array, spare, ranges[k, 0], ranges[k, 1], ranges[k, 2])
    for k in range(count - 1, -1, -1):
        if ranges[k, 2] > 0:
            shift_range(array, spare, ranges[k, 0], ranges[k, 1], ranges[k, 2])


@kernel_part
def shift_range(array, spare, first, last, shift):
    """Move one range of an array; by way of another array, so that copying is not slowed by what overlaps."""
    for j in range(first, last):
        spare[index(j)] = array[index(j)]
    for j in range(first, last):
        array[index(j + shift)] = spare[index(j)]


@integer_kernel
def update_order(
    element_of_point, moved_point, moved_from, n_moved, start, order, occupied, n_occupied, spare_start, spare_order
):
    """Repair the sorting by element in place after a few points have moved, shifting what lies between their elements.

    Equal to `sort_by_element` to the last entry.

    moved_point, moved_from : (n,) int32
        The first n_moved entries: points, ascending, and the elements that they have left.
    spare_start, spare_order
        As `start` and `order`, for copies on the way.
    Returns the number of occupied elements and of points.
    """
    n_elements = start.size - 1
    listed, touched, n_listed = np.empty(2 * n_moved, np.int32), np.empty(2 * n_moved, np.int32), 0
    for k in range(n_moved):
        listed[n_listed] = moved_from[k]
        n_listed += 1
        if element_of_point[moved_point[k]] >= 0:
            listed[n_listed] = element_of_point[moved_point[k]]
            n_listed += 1
    ascending, n_touched, n_held = np.argsort(listed[:n_listed], kind="mergesort"), 0, 0
    for k in range(n_listed):
        e = listed[ascending[k]]
        if n_touched == 0 or e != touched[n_touched - 1]:
            touched[n_touched] = e
            n_touched += 1
            n_held += start[e + 1] - start[e]
    # the new lists of these elements, one after the other
    held, n_new = np.empty(n_held + n_moved, np.int32), 0
    goal = np.empty(n_moved, np.int32)
    for k in range(n_moved):
        goal[k] = element_of_point[moved_point[k]]
    arriving, a = np.argsort(goal, kind="mergesort"), 0
    ends = np.empty(n_touched, np.int64)
    for t in range(n_touched):
        e = touched[t]
        while a < n_moved and goal[arriving[a]] < e:
            a += 1
        read = start[e]
        while True:
            incoming = a < n_moved and goal[arriving[a]] == e
            if read < start[e + 1] and (not incoming or order[read] < moved_point[arriving[a]]):
                i = order[read]
                read += 1
                if element_of_point[i] == e:
                    held[n_new] = i
                    n_new += 1
            elif incoming:
                i = moved_point[arriving[a]]
                a += 1
                if read < start[e + 1] and order[read] == i:
                    read += 1  # it left and came back within the search
                held[n_new] = i
                n_new += 1
            else:
                break
        ends[t] = n_new
    # what lies between them, and the elements that are occupied from now on or no more
    ranges, shift = np.empty((n_touched, 3), np.int64), 0
    places, n_places, change = np.empty((n_touched, 3), np.int64), 0, 0
    entering = np.empty(n_touched, np.int64)
    for t in range(n_touched):
        e = touched[t]
        count, before = ends[t] - (ends[t - 1] if t > 0 else 0), start[e + 1] - start[e]
        shift += count - before
        ranges[t, 0], ranges[t, 2] = start[e + 1], shift
        ranges[t, 1] = start[touched[t + 1]] if t + 1 < n_touched else start[n_elements]
        if (count > 0) != (before > 0):
            place = place_of(e, occupied, 0, n_occupied)
            if n_places > 0:
                places[n_places - 1, 1] = place
            change += 1 if count > 0 else -1
            places[n_places, 0], places[n_places, 1], places[n_places, 2] = place + (before > 0), n_occupied, change
            entering[n_places] = e if count > 0 else -1
            n_places += 1
    shift_ranges(order, spare_order, ranges, n_touched)
    shift_ranges(occupied, spare_start, places, n_places)
    for k in range(n_places):
        if entering[k] >= 0:
            occupied[places[k, 0] + places[k, 2] - 1] = entering[k]
    k = 0
    for t in range(n_touched):
        e = touched[t]
        j = start[e]
        while k < ends[t]:
            order[j] = held[k]
            j, k = j + 1, k + 1
        last = touched[t + 1] if t + 1 < n_touched else n_elements
        if ranges[t, 2] != 0:
            for f in range(e + 1, last + 1):
                start[index(f)] += ranges[t, 2]
    return n_occupied + change, start[n_elements]


@kernel_part
def follow_points(system, n_occupied):
    """Count the points that `locate` has found with the elements that hold them, and repair the sorting.

    Written of the `system`: the points by element, contents of the elements. Quadrilaterals that they leave empty are
    not full.

    Returns
    -------
    n_occupied, n_active : int
        Number of occupied elements and of points in them.
    removed : float
        Grains taken out [kg/m].
    """
    ground, tally, contents = system.ground, system.tally, system.net.contents
    element_of_point, points = ground.element_of_point, ground.points
    soil_of_point, soils = ground.soil_of_point, ground.soils
    start, order, occupied = ground.start, ground.order, ground.occupied
    left, origin, first_left, n_left = tally.left, tally.origin, tally.first_left, tally.n_left
    spare_start, spare_order = tally.spare_start, tally.spare_order
    moved, n_moved, removed = np.empty(n_left.sum(), np.int32), 0, 0.0
    for part in range(n_left.size):
        for k in range(first_left[part], first_left[part] + n_left[part]):
            i = left[k]
            e = element_of_point[i]
            if e >= 0:
                added = points[i, MASS] / (soils[soil_of_point[i], S_RHO_S] * (1.0 - points[i, N]))
                contents[e, E_VOLUME] += added
                contents[e, E_PRESSURE] += added * max(points[i, P], 0.0)
                contents[e, E_X] += added * points[i, X]
                contents[e, E_Y] += added * points[i, Y]
            else:
                removed += points[i, MASS]
            if e != origin[k]:
                moved[n_moved] = k
                n_moved += 1
    if n_moved == 0:
        return n_occupied, start[start.size - 1], removed
    moved_point, moved_from = np.empty(n_moved, np.int32), np.empty(n_moved, np.int32)
    for k in range(n_moved):
        moved_point[k] = left[moved[k]]
    ascending = np.argsort(moved_point, kind="mergesort")
    for k in range(n_moved):
        moved_point[k], moved_from[k] = left[moved[ascending[k]]], origin[moved[ascending[k]]]
    n_occupied, n_active = update_order(
        element_of_point, moved_point, moved_from, n_moved, start, order, occupied, n_occupied, spare_start, spare_order
    )
    for k in range(n_moved):
        e = moved_from[k]
        first = e & ~3
        if start[first + 4] == start[first]:
            contents[first : first + 4, E_FILL] = 0.0
    return n_occupied, n_active, removed


@cache
def locate_kernel(wet, undrained, tied):
    """Kernel `locate` for points with pore water or without, on levels tied to each other or on one."""
    map_point = map_kernel(wet, undrained, tied)

    @kernel_part
    def locate(left, n_left, origin, own, finished, system):
        """Find the new element of every point that left its own, walking over neighbours, and map it there.

        A point that would cross the boundary of the mesh is put back on it (and counted); one that
        crosses an outflow edge (neighbour -2) is taken out: element -1. A point on its way to an element of a
        level above `finished`, whose step is not over, waits in its own as if on the edge.
        It may be called for a part of the points while others are updated; `follow_points` does the rest.

        left, n_left : (n_points,) int32, int
            Points that left their element, of `update_points`, and how many;  own : the part that sums them up.
        origin : (n_points,) int32
            Written: the elements that they left.

        Returns
        -------
        limit, limit_speed : float
            As of `update_points`, over these points.
        """
        ground, net, density_liquid = system.ground, system.net, system.medium.density_liquid
        element_of_point, points = ground.element_of_point, ground.points
        soil_of_point, soils = ground.soil_of_point, ground.soils
        rows, geometry, neighbours, contents = net.rows, net.geometry, net.neighbours, net.contents
        level_of_element, touched, sums = net.level_of_element, net.touched[own], net.sums[own]
        wave_speed, clamps = system.pace.wave_speed, system.tally.clamps[own]
        limit = np.inf
        limit_speed = 0.0
        for k in range(n_left):
            i = left[k]
            e = -2 - element_of_point[i]
            origin[k] = e
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
                e = origin[k]
            element_of_point[i] = e
            if e >= 0:
                fastest = np.sqrt(
                    map_point(
                        points[i], soils[soil_of_point[i]], density_liquid, rows[e], geometry[e], contents[e, E_FILL],
                        touched, sums,
                    )
                )  # fmt: skip
                local = geometry[e, 7] / ((wave_speed + fastest) * (1 << level_of_element[e]))
                if local < limit:
                    limit = local
                    limit_speed = fastest
        return limit, limit_speed

    return locate
