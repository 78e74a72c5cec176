"""Mohr-Coulomb element paths: laboratory tests in closed form, and strain paths over planes, edges and cut-offs."""

import time as clock
from functools import partial

import numpy as np

from mpm.laws.mohr_coulomb import Strength, return_to_surface
from mpm.laws.stress import Stress
from verification.problems.exact_plasticity import exact_path, stiffness, yield_planes
from verification.problems.problem import Problem, Result, register

E, NU = 2e7, 0.3
CONFINEMENT = 1e5  # [Pa]


def timed(work):
    """What a function without arguments returns, and the processor seconds that it took."""
    begin = clock.process_time()
    return work(), clock.process_time() - begin


class Element:
    """One piece of soil that the return mapping of `mpm` strains step by step.

    cohesion, friction_angle, dilatancy_angle, tensile_strength : float [Pa], [deg], [deg], [Pa];
    rotation : float, angle from the mesh's to the principal axes in the plane [deg];
    relaxation : tuple of two floats, relaxation time and time step [s].
    """

    def __init__(
        self, cohesion, friction_angle, dilatancy_angle, tensile_strength=1e8, rotation=0.0, relaxation=(0.0, 1.0),
    ):  # fmt: skip
        phi, psi, turn = np.radians([friction_angle, dilatancy_angle, rotation])
        self.elastic = stiffness(E, NU)
        shear = E / (2 * (1 + NU))
        apex = cohesion / np.tan(phi) if phi > 0 else np.inf
        strength = cohesion * np.cos(phi), np.sin(phi), np.sin(psi), apex, min(tensile_strength, apex)
        keep = relaxation[0] / sum(relaxation)
        self.parameters = shear, E / (3 * (1 - 2 * NU)), strength, keep
        self.turn = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])

    def advance(self, stress, strain):
        """Principal stresses (xx, yy, zz) [Pa] after a strain increment (xx, yy, zz) [-] in principal axes."""
        trial = stress + self.elastic @ strain
        plane = self.turn @ np.diag(trial[:2]) @ self.turn.T
        shear, bulk, strength, keep = self.parameters
        (xx, yy, zz, xy), _ = return_to_surface(
            Stress(plane[0, 0], plane[1, 1], trial[2], plane[0, 1]), shear, bulk, Strength(*strength), keep
        )
        plane = self.turn.T @ np.array([[xx, xy], [xy, yy]]) @ self.turn
        return np.array([plane[0, 0], plane[1, 1], zz])

    def laboratory_test(self, stress, axial, steps, held):
        """Strain `axial` along yy in equal steps, the components `held` at constant stress, the others at rest.

        Returns stresses (steps + 1, 3) [Pa] and strains (steps + 1, 3) [-] in principal axes.
        """
        target = np.array(stress, float)
        stresses, strains = [target.copy()], [np.zeros(3)]
        for _ in range(steps):
            increment = np.array([0.0, axial / steps, 0.0])
            new = self._hold(stresses[-1], increment, held, target)
            stresses.append(new)
            strains.append(strains[-1] + increment)
        return np.array(stresses), np.array(strains)

    def _hold(self, stress, increment, held, target):
        """Newton iteration on the lateral strain increment, in place; the stress is piecewise linear in it."""
        small = 1e-3 * np.abs(increment).max()
        for _ in range(30):
            new = self.advance(stress, increment)
            miss = np.mean(new[held] - target[held])
            if abs(miss) < 1e-11 * E * small / 1e-3:
                break
            probe = increment.copy()
            probe[held] += small
            slope = (np.mean(self.advance(stress, probe)[held]) - np.mean(new[held])) / small
            increment[held] -= miss / slope
        return new


def closed_form(cohesion, friction_angle, dilatancy_angle, direction, plane_strain, axial):
    """Axial stress [Pa] and volumetric strain [-] of a test at constant lateral stress, over the axial strain.

    direction -1: compression, 1: extension. Elastic up to s_3 = K_p s_1 - 2 c sqrt(K_p) (tension positive), then
    constant stress with the dilatancy of the flow rule: Vermeer & de Borst (1984), Heron 29(3), section 3.
    """
    phi, psi = np.radians(friction_angle), np.sin(np.radians(dilatancy_angle))
    kp = (1 + np.sin(phi)) / (1 - np.sin(phi))
    strength = 2 * cohesion * np.sqrt(kp)
    peak = -CONFINEMENT * kp - strength if direction < 0 else (-CONFINEMENT + strength) / kp
    modulus = E / (1 - NU**2) if plane_strain else E
    elastic_volume = (1 - 2 * NU) / (1 - NU) if plane_strain else 1 - 2 * NU
    # volumetric over axial plastic strain: the axial one is -(1 - sin psi) or (1 + sin psi), the volume 2 sin psi
    plastic_volume = 2 * psi / (direction + psi)
    at_yield = (peak + CONFINEMENT) / modulus
    elastic = np.clip(axial / at_yield, 0, 1) * at_yield
    return -CONFINEMENT + modulus * elastic, elastic_volume * elastic + plastic_volume * (axial - elastic)


def laboratory(
    direction, plane_strain, steps=20, friction_angle=35.0, dilatancy_angle=10.0, cohesion=5e3, rotation=0.0,
    axial=0.04,
):  # fmt: skip
    """Run one test at constant lateral stress; the larger error of stress and volume over the path."""
    element = Element(cohesion, friction_angle, dilatancy_angle, rotation=rotation)
    held = [0] if plane_strain else [0, 2]
    (stresses, strains), seconds = timed(
        lambda: element.laboratory_test([-CONFINEMENT] * 3, direction * axial, steps, held)
    )
    exact_stress, exact_volume = closed_form(
        cohesion, friction_angle, dilatancy_angle, direction, plane_strain, strains[:, 1]
    )
    stress = np.abs(stresses[:, 1] - exact_stress).max() / np.ptp(exact_stress)
    volume = np.abs(strains.sum(axis=1) - exact_volume).max() / np.abs(exact_volume).max()
    lateral = np.abs(stresses[:, 0] + CONFINEMENT).max() / CONFINEMENT
    values = {"axial_stress": float(stresses[-1, 1]), "volumetric_strain": float(strains[-1].sum())}
    return Result(float(max(stress, volume, lateral)), values, steps, points=1, cpu_seconds=seconds)


for name, title, direction, plane_strain in (
    ("triaxial-compression", "triaxial compression along the edge s1 = s2", -1, False),
    ("triaxial-extension", "triaxial extension along the edge s2 = s3", 1, False),
    ("biaxial-compression", "plane-strain compression, principal axes at an angle", -1, True),
    ("biaxial-extension", "plane-strain extension, principal axes at an angle", 1, True),
):
    fast = {"steps": 20, "friction_angle": 35.0, "dilatancy_angle": 10.0, "cohesion": 5e3, "axial": 0.04}
    ladder = {
        "steps": (10, 20, 400), "friction_angle": (10.0, 25.0, 35.0, 45.0), "dilatancy_angle": (0.0, 10.0, 35.0),
        "cohesion": (0.0, 5e3, 5e4),
    }  # fmt: skip
    if plane_strain:
        fast["rotation"], ladder["rotation"] = 25.0, (0.0, 25.0, 45.0, 70.0)
    register(Problem(
        name=name, title=title, source="Vermeer & de Borst (1984), Heron 29(3), section 3",
        norm="largest error of axial stress over its range, of volumetric strain over its largest, of lateral stress",
        solve=partial(laboratory, direction, plane_strain), fast=fast, ladder=ladder, limit=1e-8,
        why="the answer is piecewise linear and an implicit step has no error on it: round-off of the Newton iteration",
    ))  # fmt: skip


def isotropic(cohesion=2e4, friction_angle=30.0, dilatancy_angle=10.0, tensile_strength=1e8, steps=40):
    """Expand all around beyond the apex or the tensile strength and press again: elastic, capped, elastic at once."""
    element = Element(cohesion, friction_angle, dilatancy_angle, tensile_strength)
    _, bulk, (*_, cap), _ = element.parameters
    reach = 2 * (cap + CONFINEMENT) / (3 * bulk)  # twice the strain to the cap

    def run():
        stress, exact, worst = np.full(3, -CONFINEMENT), -CONFINEMENT, 0.0
        for increment in [reach / steps] * steps + [-reach / steps] * steps:
            stress = element.advance(stress, np.full(3, increment))
            exact = min(exact + 3 * bulk * increment, cap)
            worst = max(worst, float(np.abs(stress - exact).max()))
        return worst

    worst, seconds = timed(run)
    return Result(worst / CONFINEMENT, steps=2 * steps, points=1, cpu_seconds=seconds)


register(Problem(
    name="apex", title="isotropic expansion to the apex or the tensile strength, and back",
    source="elastic up to c cot(phi) or the tensile strength, constant there, elastic on return",
    norm="largest stress error over the confining stress", solve=isotropic,
    fast={"cohesion": 2e4, "friction_angle": 30.0, "tensile_strength": 1e8, "steps": 40},
    ladder={
        "cohesion": (0.0, 2e4), "friction_angle": (20.0, 40.0), "dilatancy_angle": (0.0, 10.0, 30.0),
        "tensile_strength": (0.0, 5e3, 1e8), "steps": (3, 40),
    },
    limit=1e-9, why="piecewise linear: round-off only",
))  # fmt: skip


def overstress(steps=200, relaxation_time=1e-3, duration=1e-2, rate=2.0, rotation=25.0):
    """Shear soil without friction at a constant rate in the plane: what it bears beyond its strength.

    Reference: x' = 2 G e' - x / tau from yield on, so x = 2 G e' tau (1 - exp(-t / tau)); Duvaut & Lions (1972).
    """
    cohesion = 5e3
    element = Element(cohesion, 0.0, 0.0, rotation=rotation, relaxation=(relaxation_time, duration / steps))
    shear = element.parameters[0]
    at_yield = cohesion / (2 * shear * rate)
    times = np.arange(1, steps + 1) * duration / steps

    def run():
        stress, beyond = np.full(3, -CONFINEMENT), []
        for _ in times:
            stress = element.advance(stress, np.array([rate, -rate, 0.0]) * duration / steps)
            beyond.append((stress[0] - stress[1]) / 2 - cohesion)
        return np.array(beyond)

    beyond, seconds = timed(run)
    steady = 2 * shear * rate * relaxation_time
    exact = steady * -np.expm1(-np.maximum(times - at_yield, 0.0) / relaxation_time)
    exact[times < at_yield] = 2 * shear * rate * times[times < at_yield] - cohesion
    values = {"steady": float(beyond[-1] / steady)}
    return Result(float(np.abs(beyond - exact).max() / steady), values, steps, points=1, cpu_seconds=seconds)


register(Problem(
    name="overstress", title="soil with a relaxation time, sheared at a constant rate",
    source="Duvaut & Lions (1972): x = 2 G e' tau (1 - exp(-t / tau))",
    norm="largest error of the stress beyond strength over its steady value",
    solve=overstress, fast={"steps": 200, "relaxation_time": 1e-3},
    ladder={"steps": (50, 100, 200, 400), "relaxation_time": (1e-4, 1e-3), "rotation": (0.0, 70.0)},
    limit=0.02, why="first order in the step over the relaxation time (backward Euler): 1 % with 20 steps in it",
))  # fmt: skip


def strain_paths(paths, pieces, mean, seed):
    """Random principal strain rates [1/s] over pieces of 1 s, drawn towards the volumetric rate `mean`."""
    rng = np.random.default_rng(seed)
    rates = rng.normal(0.0, 4e-3, (paths, pieces, 3))
    return rates - rates.mean(axis=2, keepdims=True) + mean / 3


def path_error(element, planes, rates, increments):
    """Largest stress error at the ends of the pieces over the largest stress of all paths."""
    worst = scale = 0.0
    elastic = stiffness(E, NU)
    for path in rates:
        exact = exact_path([-CONFINEMENT] * 3, path, np.ones(len(path)), elastic, planes)
        stress = np.full(3, -CONFINEMENT)
        for rate, end in zip(path, exact, strict=True):
            for _ in range(increments):
                stress = element.advance(stress, rate / increments)
            worst = max(worst, float(np.abs(stress - end).max()))
            scale = max(scale, float(np.abs(end).max()))
    return worst / scale


def random_paths(
    mean, increments=64, friction_angle=30.0, dilatancy_angle=10.0, tensile_strength=5e3, paths=40, pieces=4, seed=1,
):  # fmt: skip
    """Zigzag strain paths through planes, edges and cut-off against the event-by-event solution.

    mean : volumetric strain rate that they are drawn to [1/s]: below zero under pressure, above until tension is cut.
    """
    cohesion = 2e4
    element = Element(cohesion, friction_angle, dilatancy_angle, tensile_strength)
    planes = yield_planes(cohesion, friction_angle, dilatancy_angle, element.parameters[2][4])
    rates = strain_paths(paths, pieces, mean, seed)
    error, seconds = timed(lambda: path_error(element, planes, rates, increments))
    return Result(error, steps=increments * pieces, points=paths, cpu_seconds=seconds)


register(Problem(
    name="zigzag", title="random zigzag strain paths under pressure, over planes and both edges",
    source="Koiter (1953), Quart. Appl. Math. 11: rate form, integrated from event to event",
    norm="largest stress error at the ends of the pieces over the largest stress of all paths",
    solve=partial(random_paths, -2e-3, tensile_strength=1e8),
    fast={"increments": 64, "friction_angle": 30.0, "dilatancy_angle": 10.0},
    ladder={
        "increments": (4, 16, 64, 256), "friction_angle": (10.0, 30.0, 40.0), "dilatancy_angle": (0.0, 10.0, 30.0),
    },
    limit=1e-3,
    why="first order where an increment enters an edge",
))  # fmt: skip

register(Problem(
    name="tension-cut-off", title="random strain paths that expand to the tensile strength and to the apex",
    source="Koiter (1953), Quart. Appl. Math. 11, with Rankine planes and associated flow in tension",
    norm="largest stress error at the ends of the pieces over the largest stress of all paths",
    solve=partial(random_paths, 4e-3), fast={"increments": 256, "friction_angle": 30.0, "dilatancy_angle": 10.0},
    ladder={"increments": (4, 16, 64, 256), "tensile_strength": (0.0, 5e3, 1e8)},
    limit=0.02,
    why="first order where cone and cut-off meet",
))  # fmt: skip
