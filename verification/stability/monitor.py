"""Balances of a run, step by step, and the verdict they allow: energy, mass, stress, place, porosity, inflow."""

import math

import numpy as np

from mpm.fields import (
    CLAMPS,
    POROSITY_CEILING,
    POROSITY_FLOOR,
    values,
)

ENERGY_SLACK = 0.05  # of the largest energy in play: volumes change, points change elements
MASS_ERROR = 1e-10
HAMMER = 3.0  # of the Joukowsky pressure; a reflection at a wall doubles it, two that meet there triple it


class Monitor:
    """Sums over the steps of a solver what must balance.

    Parameters
    ----------
    solver : mpm.solver.Solver
        In its initial state.
    """

    def __init__(self, solver):
        self.solver = solver
        self.kinetic = self.most_kinetic = kinetic_energy(solver)
        self.stored = strain_energy(solver)
        self._start = self.kinetic + self.stored
        self._at_first = self.stored
        self.grain_mass = float(np.sum(solver.points["grain_mass"]))
        self.stress_bound = 0.0
        self.most_stress = self.most_speed = 0.0
        self.work = self.balance = 0.0
        self.in_play = self.kinetic
        self.created = -math.inf  # energy that is there beyond what was and what gravity did, most of all times [J/m]
        self.mass_error = 0.0
        self.inflow = [solver.inflow_mass()]
        self.times = [0.0]
        self._initial_stress = largest_stress(solver)
        depth = float(solver.mesh.nodes[:, 1].max() - solver.mesh.nodes[:, 1].min())
        self._mixture = float((solver.points["grain_mass"] + pore_water(solver)).sum() / solver._volumes().sum())
        self._static = self._initial_stress + self._mixture * solver.scene.gravity * depth

    def step(self, dt_max=math.inf):
        """Advance the solver by a step and its balances with it; returns the step [s]."""
        solver = self.solver
        dt, _ = solver.step(dt_max)
        inside = solver.element_of_point >= 0
        points = solver.points[inside]
        water = pore_water(solver)[inside]
        self.work -= (
            dt
            * solver.scene.gravity
            * float(points["grain_mass"] @ points["velocity_solid_y"] + water @ points["velocity_liquid_y"])
        )
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
        solver = self.solver
        held = float(solver.sums["mass_solid"].sum()) + solver.removed_mass
        self.mass_error = max(self.mass_error, abs(held / self.grain_mass - 1.0))
        inside = solver.element_of_point >= 0
        velocity = values(
            solver.points[inside], ("velocity_solid_x", "velocity_solid_y", "velocity_liquid_x", "velocity_liquid_y")
        )
        self.most_speed = max(self.most_speed, float(np.hypot(velocity[:, ::2], velocity[:, 1::2]).max(initial=0.0)))
        self.most_stress = max(self.most_stress, largest_stress(solver))
        self.stress_bound = HAMMER * (self._static + self._mixture * solver.wave_speed * self.most_speed)
        self.inflow.append(solver.inflow_mass())
        self.times.append(solver.time)

    def faults(self):
        """What is wrong, one sentence each; empty for a sound run."""
        self.check()
        solver, faults = self.solver, []
        inside = solver.element_of_point >= 0
        state = solver.points[inside]
        if not np.isfinite(state).all():
            faults.append("a point is not finite")
        if self.created > ENERGY_SLACK * self.in_play:
            faults.append(
                f"energy from nothing: {self.created:.3g} J/m, {self.created / self.in_play:.0%} of what moves"
            )
        if self.mass_error > MASS_ERROR:
            faults.append(f"grain mass at the nodes is wrong by {self.mass_error:.1e}")
        if self.most_stress > self.stress_bound:
            faults.append(f"stress {self.most_stress:.3g} Pa beyond {self.stress_bound:.3g} Pa")
        low, high = solver.mesh.nodes.min(axis=0) - 1e-9, solver.mesh.nodes.max(axis=0) + 1e-9
        if ((values(state, ("x", "y")) < low) | (values(state, ("x", "y")) > high)).any():
            faults.append("a point lies outside the mesh")
        if ((state["porosity"] < POROSITY_FLOOR) | (state["porosity"] > POROSITY_CEILING)).any():
            faults.append("a porosity is out of its range")
        return faults

    def measures(self):
        """The numbers behind the verdict, as a dict of floats."""
        solver = self.solver
        return {
            "time": solver.time,
            "steps": solver.step_count,
            "points": len(solver.points),
            "wave_speed": solver.wave_speed,
            "energy_created": max(self.created, 0.0) / self.in_play if self.in_play > 0 else 0.0,
            "kinetic_energy": self.kinetic,
            "most_kinetic_energy": self.most_kinetic,
            "gravity_work": self.work,
            "stored_change": self.stored - self._at_first,
            "energy_balance": self.balance,
            "mass_error": self.mass_error,
            "most_stress": self.most_stress,
            "stress_bound": self.stress_bound,
            "most_speed": self.most_speed,
            "inflow_mass": self.inflow[-1] - self.inflow[0],
            **{f"clamped_{name}": float(count) for name, count in zip(CLAMPS, solver.clamps.sum(axis=0), strict=True)},
        }


def pore_water(solver):
    """Mass of the pore water of every point [kg/m]."""
    return solver._volumes() * solver.points["porosity"] * solver._water_density


def kinetic_energy(solver):
    """Of grains and pore water [J/m]."""
    inside = solver.element_of_point >= 0
    p = solver.points[inside]
    grains = p["grain_mass"] @ (p["velocity_solid_x"] ** 2 + p["velocity_solid_y"] ** 2)
    return 0.5 * float(
        grains + pore_water(solver)[inside] @ (p["velocity_liquid_x"] ** 2 + p["velocity_liquid_y"] ** 2)
    )


def strain_energy(solver):
    """Stored in skeleton and water [J/m]: 1/2 sigma : C^-1 : sigma + p^2 n / (2 K_w), times the volume."""
    inside = solver.element_of_point >= 0
    p, volume = solver.points[inside], solver._volumes()[inside]
    shear, lam = (solver.soils[name][solver.soil_of_point[inside]] for name in ("shear", "lame"))
    trace = p["stress_xx"] + p["stress_yy"] + p["stress_zz"]
    square = p["stress_xx"] ** 2 + p["stress_yy"] ** 2 + p["stress_zz"] ** 2 + 2 * p["stress_xy"] ** 2
    energy = (square - lam / (3 * lam + 2 * shear) * trace**2) / (4 * shear)
    if solver._water_modulus:
        energy = energy + np.maximum(p["pore_pressure"], 0.0) ** 2 * p["porosity"] / (2 * solver._water_modulus)
    return float(volume @ energy)


def largest_stress(solver):
    """Largest effective stress or pore pressure of the points in the mesh [Pa]; a negative pressure carries nothing."""
    p = solver.points[solver.element_of_point >= 0]
    return float(
        max(
            np.abs(values(p, ("stress_xx", "stress_yy", "stress_zz", "stress_xy"))).max(initial=0.0),
            p["pore_pressure"].max(initial=0.0),
        )
    )
