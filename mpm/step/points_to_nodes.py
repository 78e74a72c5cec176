"""Points to nodes: the pass of a step that strains the points and sums their masses, momenta and forces at the nodes.

Each kernel works on a range of the list of occupied elements and writes only to rows that these elements own, so ranges
may run in any number of threads with the same bits. Shape functions are those of the linear triangle.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from mpm.fields import POROSITY_CEILING, POROSITY_FLOOR
from mpm.laws.law import stress_kernel
from mpm.laws.stress import Strain, Stress
from mpm.machine.compile import index, inline_kernel, kernel_part, prefetch
from mpm.step.cells import felt_share, is_carried
from mpm.step.nodes_to_points import AHEAD, on_element, shares


class Push(NamedTuple):
    """Total stress and pore pressure of an element, times volume [N m/m]."""

    xx: float
    yy: float
    xy: float
    pressure: float


@inline_kernel
def gradients(shape, x0, y0, x1, y1, x2, y2):
    """Velocity gradients (xx, yy, xy, yx) of an element from the velocities of its corners [1/s]."""
    ux1, ux2, uy1, uy2 = x1 - x0, x2 - x0, y1 - y0, y2 - y0
    xx, yy = shape.dn1_dx * ux1 + shape.dn2_dx * ux2, shape.dn1_dy * uy1 + shape.dn2_dy * uy2
    return xx, yy, shape.dn1_dy * ux1 + shape.dn2_dy * ux2, shape.dn1_dx * uy1 + shape.dn2_dx * uy2


@cache
def strain_kernel(needs):
    """Kernel `strain_of_element` for what a scene needs."""
    two_phase = needs.two_phase

    @kernel_part
    def strain_of_element(shape, a, b, c, dt):
        """Strain increments of an element in dt from its nodes a, b, c: :class:`mpm.laws.stress.Strain`."""
        third = 1.0 / 3.0
        rate_xx, rate_yy, xy, yx = gradients(
            shape, a.velocity_solid_x, a.velocity_solid_y, b.velocity_solid_x, b.velocity_solid_y, c.velocity_solid_x,
            c.velocity_solid_y,
        )  # fmt: skip
        exx, eyy, exy, spin = dt * rate_xx, dt * rate_yy, 0.5 * dt * (xy + yx), 0.5 * dt * (yx - xy)
        expansion = exx + eyy
        expansion_liquid = expansion
        if two_phase:
            liquid_xx, liquid_yy, _, _ = gradients(
                shape, a.velocity_liquid_x, a.velocity_liquid_y, b.velocity_liquid_x, b.velocity_liquid_y,
                c.velocity_liquid_x, c.velocity_liquid_y,
            )  # fmt: skip
            expansion_liquid = dt * (liquid_xx + liquid_yy)
        mean = expansion * third
        equivalent = np.sqrt(2.0 * third * ((exx - mean) ** 2 + (eyy - mean) ** 2 + mean * mean + 2.0 * exy * exy))
        return Strain(exx, eyy, exy, spin, expansion, expansion_liquid, 1.0 / (1.0 + expansion), equivalent)

    return strain_of_element


@inline_kernel
def release(point):
    """Take the effective stress from a point."""
    point.stress_xx = point.stress_yy = point.stress_zz = point.stress_xy = 0.0


@inline_kernel
def turned(point, spin):
    """Effective stress of a point, turned with the material (Jaumann rate)."""
    turn = 2.0 * spin * point.stress_xy
    across = point.stress_xy + spin * (point.stress_xx - point.stress_yy)
    return Stress(point.stress_xx - turn, point.stress_yy + turn, point.stress_zz, across)


@cache
def state_kernel(needs):
    """Kernel `advance_state` for what a scene needs."""
    wet, new_stress = needs.wet, stress_kernel(needs.laws)

    @kernel_part
    def advance_state(point, soil, strain, full, dt, bulk_liquid, clamps):
        """Advance porosity, pore pressure and effective stress of a point by the strain of its element, in place.

        Mass balance of the mixture for the pore pressure, dp/dt = -(K_w/n) [(1 - n) div v_s + n div v_l] (Jassim et
        al. 2013, opposite sign of p). A negative pore pressure is a memory of missing volume and carries nothing. Above
        the loose porosity grains do not touch: no effective stress; and while the element is not `full`, closing the
        air between suspended lumps builds neither stress nor pressure.

        Returns whether the grains of the point are suspended.
        """
        void = point.porosity
        point.deviatoric_strain += strain.equivalent
        if void >= soil.loose_porosity and point.pore_pressure <= 0.0 and (strain.expansion > 0.0 or not full):
            # lumps with air between them: shape changes, neither grains nor water are stretched or squeezed
            release(point)
            return True
        n = 1.0 - (1.0 - void) * strain.shrunk
        if n < POROSITY_FLOOR:
            n = POROSITY_FLOOR
            clamps.porosity_floor += 1
        elif n > POROSITY_CEILING:
            n = POROSITY_CEILING
            clamps.porosity_ceiling += 1
        if wet:
            # the water held, n V (1 + p / K_w), changes by n V (div v_s - div v_l) dt
            p = void * (point.pore_pressure - bulk_liquid * strain.expansion_liquid)
            p -= (1.0 - void) * bulk_liquid * strain.expansion
            p *= strain.shrunk / n
            point.pore_pressure = p
            if p < 0.0:
                clamps.cavitated += 1
        point.porosity = n
        if n >= soil.loose_porosity:
            release(point)
            return True
        stress, at_tip = new_stress(turned(point, strain.spin), strain, point, soil, dt)
        if at_tip:
            clamps.tension += 1
        point.stress_xx, point.stress_yy, point.stress_zz, point.stress_xy = stress
        return False

    return advance_state


@inline_kernel
def is_finite(point):
    """Whether the state of a point is."""
    total = point.stress_xx + point.pore_pressure + point.porosity
    total += point.velocity_solid_x + point.velocity_solid_y + point.velocity_liquid_x + point.velocity_liquid_y
    return np.isfinite(total)


@cache
def point_kernel(needs):
    """Kernel `add_point` for what a scene needs."""
    wet, two_phase = needs.wet, needs.two_phase
    undrained = wet and not two_phase

    @inline_kernel
    def add_to_node(row, share, m, w, pore, drag, point):
        """Add a share of masses, drag and momenta of a point to a row of the nodes' sums, in place.

        m, w, pore : float
            Mass of its grains, of water as if it filled all, of its pore water [kg/m]; drag [kg/m/s].
        """
        row.mass_solid += share * m
        if wet:
            row.mass_liquid += share * w
            row.mass_pore_liquid += share * pore
        if two_phase:
            row.drag += share * drag
        moving = m + pore if undrained else m
        row.momentum_solid_x += share * (moving * point.velocity_solid_x)
        row.momentum_solid_y += share * (moving * point.velocity_solid_y)
        if two_phase:
            row.momentum_liquid_x += share * (w * point.velocity_liquid_x)
            row.momentum_liquid_y += share * (w * point.velocity_liquid_y)

    @kernel_part
    def add_point(point, soil, n0, n1, n2, a, b, c, density_liquid):
        """Add masses, drag and momenta of a point to the rows of its element's corners.

        Returns
        -------
        volume, squared_speed : float
            [m2], of the faster phase [m2/s2]
        """
        m, n = point.grain_mass, point.porosity
        v = m / (soil.grain_density * (1.0 - n))
        fastest = point.velocity_solid_x * point.velocity_solid_x + point.velocity_solid_y * point.velocity_solid_y
        w = pore = drag = 0.0
        if wet:
            w = v * density_liquid
            pore = n * w
        if two_phase:
            drag = pore * soil.drag
            ux, uy = point.velocity_liquid_x, point.velocity_liquid_y
            fastest = max(fastest, ux * ux + uy * uy)
        add_to_node(a, n0, m, w, pore, drag, point)
        add_to_node(b, n1, m, w, pore, drag, point)
        add_to_node(c, n2, m, w, pore, drag, point)
        return v, fastest

    return add_point


@cache
def force_kernel(wet):
    """Kernel `add_forces`, what stress and pore pressure of an element push its nodes with."""

    @inline_kernel
    def add_force(row, gx, gy, push):
        """Subtract the push of a shape function's gradient."""
        row.force_x -= gx * push.xx + gy * push.xy
        row.force_y -= gx * push.xy + gy * push.yy
        if wet:
            row.force_liquid_x += gx * push.pressure
            row.force_liquid_y += gy * push.pressure

    @kernel_part
    def add_forces(shape, push, a, b, c):
        """Add the forces of total stress, and of pore pressure, times volume to three rows, in place."""
        add_force(a, -shape.dn1_dx - shape.dn2_dx, -shape.dn1_dy - shape.dn2_dy, push)
        add_force(b, shape.dn1_dx, shape.dn1_dy, push)
        add_force(c, shape.dn2_dx, shape.dn2_dy, push)

    return add_forces


@inline_kernel
def scaled(push, factor):
    """A push times a factor."""
    return Push(factor * push.xx, factor * push.yy, factor * push.xy, factor * push.pressure)


@inline_kernel
def run_ahead(push, before, ahead):
    """A push ahead of itself by so many steps, from what it was `before` the last one."""
    return Push(
        push.xx + ahead * (push.xx - before.xx), push.yy + ahead * (push.yy - before.yy),
        push.xy + ahead * (push.xy - before.xy), push.pressure + ahead * (push.pressure - before.pressure),
    )  # fmt: skip


@inline_kernel
def with_point(push, volume, point, p):
    """A push with the total stress of one more point, whose pore pressure p acts."""
    return Push(
        push.xx + volume * (point.stress_xx - p), push.yy + volume * (point.stress_yy - p),
        push.xy + volume * point.stress_xy, push.pressure + volume * p,
    )  # fmt: skip


@cache
def push_kernel(wet):
    """Kernel `push_nodes` for soil with pore water or without."""
    add_forces = force_kernel(wet)

    @kernel_part
    def push_nodes(e, push, before, runs_ahead, own, system):
        """Add the forces of an element's stress, and of an empty one's beside it that is carried, to their nodes."""
        net, ahead, sums, touched = system.net, system.clock.ahead[e], system.net.sums[own], system.net.touched[own]
        held, shape = net.contents[e], net.geometry[e]
        share = felt_share(held.volume, shape.area, held.fill)
        push = scaled(push, share)
        if runs_ahead:
            push = run_ahead(push, scaled(before, share), ahead)
        add_forces(shape, push, sums[index(net.rows[e, 0])], sums[index(net.rows[e, 1])], sums[index(net.rows[e, 2])])
        for turn in range(1, 4, 2):  # the triangles beside it in its quadrilateral
            beside = (e & ~index(3)) + ((e + index(turn)) & index(3))
            if is_carried(beside, system.ground.start, held.fill):
                a, b, c = index(net.rows[beside, 0]), index(net.rows[beside, 1]), index(net.rows[beside, 2])
                touched[a] = touched[b] = touched[c] = 1
                area = 0.5 * net.geometry[beside].area / shape.area
                add_forces(net.geometry[beside], scaled(push, area), sums[a], sums[b], sums[c])

    return push_nodes


@cache
def element_kernel(needs):
    """Kernel `update_element` for what a scene needs."""
    wet = needs.wet
    strain_of_element, advance_state = strain_kernel(needs), state_kernel(needs)
    add_point, push_nodes = point_kernel(needs), push_kernel(needs.wet)

    @kernel_part
    def update_element(e, left, moved, advance, own, system):
        """`update_points` for one element; returns its fastest point [m/s] too."""
        ground, net, clamps = system.ground, system.net, system.tally.clamps[own]
        shape, held, sums, touched = net.geometry[e], net.contents[e], net.sums[own], net.touched[own]
        ia, ib, ic = index(net.rows[e, 0]), index(net.rows[e, 1]), index(net.rows[e, 2])
        touched[ia] = touched[ib] = touched[ic] = 1
        dt = system.clock.dt_of_level[net.level_of_element[e]]
        strain = strain_of_element(shape, net.nodes[ia], net.nodes[ib], net.nodes[ic], dt)
        full, runs_ahead = held.volume >= shape.area, advance and system.clock.ahead[e] > 0.0
        push = before = Push(0.0, 0.0, 0.0, 0.0)
        total = x = y = fastest = 0.0
        suspended, bad = 0, -1
        for j in range(ground.start[e], ground.start[e + 1]):
            i = index(ground.order[j])
            prefetch(ground.points, index(ground.order[min(j + AHEAD, ground.order.size - 1)]))
            point, soil = ground.points[i], ground.soils[index(ground.soil_of_point[i])]
            if runs_ahead:
                p = max(point.pore_pressure, 0.0) if wet else 0.0
                earlier = Push(point.stress_xx - p, point.stress_yy - p, point.stress_xy, p)
            if advance:
                suspended += advance_state(point, soil, strain, full, dt, system.medium.bulk_liquid, clamps)
                if bad < 0 and not is_finite(point):
                    bad = np.int64(i)
            n0, n1, n2 = shares(point, shape)
            if n1 < 0.0 or n2 < 0.0 or n1 + n2 > 1.0:
                ground.element_of_point[i] = -2 - np.int64(e)  # to be searched from e
                left[moved] = i
                moved += 1
                continue
            v, speed = add_point(point, soil, n0, n1, n2, sums[ia], sums[ib], sums[ic], system.medium.density_liquid)
            fastest = max(fastest, speed)
            push = with_point(push, v, point, max(point.pore_pressure, 0.0) if wet else 0.0)
            total += v
            if wet:
                x += v * point.x
                y += v * point.y
            if runs_ahead:
                before = Push(
                    before.xx + v * earlier.xx, before.yy + v * earlier.yy, before.xy + v * earlier.xy,
                    before.pressure + v * earlier.pressure,
                )  # fmt: skip
        held.volume = total
        if wet:
            held.pressure, held.x, held.y = push.pressure, x, y
        clamps.suspended += suspended
        push_nodes(e, push, before, runs_ahead, own, system)
        return moved, bad, suspended, np.sqrt(fastest)

    return update_element


@cache
def update_kernel(needs):
    """Kernel `update_points` for what a scene needs (`mpm.step.system.Needs`)."""
    update_element = element_kernel(needs)

    @inline_kernel
    def update_points(first, last, own, left, advance, system):
        """Advance stress, pore pressure and porosity of the points of a range of elements, and map them to the nodes.

        One pass does both, since passes over the points are what a step costs. `advance` False maps only.
        Points that left their element are not mapped; `locate` does that.

        Stress that acts on the nodes runs ahead of that of the points by `ahead` steps of the element. Held back, a
        spring feeds motion (`mpm.time_step.levels`); ahead, it damps it: a Kelvin-Voigt viscosity of that time.

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
        limit, limit_speed = np.inf, 0.0
        moved, suspended, bad = 0, 0, -1
        for k in range(first, last):
            e = index(system.ground.occupied[k])
            moved, wrong, loose, fastest = update_element(e, left, moved, advance, own, system)
            suspended += loose
            bad = wrong if bad < 0 else bad
            local = time_limit(e, fastest, system)
            if local < limit:
                limit, limit_speed = local, fastest
        return moved, bad, suspended, limit, limit_speed

    return update_points


@inline_kernel
def time_limit(e, fastest, system):
    """Altitude of an element over the speed of waves and of its fastest point [m/s], in steps of level 0 [s]."""
    level = system.net.level_of_element[e]
    return system.net.geometry[e].altitude / ((system.pace.wave_speed + fastest) * (1 << level))


@cache
def map_kernel(needs):
    """Kernel `map_point` for what a scene needs; with levels a point may wait outside its element."""
    wet, tied = needs.wet, needs.tied
    add_point, add_forces = point_kernel(needs), force_kernel(needs.wet)

    @kernel_part
    def map_point(i, e, own, system):
        """Add one point to the rows of the element that holds it, as `update_points` does for those that stay.

        Where stress counts with area it is that of the points that stayed. Returns the larger speed [m/s].
        """
        ground, net, sums = system.ground, system.net, system.net.sums[own]
        point, soil, shape = ground.points[i], ground.soils[ground.soil_of_point[i]], net.geometry[e]
        n0, n1, n2 = shares(point, shape)
        if tied and (n0 < 0.0 or n1 < 0.0 or n2 < 0.0):
            n0, n1, n2 = on_element(n0, n1, n2)
        ia, ib, ic = index(net.rows[e, 0]), index(net.rows[e, 1]), index(net.rows[e, 2])
        touched = net.touched[own]
        touched[ia] = touched[ib] = touched[ic] = 1
        a, b, c = sums[ia], sums[ib], sums[ic]
        v, fastest = add_point(point, soil, n0, n1, n2, a, b, c, system.medium.density_liquid)
        if net.contents[e].fill <= 0.0:
            p = max(point.pore_pressure, 0.0) if wet else 0.0
            add_forces(shape, with_point(Push(0.0, 0.0, 0.0, 0.0), v, point, p), a, b, c)
        return np.sqrt(fastest)

    return map_point
