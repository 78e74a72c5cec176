"""Nodes: the passes of a step that advance their velocities, and find them anew from those of the points (MUSL)."""

from functools import cache
from typing import NamedTuple

from mpm.fields import MIRROR_X, OPEN_X, OPEN_Y
from mpm.machine.compile import inline_kernel, kernel_part
from mpm.step.constraints import constrained, held_kernel, past_held_grains
from mpm.walls.contact import Masses, Pair, contact_kernel, free_pair, in_wall_frame


class Forces(NamedTuple):
    """On mixture and water of a node, by stress and pore pressure alone [N/m]."""

    x: float
    y: float
    liquid_x: float
    liquid_y: float


@cache
def sum_kernel(needs):
    """Kernel `sum_of_node` for what a scene needs."""
    wet, two_phase = needs.wet, needs.two_phase

    @kernel_part
    def sum_of_node(i, dt, net, walls):
        """Masses (with drag times dt), momenta and forces of a node: all parts of all its rows."""
        ms = ml = mn = drag = psx = psy = plx = ply = fx = fy = flx = fly = 0.0
        r = i
        while r >= 0:
            for part in range(net.sums.shape[0]):
                if net.touched[part, r] == 0:
                    continue
                row = net.sums[part, r]
                ms += row.mass_solid
                psx += row.momentum_solid_x
                psy += row.momentum_solid_y
                fx += row.force_x
                fy += row.force_y
                if wet:
                    ml += row.mass_liquid
                    mn += row.mass_pore_liquid
                    flx += row.force_liquid_x
                    fly += row.force_liquid_y
                if two_phase:
                    drag += row.drag
                    plx += row.momentum_liquid_x
                    ply += row.momentum_liquid_y
            r = net.next_row[r]
        if two_phase and walls.fixed[i] & (OPEN_X | OPEN_Y):
            flx += walls.sides[i].push_x
            fly += walls.sides[i].push_y
        if walls.fixed[i] & MIRROR_X:  # the mirror image's momentum is the opposite
            psx = plx = 0.0
        if wet and not two_phase:
            ms += mn  # grains and water move as one
        return Masses(ms, ml, mn, dt * drag), Pair(psx, psy, plx, ply), Forces(fx, fy, flx, fly)

    return sum_of_node


@cache
def free_kernel(needs):
    """Kernel `without_reactions` for what a scene needs."""
    two_phase = needs.two_phase

    @inline_kernel
    def without_reactions(m, p, u, force, dt, gravity):
        """Momenta at the end of a step without reactions of walls [kg/s]; p, u : Pair, at its beginning."""
        if two_phase:
            return Pair(
                p.solid_x + m.pore * u.liquid_x + dt * force.x,
                p.solid_y + m.pore * u.liquid_y + dt * (force.y - (m.solid + m.pore) * gravity),
                p.liquid_x + dt * force.liquid_x,
                p.liquid_y + dt * (force.liquid_y - m.liquid * gravity),
            )
        return Pair(p.solid_x + dt * force.x, p.solid_y + dt * (force.y - m.solid * gravity), 0.0, 0.0)

    return without_reactions


@inline_kernel
def velocities_of(m, momentum, two_phase):
    """Velocities of the momenta of a node."""
    if two_phase:
        return Pair(
            momentum.solid_x / m.solid, momentum.solid_y / m.solid, momentum.liquid_x / m.liquid,
            momentum.liquid_y / m.liquid,
        )  # fmt: skip
    return Pair(momentum.solid_x / m.solid, momentum.solid_y / m.solid, 0.0, 0.0)


@inline_kernel
def moved(b, m, x, y):
    """Momenta as seen from a wall that moves with (x, y) [m/s]."""
    both = m.solid + m.pore
    return Pair(b.solid_x - both * x, b.solid_y - both * y, b.liquid_x - m.liquid * x, b.liquid_y - m.liquid * y)


@inline_kernel
def shifted(v, x, y):
    """Velocities plus (x, y)."""
    return Pair(v.solid_x + x, v.solid_y + y, v.liquid_x + x, v.liquid_y + y)


@kernel_part
def stop_rows(i, net):
    """No velocity at a node without mass, on none of its rows."""
    r = i
    while r >= 0:
        node = net.nodes[r]
        node.velocity_solid_x = node.velocity_solid_y = node.velocity_liquid_x = node.velocity_liquid_y = 0.0
        node.change_solid_x = node.change_solid_y = node.change_liquid_x = node.change_liquid_y = 0.0
        if r >= net.which_node.size:
            clear_mean(net.tied_means[r - net.which_node.size])
        r = net.next_row[r]


@inline_kernel
def clear_mean(mean):
    """Begin the mean over a step of a tied row."""
    mean.solid_x = mean.solid_y = 0.0
    mean.remapped_solid_x = mean.remapped_solid_y = mean.remapped_liquid_x = mean.remapped_liquid_y = 0.0


@cache
def wall_kernel(needs):
    """Kernel `velocity_at_wall` for what a scene needs."""
    two_phase, moving, at_wall = needs.two_phase, needs.moving, contact_kernel(needs)
    undrained = needs.wet and not two_phase

    @kernel_part
    def velocity_at_wall(i, c, b, m, u, force, dt, walls, ledger, system):
        """Velocities of a node at a wall; its reactions go to the wall's impulse, what they leave to the ledger."""
        contact, impulse, gravity = walls.contact[c], walls.impulse[c], system.medium.gravity
        x, y = (walls.velocity[c, 0], walls.velocity[c, 1]) if moving else (0.0, 0.0)
        if moving:
            b = moved(b, m, x, y)
        water = 0.0
        if undrained:
            wx, wy = m.liquid * u.solid_x + dt * force.liquid_x, m.liquid * u.solid_y
            wy += dt * (force.liquid_y - m.liquid * gravity)
            water = -(contact.normal_x * wx + contact.normal_y * wy)
        v, reaction = at_wall(b, m, water, contact)
        system.net.status[i] = reaction.status
        impulse.soil += reaction.soil
        impulse.water += reaction.water
        impulse.shear += reaction.shear
        impulse.soil_squared += reaction.soil * reaction.soil / dt
        impulse.water_squared += reaction.water * reaction.water / dt
        # change of the momentum that reactions, stress and weight do not make up
        push = reaction.soil + reaction.water
        rx, ry = in_wall_frame(push, reaction.shear, contact)
        pore = m.pore if two_phase else 0.0
        ledger.unexplained += abs(m.solid * v.solid_x + pore * v.liquid_x - b.solid_x - rx)
        ledger.unexplained += abs(m.solid * v.solid_y + pore * v.liquid_y - b.solid_y - ry)
        ledger.reactions += push
        return shifted(v, x, y) if moving else v

    return velocity_at_wall


@cache
def set_kernel(two_phase):
    """Kernel `set_velocity` for one velocity or two."""

    @inline_kernel
    def set_velocity(node, v, ux, uy, wx, wy):
        """The velocities of a node at the end of its step, and what they changed by from u, w."""
        node.velocity_solid_x, node.velocity_solid_y = v.solid_x, v.solid_y
        node.change_solid_x += v.solid_x - ux
        node.change_solid_y += v.solid_y - uy
        if two_phase:
            node.velocity_liquid_x, node.velocity_liquid_y = v.liquid_x, v.liquid_y
            node.change_liquid_x += v.liquid_x - wx
            node.change_liquid_y += v.liquid_y - wy

    return set_velocity


@cache
def follow_kernel(needs):
    """Kernel `follow_node` for what a scene needs."""
    two_phase, set_velocity = needs.two_phase, set_kernel(needs.two_phase)
    undrained = needs.wet and not two_phase

    @kernel_part
    def follow_node(i, v, u, dt, begun, net, dt_of_level):
        """Rows of a node that are tied to its finest one: mean velocity, change, and momenta of the parts."""
        r = net.next_row[i]
        while r >= 0:
            node, mean = net.nodes[r], net.tied_means[r - net.which_node.size]
            if net.level_of_row[r] <= begun:
                clear_mean(mean)
                node.change_solid_x = node.change_solid_y = node.change_liquid_x = node.change_liquid_y = 0.0
            share = dt / dt_of_level[net.level_of_row[r]]
            mean.solid_x += share * v.solid_x
            mean.solid_y += share * v.solid_y
            set_velocity(node, v, u.solid_x, u.solid_y, u.liquid_x, u.liquid_y)
            for part in range(net.sums.shape[0]):
                row = net.sums[part, r]
                held = row.mass_solid + row.mass_pore_liquid if undrained else row.mass_solid
                row.momentum_solid_x += held * (v.solid_x - u.solid_x)
                row.momentum_solid_y += held * (v.solid_y - u.solid_y)
                if two_phase:
                    row.momentum_liquid_x += row.mass_liquid * (v.liquid_x - u.liquid_x)
                    row.momentum_liquid_y += row.mass_liquid * (v.liquid_y - u.liquid_y)
            r = net.next_row[r]

    return follow_node


@cache
def book_kernel(two_phase):
    """Kernel `book` for one velocity or two."""

    @kernel_part
    def book(m, v, u, force, dt, gravity, ledger):
        """Add to the ledger what a node's step has changed, with the mean velocities of the step: with them work is the
        change of kinetic energy, whatever the time step.
        """
        sx, sy = 0.5 * (u.solid_x + v.solid_x), 0.5 * (u.solid_y + v.solid_y)
        dx, dy = m.solid * (v.solid_x - u.solid_x), m.solid * (v.solid_y - u.solid_y)
        kinetic, weight = sx * dx + sy * dy, m.solid * sy
        work = sx * force.x + sy * force.y
        if two_phase:
            lx, ly = 0.5 * (u.liquid_x + v.liquid_x), 0.5 * (u.liquid_y + v.liquid_y)
            wx, wy = m.pore * (v.liquid_x - u.liquid_x), m.pore * (v.liquid_y - u.liquid_y)
            kinetic += lx * wx + ly * wy
            weight += m.pore * ly
            share = m.pore / m.liquid
            work += share * ((lx - sx) * force.liquid_x + (ly - sy) * force.liquid_y)
            slip = (v.liquid_x - v.solid_x) * (sx - lx) + (v.liquid_y - v.solid_y) * (sy - ly)
            ledger.drag += share * m.drag * slip
            dx += wx
            dy += wy
        ledger.momentum_x += dx
        ledger.momentum_y += dy
        ledger.kinetic += kinetic
        ledger.gravity -= dt * gravity * weight
        ledger.stress += dt * work

    return book


@cache
def solve_kernel(needs):
    """Kernel `solve_nodes` for what a scene needs (`mpm.step.system.Needs`)."""
    two_phase, tied = needs.two_phase, needs.tied
    sum_of_node, without_reactions, velocity_at_wall = sum_kernel(needs), free_kernel(needs), wall_kernel(needs)
    set_velocity, follow_node, book = set_kernel(two_phase), follow_kernel(needs), book_kernel(two_phase)

    @kernel_part
    def solve_node(i, begun, ledger, system):
        """`solve_nodes` for one node."""
        net, walls, gravity = system.net, system.walls, system.medium.gravity
        dt = system.clock.dt_of_level[net.level_of_row[i]]
        node, c = net.nodes[i], walls.contact_of_node[i]
        m, momentum, force = sum_of_node(i, dt, net, walls)
        net.status[i] = 0
        node.mass_solid, node.mass_liquid = m.solid, m.liquid
        if m.solid <= 0.0 or (two_phase and m.liquid <= 0.0):
            node.mass_solid = 0.0
            stop_rows(i, net)
            return
        u = velocities_of(m, momentum, two_phase)
        b = without_reactions(m, momentum, u, force, dt, gravity)
        if c >= 0 and walls.contact[c].active > 0.0:
            v = velocity_at_wall(i, c, b, m, u, force, dt, walls, ledger, system)
        elif two_phase:
            sx, lx = free_pair(b.solid_x, b.liquid_x, m)
            sy, ly = free_pair(b.solid_y, b.liquid_y, m)
            v = Pair(sx, sy, lx, ly)
        else:
            v = Pair(b.solid_x / m.solid, b.solid_y / m.solid, 0.0, 0.0)
        if two_phase and walls.fixed[i] & (OPEN_X | OPEN_Y):
            v, side = past_held_grains(v, b, m, walls.fixed[i]), walls.sides[i]
            through = v.liquid_x * side.area_x + v.liquid_y * side.area_y
            ledger.recharge += dt * system.medium.density_liquid * m.pore / m.liquid * through
        v = constrained(v, walls.fixed[i])
        node.change_solid_x = node.change_solid_y = node.change_liquid_x = node.change_liquid_y = 0.0
        set_velocity(node, v, u.solid_x, u.solid_y, u.liquid_x, u.liquid_y)
        if tied:
            follow_node(i, v, u, dt, begun, net, system.clock.dt_of_level)
        book(m, v, u, force, dt, gravity, ledger)

    @inline_kernel
    def solve_nodes(first, last, own, begun, system):
        """Add up the parts of a range of nodes and advance both phases by the time step of each node's finest level.

        first, last : range of `net.which_node`;  own : part of the ledger;  begun : levels up to it begin a step now.
        Written of the `system`: velocities, increments, masses and status of the nodes, means and momenta of rows tied
        to a finer one, which follow the node, the walls' impulse, the ledger. Where grains and water move as one, or
        there is no water, the first velocity is that of all, and the second stays as it is.
        """
        for k in range(first, last):
            solve_node(system.net.which_node[k], begun, system.tally.ledger[own], system)

    return solve_nodes


@cache
def remap_kernel(needs):
    """Kernel `remap_nodes` for what a scene needs (`mpm.step.system.Needs`)."""
    two_phase, moving, tied, held_at_wall = needs.two_phase, needs.moving, needs.tied, held_kernel(needs.two_phase)

    @kernel_part
    def new_momentum(i, finished, net):
        """Momenta of a node: new ones of rows that finish a step, of which sums and momenta are cleared."""
        sx = sy = lx = ly = 0.0
        r = i
        while r >= 0:
            done = net.level_of_row[r] <= finished
            for part in range(net.momenta.shape[0]):
                if net.touched[part, r] == 0:
                    continue
                if done:
                    new = net.momenta[part, r]
                    sx += new.solid_x
                    sy += new.solid_y
                    if two_phase:
                        lx += new.liquid_x
                        ly += new.liquid_y
                    net.touched[part, r] = 0
                    net.momenta[part, r] = net.empty_momentum[0]
                    net.sums[part, r] = net.empty_sum[0]
                else:
                    row = net.sums[part, r]
                    sx += row.momentum_solid_x
                    sy += row.momentum_solid_y
                    if two_phase:
                        lx += row.momentum_liquid_x
                        ly += row.momentum_liquid_y
            r = net.next_row[r]
        return Pair(sx, sy, lx, ly)

    @kernel_part
    def remap_node(i, finished, system):
        """`remap_nodes` for one node."""
        net, walls, node = system.net, system.walls, system.net.nodes[i]
        momentum = new_momentum(i, finished, net)
        if node.mass_solid <= 0.0:
            return
        v = velocities_of(Masses(node.mass_solid, node.mass_liquid, 0.0, 0.0), momentum, two_phase)
        c = walls.contact_of_node[i]
        if c >= 0 and walls.contact[c].active > 0.0:
            if moving:
                v = shifted(v, -walls.velocity[c, 0], -walls.velocity[c, 1])
            v = held_at_wall(v, net.status[i], walls.contact[c])
            if moving:
                v = shifted(v, walls.velocity[c, 0], walls.velocity[c, 1])
        v = constrained(v, walls.fixed[i])
        node.velocity_solid_x, node.velocity_solid_y = v.solid_x, v.solid_y
        if two_phase:
            node.velocity_liquid_x, node.velocity_liquid_y = v.liquid_x, v.liquid_y
        if tied:
            remap_tied_rows(i, v, finished, net, system.clock.dt_of_level)

    @inline_kernel
    def remap_nodes(first, last, finished, system):
        """Nodal velocities from the updated point momenta (MUSL), under the constraints that acted in this step.

        Rows of levels up to `finished` have new momenta; the others keep the node's, which `solve_nodes` has followed
        in `sums`, and their own velocities become the mean over their step when it ends. `momenta`, `sums` and
        `touched` are cleared where they have been read, for `update_points`.
        """
        for k in range(first, last):
            remap_node(system.net.which_node[k], finished, system)

    return remap_nodes


@kernel_part
def remap_tied_rows(i, v, finished, net, dt_of_level):
    """Mean over their own step of the remapped velocity of the node that rows are tied to."""
    r = net.next_row[i]
    while r >= 0:
        node, mean = net.nodes[r], net.tied_means[r - net.which_node.size]
        share = dt_of_level[net.level_of_row[i]] / dt_of_level[net.level_of_row[r]]
        mean.remapped_solid_x += share * v.solid_x
        mean.remapped_solid_y += share * v.solid_y
        mean.remapped_liquid_x += share * v.liquid_x
        mean.remapped_liquid_y += share * v.liquid_y
        if net.level_of_row[r] <= finished:
            node.velocity_solid_x, node.velocity_solid_y = mean.remapped_solid_x, mean.remapped_solid_y
            node.velocity_liquid_x, node.velocity_liquid_y = mean.remapped_liquid_x, mean.remapped_liquid_y
        r = net.next_row[r]
