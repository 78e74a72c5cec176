"""Arnoldi's process with the operator of a step: what the points resist in a second, over mass, and back: kernels."""

from functools import cache
from typing import NamedTuple

import numpy as np

from mpm.fields import FIXED_X, FIXED_Y, OPEN_X, OPEN_Y, record
from mpm.laws.law import moduli_kernel
from mpm.machine.compile import index, inline_kernel, kernel_part, step_kernel
from mpm.machine.team import shared
from mpm.step.cells import felt_share
from mpm.step.nodes_to_points import shares
from mpm.step.points_to_nodes import gradients
from mpm.walls.contact import Masses, free_pair

KRYLOV = 10  # vectors: from a wrong mode within 0.4 % of the step that many more give

#: What an element sums over its points: moduli, and stiffness of the water under the strain of grains and of water,
#: each times volume [N m/m].
STIFFNESS_RECORD = record(("lame", "shear", "water_by_grains", "water_by_water"))
#: What a node does: masses [kg/m], drag [kg/m/s].
NODAL_RECORD = record(Masses._fields)
CORNER_PAIRS = 6  # entries of the upper triangle of an element's consistent mass, row by row


class Operator(NamedTuple):
    """What the largest eigenvalue is sought of, and arrays for the way there; those of parts are zeros between uses."""

    elements: np.ndarray
    geometry: np.ndarray
    contents: np.ndarray
    stiffened: np.ndarray  # (n_elements,) factor of the stiffness of an element
    fixed: np.ndarray
    step_of_node: np.ndarray  # (n_nodes,) a node's step over that of level 0
    stiffness: np.ndarray  # (n_elements,) records, the occupied elements one after the other, as the next
    masses: np.ndarray  # (n_elements, 2, 6) consistent, of grains and of water [kg/m]
    nodal: np.ndarray  # (n_nodes,) records
    free: np.ndarray  # (n_nodes, 4) bool: components of grains and water that are not held
    element_cuts: np.ndarray  # (n_parts + 1,) as the others; of the occupied elements
    node_cuts: np.ndarray
    at_nodes: np.ndarray  # (n_parts, n_nodes, 4) what parts sum there, one after the other: masses, forces, momenta
    acceleration: np.ndarray  # (n_nodes, 4 or 2)
    dots: np.ndarray  # (n_parts, KRYLOV + 1)


@cache
def gather_kernel(needs):
    """Kernel `gather` for what a scene needs: sets an operator up for the points as they are."""
    undrained, moduli = needs.wet and not needs.two_phase, moduli_kernel(needs.laws)

    @kernel_part
    def sum_points(k, ground, medium, o, nodal):
        """Sum the points of an occupied element in its stiffness and masses, and at the nodes."""
        e = index(ground.occupied[k])
        shape, held = o.geometry[e], o.stiffness[k]
        held.lame = held.shear = held.water_by_grains = held.water_by_water = total = 0.0
        for pair in range(CORNER_PAIRS):
            o.masses[k, 0, pair] = o.masses[k, 1, pair] = 0.0
        for j in range(ground.start[e], ground.start[e + 1]):
            i = index(ground.order[j])
            point, soil = ground.points[i], ground.soils[index(ground.soil_of_point[i])]
            weight, lame_and_shear = shares(point, shape), moduli(point, soil)
            mass, n = point.grain_mass, point.porosity
            volume = mass / (soil.grain_density * (1.0 - n))
            water = volume * medium.density_liquid
            stiff = volume * o.stiffened[e]
            total += volume
            if undrained:
                mass += n * water
            held.lame += stiff * lame_and_shear[0]
            held.shear += stiff * lame_and_shear[1]
            held.water_by_grains += stiff * medium.bulk_liquid * (1.0 - n) / n
            held.water_by_water += stiff * medium.bulk_liquid
            pair = 0
            for a in range(3):
                for b in range(a, 3):
                    o.masses[k, 0, pair] += mass * weight[a] * weight[b]
                    o.masses[k, 1, pair] += water * weight[a] * weight[b]
                    pair += 1
                c = index(o.elements[e, a])
                nodal[c, 0] += weight[a] * mass
                nodal[c, 1] += weight[a] * water
                nodal[c, 2] += weight[a] * n * water
                nodal[c, 3] += weight[a] * n * water * soil.drag
        share = felt_share(total, shape.area, o.contents[e].fill)
        held.lame *= share
        held.shear *= share
        held.water_by_grains *= share
        held.water_by_water *= share

    @inline_kernel
    def gather(team, ground, medium, o):
        """Sum the points in elements and nodes, by all threads."""
        parts = o.at_nodes.shape[0]
        for part in shared(team, parts):
            for k in range(o.element_cuts[part], o.element_cuts[part + 1]):
                sum_points(k, ground, medium, o, o.at_nodes[part])
        for part in shared(team, parts):
            for i in range(o.node_cuts[part], o.node_cuts[part + 1]):
                node = o.nodal[i]
                node.solid, node.liquid = take(o.at_nodes, i, 0), take(o.at_nodes, i, 1)
                node.pore, node.drag = take(o.at_nodes, i, 2), take(o.at_nodes, i, 3)
                there, fixed = node.solid > 0.0, o.fixed[i]
                o.free[i, 0] = there and not fixed & FIXED_X
                o.free[i, 1] = there and not fixed & FIXED_Y
                o.free[i, 2] = there and (fixed & OPEN_X or not fixed & FIXED_X)
                o.free[i, 3] = there and (fixed & OPEN_Y or not fixed & FIXED_Y)

    return gather


@inline_kernel
def take(at_nodes, i, column):
    """Sum of the parts in a column of a node, which are cleared."""
    total = 0.0
    for part in range(at_nodes.shape[0]):
        total += at_nodes[part, i, column]
        at_nodes[part, i, column] = 0.0
    return total


@kernel_part
def add_forces(k, e, o, velocity, force):
    """Add the forces of the stresses that `velocity` builds in an element in a second to its nodes.

    force : (n_nodes, 4) float64
        Of the mixture, and of the pore pressure on the water.
    """
    a, b, c = index(o.elements[e, 0]), index(o.elements[e, 1]), index(o.elements[e, 2])
    shape, held = o.geometry[e], o.stiffness[k]
    xx, yy, xy, yx = gradients(
        shape, velocity[a, 0], velocity[a, 1], velocity[b, 0], velocity[b, 1], velocity[c, 0], velocity[c, 1]
    )
    volume = liquid = xx + yy
    if velocity.shape[1] == 4:
        liquid_xx, liquid_yy, _, _ = gradients(
            shape, velocity[a, 2], velocity[a, 3], velocity[b, 2], velocity[b, 3], velocity[c, 2], velocity[c, 3]
        )
        liquid = liquid_xx + liquid_yy
    pressure = -(held.water_by_grains * volume + held.water_by_water * liquid)
    sxx = held.lame * volume + 2.0 * held.shear * xx - pressure
    syy = held.lame * volume + 2.0 * held.shear * yy - pressure
    sxy = held.shear * (xy + yx)
    for corner in range(3):
        if corner == 0:
            i, gx, gy = a, -shape.dn1_dx - shape.dn2_dx, -shape.dn1_dy - shape.dn2_dy
        elif corner == 1:
            i, gx, gy = b, shape.dn1_dx, shape.dn1_dy
        else:
            i, gx, gy = c, shape.dn2_dx, shape.dn2_dy
        force[i, 0] -= gx * sxx + gy * sxy
        force[i, 1] -= gx * sxy + gy * syy
        force[i, 2] += gx * pressure
        force[i, 3] += gy * pressure


@kernel_part
def accelerate(i, o, drag_time):
    """Accelerations of both phases of a node from the forces that the parts have summed, which are cleared."""
    wet, node = o.acceleration.shape[1] == 4, o.nodal[i]
    m = Masses(node.solid, node.liquid, node.pore, drag_time * o.step_of_node[i] * node.drag)
    for axis in range(2):
        total, liquid = take(o.at_nodes, i, axis), take(o.at_nodes, i, axis + 2)
        if wet:
            grains, water = free_pair(total, liquid, m)
            if not o.free[i, axis]:
                grains, water = 0.0, liquid / (m.liquid + m.drag) if o.free[i, axis + 2] else 0.0
            o.acceleration[i, axis], o.acceleration[i, axis + 2] = grains, water
        else:
            o.acceleration[i, axis] = total / m.solid if o.free[i, axis] else 0.0


@inline_kernel
def dot(dots, k):
    """Sum of the parts of a dot product."""
    total = 0.0
    for part in range(dots.shape[0]):
        total += dots[part, k]
    return total


@kernel_part
def product(u, v, first, last):
    """Dot product of a range of two vectors, in four sums that run beside each other."""
    a = b = c = d = 0.0
    i = first
    while i + 4 <= last:
        a += u[i] * v[i]
        b += u[i + 1] * v[i + 1]
        c += u[i + 2] * v[i + 2]
        d += u[i + 3] * v[i + 3]
        i += 4
    for k in range(i, last):
        a += u[k] * v[k]
    return (a + b) + (c + d)


@cache
def apply_kernel(width):
    """Kernel `apply` for velocities of so many numbers: two, or four with those of the water."""

    @kernel_part
    def through_points(k, e, o, returned):
        """Add what an element passes from nodal accelerations through its points and back, times mass."""
        a, b, c = index(o.elements[e, 0]), index(o.elements[e, 1]), index(o.elements[e, 2])
        for x in range(width):
            m = o.masses[k, x // 2]
            u, v, w = o.acceleration[a, x], o.acceleration[b, x], o.acceleration[c, x]
            returned[a, x] += m[0] * u + m[1] * v + m[2] * w
            returned[b, x] += m[1] * u + m[3] * v + m[4] * w
            returned[c, x] += m[2] * u + m[4] * v + m[5] * w

    @inline_kernel
    def apply(team, ground, o, drag_time, velocity, image):
        """The operator: nodal velocities to accelerations, with changed sign, by all threads.

        Stresses that build in a second, mass, and the way through the points.
        """
        parts = o.at_nodes.shape[0]
        for part in shared(team, parts):
            for k in range(o.element_cuts[part], o.element_cuts[part + 1]):
                add_forces(k, index(ground.occupied[k]), o, velocity, o.at_nodes[part])
        for part in shared(team, parts):
            for i in range(o.node_cuts[part], o.node_cuts[part + 1]):
                accelerate(i, o, drag_time)
        for part in shared(team, parts):
            for k in range(o.element_cuts[part], o.element_cuts[part + 1]):
                through_points(k, index(ground.occupied[k]), o, o.at_nodes[part])
        for part in shared(team, parts):
            for i in range(o.node_cuts[part], o.node_cuts[part + 1]):
                for x in range(width):
                    mass = o.nodal[i].solid if x < 2 else o.nodal[i].liquid
                    total = take(o.at_nodes, i, x)
                    image[i, x] = -total / mass if o.free[i, x] else 0.0

    return apply


@cache
def krylov_kernel(needs):
    """Kernel `build_krylov` for what a scene needs."""
    width, gather = 4 if needs.two_phase else 2, gather_kernel(needs)
    apply = apply_kernel(width)

    @inline_kernel
    def orthogonalise(team, o, j, flat, hessenberg):
        """Make vector j + 1 a unit vector at right angles to those before, by all threads."""
        parts = o.at_nodes.shape[0]
        for part in shared(team, parts):
            first, last = width * o.node_cuts[part], width * o.node_cuts[part + 1]
            for k in range(j + 1):
                o.dots[part, k] = product(flat[k], flat[j + 1], first, last)
        for part in shared(team, parts):
            first, last = width * o.node_cuts[part], width * o.node_cuts[part + 1]
            for k in range(j + 1):
                share = dot(o.dots, k)
                for i in range(first, last):
                    flat[j + 1, i] -= share * flat[k, i]
            o.dots[part, -1] = product(flat[j + 1], flat[j + 1], first, last)
        for part in shared(team, parts):
            norm = np.sqrt(dot(o.dots, KRYLOV))
            scale = 1.0 / norm if norm > 0.0 else 0.0
            for i in range(width * o.node_cuts[part], width * o.node_cuts[part + 1]):
                flat[j + 1, i] *= scale
            if part == 0:
                for k in range(j + 1):
                    hessenberg[k, j] = dot(o.dots, k)
                hessenberg[j + 1, j] = norm

    @step_kernel
    def build_krylov(team, fresh, ground, medium, operator, drag_time, basis, hessenberg):
        """Arnoldi's process: orthonormal vectors that span the powers of the operator on the first of them.

        Sums run over fixed parts, so the bits do not depend on the threads.

        fresh : bool
            The points are others than before.
        drag_time : float
            Time over which the implicit drag acts on level 0 [s].
        basis : (k + 1, n_nodes, 4 or 2) float64
            The first, a unit vector, is given.
        hessenberg : (k + 1, k) float64
            Written; zeros at first.
        """
        flat = basis.reshape(basis.shape[0], width * basis.shape[1])
        if fresh:
            gather(team, ground, medium, operator)
        for j in range(hessenberg.shape[1]):
            apply(team, ground, operator, drag_time, basis[j], basis[j + 1])
            orthogonalise(team, operator, j, flat, hessenberg)

    return build_krylov
