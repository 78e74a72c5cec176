"""Balances of a run, step by step, and the verdict they allow: energy, mass, stress, place, porosity, inflow."""

import math

import numpy as np

from mpm.fields import CLAMPS, POROSITY_CEILING, POROSITY_FLOOR, numbers
from verification.boxes import STRESS, inside, state, volumes

ENERGY_SLACK = 0.05  # of the largest energy in play: volumes change, points change elements
MASS_ERROR = 1e-10
HAMMER = 3.0  # of the Joukowsky pressure; a reflection at a wall doubles it, two that meet there triple it
SOLID, LIQUID = (tuple(f"velocity_{phase}_{axis}" for axis in "xy") for phase in ("solid", "liquid"))


class Monitor:
    """Sums over the steps of a solver what must balance.

    solver : mpm.solver.Solver, in its initial state.
    """

    def __init__(self, solver):
        self.solver = solver
        self.kinetic = self.most_kinetic = self.in_play = kinetic_energy(solver)
        self.stored = self._at_first = strain_energy(solver)
        self._start = self.kinetic + self.stored
        self.grain_mass = float(np.sum(state(solver, "grain_mass")))
        self.stress_bound = self.most_stress = self.most_speed = self.work = self.balance = self.mass_error = 0.0
        self.created = -math.inf  # energy that is there beyond what was and what gravity did, most of all times [J/m]
        self.inflow, self.times = [solver.inflow_mass()], [0.0]
        depth = float(np.ptp(solver.mesh.nodes[:, 1]))
        self._mixture = float((state(solver, "grain_mass") + pore_water(solver)).sum() / volumes(solver).sum())
        self._static = largest_stress(solver) + self._mixture * solver.scene.gravity * depth

    def step(self, dt_max=math.inf):
        """Advance the solver by a step and its balances with it; returns the step [s]."""
        solver = self.solver
        dt, _ = solver.step(dt_max)
        here = inside(solver)
        grains = state(solver, "grain_mass")[here] @ state(solver, SOLID[1])[here]
        water = pore_water(solver)[here] @ state(solver, LIQUID[1])[here]
        self.work -= dt * solver.scene.gravity * float(grains + water)
        self.kinetic = kinetic_energy(solver)
        before, self.stored = self.stored, strain_energy(solver)
        self.most_kinetic = max(self.most_kinetic, self.kinetic)
        self.in_play = max(self.in_play, self.kinetic, abs(self.work), abs(self.stored - self._at_first))
        # velocities belong to the middle between the stresses before and after
        elastic = math.sqrt(before * self.stored)  # the leapfrog keeps the product of neighbours, not their squares
        self.balance = self.kinetic + elastic - self._start - self.work
        self.created = max(self.created, self.balance)
        if solver.long_step_count % 20 == 0:
            self.check()
        return dt

    def check(self):
        """What is too dear for every step: mass at the nodes, stresses, speeds, inflow."""
        solver, here = self.solver, inside(self.solver)
        held = float(solver.sums["mass_solid"].sum()) + solver.removed_mass
        self.mass_error = max(self.mass_error, abs(held / self.grain_mass - 1.0))
        speeds = [np.hypot(*state(solver, *phase)[here].T).max(initial=0.0) for phase in (SOLID, LIQUID)]
        self.most_speed = max(self.most_speed, *map(float, speeds))
        self.most_stress = max(self.most_stress, largest_stress(solver))
        self.stress_bound = HAMMER * (self._static + self._mixture * solver.wave_speed * self.most_speed)
        self.inflow.append(solver.inflow_mass())
        self.times.append(solver.time)

    def faults(self):
        """What is wrong, one sentence each; empty for a sound run."""
        self.check()
        solver, here, faults = self.solver, inside(self.solver), []
        if not np.isfinite(numbers(solver.points[here])).all():
            faults.append("a point is not finite")
        if self.created > ENERGY_SLACK * self.in_play:
            share = self.created / self.in_play
            faults.append(f"energy from nothing: {self.created:.3g} J/m, {share:.0%} of what moves")
        if self.mass_error > MASS_ERROR:
            faults.append(f"grain mass at the nodes is wrong by {self.mass_error:.1e}")
        if self.most_stress > self.stress_bound:
            faults.append(f"stress {self.most_stress:.3g} Pa beyond {self.stress_bound:.3g} Pa")
        nodes, places = solver.mesh.nodes, state(solver, "x", "y")[here]
        if ((places < nodes.min(axis=0) - 1e-9) | (places > nodes.max(axis=0) + 1e-9)).any():
            faults.append("a point lies outside the mesh")
        porosity = state(solver, "porosity")[here]
        if ((porosity < POROSITY_FLOOR) | (porosity > POROSITY_CEILING)).any():
            faults.append("a porosity is out of its range")
        return faults

    def measures(self):
        """The numbers behind the verdict, as a dict of floats."""
        solver = self.solver
        clamped = ((name, solver.clamps[name].sum()) for name in CLAMPS)
        return {
            "time": solver.time, "steps": solver.step_count, "points": solver.n_points,
            "wave_speed": solver.wave_speed,
            "energy_created": max(self.created, 0.0) / self.in_play if self.in_play > 0 else 0.0,
            "kinetic_energy": self.kinetic, "most_kinetic_energy": self.most_kinetic, "gravity_work": self.work,
            "stored_change": self.stored - self._at_first, "energy_balance": self.balance,
            "mass_error": self.mass_error, "most_stress": self.most_stress, "stress_bound": self.stress_bound,
            "most_speed": self.most_speed, "inflow_mass": self.inflow[-1] - self.inflow[0],
            **{f"clamped_{name}": float(count) for name, count in clamped},
        }  # fmt: skip


def follow(monitor, seconds, most_steps=200_000, events=()):
    """Step until `seconds` of simulated time; events: (time, callable) in order of time.

    Returns (faults, measures). More than `most_steps` is a fault: a time step that dies is a hang.
    """
    solver, pending = monitor.solver, list(events)
    while solver.time < seconds * (1 - 1e-12):
        while pending and solver.time >= pending[0][0] * (1 - 1e-12):
            pending.pop(0)[1]()
        target = min(seconds, pending[0][0]) if pending else seconds
        monitor.step(target - solver.time)
        if solver.step_count > most_steps:
            return [f"only {solver.time:.3g} s after {most_steps} steps", *monitor.faults()], monitor.measures()
    return monitor.faults(), monitor.measures()


def pore_water(solver):
    """Mass of the pore water of every point [kg/m]."""
    water = solver.scene.water
    return volumes(solver) * state(solver, "porosity") * (water.density if water else 0.0)


def kinetic_energy(solver):
    """Of grains and pore water [J/m]."""
    here, energy = inside(solver), 0.0
    for mass, velocity in ((state(solver, "grain_mass"), SOLID), (pore_water(solver), LIQUID)):
        energy += mass[here] @ (state(solver, *velocity)[here] ** 2).sum(axis=1)
    return 0.5 * float(energy)


def strain_energy(solver):
    """Stored in skeleton and water [J/m]: 1/2 sigma : C^-1 : sigma + p^2 n / (2 K_w), times the volume."""
    here, water = inside(solver), solver.scene.water
    soils = [(s.youngs_modulus, s.poissons_ratio) for s in solver.scene.soils]
    young, nu = np.array(soils)[solver.soil_of_point[here]].T
    normal, shear = state(solver, *STRESS[:3])[here], state(solver, STRESS[3])[here]
    trace = normal.sum(axis=1)
    square = (normal**2).sum(axis=1) + 2 * shear**2
    energy = ((1 + nu) * square - nu * trace**2) / (2 * young)
    if water:
        pressure, porosity = state(solver, "pore_pressure", "porosity")[here].T
        energy = energy + np.maximum(pressure, 0.0) ** 2 * porosity / (2 * water.bulk_modulus)
    return float(volumes(solver)[here] @ energy)


def largest_stress(solver):
    """Largest effective stress or pore pressure of the points in the mesh [Pa]; a negative pressure carries nothing."""
    here = inside(solver)
    stress, pressure = state(solver, *STRESS)[here], state(solver, "pore_pressure")[here]
    return float(max(np.abs(stress).max(initial=0.0), pressure.max(initial=0.0)))
