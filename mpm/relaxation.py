"""The drained initial state: dynamic relaxation of the effective stress with the water at rest.

K0 and hydrostatic fields already satisfy equilibrium in the ground; what has to settle is the shear
that the lining's friction cannot carry. Water pressure is held, points stay where they are, and
inertia is fictitious, chosen per element so that one pseudo time step of 1 s is stable everywhere.
Source: kinetic damping after Cundall (1976) as in Barnes (1999): velocities are
zeroed whenever the kinetic energy passes a peak. From rest the first step takes half of the force (twice the mass), as
velocities are half a step behind: with all of it, modes with omega dt > sqrt(2) grow when rest follows rest.
"""

from functools import cache

import numpy as np

from mpm.fields import FIXED_X, FIXED_Y, MIRROR_X, REACTION_RECORD, values
from mpm.laws.law import stress_kernel
from mpm.laws.stress import Strain, Stress
from mpm.machine.compile import kernel
from mpm.step.points_to_nodes import Push, force_kernel, gradients, with_point
from mpm.walls.contact import in_wall_frame, shear_limit

MASS_SAFETY = 0.7  # pseudo Courant number of the fictitious masses


@cache
def relax_kernel(laws):
    """Kernel `relax_elements` for the laws of a scene's soils."""
    new_stress, add_forces = stress_kernel(laws), force_kernel(False)

    @kernel
    def relax_elements(first, last, ground, net, velocity, strained, force):
        """Strain the points of a range of elements by nodal velocity * 1 s (if `strained`); add -B^T sigma' V.

        velocity : (n_nodes, 2) float64
        force : (n_nodes,) records
            Written: `force_x`, `force_y` [N/m].
        """
        for i in range(force.size):
            force[i].force_x = force[i].force_y = 0.0
        for k in range(first, last):
            e = ground.occupied[k]
            shape, a, b, c = net.geometry[e], net.rows[e, 0], net.rows[e, 1], net.rows[e, 2]
            xx, yy, xy, yx = gradients(
                shape, velocity[a, 0], velocity[a, 1], velocity[b, 0], velocity[b, 1], velocity[c, 0], velocity[c, 1]
            )
            strain = Strain(xx, yy, 0.5 * (xy + yx), 0.0, xx + yy, xx + yy, 1.0 / (1.0 + xx + yy), 0.0)
            push = Push(0.0, 0.0, 0.0, 0.0)
            for j in range(ground.start[e], ground.start[e + 1]):
                i = ground.order[j]
                point, soil = ground.points[i], ground.soils[ground.soil_of_point[i]]
                if strained:
                    stress = Stress(point.stress_xx, point.stress_yy, point.stress_zz, point.stress_xy)
                    stress, _ = new_stress(stress, strain, point, soil, np.inf)
                    point.stress_xx, point.stress_yy, point.stress_zz, point.stress_xy = stress
                volume = point.grain_mass / (soil.grain_density * (1.0 - point.porosity))
                push = with_point(push, volume, point, 0.0)
            add_forces(shape, push, force[a], force[b], force[c])

    return relax_elements


@kernel
def relax_nodes(first, last, heavy, force, held_force, held_liquid, mass, walls, moving, velocity, reaction, sums):
    """Advance the fictitious motion of a range of nodes by 1 s.

    heavy : float
        By which the masses are multiplied in this step.

    force : (n_parts, n_nodes) records
    held_force, held_liquid : (n_nodes, 2) float64
        Weight plus pore-pressure force of the mixture and of the liquid [N/m], constant.
    walls : mpm.step.system.Walls
        With the friction of this stage; `velocity` is that of the lining where it is `moving`.
    reaction : (n_contact,) records
        Written: effective normal, water normal, tangential on the material [N/m].
    sums : (3,) float64
        Written: kinetic energy, squared unbalanced force, squared total force.
    """
    energy = unbalanced = total = 0.0
    for i in range(first, last):
        if mass[i] <= 0.0:
            continue
        fx, fy = held_force[i, 0], held_force[i, 1]
        for part in range(force.shape[0]):
            fx += force[part, i].force_x
            fy += force[part, i].force_y
        m = heavy * mass[i]
        vx, vy = velocity[i, 0], velocity[i, 1]
        c = walls.contact_of_node[i]
        if c >= 0 and walls.contact[c].active > 0.0:
            contact = walls.contact[c]
            push, _ = in_wall_frame(held_liquid[i, 0], held_liquid[i, 1], contact)
            water = max(-push, 0.0)
            fn, ft = in_wall_frame(fx, fy, contact)
            fn += water
            vn, vt = in_wall_frame(vx, vy, contact)
            if moving:
                wn, wt = in_wall_frame(walls.velocity[c, 0], walls.velocity[c, 1], contact)
                vn, vt = vn - wn, vt - wt
            r_s = max(-(m * vn + fn), 0.0)
            shear = -(m * vt + ft)
            limit = shear_limit(contact, r_s)[0] if r_s > 0.0 else 0.0  # infinite friction times zero is not a number
            shear = min(max(shear, -limit), limit)
            fx, fy = in_wall_frame(fn + r_s, ft + shear, contact)
            reaction[c].soil, reaction[c].water, reaction[c].shear = r_s, water, shear
        if walls.fixed[i] & FIXED_X:
            fx = 0.0
        if walls.fixed[i] & FIXED_Y:
            fy = 0.0
        velocity[i, 0] = vx + fx / m
        velocity[i, 1] = vy + fy / m
        energy += mass[i] * (velocity[i, 0] ** 2 + velocity[i, 1] ** 2)
        if walls.fixed[i] & MIRROR_X:  # half of a node, whose other half has the same force along the line
            unbalanced += 2.0 * fy * fy
            total += 2.0 * held_force[i, 1] ** 2
        else:
            unbalanced += fx * fx + fy * fy
            total += held_force[i, 0] ** 2 + held_force[i, 1] ** 2
    sums[0], sums[1], sums[2] = energy, unbalanced, total


def fictitious_masses(solver):
    """Masses of the nodes with which a pseudo time step of 1 s is stable everywhere: (n_nodes,) float64."""
    s, modulus = solver, solver.extremes_of_soils()[:, 2].max()
    density = modulus / (MASS_SAFETY * s.geometry["altitude"]) ** 2
    share = np.where(np.diff(s.start) > 0, density * s.geometry["area"] / 3, 0.0)
    return np.bincount(s.mesh.elements.ravel(), np.repeat(share, 3), len(s.mesh.nodes))


def relax(solver, friction, tolerance, max_steps, progress=None):
    """Bring the initial state to equilibrium with the lining's friction, drained, in place.

    Parameters
    ----------
    solver : mpm.solver.Solver
        Freshly filled; its points' effective stress is changed.
    friction : (n_contact,) float64
        Coulomb coefficient of this stage; infinite for a lining bonded to the ground.
    tolerance : float
        Ratio of the norm of unbalanced to the norm of weight forces at which to stop [-].
    max_steps : int
    progress : callable or None
        Called with the ratio now and then.

    Returns
    -------
    steps : int
    residual : float
    reaction : (n_contact,) records of `mpm.fields.REACTION`
        Effective normal, water normal and tangential reaction [N/m].
    """
    s = solver
    s.map_points()
    mapped = s.nodal_sums()
    held_liquid = values(mapped, ("force_liquid_x", "force_liquid_y"))
    held_liquid[:, 1] -= mapped["mass_liquid"] * s.scene.gravity
    force = np.zeros((s.parts, len(s.mesh.nodes)), mapped.dtype)
    velocity = np.zeros((len(s.mesh.nodes), 2))
    of_elements = np.linspace(0, s.n_occupied, s.parts + 1).astype(int)
    of_nodes = np.linspace(0, len(s.mesh.nodes), s.parts + 1).astype(int)
    system = s.system()
    net = system.net._replace(rows=s.mesh.elements)
    walls = system.walls._replace(contact=s.contact.copy())
    walls.contact["friction"] = friction
    # the forces of the effective stress, with no strain yet, separate what is held from what relaxes
    relax_elements = relax_kernel(s.needs.laws)
    s.workers.over(of_elements, relax_elements, system.ground, net, velocity, False, per_range=(force,))
    effective = values(force, ("force_x", "force_y"))
    held = values(mapped, ("force_x", "force_y")) - effective.sum(axis=0)
    held[:, 1] -= (mapped["mass_solid"] + mapped["mass_pore_liquid"]) * s.scene.gravity
    mass = fictitious_masses(s)
    reaction = np.zeros(s.n_contact, REACTION_RECORD)
    sums = np.zeros((s.parts, 3))
    last_energy, heavy = 0.0, 2.0
    residual = np.inf
    for step in range(1, max_steps + 1):
        s.workers.over(of_elements, relax_elements, system.ground, net, velocity, True, per_range=(force,))
        lining_energy = lining_unbalanced = 0.0
        if s.moving is not None:
            effective = values(force, ("force_x", "force_y")).sum(axis=0)
            lining_energy, lining_unbalanced = s.moving.settle(
                held + effective, held_liquid, heavy * mass, velocity, walls.contact
            )
            lining_energy /= heavy
        s.workers.over(
            of_nodes, relax_nodes, heavy, force, held, held_liquid, mass, walls, s.moving is not None, velocity,
            reaction, per_range=(sums,),
        )  # fmt: skip
        energy, unbalanced, total = sums.sum(axis=0) + np.array([lining_energy, lining_unbalanced, 0.0])
        residual = float(np.sqrt(unbalanced / total)) if unbalanced > 0.0 else 0.0  # no weight at all: 0 / 0
        if progress is not None and step % 50 == 0:
            progress(step, residual)
        if residual < tolerance and (s.moving is None or last_energy == 0.0):  # rings balance from rest
            break
        heavy = 1.0
        if energy < last_energy or residual < tolerance:
            velocity[:] = 0.0
            energy, heavy = 0.0, 2.0
            if s.moving is not None:
                s.moving.halt()
        last_energy = energy
    if s.moving is not None:
        s.moving.halt()
        s.moving.remember()
        s.moving.check()
    return step, residual, reaction
