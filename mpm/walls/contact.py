"""Contact of grains and water with a wall: unilateral along its normal, frictional along it; value and derivative.

Per node the velocities of both phases solve, each component on its own and with d = dt D of the drag,
    (M_l + d) v_l' - d v_s' = M_l v_l + dt F_l + dt R_l
    M_s v_s' + M_nl v_l'    = M_s v_s + M_nl v_l + dt F_mix + dt (R_l + R_s)
with the reactions R of an impermeable, rough wall: for each phase either the normal velocity is zero and the reaction
pushes, or there is no reaction and the phase leaves the wall. As a linear complementarity problem its matrix has
positive principal minors, so exactly one of the four cases holds. Drag is implicit: no permeability limits the time
step. What the wall bears in shear is `shear_limit`, and nothing else of the program knows how.
"""

from functools import cache
from typing import NamedTuple

from mpm.machine.compile import inline_kernel, kernel_part

#: Bits of the constraints that acted at a wall.
SOLID_HELD, SOLID_STICKS, LIQUID_HELD = 1, 2, 4


class Masses(NamedTuple):
    """Of a node [kg/m]: what has the first velocity, water as if it filled all, pore water; and drag times dt."""

    solid: float
    liquid: float
    pore: float
    drag: float


class Pair(NamedTuple):
    """A vector of the grains, or of all that moves as one, and one of the water: momenta, velocities."""

    solid_x: float
    solid_y: float
    liquid_x: float
    liquid_y: float


class Reaction(NamedTuple):
    """Of a wall in a step [N s/m]: normal on grains and water, shear along (normal_y, -normal_x); constraint bits."""

    soil: float
    water: float
    shear: float
    status: int


@inline_kernel
def shear_limit(contact, pressing):
    """Largest shear impulse of a wall on grains that press on it with an impulse, and its derivative by that (Coulomb).

    contact : record of `mpm.fields.CONTACT`.
    """
    return contact.friction * pressing, contact.friction


@inline_kernel
def free_pair(b_s, b_l, m):
    """Velocities (solid, liquid) of one component without reactions."""
    vs = (b_s - m.pore * b_l / (m.liquid + m.drag)) / (m.solid + m.pore * m.drag / (m.liquid + m.drag))
    return vs, (b_l + m.drag * vs) / (m.liquid + m.drag)


@kernel_part
def wall_normal(b_s, b_l, m):
    """Normal velocities (solid, liquid) at a wall and impulses of its reaction on grains and water [N s/m]."""
    r_l = -b_l
    r_s = -b_s - r_l
    if r_l >= 0.0 and r_s >= 0.0:
        return 0.0, 0.0, r_s, r_l
    vs = (b_s - b_l) / (m.solid + m.drag)  # grains leave, water is held
    r_l = -(m.drag * vs + b_l)
    if vs >= 0.0 and r_l >= 0.0:
        return vs, 0.0, 0.0, r_l
    vl = b_l / (m.liquid + m.drag)  # water leaves, grains are held
    r_s = m.pore * vl - b_s
    if vl >= 0.0 and r_s >= 0.0:
        return 0.0, vl, r_s, 0.0
    vs, vl = free_pair(b_s, b_l, m)
    return vs, vl, 0.0, 0.0


@inline_kernel
def in_wall_frame(x, y, contact):
    """Components along the normal and along (normal_y, -normal_x); its own inverse."""
    return contact.normal_x * x + contact.normal_y * y, contact.normal_y * x - contact.normal_x * y


@cache
def contact_kernel(needs):
    """Kernel `at_wall` for what a scene needs: momenta at a wall to velocities and reactions.

    at_wall(b, m, water, contact), b : Pair, momenta at the end of a step without the wall's reactions, seen from the
    wall [kg/s]; m : Masses; water : float, undrained the impulse that holds the water's own momentum [N s/m].
    Returns velocities (Pair, seen from the wall [m/s]) and a Reaction.
    """
    two_phase, undrained = needs.two_phase, needs.wet and not needs.two_phase

    @kernel_part
    def both_at_wall(b, m, water, contact):
        bsn, bst = in_wall_frame(b.solid_x, b.solid_y, contact)
        bln, blt = in_wall_frame(b.liquid_x, b.liquid_y, contact)
        vsn, vln, soil, push = wall_normal(bsn, bln, m)
        shear, status = 0.0, 0
        if soil > 0.0:
            status = SOLID_HELD
            vst, vlt = 0.0, blt / (m.liquid + m.drag)
            shear = m.pore * vlt - bst
            limit, _ = shear_limit(contact, soil)
            if abs(shear) > limit:
                shear = limit if shear > 0.0 else -limit
                vst, vlt = free_pair(bst + shear, blt, m)
            else:
                status |= SOLID_STICKS
        else:
            vst, vlt = free_pair(bst, blt, m)
        if push > 0.0:
            status |= LIQUID_HELD
        sx, sy = in_wall_frame(vsn, vst, contact)
        lx, ly = in_wall_frame(vln, vlt, contact)
        return Pair(sx, sy, lx, ly), Reaction(soil, push, shear, status)

    @kernel_part
    def one_at_wall(b, m, water, contact):
        """Undrained the wall pushes the mixture or lets it go: of its push the water bears no more than all and no
        tension; grains bear the rest, which limits friction.
        """
        pn, pt = in_wall_frame(b.solid_x, b.solid_y, contact)
        soil = push = shear = 0.0
        status = 0
        if pn < 0.0:
            soil, status = -pn, SOLID_HELD
            if undrained:
                push = min(max(water, 0.0), soil)
                soil -= push
            pn, shear = 0.0, -pt
            limit, _ = shear_limit(contact, soil)
            if abs(shear) > limit:
                shear = limit if shear > 0.0 else -limit
                pt += shear
            else:
                pt = 0.0
                status |= SOLID_STICKS
        x, y = in_wall_frame(pn, pt, contact)
        return Pair(x / m.solid, y / m.solid, 0.0, 0.0), Reaction(soil, push, shear, status)

    return both_at_wall if two_phase else one_at_wall


@cache
def response_kernel(wet):
    """Kernel `response` for soil with pore water or without: how the reactions of a wall grow with its velocity.

    response(b, m, contact), b : Pair, momenta seen from the wall [kg/s];  m : Masses.
    Returns push, shear : normal (soil and water) and tangential impulse on the material [N s/m]; push_n, shear_n,
    shear_t : their derivatives by the normal and the tangential velocity of the wall [kg/m].
    """

    @kernel_part
    def response(b, m, contact):
        bsn, bst = in_wall_frame(b.solid_x, b.solid_y, contact)
        push = push_n = grip = grip_n = shear = shear_n = shear_t = 0.0
        mass_t, free_t = m.solid, bst  # what friction must hold
        if wet:
            bln, blt = in_wall_frame(b.liquid_x, b.liquid_y, contact)
            _, vl, grip, water = wall_normal(bsn, bln, m)
            push, both = grip + water, m.solid + m.pore
            # the wall's mass matrix of what it holds: grains and water, water alone, grains alone
            mass_t = both - m.pore * m.liquid / (m.liquid + m.drag)
            if grip > 0.0 and vl == 0.0:
                grip_n, push_n = both - m.liquid, both
            elif grip > 0.0:
                grip_n = push_n = mass_t
            elif water > 0.0:
                push_n = m.liquid + m.drag * (both - m.liquid) / (m.solid + m.drag)
            free_t = bst - m.pore * blt / (m.liquid + m.drag)
        elif bsn < 0.0:
            grip = push = -bsn
            grip_n = push_n = m.solid
        if grip > 0.0:
            shear, shear_t = -free_t, mass_t
            limit, slope = shear_limit(contact, grip)
            if abs(shear) > limit:
                sign = 1.0 if shear > 0.0 else -1.0
                shear, shear_n, shear_t = sign * limit, sign * slope * grip_n, 0.0
        return push, shear, push_n, shear_n, shear_t

    return response
