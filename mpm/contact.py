"""Node equations of both phases with implicit drag, box boundaries and contact with the lining.

Per node the unknown velocities solve, each component on its own,
    (M_l + dt D) v_l' - dt D v_s' = M_l v_l + dt F_l + dt R_l
    M_s v_s' + M_nl v_l'          = M_s v_s + M_nl v_l + dt F_mix + dt (R_l + R_s)
with the reactions R of an impermeable, rough, unilateral wall: for each phase either the normal
velocity is zero and the reaction pushes, or there is no reaction and the phase leaves the wall.
As a linear complementarity problem its matrix has positive principal minors, so exactly one of
the four cases holds. Drag is implicit: no permeability limits the time step.
"""

from functools import cache

from mpm.jit import inline_kernel, kernel_part
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
    BUFFER_WIDTH,
    NODAL_MOMENTA,
    V_DLX,
    V_DLY,
    V_DSX,
    V_DSY,
    V_LX,
    V_LY,
    V_ML,
    V_MS,
    V_SX,
    V_SY,
)

FIXED_X, FIXED_Y, MIRROR_X = 1, 2, 4
SOLID_HELD, SOLID_STICKS, LIQUID_HELD = 1, 2, 4


@inline_kernel
def free_pair(b_s, b_l, ms, ml, mn, d):
    """Velocities (solid, liquid) of one component without reactions; d = dt D."""
    vs = (b_s - mn * b_l / (ml + d)) / (ms + mn * d / (ml + d))
    return vs, (b_l + d * vs) / (ml + d)


@kernel_part
def wall_normal(b_s, b_l, ms, ml, mn, d, dt):
    """Normal velocities (solid, liquid) and reactions (effective, water) at a wall [N per metre]."""
    r_l = -b_l / dt
    r_s = -b_s / dt - r_l
    if r_l >= 0.0 and r_s >= 0.0:
        return 0.0, 0.0, r_s, r_l
    vs = (b_s - b_l) / (ms + d)  # grains leave, water is held
    r_l = -(d * vs + b_l) / dt
    if vs >= 0.0 and r_l >= 0.0:
        return vs, 0.0, 0.0, r_l
    vl = b_l / (ml + d)  # water leaves, grains are held
    r_s = (mn * vl - b_s) / dt
    if vl >= 0.0 and r_s >= 0.0:
        return 0.0, vl, r_s, 0.0
    vs, vl = free_pair(b_s, b_l, ms, ml, mn, d)
    return vs, vl, 0.0, 0.0


@kernel_part
def stop_rows(i, next_row, nodes, mean):
    """No velocity at a node without mass, on none of its rows."""
    n_nodes = nodes.shape[0] - mean.shape[0]
    r = i
    while r >= 0:
        for column in range(V_SX, V_DLY + 1):
            nodes[r, column] = 0.0
        if r >= n_nodes:
            for column in range(mean.shape[1]):
                mean[r - n_nodes, column] = 0.0
        r = next_row[r]


@kernel_part
def solve_nodes(first, last, own, begun, wall, system):
    """Add up the parts of a range of nodes and advance both phases by the time step of each node's finest level.

    first, last : range of `net.which_node`;  own : part of the ledger;  begun : levels up to it begin a step now;
    wall : its velocity, of `system.walls` (an argument, so that None compiles its motion out).
    Written of the `system`: velocities, increments, masses and status of the nodes, means and momenta of rows tied to a
    finer one, which follow the node, the walls' impulse, the ledger.
    """
    net, walls, dt_of_level, gravity = system.net, system.walls, system.clock.dt_of_level, system.medium.gravity
    which, next_row, level_of_row, touched, sums = (
        net.which_node, net.next_row, net.level_of_row, net.touched, net.sums,
    )  # fmt: skip
    nodes, mean, status, ledger = net.nodes, net.tied_means, net.status, system.tally.ledger[own]
    fixed, contact_of_node, impulse = walls.fixed, walls.contact_of_node, walls.impulse
    normal, active, friction = walls.normal, walls.active, walls.friction
    px = py = kinetic = by_gravity = by_drag = by_stress = unfelt = reactions = 0.0
    n_nodes = nodes.shape[0] - mean.shape[0]
    for k in range(first, last):
        i = which[k]
        dt = dt_of_level[level_of_row[i]]
        ms = ml = mn = dd = psx = psy = plx = ply = fx = fy = flx = fly = 0.0
        r = i
        while r >= 0:
            for part in range(sums.shape[0]):
                if touched[part, r] == 0:
                    continue
                ms += sums[part, r, B_MS]
                ml += sums[part, r, B_ML]
                mn += sums[part, r, B_MN]
                dd += sums[part, r, B_D]
                psx += sums[part, r, B_PSX]
                psy += sums[part, r, B_PSY]
                plx += sums[part, r, B_PLX]
                ply += sums[part, r, B_PLY]
                fx += sums[part, r, B_FX]
                fy += sums[part, r, B_FY]
                flx += sums[part, r, B_FLX]
                fly += sums[part, r, B_FLY]
            r = next_row[r]
        if fixed[i] & MIRROR_X:  # the mirror image's momentum is the opposite
            psx = plx = 0.0
        nodes[i, V_MS] = ms
        nodes[i, V_ML] = ml
        status[i] = 0
        if ms <= 0.0 or ml <= 0.0:
            nodes[i, V_MS] = 0.0
            stop_rows(i, next_row, nodes, mean)
            continue
        grid_x, grid_y, water_x, water_y = fx, fy, flx, fly  # of stresses alone
        fy -= (ms + mn) * gravity
        fly -= ml * gravity
        ux, uy, wx, wy = psx / ms, psy / ms, plx / ml, ply / ml
        bsx = psx + mn * wx + dt * fx
        bsy = psy + mn * wy + dt * fy
        blx = plx + dt * flx
        bly = ply + dt * fly
        d = dt * dd
        c = contact_of_node[i]
        if c >= 0 and active[c]:
            nx, ny = normal[c, 0], normal[c, 1]
            if wall is not None:  # momenta and velocities as seen from the wall
                bsx -= (ms + mn) * wall[c, 0]
                bsy -= (ms + mn) * wall[c, 1]
                blx -= ml * wall[c, 0]
                bly -= ml * wall[c, 1]
            bsn, bln = nx * bsx + ny * bsy, nx * blx + ny * bly
            bst, blt = ny * bsx - nx * bsy, ny * blx - nx * bly
            vsn, vln, r_s, r_l = wall_normal(bsn, bln, ms, ml, mn, d, dt)
            shear = 0.0
            if r_s > 0.0:
                vlt = blt / (ml + d)
                vst = 0.0
                shear = (mn * vlt - bst) / dt
                limit = friction[c] * r_s
                if abs(shear) > limit:
                    shear = limit if shear > 0.0 else -limit
                    vst, vlt = free_pair(bst + dt * shear, blt, ms, ml, mn, d)
                else:
                    status[i] |= SOLID_STICKS
                status[i] |= SOLID_HELD
            else:
                vst, vlt = free_pair(bst, blt, ms, ml, mn, d)
            if r_l > 0.0:
                status[i] |= LIQUID_HELD
            vsx, vsy = nx * vsn + ny * vst, ny * vsn - nx * vst
            vlx, vly = nx * vln + ny * vlt, ny * vln - nx * vlt
            impulse[c, 0] += dt * r_s
            impulse[c, 1] += dt * r_l
            impulse[c, 2] += dt * shear
            impulse[c, 3] += dt * r_s * r_s
            impulse[c, 4] += dt * r_l * r_l
            # change of the momentum that reactions, stress and weight do not make up
            unfelt += abs(ms * vsx + mn * vlx - bsx - dt * (nx * (r_s + r_l) + ny * shear))
            unfelt += abs(ms * vsy + mn * vly - bsy - dt * (ny * (r_s + r_l) - nx * shear))
            reactions += dt * (r_s + r_l)
            if wall is not None:
                vsx += wall[c, 0]
                vsy += wall[c, 1]
                vlx += wall[c, 0]
                vly += wall[c, 1]
        else:
            vsx, vlx = free_pair(bsx, blx, ms, ml, mn, d)
            vsy, vly = free_pair(bsy, bly, ms, ml, mn, d)
        if fixed[i] & FIXED_X:
            vsx = vlx = 0.0
        if fixed[i] & FIXED_Y:
            vsy = vly = 0.0
        nodes[i, V_SX], nodes[i, V_SY], nodes[i, V_LX], nodes[i, V_LY] = vsx, vsy, vlx, vly
        nodes[i, V_DSX], nodes[i, V_DSY] = vsx - ux, vsy - uy
        nodes[i, V_DLX], nodes[i, V_DLY] = vlx - wx, vly - wy
        r = next_row[i]
        while r >= 0:
            t = r - n_nodes
            if level_of_row[r] <= begun:
                for column in range(mean.shape[1]):
                    mean[t, column] = 0.0
                nodes[r, V_DSX] = nodes[r, V_DSY] = nodes[r, V_DLX] = nodes[r, V_DLY] = 0.0
            share = dt / dt_of_level[level_of_row[r]]
            mean[t, 0] += share * vsx
            mean[t, 1] += share * vsy
            nodes[r, V_SX], nodes[r, V_SY], nodes[r, V_LX], nodes[r, V_LY] = vsx, vsy, vlx, vly
            nodes[r, V_DSX] += vsx - ux
            nodes[r, V_DSY] += vsy - uy
            nodes[r, V_DLX] += vlx - wx
            nodes[r, V_DLY] += vly - wy
            for part in range(sums.shape[0]):
                sums[part, r, B_PSX] += sums[part, r, B_MS] * (vsx - ux)
                sums[part, r, B_PSY] += sums[part, r, B_MS] * (vsy - uy)
                sums[part, r, B_PLX] += sums[part, r, B_ML] * (vlx - wx)
                sums[part, r, B_PLY] += sums[part, r, B_ML] * (vly - wy)
            r = next_row[r]
        # mean velocities of the step: with them work is the change of kinetic energy, whatever the time step
        sx, sy, lx, ly = 0.5 * (ux + vsx), 0.5 * (uy + vsy), 0.5 * (wx + vlx), 0.5 * (wy + vly)
        share = mn / ml
        px += ms * (vsx - ux) + mn * (vlx - wx)
        py += ms * (vsy - uy) + mn * (vly - wy)
        kinetic += ms * (sx * (vsx - ux) + sy * (vsy - uy)) + mn * (lx * (vlx - wx) + ly * (vly - wy))
        by_gravity -= dt * gravity * (ms * sy + mn * ly)
        by_drag += share * d * ((vlx - vsx) * (sx - lx) + (vly - vsy) * (sy - ly))
        by_stress += dt * (sx * (grid_x - share * water_x) + sy * (grid_y - share * water_y))
        by_stress += dt * share * (lx * water_x + ly * water_y)
    ledger[0] += px
    ledger[1] += py
    ledger[2] += kinetic
    ledger[3] += by_gravity
    ledger[4] += by_drag
    ledger[5] += by_stress
    ledger[6] += unfelt
    ledger[7] += reactions


@cache
def one_velocity_kernel(undrained):
    """Kernel `solve_one_velocity` for dry soil, or for pore water that moves with the grains."""

    @kernel_part
    def solve_one_velocity(first, last, own, begun, wall, system):
        """`solve_nodes` with one momentum equation a node: of the grains, or undrained, of the mixture.

        Undrained is the limit of infinite drag. A wall pushes the mixture or lets it go. Of its push the water bears
        what holds its own momentum, M_l v + dt F_l, but no more than all and no tension; grains bear the rest, which
        limits friction. `nodes` columns of the water's velocity are not touched; V_MS is the mass that moves.
        """
        net, walls, dt_of_level, gravity = system.net, system.walls, system.clock.dt_of_level, system.medium.gravity
        which, next_row, level_of_row, touched, sums = (
            net.which_node, net.next_row, net.level_of_row, net.touched, net.sums,
        )  # fmt: skip
        nodes, mean, status, ledger = net.nodes, net.tied_means, net.status, system.tally.ledger[own]
        fixed, contact_of_node, impulse = walls.fixed, walls.contact_of_node, walls.impulse
        normal, active, friction = walls.normal, walls.active, walls.friction
        sum_x = sum_y = kinetic = by_gravity = by_stress = unfelt = reactions = 0.0
        n_nodes = nodes.shape[0] - mean.shape[0]
        for k in range(first, last):
            i = which[k]
            dt = dt_of_level[level_of_row[i]]
            mass = ml = px = py = fx = fy = flx = fly = 0.0
            r = i
            while r >= 0:
                for part in range(sums.shape[0]):
                    if touched[part, r] == 0:
                        continue
                    mass += sums[part, r, B_MS]
                    px += sums[part, r, B_PSX]
                    py += sums[part, r, B_PSY]
                    fx += sums[part, r, B_FX]
                    fy += sums[part, r, B_FY]
                    if undrained:
                        mass += sums[part, r, B_MN]
                        ml += sums[part, r, B_ML]
                        flx += sums[part, r, B_FLX]
                        fly += sums[part, r, B_FLY]
                r = next_row[r]
            if fixed[i] & MIRROR_X:
                px = 0.0
            nodes[i, V_MS] = mass
            status[i] = 0
            if mass <= 0.0:
                nodes[i, V_MS] = 0.0
                stop_rows(i, next_row, nodes, mean)
                continue
            ux, uy = px / mass, py / mass
            px += dt * fx
            py += dt * (fy - mass * gravity)
            c = contact_of_node[i]
            if c >= 0 and active[c]:
                nx, ny = normal[c, 0], normal[c, 1]
                if wall is not None:
                    px -= mass * wall[c, 0]
                    py -= mass * wall[c, 1]
                pn, pt = nx * px + ny * py, ny * px - nx * py
                if pn < 0.0:
                    reaction = push = -pn / dt
                    if undrained:
                        water = -(ml * (nx * ux + ny * uy) / dt + nx * flx + ny * (fly - ml * gravity))
                        water = min(max(water, 0.0), push)
                        reaction = push - water
                        impulse[c, 1] += dt * water
                        impulse[c, 4] += dt * water * water
                    shear = -pt / dt
                    limit = friction[c] * reaction
                    status[i] = SOLID_HELD
                    if abs(shear) > limit:
                        shear = limit if shear > 0.0 else -limit
                        pt += dt * shear
                    else:
                        pt = 0.0
                        status[i] |= SOLID_STICKS
                    impulse[c, 0] += dt * reaction
                    impulse[c, 2] += dt * shear
                    impulse[c, 3] += dt * reaction * reaction
                    unfelt += abs(ny * pt - px - dt * (nx * push + ny * shear))
                    unfelt += abs(-nx * pt - py - dt * (ny * push - nx * shear))
                    reactions += dt * push
                    px, py = ny * pt, -nx * pt
                if wall is not None:
                    px += mass * wall[c, 0]
                    py += mass * wall[c, 1]
            vx, vy = px / mass, py / mass
            if fixed[i] & FIXED_X:
                vx = 0.0
            if fixed[i] & FIXED_Y:
                vy = 0.0
            nodes[i, V_SX], nodes[i, V_SY] = vx, vy
            nodes[i, V_DSX], nodes[i, V_DSY] = vx - ux, vy - uy
            r = next_row[i]
            while r >= 0:
                t = r - n_nodes
                if level_of_row[r] <= begun:
                    for column in range(mean.shape[1]):
                        mean[t, column] = 0.0
                    nodes[r, V_DSX] = nodes[r, V_DSY] = 0.0
                share = dt / dt_of_level[level_of_row[r]]
                mean[t, 0] += share * vx
                mean[t, 1] += share * vy
                nodes[r, V_SX], nodes[r, V_SY] = vx, vy
                nodes[r, V_DSX] += vx - ux
                nodes[r, V_DSY] += vy - uy
                for part in range(sums.shape[0]):
                    held = sums[part, r, B_MS]
                    if undrained:
                        held += sums[part, r, B_MN]
                    sums[part, r, B_PSX] += held * (vx - ux)
                    sums[part, r, B_PSY] += held * (vy - uy)
                r = next_row[r]
            sx, sy = 0.5 * (ux + vx), 0.5 * (uy + vy)
            sum_x += mass * (vx - ux)
            sum_y += mass * (vy - uy)
            kinetic += mass * (sx * (vx - ux) + sy * (vy - uy))
            by_gravity -= dt * gravity * mass * sy
            by_stress += dt * (sx * fx + sy * fy)
        ledger[0] += sum_x
        ledger[1] += sum_y
        ledger[2] += kinetic
        ledger[3] += by_gravity
        ledger[5] += by_stress
        ledger[6] += unfelt
        ledger[7] += reactions

    return solve_one_velocity


@cache
def remap_kernel(two_phase):
    """Kernel `remap_nodes` for water that has a velocity of its own or not."""

    @kernel_part
    def remap_nodes(first, last, finished, wall, system):
        """Nodal velocities from the updated point momenta (MUSL), under the constraints that acted in this step.

        Rows of levels up to `finished` have new momenta; the others keep the node's, which `solve_nodes` has followed
        in `sums`, and their own velocities become the mean over their step when it ends. `momenta`, `sums` and
        `touched` are cleared where they have been read, for `update_points`.
        """
        net, walls, dt_of_level = system.net, system.walls, system.clock.dt_of_level
        which, next_row, level_of_row, touched = net.which_node, net.next_row, net.level_of_row, net.touched
        momenta, sums, nodes, mean, status = net.momenta, net.sums, net.nodes, net.tied_means, net.status
        fixed, contact_of_node, normal, active = walls.fixed, walls.contact_of_node, walls.normal, walls.active
        n_nodes = nodes.shape[0] - mean.shape[0]
        for k in range(first, last):
            i = which[k]
            sx = sy = lx = ly = 0.0
            r = i
            while r >= 0:
                done = level_of_row[r] <= finished
                for part in range(momenta.shape[0]):
                    if touched[part, r] == 0:
                        continue
                    if done:
                        sx += momenta[part, r, 0]
                        sy += momenta[part, r, 1]
                        if two_phase:
                            lx += momenta[part, r, 2]
                            ly += momenta[part, r, 3]
                        touched[part, r] = 0
                        for column in range(NODAL_MOMENTA):
                            momenta[part, r, column] = 0.0
                        for column in range(BUFFER_WIDTH):
                            sums[part, r, column] = 0.0
                    else:
                        sx += sums[part, r, B_PSX]
                        sy += sums[part, r, B_PSY]
                        if two_phase:
                            lx += sums[part, r, B_PLX]
                            ly += sums[part, r, B_PLY]
                r = next_row[r]
            if nodes[i, V_MS] <= 0.0:
                continue
            sx /= nodes[i, V_MS]
            sy /= nodes[i, V_MS]
            if two_phase:
                lx /= nodes[i, V_ML]
                ly /= nodes[i, V_ML]
            c = contact_of_node[i]
            if c >= 0 and active[c]:
                nx, ny = normal[c, 0], normal[c, 1]
                if wall is not None:
                    sx -= wall[c, 0]
                    sy -= wall[c, 1]
                    lx -= wall[c, 0]
                    ly -= wall[c, 1]
                if status[i] & SOLID_STICKS:
                    sx = sy = 0.0
                else:
                    vn = nx * sx + ny * sy
                    if status[i] & SOLID_HELD or vn < 0.0:
                        sx -= vn * nx
                        sy -= vn * ny
                if two_phase:
                    vn = nx * lx + ny * ly
                    if status[i] & LIQUID_HELD or vn < 0.0:
                        lx -= vn * nx
                        ly -= vn * ny
                if wall is not None:
                    sx += wall[c, 0]
                    sy += wall[c, 1]
                    lx += wall[c, 0]
                    ly += wall[c, 1]
            if fixed[i] & FIXED_X:
                sx = lx = 0.0
            if fixed[i] & FIXED_Y:
                sy = ly = 0.0
            nodes[i, V_SX], nodes[i, V_SY] = sx, sy
            if two_phase:
                nodes[i, V_LX], nodes[i, V_LY] = lx, ly
            r = next_row[i]
            while r >= 0:
                t = r - n_nodes
                share = dt_of_level[level_of_row[i]] / dt_of_level[level_of_row[r]]
                mean[t, 2] += share * sx
                mean[t, 3] += share * sy
                mean[t, 4] += share * lx
                mean[t, 5] += share * ly
                if level_of_row[r] <= finished:
                    nodes[r, V_SX], nodes[r, V_SY] = mean[t, 2], mean[t, 3]
                    nodes[r, V_LX], nodes[r, V_LY] = mean[t, 4], mean[t, 5]
                r = next_row[r]

    return remap_nodes
