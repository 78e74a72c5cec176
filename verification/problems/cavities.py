"""Round openings in a quarter annulus: a cavity that is unloaded, steady seepage to it, and a well that drains."""

import numpy as np
from scipy.optimize import brentq
from scipy.special import j0, j1, y0, y1

from verification.boxes import STRESS, annulus_mesh, box_scene, clear_stress, hold, put, run_to, state
from verification.driven import DrivenSolver
from verification.problems.problem import NUMERICS, WET, Problem, Result, register


def annulus(name, sectors, outer, depth, damping=0.0, **settings):
    """A solver of weightless ground around a hole of 1 m radius, held at its `outer` arc [m] and on its axes."""
    growth = np.pi / 2 / sectors  # elements about as long as they are wide
    radii = np.geomspace(1.0, outer, round(np.log(outer) / np.log1p(growth)) + 1)
    mesh = annulus_mesh(radii, sectors)
    solver = DrivenSolver(box_scene(name, 1.0, 2 * outer, depth, 0.0, **settings), mesh, damping)
    hold(solver, mesh.on_axis, y=True)
    hold(solver, mesh.outer, x=True, y=True)
    return solver


def wet_annulus(name, sectors, outer, conductivity, **numerics):
    """The same of elastic ground full of water, without stress; the weightless scene has no drag of its own."""
    solver = annulus(
        name, sectors, outer, outer + 1, model="elastic", youngs_modulus=1e7, loose_porosity=0.6, bulk_modulus=1e7,
        hydraulic_conductivity=conductivity, **numerics,
    )  # fmt: skip
    solver.let_drain(conductivity)
    clear_stress(solver)
    solver.driven_liquid[solver.mesh.outer] = True
    return solver


def salencon(pressure, initial, cohesion, friction_angle, dilatancy_angle, youngs_modulus, poissons_ratio):
    """Inward displacement over radius of a cylindrical cavity under the given inner pressure [-].

    Elastic above the pressure at which the wall yields; below, Salencon (1969), Annales des Ponts et Chaussees 4:
    u / r = chi / (2 G) in an elastic, perfectly plastic Mohr-Coulomb soil under an isotropic `initial` stress [Pa].
    """
    sine = np.sin(np.radians(friction_angle))
    kp, q = (1 + sine) / (1 - sine), 2 * cohesion * np.cos(np.radians(friction_angle)) / (1 - sine)
    dilation = np.sin(np.radians(dilatancy_angle))
    kpsi = (1 + dilation) / (1 - dilation)
    shear, nu = youngs_modulus / (2 * (1 + poissons_ratio)), poissons_ratio
    shift = q / (kp - 1)
    p = np.asarray(pressure, float) + shift
    far = initial + shift
    radius = np.maximum((2 / (kp + 1) * far / p) ** (1 / (kp - 1)), 1.0)
    chi = (
        (2 * nu - 1) * far
        + (1 - nu) * (kp**2 - 1) / (kp + kpsi) * p * radius ** (kp + kpsi)
        + ((1 - nu) * (kp * kpsi + 1) / (kp + kpsi) - nu) * p
    )
    return np.where(radius > 1, chi, far - p) / (2 * shear)


def cavity(
    sectors=10, outer=20.0, friction_angle=30.0, dilatancy_angle=0.0, cohesion=0.1, release=0.9, duration=0.6,
    damping=0.0, **numerics,
):  # fmt: skip
    """Let the wall of a cavity of 1 m radius move inwards until the share `release` of the initial pressure is gone.

    cohesion : over the initial stress [-]. The outer arc is held: u there is (1 / outer)^2 of that at the plastic rim.
    """
    initial, modulus, nu = 1e6, 5e8, 0.3
    solver = annulus(
        "cavity", sectors, outer, outer, damping, youngs_modulus=modulus, poissons_ratio=nu,
        cohesion=cohesion * initial, tensile_strength=0.0, friction_angle=friction_angle,
        dilatancy_angle=dilatancy_angle, k0=1.0, **numerics,
    )  # fmt: skip
    put(solver, **dict.fromkeys(STRESS[:3], -initial))
    wall, outward = solver.mesh.inner, solver.mesh.nodes[solver.mesh.inner]
    solver.driven[wall] = True
    law = (initial, cohesion * initial, friction_angle, dilatancy_angle, modulus, nu)
    reach = float(salencon((1 - release) * initial, *law))
    arc = 2 * sectors * np.sin(np.pi / 4 / sectors)
    speed, closure, pressure = [0.0], [0.0], []

    def drive():
        speed[0] = reach / duration * min(1.0, 5 * solver.time / duration) / 0.9
        solver.velocity[wall] = -speed[0] * outward

    def look(dt):
        closure.append(closure[-1] + dt * speed[0])
        pressure.append(np.sum(solver.reaction[wall] * outward) / arc)

    seconds = run_to(solver, duration, drive, look)
    closure, pressure = np.array(closure[1:]), np.array(pressure)
    # the ground reaction curve in 30 pieces: dynamic noise is averaged within a piece
    pieces = [p for p in np.array_split(np.arange(len(closure)), 30) if len(p)]
    measured = np.array([[closure[p].mean(), pressure[p].mean()] for p in pieces])
    table = np.linspace(0.01, 1.0, 2000) * initial
    exact = np.interp(measured[:, 0], salencon(table, *law)[::-1], table[::-1])
    return Result.of(
        solver, seconds, np.abs(measured[:, 1] - exact).max() / initial, pressure=measured[-1, 1] / initial,
        exact=exact[-1] / initial, closure=measured[-1, 0],
    )  # fmt: skip


def seepage(sectors=10, outer=6.0, conductivity=0.05, duration=1.2, **numerics):
    """Water that enters evenly at the outer arc flows to a cavity of 1 m radius: steady excess pressure.

    Reference: Darcy in a ring, p = p_outer ln(r) / ln(outer), Thiem (1906). The pressure needs a time to become steady
    that goes with 1 / conductivity: the run takes `duration` at 0.05 m/s.
    """
    high, density, gravity = 1e4, 1000.0, 9.81
    solver = wet_annulus("seepage", sectors, outer, conductivity, **numerics)
    rim, arc = solver.mesh.outer, solver.mesh.nodes[solver.mesh.outer]
    flux = conductivity / (density * gravity) * high / np.log(outer) / outer / solver.scene.soils[0].porosity
    end = duration * 0.05 / conductivity

    def feed():
        ramp = min(1.0, 5 * solver.time / end)
        solver.velocity_liquid[rim] = -ramp * flux * arc / np.linalg.norm(arc, axis=1)[:, None]

    seconds = run_to(solver, end, feed)
    radius, pressure = np.hypot(*state(solver, "x", "y").T), state(solver, "pore_pressure")
    miss = pressure - high * np.log(radius) / np.log(outer)
    return Result.of(
        solver, seconds, np.sqrt(np.average(miss**2, weights=state(solver, "grain_mass"))) / high,
        outer_pressure=pressure[radius > 0.95 * outer].mean() / high, largest=np.abs(miss).max() / high,
    )  # fmt: skip


def drained_well(radius, times, outer, terms=60):
    """Excess pressure over the initial one around a well at 1 m that is drained at once, closed at `outer` [m].

    dp/dt = D (p'' + p'/r) as a series of U(r) = J0(a r) Y0(a) - Y0(a r) J0(a) with U'(outer) = 0; Carslaw & Jaeger
    (1959), Conduction of Heat in Solids, ch. 13. times : D t [m2].
    """

    def slope(a):
        return j1(a * outer) * y0(a) - y1(a * outer) * j0(a)

    grid = np.linspace(1e-3, (terms + 1) * np.pi / (outer - 1), 40 * terms)
    sign = np.sign(slope(grid))
    roots = [brentq(slope, grid[k], grid[k + 1]) for k in np.flatnonzero(sign[:-1] * sign[1:] < 0)[:terms]]
    pressure = np.zeros((len(times), len(radius)))
    for a in roots:

        def shape(r, a=a):
            return j0(a * r) * y0(a) - y0(a * r) * j0(a)

        # int r U dr and int r U^2 dr from 1 to outer by Bessel's equation: U(1) = U'(outer) = 0
        inner = j0(a) * y1(a) - j1(a) * y0(a)  # slope of U at 1 over -a
        over, norm = inner / a, 0.5 * (outer**2 * shape(outer) ** 2 - inner**2)
        pressure += over / norm * np.exp(-(a**2) * np.asarray(times)[:, None]) * shape(np.asarray(radius))
    return pressure


def well(sectors=10, outer=4.0, conductivity=1e-3, stages=(0.1, 0.5, 2.0), **numerics):
    """Ground that does not move drains to a hole of 1 m radius (or half of one in a half plane); closed at `outer`.

    Reference: `drained_well` at `stages` D t [m2], D = k K_w / (rho g n): first a thin front, as in unbounded ground,
    then the decay of the whole.
    """
    initial, gravity = 1e4, 9.81
    solver = wet_annulus("well", sectors, outer, conductivity, **numerics)
    put(solver, pore_pressure=initial)
    solver.driven[:] = True
    water, porosity = solver.scene.water, solver.scene.soils[0].porosity
    diffusivity = conductivity * water.bulk_modulus / (water.density * gravity * porosity)
    table = np.linspace(1, outer, 400)
    errors, drained, seconds = [], [], 0.0
    for stage, profile in zip(stages, drained_well(table, stages, outer), strict=True):
        seconds += run_to(solver, stage / diffusivity)
        radius, weight = np.hypot(*state(solver, "x", "y").T), state(solver, "grain_mass")
        pressure = state(solver, "pore_pressure") / initial
        miss = pressure - np.interp(radius, table, profile)
        errors.append(float(np.sqrt(np.average(miss**2, weights=weight))))
        left = np.trapezoid(profile * table, table) / (0.5 * (outer**2 - 1))
        drained.append((1 - np.average(pressure, weights=weight)) / (1 - left) - 1)
    return Result.of(
        solver, seconds, max(errors), early=errors[0], late=errors[-1], outflow_early=drained[0],
        outflow_late=drained[-1],
    )  # fmt: skip


register(Problem(
    name="cavity", title="ground reaction curve of a cylindrical cavity in Mohr-Coulomb soil",
    source="Salencon (1969), Annales des Ponts et Chaussees 4",
    norm="largest difference of the pressure at equal closure over the initial pressure", solve=cavity,
    fast={"sectors": 10},
    ladder={
        "sectors": (5, 10, 20), **NUMERICS, "friction_angle": (20.0, 30.0, 40.0),
        "dilatancy_angle": (0.0, 10.0, 30.0), "cohesion": (0.02, 0.1, 0.3), "outer": (10.0, 20.0, 40.0),
    },
    limit=0.03, why="an element at the wall is 0.16 of the radius",
))  # fmt: skip

register(Problem(
    name="radial-seepage", title="steady radial seepage to a drained cavity", source="Thiem (1906); Darcy in a ring",
    norm="root mean square of the pressure error over the pressure at the outer arc", solve=seepage,
    fast={"sectors": 10}, ladder={"sectors": (5, 10, 20), **NUMERICS, **WET, "conductivity": (0.025, 0.05, 0.1)},
    limit=0.01, why="linear pressure in elements of 0.16 of the radius: p'' h^2 / 8 is 0.3 % of p at the wall",
))  # fmt: skip

register(Problem(
    name="well", title="ground that does not move drains to a hole",
    source="Carslaw & Jaeger (1959), ch. 13: cylinder drained inside and closed outside",
    norm="root mean square of the pressure error over the initial pressure, the largest of all stages", solve=well,
    fast={"sectors": 10}, ladder={"sectors": (5, 10, 20), **NUMERICS, **WET, "conductivity": (3e-4, 1e-3, 3e-3)},
    limit=0.01, why="the first stage is a front of 0.3 m, two elements",
))  # fmt: skip
