"""Nodes to points: the pass of a step that moves the points and brings their momenta back to the nodes (MUSL).

Each kernel works on a range of the list of occupied elements and writes only to rows that these elements own, so ranges
may run in any number of threads with the same bits. Shape functions are those of the linear triangle.
"""

from functools import cache

from mpm.machine.compile import index, inline_kernel, kernel_part, prefetch
from mpm.step.cells import fill_cell, resolved_pressure

AHEAD = 16  # points whose rows are on the way into the cache: their order is known, the machine does not guess it


@inline_kernel
def on_element(n0, n1, n2):
    """Barycentric coordinates of the point of an element's edge that stands for one a little outside."""
    n0, n1, n2 = max(n0, 0.0), max(n1, 0.0), max(n2, 0.0)
    total = n0 + n1 + n2
    return n0 / total, n1 / total, n2 / total


@inline_kernel
def shares(point, shape):
    """Shape functions of an element's corners at a point."""
    dx, dy = point.x - shape.x, point.y - shape.y
    n1 = shape.dn1_dx * dx + shape.dn1_dy * dy
    n2 = shape.dn2_dx * dx + shape.dn2_dy * dy
    return 1.0 - n1 - n2, n1, n2


@kernel_part
def drift(row, n_nodes, means, node):
    """What the mean velocity over all steps of a node that a row is tied to has over the velocity at their end."""
    if row < n_nodes:
        return 0.0, 0.0
    mean = means[row - n_nodes]
    return mean.solid_x - node.velocity_solid_x, mean.solid_y - node.velocity_solid_y


@inline_kernel
def add_momentum(row, share, px, py, qx, qy, two_phase):
    """Add a share of the momenta of a point to a row."""
    row.solid_x += share * px
    row.solid_y += share * py
    if two_phase:
        row.liquid_x += share * qx
        row.liquid_y += share * qy


@cache
def flip_kernel(two_phase):
    """Kernel `new_velocities` for one velocity or two."""

    @inline_kernel
    def new_velocities(point, n0, n1, n2, a, b, c, flip):
        """Velocity of the grains at a point's place, and new velocities of its grains and water."""
        pic = 1.0 - flip
        gx = n0 * a.velocity_solid_x + n1 * b.velocity_solid_x + n2 * c.velocity_solid_x
        gy = n0 * a.velocity_solid_y + n1 * b.velocity_solid_y + n2 * c.velocity_solid_y
        vx = point.velocity_solid_x + n0 * a.change_solid_x + n1 * b.change_solid_x + n2 * c.change_solid_x
        vy = point.velocity_solid_y + n0 * a.change_solid_y + n1 * b.change_solid_y + n2 * c.change_solid_y
        vx, vy = flip * vx + pic * gx, flip * vy + pic * gy
        ux, uy = vx, vy
        if two_phase:
            hx = n0 * a.velocity_liquid_x + n1 * b.velocity_liquid_x + n2 * c.velocity_liquid_x
            hy = n0 * a.velocity_liquid_y + n1 * b.velocity_liquid_y + n2 * c.velocity_liquid_y
            ux = point.velocity_liquid_x + n0 * a.change_liquid_x + n1 * b.change_liquid_x + n2 * c.change_liquid_x
            uy = point.velocity_liquid_y + n0 * a.change_liquid_y + n1 * b.change_liquid_y + n2 * c.change_liquid_y
            ux, uy = flip * ux + pic * hx, flip * uy + pic * hy
        return gx, gy, vx, vy, ux, uy

    return new_velocities


@cache
def advance_kernel(needs):
    """Kernel `advance_points` for what a scene needs (`mpm.step.system.Needs`)."""
    wet, two_phase, tied, new_velocities = needs.wet, needs.two_phase, needs.tied, flip_kernel(needs.two_phase)
    undrained = wet and not two_phase

    @kernel_part
    def advance_element(e, momenta, system):
        """`advance_points` for one element."""
        ground, net, clock = system.ground, system.net, system.clock
        shape, level, n_nodes = net.geometry[e], net.level_of_element[e], index(net.which_node.size)
        dt, flip = clock.dt_of_level[level], clock.flip_of_level[level]
        ia, ib, ic = index(net.rows[e, 0]), index(net.rows[e, 1]), index(net.rows[e, 2])
        a, b, c = net.nodes[ia], net.nodes[ib], net.nodes[ic]
        at_a, at_b, at_c = momenta[ia], momenta[ib], momenta[ic]
        border = tied and max(ia, ib, ic) >= n_nodes
        jx0 = jy0 = jx1 = jy1 = jx2 = jy2 = 0.0
        if border:
            jx0, jy0 = drift(ia, n_nodes, net.tied_means, a)
            jx1, jy1 = drift(ib, n_nodes, net.tied_means, b)
            jx2, jy2 = drift(ic, n_nodes, net.tied_means, c)
        pressure = px = py = slope_x = slope_y = share = 0.0
        if wet and clock.filter_of_level[level] > 0.0:
            pressure, px, py, slope_x, slope_y, share = resolved_pressure(e, net.geometry, net.contents)
            share *= clock.filter_of_level[level]
        for j in range(ground.start[e], ground.start[e + 1]):
            i = index(ground.order[j])
            prefetch(ground.points, index(ground.order[min(j + AHEAD, ground.order.size - 1)]))
            point = ground.points[i]
            n0, n1, n2 = shares(point, shape)
            if tied and (n0 < 0.0 or n1 < 0.0 or n2 < 0.0):
                n0, n1, n2 = on_element(n0, n1, n2)
            gx, gy, vx, vy, ux, uy = new_velocities(point, n0, n1, n2, a, b, c, flip)
            m, w = point.grain_mass, 0.0
            if wet:
                density = ground.soils[index(ground.soil_of_point[i])].grain_density
                w = m / (density * (1.0 - point.porosity)) * system.medium.density_liquid
                felt = pressure + slope_x * (point.x - px) + slope_y * (point.y - py)
                point.pore_pressure += share * (felt - max(point.pore_pressure, 0.0))
            if undrained:
                m += point.porosity * w
            point.velocity_solid_x, point.velocity_solid_y = vx, vy
            if wet:
                point.velocity_liquid_x, point.velocity_liquid_y = ux, uy
            add_momentum(at_a, n0, m * vx, m * vy, w * ux, w * uy, two_phase)
            add_momentum(at_b, n1, m * vx, m * vy, w * ux, w * uy, two_phase)
            add_momentum(at_c, n2, m * vx, m * vy, w * ux, w * uy, two_phase)
            if border:
                gx += n0 * jx0 + n1 * jx1 + n2 * jx2
                gy += n0 * jy0 + n1 * jy1 + n2 * jy2
            point.x += dt * gx
            point.y += dt * gy

    @inline_kernel
    def advance_points(first, last, own, system):
        """Advance point velocities and positions from the nodes and map new momenta back (MUSL).

        Velocities take `flip_of_level` of the FLIP and the rest of the PIC update; positions move with
        the solid. A pore pressure is drawn by `filter_of_level` to what the nodes feel of it (`resolved_pressure`).
        Where water is missing the pressure that acts, zero, is drawn just so: what wet points lose fills dry ones.

        first, last : range of the occupied elements;  own : the part that sums up their momenta. Written of the
        `system`: points, how full the elements are, momenta (cleared by `remap_nodes`), rows touched.

        Source: Sulsky, Zhou & Schreyer (1995) for MUSL; Zhu & Bridson (2005) for the PIC/FLIP blend.
        """
        net, touched = system.net, system.net.touched[own]
        for k in range(first, last):
            e = index(system.ground.occupied[k])
            for corner in range(3):
                touched[index(net.rows[e, corner])] = 1
            fill_cell(e, system.ground.start, net.geometry, net.contents)
            advance_element(e, net.momenta[own], system)

    return advance_points
