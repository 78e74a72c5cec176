"""Points to nodes and back: the kernels of a step that pass over the points, element by element.

Each kernel works on a range of the list of occupied elements and writes only to rows that these
elements own, so ranges may run in any number of threads with the same bits. Shape functions are
those of the linear triangle; `geometry` rows hold (g1x, g1y, g2x, g2y, x0, y0, area, height).

Arrays are read as `points[i, X]`, never through a row `points[i]` taken in a loop over points: numba counts the
references of every such view, and the two calls a point cost as much as its arithmetic.
"""

from functools import cache

import numpy as np

from mpm.jit import index, inline_kernel, kernel_part, prefetch
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
    B_Q,
    C_CAVITATED,
    C_CEILING,
    C_FLOOR,
    C_SUSPENDED,
    C_TENSION,
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
    S_N0,
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
    V_GX,
    V_GY,
    V_LX,
    V_LY,
    V_P,
    V_SX,
    V_SY,
    V_TS,
    V_WL,
    V_WS,
    VLX,
    VLY,
    VSX,
    VSY,
    N,
    P,
    X,
    Y,
)

AHEAD = 16  # points whose rows are on the way into the cache: their order is known, the machine does not guess it
# Share of the squared altitude: the shortest wave of the mesh loses most of its amplitude in a step, none overshoots.
PROJECTION_SMOOTHING = 0.1


@inline_kernel
def on_element(n0, n1, n2):
    """Barycentric coordinates of the point of an element's edge that stands for one a little outside."""
    n0, n1, n2 = max(n0, 0.0), max(n1, 0.0), max(n2, 0.0)
    total = n0 + n1 + n2
    return n0 / total, n1 / total, n2 / total


@inline_kernel
def spread_volume(volume, area, fill0, fill1, fill2):
    """Volume of an element with what its points have too much or too little of it shared with those around [m2].

    How many points an element holds is chance. Where they fill the elements around all nodes, the mean of what nodes
    hold is the better measure: else water would flow from elements with many points to those with few, and be lost.
    """
    inside = min(fill0, fill1, fill2, 1.0)
    return (1.0 - inside) * volume + inside * area * (fill0 + fill1 + fill2) / 3.0


@inline_kernel
def gradients(g1x, g1y, g2x, g2y, v0x, v0y, v1x, v1y, v2x, v2y):
    """Velocity gradients (xx, yy, xy, yx) of an element from those of its corners [1/s]."""
    ux1, ux2, uy1, uy2 = v1x - v0x, v2x - v0x, v1y - v0y, v2y - v0y
    return g1x * ux1 + g2x * ux2, g1y * uy1 + g2y * uy2, g1y * ux1 + g2y * ux2, g1x * uy1 + g2x * uy2


@cache
def advance_kernel(wet, undrained, tied, remapping):
    """Kernel `advance_points` for points with pore water or without, on levels tied to each other or on one.

    `undrained`: the water has the velocity of the grains. Without `remapping` no momenta are mapped back.
    """
    two_phase = wet and not undrained

    @kernel_part
    def advance_points(
        first, last, occupied, start, order, points, soil_of_point, soils, density_liquid, rows, geometry, nodes,
        mean, level_of_element, dt_of_level, flip_of_level, filter_of_level, touched, sums,
    ):  # fmt: skip
        """Advance point velocities and positions from the nodes and, with remapping, map new momenta back (MUSL).

        Velocities take `flip_of_level` of the FLIP and the rest of the PIC update; positions move with
        the solid. A pore pressure is drawn by `filter_of_level` towards its projection on continuous
        linear functions: what such a function can represent is left as it is. Where water is missing
        the pressure that acts, zero, is drawn just so: what wet points lose fills dry ones.

        mean : (n_rows - n_nodes, 6) float64
            Of rows tied to a finer one: mean velocities over the steps of their node, of :mod:`mpm.contact`.
        touched : (n_rows,) uint8
            Set for the rows of these elements.
        sums : (n_rows, 9) float64
            Added to its first columns, with remapping: the new momenta of both phases, or of the mixture [kg m/s per
            metre]. `remap_nodes` reads and clears them before `element_rates` adds to the same rows.

        Source: Sulsky, Zhou & Schreyer (1995) for MUSL; Zhu & Bridson (2005) for the PIC/FLIP blend.
        """
        n_nodes = index(nodes.shape[0] - mean.shape[0])
        for k in range(first, last):
            e = index(occupied[k])
            dt = dt_of_level[level_of_element[e]]
            flip_fraction, pressure_filter = flip_of_level[level_of_element[e]], filter_of_level[level_of_element[e]]
            g1x, g1y, g2x, g2y = geometry[e, 0], geometry[e, 1], geometry[e, 2], geometry[e, 3]
            x0, y0 = geometry[e, 4], geometry[e, 5]
            a, b, c = index(rows[e, 0]), index(rows[e, 1]), index(rows[e, 2])
            touched[a] = touched[b] = touched[c] = 1
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
                    smooth = n0 * nodes[a, V_P] + n1 * nodes[b, V_P] + n2 * nodes[c, V_P]
                    points[i, P] += pressure_filter * (smooth - max(points[i, P], 0.0))
                if undrained:
                    m += points[i, N] * w
                if two_phase:
                    hx = n0 * nodes[a, V_LX] + n1 * nodes[b, V_LX] + n2 * nodes[c, V_LX]
                    hy = n0 * nodes[a, V_LY] + n1 * nodes[b, V_LY] + n2 * nodes[c, V_LY]
                    ux = points[i, VLX] + n0 * nodes[a, V_DLX] + n1 * nodes[b, V_DLX] + n2 * nodes[c, V_DLX]
                    uy = points[i, VLY] + n0 * nodes[a, V_DLY] + n1 * nodes[b, V_DLY] + n2 * nodes[c, V_DLY]
                    ux = flip_fraction * ux + pic * hx
                    uy = flip_fraction * uy + pic * hy
                    if remapping:
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
                    if remapping:
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
            if remapping:
                sums[a, 0] += sx0
                sums[a, 1] += sy0
                if two_phase:
                    sums[a, 2] += lx0
                    sums[a, 3] += ly0
                sums[b, 0] += sx1
                sums[b, 1] += sy1
                if two_phase:
                    sums[b, 2] += lx1
                    sums[b, 3] += ly1
                sums[c, 0] += sx2
                sums[c, 1] += sy2
                if two_phase:
                    sums[c, 2] += lx2
                    sums[c, 3] += ly2

    return advance_points


@cache
def rates_kernel(wet, undrained):
    """Kernel `element_rates` for points with pore water or without, `undrained` where it moves with the grains."""

    @kernel_part
    def element_rates(first, last, occupied, rows, geometry, nodes, volume, fill, sums):
        """Sum the divergences of the remapped velocities, constant in an element, at its nodes [1/s].

        volume : (n_elements, 2) float64, of `update_points`.
        fill : (n_rows,) float64
            Volume over area of the elements with points around a row, of :func:`mpm.contact.smooth_rates`.
        sums : (n_rows, 9) float64
            Added: volume and volume times the divergence of the grains; volume under pore pressure, and
            this times the divergence of the grains, as spread (`spread_volume`) times that of the water relative to
            them, and times the gradient of the projected pore pressure; that volume as spread; area.
        """
        for k in range(first, last):
            e = index(occupied[k])
            g1x, g1y, g2x, g2y = geometry[e, 0], geometry[e, 1], geometry[e, 2], geometry[e, 3]
            a, b, c = index(rows[e, 0]), index(rows[e, 1]), index(rows[e, 2])
            xx, yy, _, _ = gradients(
                g1x, g1y, g2x, g2y, nodes[a, V_SX], nodes[a, V_SY], nodes[b, V_SX], nodes[b, V_SY], nodes[c, V_SX],
                nodes[c, V_SY],
            )  # fmt: skip
            divergence = xx + yy
            v = volume[e, 0]
            area = geometry[e, 6] if v > 0.0 else 0.0
            for d in (a, b, c):
                sums[d, 0] += v
                sums[d, 1] += v * divergence
                sums[d, 8] += area
            if wet:
                relative = 0.0
                if not undrained:
                    xx, yy, _, _ = gradients(
                        g1x, g1y, g2x, g2y, nodes[a, V_LX], nodes[a, V_LY], nodes[b, V_LX], nodes[b, V_LY],
                        nodes[c, V_LX], nodes[c, V_LY],
                    )  # fmt: skip
                    relative = xx + yy - divergence
                pressed = volume[e, 1]
                spread = pressed
                if v > 0.0:
                    spread *= spread_volume(v, geometry[e, 6], fill[a], fill[b], fill[c]) / v
                p1, p2 = nodes[b, V_P] - nodes[a, V_P], nodes[c, V_P] - nodes[a, V_P]
                px, py = pressed * (g1x * p1 + g2x * p2), pressed * (g1y * p1 + g2y * p2)
                for d in (a, b, c):
                    sums[d, 2] += pressed
                    sums[d, 3] += pressed * divergence
                    if not undrained:
                        sums[d, 4] += spread * relative
                    sums[d, 5] += px
                    sums[d, 6] += py
                    sums[d, 7] += spread

    return element_rates


@cache
def update_kernel(wet, undrained, plastic, smoothing, dilatant, tied):
    """Kernel `update_points` for what the scene has: pore water, plastic or dilatant soils, smoothed volume changes.

    `undrained` pore water has the velocity of the grains: div v_s = div v_l, one momentum, no drag.

    A dilatant soil's skeleton takes the rates of its own element. Plastic volume from shear differs between elements,
    and so does the stress that follows; smoothed rates give no resistance to the motions that this drives, which grow.
    """
    two_phase = wet and not undrained

    @kernel_part
    def update_points(
        first, last, occupied, start, order, points, soil_of_point, soils, density_liquid, bulk_liquid, rows,
        geometry, nodes, volume, fill, level_of_element, dt_of_level, ahead, advance, wave_speed,
        element_of_point, clamps, touched, sums, left,
    ):  # fmt: skip
        """Advance stress, pore pressure and porosity of the points of a range of elements, and map them to the nodes.

        One pass does both, since passes over the points are what a step costs. `advance` False maps only.
        Points that left their element are not mapped; `locate` does that.

        Jaumann rate of effective stress; mass balance of the mixture for the pore pressure,
        dp/dt = -(K_w/n) [(1 - n) div v_s + n div v_l] (Jassim et al. 2013, opposite sign of p).
        A negative pore pressure is a memory of missing volume and carries nothing. Above the loose
        porosity grains do not touch: no effective stress; and while the element is not full, closing
        the air between suspended lumps builds neither stress nor pressure.

        Parameters
        ----------
        nodes : (n_rows, 16) float64
            Their velocities are those of `element_rates`: strain rates are computed again, memory is dearer.
        volume : (n_elements, 2) float64
            Material volume, and that of points under pore pressure [m2]; read of the last and written for the
            next step.
        fill : (n_rows,) float64
            Volume over area of the elements with points around a row.
        ahead : (n_elements,) float64
            How far the stress that acts on the nodes runs ahead of that of the points, in steps of the element.
        element_of_point : (n_points,) int32
            Written: -2 - element for a point that left its element.
        touched : (n_rows,) uint8
            Set for the rows of these elements.
        sums : (n_rows, 13) float64
            Added: masses, momenta, drag and forces of these elements.
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
            i0, i1, i2 = index(rows[e, 0]), index(rows[e, 1]), index(rows[e, 2])
            touched[i0] = touched[i1] = touched[i2] = 1
            ms0 = ms1 = ms2 = ml0 = ml1 = ml2 = mn0 = mn1 = mn2 = d0 = d1 = d2 = q0 = q1 = q2 = 0.0
            sx0 = sx1 = sx2 = sy0 = sy1 = sy2 = lx0 = lx1 = lx2 = ly0 = ly1 = ly2 = 0.0
            fxx = fxy = fyy = fp = total = pressed = fastest = 0.0
            p0 = p1 = p2 = px = py = 0.0
            rate_xx, rate_yy, xy, yx = gradients(
                g1x, g1y, g2x, g2y, nodes[i0, V_SX], nodes[i0, V_SY], nodes[i1, V_SX], nodes[i1, V_SY],
                nodes[i2, V_SX], nodes[i2, V_SY],
            )  # fmt: skip
            ts = rate_xx + rate_yy
            own_s = dt * ts
            if smoothing:
                ts = third * (nodes[i0, V_TS] + nodes[i1, V_TS] + nodes[i2, V_TS])
            if wet:
                p0, p1, p2 = nodes[i0, V_P], nodes[i1, V_P], nodes[i2, V_P]
                # gradient of the projected pressure, less its nodal mean: zero for a linear pressure
                px = g1x * (p1 - p0) + g2x * (p2 - p0) - third * (nodes[i0, V_GX] + nodes[i1, V_GX] + nodes[i2, V_GX])
                py = g1y * (p1 - p0) + g2y * (p2 - p0) - third * (nodes[i0, V_GY] + nodes[i1, V_GY] + nodes[i2, V_GY])
                own_l = own_s
                if two_phase:
                    liquid_xx, liquid_yy, _, _ = gradients(
                        g1x, g1y, g2x, g2y, nodes[i0, V_LX], nodes[i0, V_LY], nodes[i1, V_LX], nodes[i1, V_LY],
                        nodes[i2, V_LX], nodes[i2, V_LY],
                    )  # fmt: skip
                    own_l = dt * (liquid_xx + liquid_yy)
                wet_s, wet_l = own_s, own_l
                if smoothing and volume[e, 1] > 0.0:
                    wet_s = wet_l = dt * third * (nodes[i0, V_WS] + nodes[i1, V_WS] + nodes[i2, V_WS])
                if smoothing and two_phase and volume[e, 1] > 0.0:
                    wet_l = dt * third * (nodes[i0, V_WL] + nodes[i1, V_WL] + nodes[i2, V_WL])
            correction = 0.5 * (ts - (rate_xx + rate_yy))
            exx = dt * (rate_xx + correction)
            eyy = dt * (rate_yy + correction)
            exy = 0.5 * dt * (xy + yx)
            spin = 0.5 * dt * (yx - xy)
            ts *= dt
            mean = ts * third
            equivalent = np.sqrt(2.0 * third * ((exx - mean) ** 2 + (eyy - mean) ** 2 + mean * mean + 2.0 * exy * exy))
            full = volume[e, 0] >= geometry[e, 6]
            border = tied and ahead[e] > 0.0
            cxx = cyy = cxy = cp = 0.0
            for j in range(start[e], start[e + 1]):
                i = index(order[j])
                prefetch(points, index(order[min(j + AHEAD, order.size - 1)]))
                s = index(soil_of_point[i])
                dxx, dyy, dvol = exx, eyy, ts
                if dilatant and soils[s, S_SIN_DIL] > 0.0:
                    dxx, dyy, dvol = dt * rate_xx, dt * rate_yy, own_s
                if border:
                    before = max(points[i, P], 0.0) if wet else 0.0
                    cxx, cyy, cxy, cp = points[i, SXX] - before, points[i, SYY] - before, points[i, SXY], before
                if advance:
                    n = points[i, N]
                    p = points[i, P]
                    loose = n >= soils[s, S_LOOSE]
                    points[i, EQ] += equivalent
                    es = own_s
                    if wet and p > 0.0:
                        es = wet_s
                    if loose and p <= 0.0 and (own_s > 0.0 or not full):
                        # lumps with air between them: shape changes, neither grains nor water are stretched or squeezed
                        points[i, SXX] = points[i, SYY] = points[i, SZZ] = points[i, SXY] = 0.0
                        n_suspended += 1
                    else:
                        if wet:
                            # missing water constrains nothing, so nothing locks: it is remembered by the element's
                            # own rates, which are what moves its points
                            el = wet_l if p > 0.0 else own_l
                            p -= bulk_liquid / n * ((1.0 - n) * es + n * el)
                            points[i, P] = p
                            if p < 0.0:
                                n_cavitated += 1
                        # looser than in the ground, grains close up by what moves them; else with the skeleton's strain
                        change = es if n > soils[s, S_N0] else dvol
                        n = 1.0 - (1.0 - n) / (1.0 + change)
                        if n < POROSITY_FLOOR:
                            n = POROSITY_FLOOR
                            n_floor += 1
                        elif n > POROSITY_CEILING:
                            n = POROSITY_CEILING
                            n_ceiling += 1
                        points[i, N] = n
                        if n >= soils[s, S_LOOSE]:
                            points[i, SXX] = points[i, SYY] = points[i, SZZ] = points[i, SXY] = 0.0
                            n_suspended += 1
                        else:
                            lam, shear = soils[s, S_LAMBDA], soils[s, S_G]
                            sxx, syy, sxy = points[i, SXX], points[i, SYY], points[i, SXY]
                            turn = 2.0 * spin * sxy
                            txx = sxx - turn + lam * dvol + 2.0 * shear * dxx
                            tyy = syy + turn + lam * dvol + 2.0 * shear * dyy
                            txy = sxy + spin * (sxx - syy) + 2.0 * shear * exy
                            tzz = points[i, SZZ] + lam * dvol
                            if plastic and soils[s, S_MODEL] != MODEL_ELASTIC:
                                txx, tyy, tzz, txy, cut = mohr_coulomb(
                                    txx, tyy, tzz, txy, shear, soils[s, S_K], soils[s, S_C_COS], soils[s, S_SIN],
                                    soils[s, S_SIN_DIL], soils[s, S_APEX], soils[s, S_TENSION],
                                )  # fmt: skip
                                if cut > 0.0:
                                    n_tension += 1
                            points[i, SXX], points[i, SYY], points[i, SZZ], points[i, SXY] = txx, tyy, tzz, txy
                    checked = points[i, SXX] + points[i, P] + points[i, N]
                    checked += points[i, VSX] + points[i, VSY] + points[i, VLX] + points[i, VLY]
                    if bad < 0 and not np.isfinite(checked):
                        bad = np.int64(i)
                dx = points[i, X] - x0
                dy = points[i, Y] - y0
                n1 = g1x * dx + g1y * dy
                n2 = g2x * dx + g2y * dy
                if n1 < 0.0 or n2 < 0.0 or n1 + n2 > 1.0:
                    element_of_point[i] = -2 - np.int64(e)  # to be searched from e
                    left[moved] = i
                    moved += 1
                    continue
                n0 = 1.0 - n1 - n2
                m, n = points[i, MASS], points[i, N]
                v = m / (soils[s, S_RHO_S] * (1.0 - n))
                vx, vy = points[i, VSX], points[i, VSY]
                fastest = max(fastest, vx * vx + vy * vy)
                p = 0.0
                if wet:
                    p = max(points[i, P], 0.0)
                    pressed += v if p > 0.0 else 0.0
                    excess = v * (p - (n0 * p0 + n1 * p1 + n2 * p2))
                    fp += v * p
                    w = v * density_liquid
                    pore = n * w
                if undrained:
                    ms0 += n0 * m
                    ml0 += n0 * w
                    mn0 += n0 * pore
                    q0 += n0 * excess
                    ms1 += n1 * m
                    ml1 += n1 * w
                    mn1 += n1 * pore
                    q1 += n1 * excess
                    ms2 += n2 * m
                    ml2 += n2 * w
                    mn2 += n2 * pore
                    q2 += n2 * excess
                    m += pore
                    sx0 += n0 * (m * vx)
                    sy0 += n0 * (m * vy)
                    sx1 += n1 * (m * vx)
                    sy1 += n1 * (m * vy)
                    sx2 += n2 * (m * vx)
                    sy2 += n2 * (m * vy)
                elif wet:
                    drag = pore * soils[s, S_DRAG]
                    ux, uy = points[i, VLX], points[i, VLY]
                    fastest = max(fastest, ux * ux + uy * uy)
                    # the terms of each node in the order of its sums, so that they become vectors
                    ms0 += n0 * m
                    ml0 += n0 * w
                    mn0 += n0 * pore
                    d0 += n0 * drag
                    sx0 += n0 * (m * vx)
                    sy0 += n0 * (m * vy)
                    lx0 += n0 * (w * ux)
                    ly0 += n0 * (w * uy)
                    q0 += n0 * excess
                    ms1 += n1 * m
                    ml1 += n1 * w
                    mn1 += n1 * pore
                    d1 += n1 * drag
                    sx1 += n1 * (m * vx)
                    sy1 += n1 * (m * vy)
                    lx1 += n1 * (w * ux)
                    ly1 += n1 * (w * uy)
                    q1 += n1 * excess
                    ms2 += n2 * m
                    ml2 += n2 * w
                    mn2 += n2 * pore
                    d2 += n2 * drag
                    sx2 += n2 * (m * vx)
                    sy2 += n2 * (m * vy)
                    lx2 += n2 * (w * ux)
                    ly2 += n2 * (w * uy)
                    q2 += n2 * excess
                else:
                    ms0 += n0 * m
                    sx0 += n0 * (m * vx)
                    sy0 += n0 * (m * vy)
                    ms1 += n1 * m
                    sx1 += n1 * (m * vx)
                    sy1 += n1 * (m * vy)
                    ms2 += n2 * m
                    sx2 += n2 * (m * vx)
                    sy2 += n2 * (m * vy)
                fxx += v * (points[i, SXX] - p)
                fyy += v * (points[i, SYY] - p)
                fxy += v * points[i, SXY]
                total += v
                if border:
                    w = ahead[e] * v
                    fxx += w * (points[i, SXX] - p - cxx)
                    fyy += w * (points[i, SYY] - p - cyy)
                    fxy += w * (points[i, SXY] - cxy)
                    if wet:
                        fp += w * (p - cp)
            volume[e, 0] = total
            volume[e, 1] = pressed
            fastest = np.sqrt(fastest)
            local = geometry[e, 7] / ((wave_speed + fastest) * (1 << level_of_element[e]))
            if local < limit:
                limit = local
                limit_speed = fastest
            g0x, g0y = -g1x - g2x, -g1y - g2y
            if wet:
                if smoothing and total > 0.0:
                    fp *= spread_volume(total, geometry[e, 6], fill[i0], fill[i1], fill[i2]) / total
                # the smallest of the element's nodal shares of volume: a node that hardly touches it is not overdrawn
                share = 3.0 * min(ml0, ml1, ml2) / (density_liquid * total) if total > 0.0 else 0.0
                damped = PROJECTION_SMOOTHING * geometry[e, 7] ** 2 * share * pressed
                sums[i0, B_MS] += ms0
                sums[i0, B_ML] += ml0
                sums[i0, B_MN] += mn0
                if two_phase:
                    sums[i0, B_D] += d0
                    sums[i0, B_PLX] += lx0
                    sums[i0, B_PLY] += ly0
                sums[i0, B_PSX] += sx0
                sums[i0, B_PSY] += sy0
                sums[i0, B_Q] += q0 - damped * (g0x * px + g0y * py)
                sums[i0, B_FX] -= g0x * fxx + g0y * fxy
                sums[i0, B_FY] -= g0x * fxy + g0y * fyy
                sums[i0, B_FLX] += g0x * fp
                sums[i0, B_FLY] += g0y * fp
                sums[i1, B_MS] += ms1
                sums[i1, B_ML] += ml1
                sums[i1, B_MN] += mn1
                if two_phase:
                    sums[i1, B_D] += d1
                    sums[i1, B_PLX] += lx1
                    sums[i1, B_PLY] += ly1
                sums[i1, B_PSX] += sx1
                sums[i1, B_PSY] += sy1
                sums[i1, B_Q] += q1 - damped * (g1x * px + g1y * py)
                sums[i1, B_FX] -= g1x * fxx + g1y * fxy
                sums[i1, B_FY] -= g1x * fxy + g1y * fyy
                sums[i1, B_FLX] += g1x * fp
                sums[i1, B_FLY] += g1y * fp
                sums[i2, B_MS] += ms2
                sums[i2, B_ML] += ml2
                sums[i2, B_MN] += mn2
                if two_phase:
                    sums[i2, B_D] += d2
                    sums[i2, B_PLX] += lx2
                    sums[i2, B_PLY] += ly2
                sums[i2, B_PSX] += sx2
                sums[i2, B_PSY] += sy2
                sums[i2, B_Q] += q2 - damped * (g2x * px + g2y * py)
                sums[i2, B_FX] -= g2x * fxx + g2y * fxy
                sums[i2, B_FY] -= g2x * fxy + g2y * fyy
                sums[i2, B_FLX] += g2x * fp
                sums[i2, B_FLY] += g2y * fp
            else:
                sums[i0, B_MS] += ms0
                sums[i0, B_PSX] += sx0
                sums[i0, B_PSY] += sy0
                sums[i0, B_FX] -= g0x * fxx + g0y * fxy
                sums[i0, B_FY] -= g0x * fxy + g0y * fyy
                sums[i1, B_MS] += ms1
                sums[i1, B_PSX] += sx1
                sums[i1, B_PSY] += sy1
                sums[i1, B_FX] -= g1x * fxx + g1y * fxy
                sums[i1, B_FY] -= g1x * fxy + g1y * fyy
                sums[i2, B_MS] += ms2
                sums[i2, B_PSX] += sx2
                sums[i2, B_PSY] += sy2
                sums[i2, B_FX] -= g2x * fxx + g2y * fxy
                sums[i2, B_FY] -= g2x * fxy + g2y * fyy
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

    @kernel_part
    def map_point(row, soil, density_liquid, corner, geometry, nodes, touched, sums):
        """Add one point to the rows of the element that holds it, as `update_points` does for those that stay.

        row, soil, corner, geometry : one row of points, soils, elements and geometry.
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
        p = max(row[P], 0.0) if wet else 0.0
        fxx, fyy, fxy = v * (row[SXX] - p), v * (row[SYY] - p), v * row[SXY]
        fastest = row[VSX] ** 2 + row[VSY] ** 2
        if wet:
            fastest = max(fastest, row[VLX] ** 2 + row[VLY] ** 2)
            excess = p - n0 * nodes[corner[0], V_P] - n1 * nodes[corner[1], V_P] - n2 * nodes[corner[2], V_P]
        for k in range(3):
            if k == 0:
                weight, gx, gy = n0, -geometry[0] - geometry[2], -geometry[1] - geometry[3]
            elif k == 1:
                weight, gx, gy = n1, geometry[0], geometry[1]
            else:
                weight, gx, gy = n2, geometry[2], geometry[3]
            touched[corner[k]] = 1
            b = sums[corner[k]]
            b[B_MS] += weight * m
            moving = weight * (m + n * v * density_liquid) if undrained else weight * m
            b[B_PSX] += moving * row[VSX]
            b[B_PSY] += moving * row[VSY]
            b[B_FX] -= gx * fxx + gy * fxy
            b[B_FY] -= gx * fxy + gy * fyy
            if wet:
                w = weight * v * density_liquid
                b[B_ML] += w
                b[B_MN] += n * w
                b[B_Q] += weight * v * excess
                if not undrained:
                    b[B_D] += n * soil[S_DRAG] * w
                    b[B_PLX] += w * row[VLX]
                    b[B_PLY] += w * row[VLY]
                b[B_FLX] += gx * v * p
                b[B_FLY] += gy * v * p
        return fastest

    return map_point
