"""Points that left their element: the pass of a step that finds their new one, and what follows from it."""

from functools import cache

import numpy as np

from mpm.machine.compile import allocating_part, inline_kernel, kernel_part
from mpm.step.nodes_to_points import shares
from mpm.step.points_to_nodes import map_kernel, time_limit
from mpm.step.sort import ascend, pair, unpair, update_order


@kernel_part
def total(counts):
    """Sum of the counts of all parts (numpy's takes a second to compile)."""
    found = 0
    for part in range(counts.size):
        found += counts[part]
    return found


@kernel_part
def walk(point, e, net, clamps):
    """Element that holds a point, from element e over neighbours; -1 where it left through an outflow edge.

    A point that would cross the boundary of the mesh is put back on it, and counted.
    """
    for _ in range(10000):
        shape = net.geometry[e]
        n0, n1, n2 = shares(point, shape)
        worst = 0
        low = n0
        if n1 < low:
            worst, low = 1, n1
        if n2 < low:
            worst, low = 2, n2
        if low >= 0.0:
            break
        following = net.neighbours[e, worst]
        if following < 0:
            # try to leave through the other violated edge first
            other = -1
            for corner in range(3):
                value = n0 if corner == 0 else (n1 if corner == 1 else n2)
                if corner != worst and value < 0.0 and net.neighbours[e, corner] >= 0:
                    other = net.neighbours[e, corner]
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
        det = shape.dn1_dx * shape.dn2_dy - shape.dn1_dy * shape.dn2_dx
        point.x = shape.x + (n1 * shape.dn2_dy - n2 * shape.dn1_dy) / det
        point.y = shape.y + (n2 * shape.dn1_dx - n1 * shape.dn2_dx) / det
        clamps.returned_to_mesh += 1
        break
    return e


@cache
def locate_kernel(needs):
    """Kernel `locate` for what a scene needs (`mpm.step.system.Needs`)."""
    tied, map_point = needs.tied, map_kernel(needs)

    @inline_kernel
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
        ground, net, clamps = system.ground, system.net, system.tally.clamps[own]
        limit, limit_speed = np.inf, 0.0
        for k in range(n_left):
            i = left[k]
            e = -2 - ground.element_of_point[i]
            origin[k] = e
            e = walk(ground.points[i], e, net, clamps)
            if tied and e >= 0 and net.level_of_element[e] > finished:
                e = origin[k]
            ground.element_of_point[i] = e
            if e >= 0:
                fastest = map_point(i, e, own, system)
                local = time_limit(e, fastest, system)
                if local < limit:
                    limit, limit_speed = local, fastest
        return limit, limit_speed

    return locate


@allocating_part
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
    start, order, occupied = ground.start, ground.order, ground.occupied
    left, origin, first_left, n_left = tally.left, tally.origin, tally.first_left, tally.n_left
    moved, n_moved, removed = np.empty(total(n_left), np.int64), 0, 0.0
    for part in range(n_left.size):
        for k in range(first_left[part], first_left[part] + n_left[part]):
            i = left[k]
            e = element_of_point[i]
            if e >= 0:
                point, held = points[i], contents[e]
                density = ground.soils[ground.soil_of_point[i]].grain_density
                added = point.grain_mass / (density * (1.0 - point.porosity))
                held.volume += added
                held.pressure += added * max(point.pore_pressure, 0.0)
                held.x += added * point.x
                held.y += added * point.y
            else:
                removed += points[i].grain_mass
            if e != origin[k]:
                moved[n_moved] = pair(i, origin[k])
                n_moved += 1
    if n_moved == 0:
        return n_occupied, start[start.size - 1], removed
    ascend(moved, n_moved)
    n_occupied, n_active = update_order(
        element_of_point, moved, n_moved, start, order, occupied, n_occupied, tally.spare
    )
    for k in range(n_moved):
        first = unpair(moved[k])[1] & ~3
        if start[first + 4] == start[first]:
            for triangle in range(first, first + 4):
                contents[triangle].fill = 0.0
    return n_occupied, n_active, removed
