"""The drained initial state: dynamic relaxation of the effective stress with the water at rest.

K0 and hydrostatic fields already satisfy equilibrium in the ground; what has to settle is the shear
that the lining's friction cannot carry. Water pressure is held, points stay where they are, and
inertia is fictitious, chosen per element so that one pseudo time step of 1 s is stable everywhere.
Source: kinetic damping after Cundall (1976) as in Barnes (1999): velocities are
zeroed whenever the kinetic energy passes a peak.
"""

import numpy as np

from mpm.contact import FIXED_X, FIXED_Y
from mpm.jit import kernel
from mpm.materials.mohr_coulomb import mohr_coulomb
from mpm.variables import (
    B_FLX,
    B_FLY,
    B_FX,
    B_FY,
    B_ML,
    B_MN,
    B_MS,
    MASS,
    MODEL_ELASTIC,
    S_APEX,
    S_C_COS,
    S_G,
    S_K,
    S_LAMBDA,
    S_MODEL,
    S_RHO_S,
    S_SIN,
    S_SIN_DIL,
    S_TENSION,
    SXX,
    SXY,
    SYY,
    SZZ,
    N,
)

MASS_SAFETY = 0.7  # pseudo Courant number of the fictitious masses


@kernel
def relax_elements(
    first, last, occupied, start, order, points, soil_of_point, soils, elements, geometry, velocity, strain, force
):
    """Strain the points of a range of elements by nodal velocity * 1 s (if `strain`); add -B^T sigma' V to `force`."""
    force[:] = 0.0
    for k in range(first, last):
        e = occupied[k]
        g1x, g1y, g2x, g2y = geometry[e, 0], geometry[e, 1], geometry[e, 2], geometry[e, 3]
        a, b, c = elements[e, 0], elements[e, 1], elements[e, 2]
        ux1, ux2 = velocity[b, 0] - velocity[a, 0], velocity[c, 0] - velocity[a, 0]
        uy1, uy2 = velocity[b, 1] - velocity[a, 1], velocity[c, 1] - velocity[a, 1]
        exx = g1x * ux1 + g2x * ux2
        eyy = g1y * uy1 + g2y * uy2
        exy = 0.5 * (g1y * ux1 + g2y * ux2 + g1x * uy1 + g2x * uy2)
        vol = exx + eyy
        fxx = fyy = fxy = 0.0
        for j in range(start[e], start[e + 1]):
            i = order[j]
            s = soil_of_point[i]
            v = points[i, MASS] / (soils[s, S_RHO_S] * (1.0 - points[i, N]))
            lam, shear = soils[s, S_LAMBDA], soils[s, S_G]
            txx = points[i, SXX] + lam * vol + 2.0 * shear * exx
            tyy = points[i, SYY] + lam * vol + 2.0 * shear * eyy
            txy = points[i, SXY] + 2.0 * shear * exy
            tzz = points[i, SZZ] + lam * vol
            if strain and soils[s, S_MODEL] != MODEL_ELASTIC:
                txx, tyy, tzz, txy, _ = mohr_coulomb(
                    txx, tyy, tzz, txy, shear, soils[s, S_K], soils[s, S_C_COS], soils[s, S_SIN], soils[s, S_SIN_DIL],
                    soils[s, S_APEX], soils[s, S_TENSION],
                )  # fmt: skip
            points[i, SXX], points[i, SYY], points[i, SZZ], points[i, SXY] = txx, tyy, tzz, txy
            fxx += v * txx
            fyy += v * tyy
            fxy += v * txy
        g0x, g0y = -g1x - g2x, -g1y - g2y
        force[a, 0] -= g0x * fxx + g0y * fxy
        force[a, 1] -= g0x * fxy + g0y * fyy
        force[b, 0] -= g1x * fxx + g1y * fxy
        force[b, 1] -= g1x * fxy + g1y * fyy
        force[c, 0] -= g2x * fxx + g2y * fxy
        force[c, 1] -= g2x * fxy + g2y * fyy


@kernel
def relax_nodes(
    first, last, force, held_force, held_liquid, mass, fixed, contact_of_node,
    normal, active, friction, wall, velocity, reaction, sums,
):  # fmt: skip
    """Advance the fictitious motion of a range of nodes by 1 s.

    held_force, held_liquid : (n_nodes, 2) float64
        Weight plus pore-pressure force of the mixture and of the liquid [N/m], constant.
    wall : (n_contact, 2) float64 or None
        Velocity of the lining; None where it is held.
    reaction : (n_contact, 3) float64
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
            fx += force[part, i, 0]
            fy += force[part, i, 1]
        m = mass[i]
        vx, vy = velocity[i, 0], velocity[i, 1]
        c = contact_of_node[i]
        if c >= 0 and active[c]:
            nx, ny = normal[c, 0], normal[c, 1]
            water = max(-(nx * held_liquid[i, 0] + ny * held_liquid[i, 1]), 0.0)
            fn = nx * fx + ny * fy + water
            ft = ny * fx - nx * fy
            vn, vt = nx * vx + ny * vy, ny * vx - nx * vy
            if wall is not None:
                vn -= nx * wall[c, 0] + ny * wall[c, 1]
                vt -= ny * wall[c, 0] - nx * wall[c, 1]
            r_s = max(-(m * vn + fn), 0.0)
            shear = -(m * vt + ft)
            limit = friction[c] * r_s if r_s > 0.0 else 0.0  # infinite friction times zero is not a number
            shear = min(max(shear, -limit), limit)
            fn += r_s
            ft += shear
            fx, fy = nx * fn + ny * ft, ny * fn - nx * ft
            reaction[c, 0], reaction[c, 1], reaction[c, 2] = r_s, water, shear
        if fixed[i] & FIXED_X:
            fx = 0.0
        if fixed[i] & FIXED_Y:
            fy = 0.0
        velocity[i, 0] = vx + fx / m
        velocity[i, 1] = vy + fy / m
        energy += m * (velocity[i, 0] ** 2 + velocity[i, 1] ** 2)
        unbalanced += fx * fx + fy * fy
        total += held_force[i, 0] ** 2 + held_force[i, 1] ** 2
    sums[0], sums[1], sums[2] = energy, unbalanced, total


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
    reaction : (n_contact, 3) float64
        Effective normal, water normal and tangential reaction [N/m].
    """
    s = solver
    s.map_points()
    mapped = s.nodal_sums()
    held_liquid = mapped[:, B_FLX : B_FLY + 1].copy()
    held_liquid[:, 1] -= mapped[:, B_ML] * s.scene.gravity
    force = np.zeros((s.parts, len(s.mesh.nodes), 2))
    velocity = np.zeros((len(s.mesh.nodes), 2))
    layout = (s.occupied, s.start, s.order, s.points, s.soil_of_point, s.soils, s.mesh.elements, s.geometry)
    of_elements = np.linspace(0, s.n_occupied, s.parts + 1).astype(int)
    of_nodes = np.linspace(0, len(s.mesh.nodes), s.parts + 1).astype(int)
    # the forces of the effective stress, with no strain yet, separate what is held from what relaxes
    s.workers.over(of_elements, relax_elements, *layout, velocity, 0, per_range=(force,))
    held = mapped[:, B_FX : B_FY + 1] - force.sum(axis=0)
    held[:, 1] -= (mapped[:, B_MS] + mapped[:, B_MN]) * s.scene.gravity
    modulus = s.soils[:, S_LAMBDA] + 2 * s.soils[:, S_G]
    density = modulus.max() / (MASS_SAFETY * s.geometry[:, 7]) ** 2
    share = np.where(np.diff(s.start) > 0, density * s.geometry[:, 6] / 3, 0.0)
    mass = np.bincount(s.mesh.elements.ravel(), np.repeat(share, 3), len(s.mesh.nodes))
    reaction = np.zeros((s.n_contact, 3))
    sums = np.zeros((s.parts, 3))
    last_energy = 0.0
    residual = np.inf
    for step in range(1, max_steps + 1):
        s.workers.over(of_elements, relax_elements, *layout, velocity, 1, per_range=(force,))
        lining_energy = lining_unbalanced = 0.0
        if s.moving is not None:
            lining_energy, lining_unbalanced = s.moving.settle(
                held + force.sum(axis=0), held_liquid, mass, velocity, s.normal, s.active, friction
            )
        s.workers.over(
            of_nodes, relax_nodes, force, held, held_liquid, mass, s.fixed, s.contact_of_node, s.normal, s.active,
            friction, s.wall, velocity, reaction, per_range=(sums,),
        )  # fmt: skip
        energy, unbalanced, total = sums.sum(axis=0) + np.array([lining_energy, lining_unbalanced, 0.0])
        residual = float(np.sqrt(unbalanced / total)) if unbalanced > 0.0 else 0.0  # no weight at all: 0 / 0
        if progress is not None and step % 50 == 0:
            progress(step, residual)
        if residual < tolerance:
            break
        if energy < last_energy:
            velocity[:] = 0.0
            energy = 0.0
            if s.moving is not None:
                s.moving.halt()
        last_energy = energy
    if s.moving is not None:
        s.moving.halt()
    return step, residual, reaction
