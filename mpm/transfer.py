"""Points to nodes and back: the kernels of a step that pass over the points, element by element.

Each kernel works on a range of the list of occupied elements and writes only to rows that these
elements own, so ranges may run in any number of threads with the same bits. Shape functions are
those of the linear triangle; `geometry` rows hold (g1x, g1y, g2x, g2y, x0, y0, area, height).
Elements 4 q .. 4 q + 3 are the triangles into which both diagonals cut quadrilateral q (`mpm.mesh`).

Arrays are read as `points[i, X]`, never through a row `points[i]` taken in a loop over points: numba counts the
references of every such view, and the two calls a point cost as much as its arithmetic.
"""

from functools import cache

import numpy as np

from mpm.jit import index, inline_kernel, kernel, kernel_part, prefetch
from mpm.materials.mohr_coulomb import mohr_coulomb
from mpm.variables import (
    B_D,
    B_FLX,
    B_FLY,
    B_FX,
    B_FY,
    B_ML,
    B_MN,
    B_MS,
    B_PLX,
    B_PLY,
    B_PSX,
    B_PSY,
    C_CAVITATED,
    C_CEILING,
    C_FLOOR,
    C_SUSPENDED,
    C_TENSION,
    E_FILL,
    E_PRESSURE,
    E_VOLUME,
    E_X,
    E_Y,
    EQ,
    MASS,
    MODEL_ELASTIC,
    POROSITY_CEILING,
    POROSITY_FLOOR,
    S_APEX,
    S_C_COS,
    S_DRAG,
    S_G,
    S_K,
    S_LAMBDA,
    S_LOOSE,
    S_MODEL,
    S_RELAX,
    S_RHO_S,
    S_SIN,
    S_SIN_DIL,
    S_TENSION,
    SXX,
    SXY,
    SYY,
    SZZ,
    V_DLX,
    V_DLY,
    V_DSX,
    V_DSY,
    V_LX,
    V_LY,
    V_SX,
    V_SY,
    VLX,
    VLY,
    VSX,
    VSY,
    N,
    P,
    X,
    Y,
)

# Area spanned by the ways between the points' centres in opposite elements, over that of the quadrilateral, below which
# they give no slope; 4/9 where they lie in the middle of their elements.
UNKNOWN_SLOPE = 0.05
# Volume of points over area from which a quadrilateral begins to count as one without free surface, and does so fully.
HALF_FULL, FULL = 0.5, 0.75
AHEAD = 16  # points whose rows are on the way into the cache: their order is known, the machine does not guess it


@inline_kernel
def on_element(n0, n1, n2):
    """Barycentric coordinates of the point of an element's edge that stands for one a little outside."""
    n0, n1, n2 = max(n0, 0.0), max(n1, 0.0), max(n2, 0.0)
    total = n0 + n1 + n2
    return n0 / total, n1 / total, n2 / total


@inline_kernel
def gradients(g1x, g1y, g2x, g2y, v0x, v0y, v1x, v1y, v2x, v2y):
    """Velocity gradients (xx, yy, xy, yx) of an element from those of its corners [1/s]."""
    ux1, ux2, uy1, uy2 = v1x - v0x, v2x - v0x, v1y - v0y, v2y - v0y
    return g1x * ux1 + g2x * ux2, g1y * uy1 + g2y * uy2, g1y * ux1 + g2y * ux2, g1x * uy1 + g2x * uy2


@kernel_part
def fill_of_cell(first, geometry, contents):
    """Share of its area that the stresses in a quadrilateral count with, 0: with the volume of its points.

    Where ground is, the mean stress of each triangle counts with the triangle's area, not with the volume of the points
    that are in it by chance: of three points one that crosses an edge takes a third of the force along, and the ground
    answers with stresses that differ by as much. At a free surface the points of the quadrilateral count, evenly over
    its triangles; from half full to three quarters the one passes into the other. One triangle may be empty
    (`is_carried`), of two nothing is known.

    first : int
        First element of the quadrilateral.

    Source: mixed integration of the material point method, Al-Kafaji (2013), Formulation of a dynamic material point
    method for geomechanical problems, section 4.3, there from 90 % on.
    """
    volume = area = 0.0
    empty = 0
    for e in range(first, first + 4):
        empty += contents[index(e), E_VOLUME] <= 0.0
        volume += contents[index(e), E_VOLUME]
        area += geometry[index(e), 6]
    if empty > 1:
        return 0.0
    fill = min(volume / area, 1.0)
    return fill + (1.0 - fill) * min(max((fill - HALF_FULL) / (FULL - HALF_FULL), 0.0), 1.0)


@kernel_part
def fill_cell(e, start, geometry, contents):
    """Write `fill_of_cell` for all triangles of the quadrilateral of an element, if that is its first with points."""
    first = e & ~index(3)
    if start[first] == start[e]:
        fill = fill_of_cell(first, geometry, contents)
        for k in range(4):
            contents[first + index(k), E_FILL] = fill


@kernel
def fill_cells(geometry, contents):
    """Write `fill_of_cell` for all elements."""
    for first in range(0, contents.shape[0], 4):
        contents[first : first + 4, E_FILL] = fill_of_cell(index(first), geometry, contents)


@inline_kernel
def felt_share(volume, area, fill):
    """What the stresses of an element's points count with, over their volume."""
    return fill * area / volume if fill > 0.0 and volume > 0.0 else 1.0


@inline_kernel
def is_carried(e, start, fill):
    """Whether an element without points has the mean stress of those beside it, since there is ground around it."""
    return fill > 0.0 and start[e] == start[e + 1]


@kernel_part
def resolved_pressure(e, geometry, contents):
    """What the nodes feel of the pore pressure in an element: its mean, and its place and slope.

    The forces of an element are those of the sum of v p over its points, whatever each of them has. The differences are
    in the null space of the map to the nodes: no velocity answers to them, and what points bring along from other
    elements stays in it for good.

    contents : (n_elements, 5) float64, of `update_points`.

    Returns
    -------
    mean, x, y, slope_x, slope_y, share : float
        Volume mean of the pressure [Pa], at (x, y) [m]; slope [Pa/m] of the quadrilateral,
        lessened where the pressure would be negative at a corner of the element; share 0 where the quadrilateral is not
        occupied throughout, or its points lie almost on a line: nothing is known then, else 1.

    Source: Gritton & Berzins (2017), Improving accuracy in the MPM method using a null space filter.
    """
    first = e & ~index(3)
    a, b, c, d = first, first + index(1), first + index(2), first + index(3)
    va, vb, vc, vd = contents[a, E_VOLUME], contents[b, E_VOLUME], contents[c, E_VOLUME], contents[d, E_VOLUME]
    if min(va, vb, vc, vd) <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    # reciprocals: of an element's work a division is the dearest
    ia, ib, ic, id_ = 1.0 / va, 1.0 / vb, 1.0 / vc, 1.0 / vd
    ux, uy = contents[a, E_X] * ia - contents[c, E_X] * ic, contents[a, E_Y] * ia - contents[c, E_Y] * ic
    wx, wy = contents[b, E_X] * ib - contents[d, E_X] * id_, contents[b, E_Y] * ib - contents[d, E_Y] * id_
    det = ux * wy - uy * wx
    if det < UNKNOWN_SLOPE * (geometry[a, 6] + geometry[b, 6] + geometry[c, 6] + geometry[d, 6]):
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    along = (contents[a, E_PRESSURE] * ia - contents[c, E_PRESSURE] * ic) / det
    across = (contents[b, E_PRESSURE] * ib - contents[d, E_PRESSURE] * id_) / det
    sx, sy = wy * along - uy * across, ux * across - wx * along
    v = 1.0 / contents[e, E_VOLUME]
    mean, x, y = contents[e, E_PRESSURE] * v, contents[e, E_X] * v, contents[e, E_Y] * v
    g1x, g1y, g2x, g2y = geometry[e, 0], geometry[e, 1], geometry[e, 2], geometry[e, 3]
    area2 = 2.0 * geometry[e, 6]
    p0 = sx * (geometry[e, 4] - x) + sy * (geometry[e, 5] - y)
    p1 = p0 + (sx * g2y - sy * g2x) * area2
    p2 = p0 + (sy * g1x - sx * g1y) * area2
    low = -min(p0, p1, p2)
    if low > mean:
        sx *= mean / low
        sy *= mean / low
    return mean, x, y, sx, sy, 1.0


@cache
def advance_kernel(wet, undrained, tied):
    """Kernel `advance_points` for points with pore water or without, on levels tied to each other or on one.

    `undrained`: the water has the velocity of the grains.
    """
    two_phase = wet and not undrained

    @kernel_part
    def advance_points(first, last, own, system):
        """Advance point velocities and positions from the nodes and map new momenta back (MUSL).

        Velocities take `flip_of_level` of the FLIP and the rest of the PIC update; positions move with
        the solid. A pore pressure is drawn by `filter_of_level` to what the nodes feel of it (`resolved_pressure`).
        Where water is missing the pressure that acts, zero, is drawn just so: what wet points lose fills dry ones.

        first, last : range of the occupied elements;  own : the part that sums up their momenta. Written of the
        `system`: points, how full the elements are, momenta (cleared by `remap_nodes`), rows touched.

        Source: Sulsky, Zhou & Schreyer (1995) for MUSL; Zhu & Bridson (2005) for the PIC/FLIP blend.
        """
        ground, net, clock, density_liquid = system.ground, system.net, system.clock, system.medium.density_liquid
        occupied, start, order, points = ground.occupied, ground.start, ground.order, ground.points
        soil_of_point, soils = ground.soil_of_point, ground.soils
        rows, geometry, contents, level_of_element = net.rows, net.geometry, net.contents, net.level_of_element
        nodes, mean, touched, sums = net.nodes, net.tied_means, net.touched[own], net.momenta[own]
        dt_of_level, flip_of_level, filter_of_level = clock.dt_of_level, clock.flip_of_level, clock.filter_of_level
        n_nodes = index(nodes.shape[0] - mean.shape[0])
        for k in range(first, last):
            e = index(occupied[k])
            dt = dt_of_level[level_of_element[e]]
            flip_fraction, pressure_filter = flip_of_level[level_of_element[e]], filter_of_level[level_of_element[e]]
            g1x, g1y, g2x, g2y = geometry[e, 0], geometry[e, 1], geometry[e, 2], geometry[e, 3]
            x0, y0 = geometry[e, 4], geometry[e, 5]
            a, b, c = index(rows[e, 0]), index(rows[e, 1]), index(rows[e, 2])
            touched[a] = touched[b] = touched[c] = 1
            fill_cell(e, start, geometry, contents)
            border = tied and max(a, b, c) >= n_nodes
            jx0 = jx1 = jx2 = jy0 = jy1 = jy2 = 0.0
            if border:
                # points move with the mean over all steps of a node, which ends with another velocity
                if a >= n_nodes:
                    jx0, jy0 = mean[a - n_nodes, 0] - nodes[a, V_SX], mean[a - n_nodes, 1] - nodes[a, V_SY]
                if b >= n_nodes:
                    jx1, jy1 = mean[b - n_nodes, 0] - nodes[b, V_SX], mean[b - n_nodes, 1] - nodes[b, V_SY]
                if c >= n_nodes:
                    jx2, jy2 = mean[c - n_nodes, 0] - nodes[c, V_SX], mean[c - n_nodes, 1] - nodes[c, V_SY]
            pressure = px = py = slope_x = slope_y = share = 0.0
            if wet and pressure_filter > 0.0:
                pressure, px, py, slope_x, slope_y, share = resolved_pressure(e, geometry, contents)
                share *= pressure_filter
            sx0 = sx1 = sx2 = sy0 = sy1 = sy2 = lx0 = lx1 = lx2 = ly0 = ly1 = ly2 = 0.0
            pic = 1.0 - flip_fraction
            for j in range(start[e], start[e + 1]):
                i = index(order[j])
                prefetch(points, index(order[min(j + AHEAD, order.size - 1)]))
                dx = points[i, X] - x0
                dy = points[i, Y] - y0
                n1 = g1x * dx + g1y * dy
                n2 = g2x * dx + g2y * dy
                n0 = 1.0 - n1 - n2
                if tied and (n0 < 0.0 or n1 < 0.0 or n2 < 0.0):
                    n0, n1, n2 = on_element(n0, n1, n2)
                m = points[i, MASS]
                gx = n0 * nodes[a, V_SX] + n1 * nodes[b, V_SX] + n2 * nodes[c, V_SX]
                gy = n0 * nodes[a, V_SY] + n1 * nodes[b, V_SY] + n2 * nodes[c, V_SY]
                vx = points[i, VSX] + n0 * nodes[a, V_DSX] + n1 * nodes[b, V_DSX] + n2 * nodes[c, V_DSX]
                vy = points[i, VSY] + n0 * nodes[a, V_DSY] + n1 * nodes[b, V_DSY] + n2 * nodes[c, V_DSY]
                vx = flip_fraction * vx + pic * gx
                vy = flip_fraction * vy + pic * gy
                if wet:
                    w = m / (soils[index(soil_of_point[i]), S_RHO_S] * (1.0 - points[i, N])) * density_liquid
                    felt = pressure + slope_x * (points[i, X] - px) + slope_y * (points[i, Y] - py)
                    points[i, P] += share * (felt - max(points[i, P], 0.0))
                if undrained:
                    m += points[i, N] * w
                if two_phase:
                    hx = n0 * nodes[a, V_LX] + n1 * nodes[b, V_LX] + n2 * nodes[c, V_LX]
                    hy = n0 * nodes[a, V_LY] + n1 * nodes[b, V_LY] + n2 * nodes[c, V_LY]
                    ux = points[i, VLX] + n0 * nodes[a, V_DLX] + n1 * nodes[b, V_DLX] + n2 * nodes[c, V_DLX]
                    uy = points[i, VLY] + n0 * nodes[a, V_DLY] + n1 * nodes[b, V_DLY] + n2 * nodes[c, V_DLY]
                    ux = flip_fraction * ux + pic * hx
                    uy = flip_fraction * uy + pic * hy
                    # the terms of each node in the order of its sums, so that they become vectors
                    sx0 += n0 * (m * vx)
                    sy0 += n0 * (m * vy)
                    lx0 += n0 * (w * ux)
                    ly0 += n0 * (w * uy)
                    sx1 += n1 * (m * vx)
                    sy1 += n1 * (m * vy)
                    lx1 += n1 * (w * ux)
                    ly1 += n1 * (w * uy)
                    sx2 += n2 * (m * vx)
                    sy2 += n2 * (m * vy)
                    lx2 += n2 * (w * ux)
                    ly2 += n2 * (w * uy)
                    points[i, VSX], points[i, VSY], points[i, VLX], points[i, VLY] = vx, vy, ux, uy
                else:
                    sx0 += n0 * (m * vx)
                    sy0 += n0 * (m * vy)
                    sx1 += n1 * (m * vx)
                    sy1 += n1 * (m * vy)
                    sx2 += n2 * (m * vx)
                    sy2 += n2 * (m * vy)
                    points[i, VSX], points[i, VSY] = vx, vy
                    if undrained:
                        points[i, VLX], points[i, VLY] = vx, vy
                if border:
                    gx += n0 * jx0 + n1 * jx1 + n2 * jx2
                    gy += n0 * jy0 + n1 * jy1 + n2 * jy2
                points[i, X] += dt * gx
                points[i, Y] += dt * gy
            sums[a, 0] += sx0
            sums[a, 1] += sy0
            sums[b, 0] += sx1
            sums[b, 1] += sy1
            sums[c, 0] += sx2
            sums[c, 1] += sy2
            if two_phase:
                sums[a, 2] += lx0
                sums[a, 3] += ly0
                sums[b, 2] += lx1
                sums[b, 3] += ly1
                sums[c, 2] += lx2
                sums[c, 3] += ly2

    return advance_points


@cache
def node_kernel(wet, undrained):
    """Kernel `add_to_node`, what a point adds to a node, for points with pore water or without."""
    two_phase = wet and not undrained

    @inline_kernel
    def add_to_node(weight, m, vx, vy, w, pore, drag, ux, uy, row, sums):
        """Add `weight` of masses, drag and momenta of a point to a row of the nodes' sums, in place.

        m, w, pore : float
            Mass of its grains, of water as if it filled all, of its pore water [kg/m]; drag [kg/m/s].
        """
        sums[row, B_MS] += weight * m
        if wet:
            sums[row, B_ML] += weight * w
            sums[row, B_MN] += weight * pore
        if two_phase:
            sums[row, B_D] += weight * drag
        moving = m + pore if undrained else m
        sums[row, B_PSX] += weight * (moving * vx)
        sums[row, B_PSY] += weight * (moving * vy)
        if two_phase:
            sums[row, B_PLX] += weight * (w * ux)
            sums[row, B_PLY] += weight * (w * uy)

    return add_to_node


@cache
def force_kernel(wet):
    """Kernel `add_forces`, what stress and pore pressure of an element push its nodes with."""

    @inline_kernel
    def add_forces(g1x, g1y, g2x, g2y, fxx, fyy, fxy, fp, a, b, c, sums):
        """Add the forces of total stress, and of pore pressure, times volume [N m/m] to three rows, in place."""
        g0x, g0y = -g1x - g2x, -g1y - g2y
        sums[a, B_FX] -= g0x * fxx + g0y * fxy
        sums[a, B_FY] -= g0x * fxy + g0y * fyy
        sums[b, B_FX] -= g1x * fxx + g1y * fxy
        sums[b, B_FY] -= g1x * fxy + g1y * fyy
        sums[c, B_FX] -= g2x * fxx + g2y * fxy
        sums[c, B_FY] -= g2x * fxy + g2y * fyy
        if wet:
            sums[a, B_FLX] += g0x * fp
            sums[a, B_FLY] += g0y * fp
            sums[b, B_FLX] += g1x * fp
            sums[b, B_FLY] += g1y * fp
            sums[c, B_FLX] += g2x * fp
            sums[c, B_FLY] += g2y * fp

    return add_forces


@cache
def update_kernel(wet, undrained, plastic, tied):
    """Kernel `update_points` for what the scene has: pore water, plastic soils, levels.

    `undrained` pore water has the velocity of the grains: div v_s = div v_l, one momentum, no drag.
    """
    two_phase = wet and not undrained
    add_to_node, add_forces = node_kernel(wet, undrained), force_kernel(wet)

    @kernel_part
    def update_points(first, last, own, left, advance, system):
        """Advance stress, pore pressure and porosity of the points of a range of elements, and map them to the nodes.

        One pass does both, since passes over the points are what a step costs. `advance` False maps only.
        Points that left their element are not mapped; `locate` does that.

        Jaumann rate of effective stress; mass balance of the mixture for the pore pressure,
        dp/dt = -(K_w/n) [(1 - n) div v_s + n div v_l] (Jassim et al. 2013, opposite sign of p).
        A negative pore pressure is a memory of missing volume and carries nothing. Above the loose
        porosity grains do not touch: no effective stress; and while the element is not full, closing
        the air between suspended lumps builds neither stress nor pressure.

        Stress that acts on the nodes runs ahead of that of the points by `ahead` steps of the element. Held back, a
        spring feeds motion (`mpm.levels`); ahead, it damps it: a Kelvin-Voigt viscosity of that time.

        first, last : range of the occupied elements;  own : the part that sums them up. Velocities of the nodes are
        those of `remap_nodes`, contents of the elements those of the last step. Written of the `system`: points,
        contents, sums, rows touched, clamps, and -2 - element for a point that left its element.
        left : (n_points,) int32
            Written: the points that left their element.

        Returns
        -------
        moved, bad, suspended : int
            Number of points that left their element, first point with a non-finite state or -1, and
            number of suspended points.
        limit, limit_speed : float
            Smallest altitude / (wave speed + point speed) / 2^level [s] and the point speed there [m/s].
        """
        ground, net, medium, clamps = system.ground, system.net, system.medium, system.tally.clamps[own]
        occupied, start, order, points = ground.occupied, ground.start, ground.order, ground.points
        element_of_point, soil_of_point, soils = ground.element_of_point, ground.soil_of_point, ground.soils
        rows, geometry, contents, level_of_element = net.rows, net.geometry, net.contents, net.level_of_element
        nodes, touched, sums = net.nodes, net.touched[own], net.sums[own]
        dt_of_level, ahead, wave_speed = system.clock.dt_of_level, system.clock.ahead, system.pace.wave_speed
        density_liquid, bulk_liquid = medium.density_liquid, medium.bulk_liquid
        limit = np.inf
        limit_speed = 0.0
        moved = 0
        n_suspended = n_cavitated = n_floor = n_ceiling = n_tension = 0
        bad = -1
        third = 1.0 / 3.0
        for k in range(first, last):
            e = index(occupied[k])
            g1x, g1y, g2x, g2y = geometry[e, 0], geometry[e, 1], geometry[e, 2], geometry[e, 3]
            x0, y0 = geometry[e, 4], geometry[e, 5]
            dt = dt_of_level[level_of_element[e]]
            a, b, c = index(rows[e, 0]), index(rows[e, 1]), index(rows[e, 2])
            touched[a] = touched[b] = touched[c] = 1
            fxx = fxy = fyy = fp = bxx = bxy = byy = bp = total = held_x = held_y = fastest = 0.0
            rate_xx, rate_yy, xy, yx = gradients(
                g1x, g1y, g2x, g2y, nodes[a, V_SX], nodes[a, V_SY], nodes[b, V_SX], nodes[b, V_SY], nodes[c, V_SX],
                nodes[c, V_SY],
            )  # fmt: skip
            exx, eyy, exy, spin = dt * rate_xx, dt * rate_yy, 0.5 * dt * (xy + yx), 0.5 * dt * (yx - xy)
            expansion = exx + eyy
            expansion_liquid = expansion
            if two_phase:
                liquid_xx, liquid_yy, _, _ = gradients(
                    g1x, g1y, g2x, g2y, nodes[a, V_LX], nodes[a, V_LY], nodes[b, V_LX], nodes[b, V_LY], nodes[c, V_LX],
                    nodes[c, V_LY],
                )  # fmt: skip
                expansion_liquid = dt * (liquid_xx + liquid_yy)
            shrunk = 1.0 / (1.0 + expansion)
            mean = expansion * third
            equivalent = np.sqrt(2.0 * third * ((exx - mean) ** 2 + (eyy - mean) ** 2 + mean * mean + 2.0 * exy * exy))
            full = contents[e, E_VOLUME] >= geometry[e, 6]
            runs_ahead = advance and ahead[e] > 0.0
            cxx = cyy = cxy = cp = 0.0
            for j in range(start[e], start[e + 1]):
                i = index(order[j])
                prefetch(points, index(order[min(j + AHEAD, order.size - 1)]))
                s = index(soil_of_point[i])
                if runs_ahead:
                    cp = max(points[i, P], 0.0) if wet else 0.0
                    cxx, cyy, cxy = points[i, SXX] - cp, points[i, SYY] - cp, points[i, SXY]
                if advance:
                    n = points[i, N]
                    p = points[i, P]
                    points[i, EQ] += equivalent
                    if n >= soils[s, S_LOOSE] and p <= 0.0 and (expansion > 0.0 or not full):
                        # lumps with air between them: shape changes, neither grains nor water are stretched or squeezed
                        points[i, SXX] = points[i, SYY] = points[i, SZZ] = points[i, SXY] = 0.0
                        n_suspended += 1
                    else:
                        void = n
                        n = 1.0 - (1.0 - n) * shrunk
                        if n < POROSITY_FLOOR:
                            n = POROSITY_FLOOR
                            n_floor += 1
                        elif n > POROSITY_CEILING:
                            n = POROSITY_CEILING
                            n_ceiling += 1
                        if wet:
                            # the water held, n V (1 + p / K_w), changes by n V (div v_s - div v_l) dt
                            p = void * (p - bulk_liquid * expansion_liquid) - (1.0 - void) * bulk_liquid * expansion
                            p *= shrunk / n
                            points[i, P] = p
                            if p < 0.0:
                                n_cavitated += 1
                        points[i, N] = n
                        if n >= soils[s, S_LOOSE]:
                            points[i, SXX] = points[i, SYY] = points[i, SZZ] = points[i, SXY] = 0.0
                            n_suspended += 1
                        else:
                            lam, shear = soils[s, S_LAMBDA], soils[s, S_G]
                            sxx, syy, sxy = points[i, SXX], points[i, SYY], points[i, SXY]
                            turn = 2.0 * spin * sxy
                            txx = sxx - turn + lam * expansion + 2.0 * shear * exx
                            tyy = syy + turn + lam * expansion + 2.0 * shear * eyy
                            txy = sxy + spin * (sxx - syy) + 2.0 * shear * exy
                            tzz = points[i, SZZ] + lam * expansion
                            if plastic and soils[s, S_MODEL] != MODEL_ELASTIC:
                                txx, tyy, tzz, txy, cut = mohr_coulomb(
                                    txx, tyy, tzz, txy, shear, soils[s, S_K], soils[s, S_C_COS], soils[s, S_SIN],
                                    soils[s, S_SIN_DIL], soils[s, S_APEX], soils[s, S_TENSION], soils[s, S_RELAX], dt,
                                )  # fmt: skip
                                if cut > 0.0:
                                    n_tension += 1
                            points[i, SXX], points[i, SYY], points[i, SZZ], points[i, SXY] = txx, tyy, tzz, txy
                    checked = points[i, SXX] + points[i, P] + points[i, N]
                    checked += points[i, VSX] + points[i, VSY] + points[i, VLX] + points[i, VLY]
                    if bad < 0 and not np.isfinite(checked):
                        bad = np.int64(i)
                x, y = points[i, X], points[i, Y]
                n1 = g1x * (x - x0) + g1y * (y - y0)
                n2 = g2x * (x - x0) + g2y * (y - y0)
                if n1 < 0.0 or n2 < 0.0 or n1 + n2 > 1.0:
                    element_of_point[i] = -2 - np.int64(e)  # to be searched from e
                    left[moved] = i
                    moved += 1
                    continue
                m, n = points[i, MASS], points[i, N]
                v = m / (soils[s, S_RHO_S] * (1.0 - n))
                vx, vy = points[i, VSX], points[i, VSY]
                fastest = max(fastest, vx * vx + vy * vy)
                p = w = pore = drag = ux = uy = 0.0
                if wet:
                    p = max(points[i, P], 0.0)
                    w = v * density_liquid
                    pore = n * w
                    fp += v * p
                    held_x += v * x
                    held_y += v * y
                if two_phase:
                    drag = pore * soils[s, S_DRAG]
                    ux, uy = points[i, VLX], points[i, VLY]
                    fastest = max(fastest, ux * ux + uy * uy)
                add_to_node(1.0 - n1 - n2, m, vx, vy, w, pore, drag, ux, uy, a, sums)
                add_to_node(n1, m, vx, vy, w, pore, drag, ux, uy, b, sums)
                add_to_node(n2, m, vx, vy, w, pore, drag, ux, uy, c, sums)
                fxx += v * (points[i, SXX] - p)
                fyy += v * (points[i, SYY] - p)
                fxy += v * points[i, SXY]
                total += v
                if runs_ahead:
                    bxx += v * cxx
                    byy += v * cyy
                    bxy += v * cxy
                    bp += v * cp
            contents[e, E_VOLUME] = total
            if wet:
                contents[e, E_PRESSURE], contents[e, E_X], contents[e, E_Y] = fp, held_x, held_y
            fastest = np.sqrt(fastest)
            local = geometry[e, 7] / ((wave_speed + fastest) * (1 << level_of_element[e]))
            if local < limit:
                limit = local
                limit_speed = fastest
            share = felt_share(total, geometry[e, 6], contents[e, E_FILL])
            fxx, fyy, fxy, fp = share * fxx, share * fyy, share * fxy, share * fp
            if runs_ahead:
                bxx, byy, bxy, bp = share * bxx, share * byy, share * bxy, share * bp
                fxx += ahead[e] * (fxx - bxx)
                fyy += ahead[e] * (fyy - byy)
                fxy += ahead[e] * (fxy - bxy)
                fp += ahead[e] * (fp - bp)
            add_forces(g1x, g1y, g2x, g2y, fxx, fyy, fxy, fp, a, b, c, sums)
            for turn in range(1, 4, 2):  # the triangles beside it in its quadrilateral
                beside = (e & ~index(3)) + ((e + index(turn)) & index(3))
                if is_carried(beside, start, contents[e, E_FILL]):
                    share = 0.5 * geometry[beside, 6] / geometry[e, 6]
                    a, b, c = index(rows[beside, 0]), index(rows[beside, 1]), index(rows[beside, 2])
                    touched[a] = touched[b] = touched[c] = 1
                    add_forces(
                        geometry[beside, 0], geometry[beside, 1], geometry[beside, 2], geometry[beside, 3],
                        share * fxx, share * fyy, share * fxy, share * fp, a, b, c, sums,
                    )  # fmt: skip
        clamps[C_SUSPENDED] += n_suspended
        clamps[C_CAVITATED] += n_cavitated
        clamps[C_FLOOR] += n_floor
        clamps[C_CEILING] += n_ceiling
        clamps[C_TENSION] += n_tension
        return moved, bad, n_suspended, limit, limit_speed

    return update_points


@cache
def map_kernel(wet, undrained, tied):
    """Kernel `map_point` for points with pore water or without; with levels a point may wait outside its element."""
    add_to_node, add_forces = node_kernel(wet, undrained), force_kernel(wet)

    @kernel_part
    def map_point(row, soil, density_liquid, corner, geometry, fill, touched, sums):
        """Add one point to the rows of the element that holds it, as `update_points` does for those that stay.

        row, soil, corner, geometry : one row of points, soils, elements and geometry.
        fill : float
            Of the element (`fill_of_cell`); above 0 its stress is that of the points that stayed.
        Returns its larger squared speed [m2/s2].
        """
        dx = row[X] - geometry[4]
        dy = row[Y] - geometry[5]
        n1 = geometry[0] * dx + geometry[1] * dy
        n2 = geometry[2] * dx + geometry[3] * dy
        n0 = 1.0 - n1 - n2
        if tied and (n0 < 0.0 or n1 < 0.0 or n2 < 0.0):
            n0, n1, n2 = on_element(n0, n1, n2)
        m, n = row[MASS], row[N]
        v = m / (soil[S_RHO_S] * (1.0 - n))
        vx, vy = row[VSX], row[VSY]
        fastest = vx * vx + vy * vy
        p = w = pore = drag = ux = uy = 0.0
        if wet:
            p = max(row[P], 0.0)
            w = v * density_liquid
            pore = n * w
        if wet and not undrained:
            drag = pore * soil[S_DRAG]
            ux, uy = row[VLX], row[VLY]
            fastest = max(fastest, ux * ux + uy * uy)
        a, b, c = index(corner[0]), index(corner[1]), index(corner[2])
        touched[a] = touched[b] = touched[c] = 1
        add_to_node(n0, m, vx, vy, w, pore, drag, ux, uy, a, sums)
        add_to_node(n1, m, vx, vy, w, pore, drag, ux, uy, b, sums)
        add_to_node(n2, m, vx, vy, w, pore, drag, ux, uy, c, sums)
        if fill <= 0.0:
            add_forces(
                geometry[0], geometry[1], geometry[2], geometry[3], v * (row[SXX] - p), v * (row[SYY] - p),
                v * row[SXY], v * p, a, b, c, sums,
            )  # fmt: skip
        return fastest

    return map_point
