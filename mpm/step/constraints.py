"""Velocities of nodes that something holds: sides of the box, the mirror line, walls while they act."""

from functools import cache

from mpm.fields import FIXED_X, FIXED_Y, OPEN_X, OPEN_Y
from mpm.machine.compile import inline_kernel, kernel_part
from mpm.walls.contact import LIQUID_HELD, SOLID_HELD, SOLID_STICKS, Pair


@inline_kernel
def past_held_grains(v, b, m, fixed):
    """Velocities of a node where water passes grains that are held; b : momenta without reactions, m : Masses."""
    lx = b.liquid_x / (m.liquid + m.drag) if fixed & OPEN_X else v.liquid_x
    ly = b.liquid_y / (m.liquid + m.drag) if fixed & OPEN_Y else v.liquid_y
    return Pair(v.solid_x, v.solid_y, lx, ly)


@inline_kernel
def constrained(v, fixed):
    """Velocities under the constraints of box and mirror line."""
    sx, sy, lx, ly = v
    if fixed & FIXED_X:
        sx = 0.0
        if not fixed & OPEN_X:
            lx = 0.0
    if fixed & FIXED_Y:
        sy = 0.0
        if not fixed & OPEN_Y:
            ly = 0.0
    return Pair(sx, sy, lx, ly)


@cache
def held_kernel(two_phase):
    """Kernel `held_at_wall` for one velocity or two."""

    @kernel_part
    def held_at_wall(v, status, contact):
        """Velocities seen from a wall, under the constraints that acted in this step."""
        sx, sy, lx, ly = v
        if status & SOLID_STICKS:
            sx = sy = 0.0
        else:
            vn = contact.normal_x * sx + contact.normal_y * sy
            if status & SOLID_HELD or vn < 0.0:
                sx -= vn * contact.normal_x
                sy -= vn * contact.normal_y
        if two_phase:
            vn = contact.normal_x * lx + contact.normal_y * ly
            if status & LIQUID_HELD or vn < 0.0:
                lx -= vn * contact.normal_x
                ly -= vn * contact.normal_y
        return Pair(sx, sy, lx, ly)

    return held_at_wall
