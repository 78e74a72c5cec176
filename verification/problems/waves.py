"""Standing compression waves in a column: one phase, undrained, both waves of two phases, damped by drag."""

import math

import numpy as np

from mpm.solver import Solver
from verification.boxes import STRESS, box_mesh, box_scene, put, run_to, state
from verification.monitor import kinetic_energy, strain_energy
from verification.problems.columns import DRAINAGE, column
from verification.problems.exact_two_phase import exact_velocities, modes
from verification.problems.problem import NUMERICS, WET, Problem, Result, register

HEIGHT = 10.0  # [m]


def two_phase_wave(cells=20, conductivity=1.0, bulk_modulus=8e7, mode="fast", periods=2.0, **numerics):
    """Quarter of a standing wave in a column of 10 m, fixed at the bottom, free at the top, under its own weight.

    mode : "fast", "slow" or "together" (grains and water start with one velocity); periods : of the undamped wave, with
    "together" of the fast one. The amplitude is so small that no pressure becomes negative near the free surface.
    """
    scene, mesh = column(cells, HEIGHT, conductivity, bulk_modulus, **numerics)
    solver = Solver(scene, mesh, threads=1)
    kappa = math.pi / (2 * HEIGHT)
    strain = np.cos(kappa * (state(solver, "y") + HEIGHT))
    # water is as stiff as K_w + p: the mean of p where the wave strains it
    bulk_modulus += float((strain**2 @ state(solver, "pore_pressure")) / (strain @ strain))
    speeds, shapes = modes(bulk_modulus)
    shape = np.ones(2) if mode == "together" else shapes[1 if mode == "fast" else 0]
    amplitude = 1e-5 * shape / np.abs(shape).max()
    wave = np.sin(kappa * (state(solver, "y") + HEIGHT))
    put(solver, velocity_solid_y=amplitude[0] * wave, velocity_liquid_y=amplitude[1] * wave)
    times, measured = [], []

    def look(dt):
        wave = np.sin(kappa * (state(solver, "y") + HEIGHT))
        times.append(solver.time - 0.5 * dt)  # velocities belong to the middle of a step
        measured.append(wave @ state(solver, "velocity_solid_y", "velocity_liquid_y") / (wave @ wave))

    end = periods * 2 * math.pi / kappa / speeds[0 if mode == "slow" else 1]
    seconds = run_to(solver, end, after=look)
    exact = exact_velocities(amplitude, kappa, times, bulk_modulus, conductivity)
    miss = (np.array(measured) - exact) / np.abs(amplitude).max()
    crossings = [zero_crossings(times, np.asarray(a)[:, 0]) for a in (measured, exact)]
    late = math.nan
    if min(len(c) for c in crossings) >= 3:
        spans = [c[2] - c[0] for c in crossings]
        late = spans[1] / spans[0] - 1
    return Result.of(solver, seconds, np.sqrt(np.mean(miss**2)), largest=np.abs(miss).max(), wave_speed_error=late)


def zero_crossings(times, values):
    """Times at which a sampled signal changes its sign, linear between the samples."""
    times, values = np.asarray(times), np.asarray(values)
    k = np.flatnonzero(values[:-1] * values[1:] < 0)
    return times[k] - values[k] * (times[k + 1] - times[k]) / (values[k + 1] - values[k])


def bar(cells=20, periods=5.0, **numerics):
    """A bar without lateral strain, fixed at one end, swings in its lowest mode: velocity and energy.

    Reference: omega = pi c / (2 L), c^2 = E / rho, of Kelvin and Voigt's body whose time is `stress_damping` steps:
    v'' + omega^2 tau v' + omega^2 v = 0. Without it the sum of kinetic and strain energy is constant.
    """
    size, length = 1.0 / cells, 1.0
    scene = box_scene("bar", size, 2 * size, length, 1e-9, model="elastic", poissons_ratio=0.0, **numerics)
    solver = Solver(scene, box_mesh([-size, 0.0, size], np.linspace(-1, 0, cells + 1)), threads=1)
    put(solver, **dict.fromkeys((*STRESS[:3], "pore_pressure"), 0.0))
    soil = scene.soils[0]
    speed = math.sqrt(soil.youngs_modulus / ((1 - soil.porosity) * soil.grain_density))
    omega, amplitude = math.pi * speed / (2 * length), 1e-4 * speed
    put(solver, velocity_solid_y=amplitude * np.sin(math.pi / 2 * (state(solver, "y") + length)))
    stored = [strain_energy(solver)]
    begin = kinetic_energy(solver) + stored[0]
    times, swing, energy = [], [], []

    def look(dt):
        shape = np.sin(math.pi / 2 * (state(solver, "y") + length))
        times.append(solver.time - 0.5 * dt)
        swing.append(shape @ state(solver, "velocity_solid_y") / (shape @ shape) / amplitude)
        before, stored[0] = stored[0], strain_energy(solver)
        energy.append((kinetic_energy(solver) + 0.5 * (before + stored[0])) / begin - 1)

    end = periods * 2 * math.pi / omega
    seconds = run_to(solver, end, after=look)
    times = np.array(times)
    decay = 0.5 * omega**2 * scene.numerics.stress_damping * end / solver.step_count
    turn = math.sqrt(omega**2 - decay**2)
    exact = np.exp(-decay * times) * (np.cos(turn * times) - decay / turn * np.sin(turn * times))
    crossings = zero_crossings(times, swing)
    last = (len(crossings) - 0.5) * math.pi / omega
    return Result.of(
        solver, seconds, np.sqrt(np.mean((np.array(swing) - exact) ** 2)), energy=np.abs(energy).max(),
        energy_at_the_end=np.mean(energy[-20:]), wave_speed_error=last / crossings[-1] - 1, decay=decay * end,
    )  # fmt: skip


# The slow wave has stiff water: its own weight compresses soft water by 0.1 %, which linear waves do not know.
#: Without what damps: what is measured is the wave. `damped-bar` measures the damping.
FREE = {"stress_damping": 0.0, "pic_rate": 0.0}
LADDER = {"cells": (5, 10, 20, 40), **NUMERICS, **WET, "bulk_modulus": (8e7, 2.2e9)}
TOO_SLOW = "phase after two periods: 20 linear elements a quarter wave are 0.2 % too slow"
NORM = "root mean square, over phases and time, of the amplitude's error over the initial amplitude"
SOURCE = "matrix exponential of the two-phase equations of a standing wave (Xie et al., Eqs. 1 and 2)"

register(Problem(
    name="bar", title="free vibration of an elastic bar", source="omega = pi c / (2 L), c^2 = E / rho",
    norm="root mean square over five periods of the amplitude's error", solve=bar, fast={"cells": 20, **FREE},
    ladder={"cells": (5, 10, 20, 40), "periods": (2.0, 5.0, 20.0), **NUMERICS},
    limit=0.02, why="the phase after five periods: linear elements of a twentieth of the bar are 0.1 % too slow",
))  # fmt: skip

register(Problem(
    name="damped-bar", title="free vibration of a bar that the damping of the stress slows down",
    source="Kelvin and Voigt: v'' + omega^2 tau v' + omega^2 v = 0, tau the share `stress_damping` of the step",
    norm="root mean square over five periods of the amplitude's error", solve=bar, fast={"cells": 20},
    ladder={"cells": (5, 10, 20, 40), "stress_damping": (0.0, 0.5, 1.0), "courant": (0.4, 0.8, 1.0)},
    limit=0.01, why="as without damping, with 15 % of the amplitude gone after five periods",
))  # fmt: skip

for name, title, fast, limit, why in (
    ("undrained-wave", "grains and water move together where the permeability is small",
     {"conductivity": 1e-9, "mode": "together"}, 0.015, TOO_SLOW),
    ("fast-wave", "fast wave, grains and water in phase, almost without drag",
     {"conductivity": 1.0, "mode": "fast"}, 0.015, TOO_SLOW),
    ("slow-wave", "slow wave, grains against water, almost without drag",
     {"conductivity": 10.0, "mode": "slow", "bulk_modulus": 2.2e9}, 0.015, TOO_SLOW),
    ("damped-wave", "both waves together, damped by drag",
     {"conductivity": 2e-2, "mode": "together"}, 0.015, TOO_SLOW),
):  # fmt: skip
    register(Problem(
        name=name, title=title, source=SOURCE, norm=NORM, solve=two_phase_wave, fast={"cells": 20, **FREE, **fast},
        ladder=LADDER | ({"drainage": DRAINAGE} if name == "undrained-wave" else {}), limit=limit, why=why,
    ))  # fmt: skip
