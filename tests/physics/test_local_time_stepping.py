"""Levels of elements that take steps of their own: how a mesh is cut into them, and what must not depend on it."""

import numpy as np
import pytest

import coupling
import mpm
from mpm.fields import block, numbers, values
from verification.boxes import box_mesh, box_scene
from verification.monitor import kinetic_energy
from verification.small_event import COARSE

GRADED = {**COARSE, "size_growth": 0.3}


def elastic_scene(wet, **numerics):
    """The small scene with soil that never fails, nothing that damps, and a mesh from 0.08 to 4 m.

    Dry soil has a strength that it never reaches: for it there are kernels already.
    """
    never = {"model": "elastic"} if wet else {"cohesion": 1e8, "tensile_strength": 1e8}
    soil = coupling.load_scene("quick").soils[0].model_dump(exclude_none=True) | never
    undamped = {"pic_rate": 0.0, "pressure_filter": 0.0, "relaxation_tolerance": 1e-3}
    changes = {} if wet else {"water": "none"}
    return coupling.load_scene(
        "quick", soils=[soil], discretisation=GRADED, numerics=undamped | numerics, **changes
    )  # fmt: skip


@pytest.fixture(scope="module")
def mesh():
    return mpm.build_mesh(elastic_scene(True))


def shaken(scene, mesh, amplitude=1e-4):
    """A solver whose points move in forty waves some metres long."""
    solver = mpm.Solver(scene, mesh, threads=1)
    rng = np.random.default_rng(1)
    wave, phase = rng.standard_normal((40, 2)), 2 * np.pi * rng.random(40)
    shape = np.cos(values(solver.points, ("x", "y")) @ wave.T + phase)
    velocity = amplitude * shape @ rng.standard_normal((40, 2))
    block(solver.points, "velocity_solid_x", "velocity_solid_y")[:] = velocity
    if scene.water is not None:
        block(solver.points, "velocity_liquid_x", "velocity_liquid_y")[:] = velocity
    solver.initial = solver.sums_over_points()
    return solver


def test_every_level_steps_within_the_limit_of_its_elements(mesh):
    solver = mpm.Solver(elastic_scene(True), mesh)
    levels, elements, altitude = solver.levels, solver.mesh.elements, solver.geometry["altitude"]
    assert levels.count >= 5
    # Level 0 begins between half and all of the smallest altitude; each further one at twice the altitude.
    assert (altitude >= 0.5 * altitude.min() * 2.0**levels.of_element).all()
    np.testing.assert_array_equal(np.sort(elements, axis=0), np.sort(mesh.elements, axis=0))
    np.testing.assert_array_equal(levels.node_of_row[levels.rows], elements)
    np.testing.assert_array_equal(levels.of_row[levels.rows], np.repeat(levels.of_element[:, None], 3, axis=1))
    finest = np.full(len(mesh.nodes), 99)
    np.minimum.at(finest, elements.ravel(), np.repeat(levels.of_element, 3))
    # No element stands alone in its level, and the smallest one has all elements around it in its own.
    assert (finest[elements].max(axis=1) == levels.of_element).all()
    around = (elements[:, :, None] == elements[np.argmin(altitude)]).any(axis=(1, 2))
    assert (levels.of_element[around] == 0).all()


def test_elements_of_one_size_are_one_level():
    mesh = box_mesh(np.linspace(-2, 2, 9), np.linspace(-4, 0, 9))
    solver = mpm.Solver(box_scene("column", 0.5, 4.0, 4.0, model="elastic"), mesh)
    assert solver.levels.count == 1 and len(solver.nodes) == len(mesh.nodes)


@pytest.mark.parametrize("wet", [False, True])
def test_momentum_is_conserved_across_levels(mesh, wet):
    scene = elastic_scene(wet)
    solver = shaken(scene, mesh)
    for _ in range(20):
        solver.step()
    assert solver.step_count >= 20 * 2 ** (solver.levels.count - 2)
    points, ledger = solver.points, numbers(solver.ledger).sum(axis=0)
    grains = points["grain_mass"]
    momentum = np.array([grains @ points["velocity_solid_x"], grains @ points["velocity_solid_y"]])
    if wet:
        porosity = points["porosity"]
        water = (
            scene.water.density
            * porosity
            * grains
            / (solver.soils["grain_density"][solver.soil_of_point] * (1 - porosity))
        )
        momentum += [water @ points["velocity_liquid_x"], water @ points["velocity_liquid_y"]]
    change = momentum - solver.initial["momentum"]
    # Grains: rounding of sums over 1e4 points and 1e3 steps. Water: its mass in a point follows the porosity, which
    # changes by strains of 1e-6 here.
    impulse = float(np.abs(ledger[:2]).max())
    assert impulse > 0
    np.testing.assert_allclose(change, ledger[:2], rtol=0, atol=(1e-5 if wet else 1e-11) * impulse)


@pytest.mark.slow
@pytest.mark.parametrize("wet", [False, True])
def test_undamped_motion_does_not_grow_across_levels(mesh, wet):
    # Forces held back at the nodes between two levels drive motions: without `Levels.ahead` the energy grows a
    # hundredfold (with water, in 1 s) or threefold (without).
    solver = shaken(elastic_scene(wet, courant=1.0), mesh)
    energy, begin = [], kinetic_energy(solver)
    while solver.time < (1.0 if wet else 8.0):
        solver.step()
        energy.append(kinetic_energy(solver))
    early, late = energy[: len(energy) // 4], energy[-len(energy) // 4 :]
    assert max(late) < max(early) and begin > 0


def graded_column(coarse, fine, width=1.6, depth=24.0):
    """A column of cells that are as wide as the coarse ones, which are squares, below and flat above half its depth."""
    low, high = np.arange(-depth, -depth / 2 - 1e-9, coarse), np.arange(-depth / 2, 1e-9, fine)
    return box_mesh(np.arange(-width / 2, width / 2 + 1e-9, coarse), np.concatenate([low, high]))


def pulse_error(local, courant=0.8, coarse=0.4, fine=0.1):
    """Error of a velocity pulse after it has split, half of it from coarse to fine elements.

    Norm: root mean square over that of the exact answer, d'Alembert: v(y, t) = (f(y - c t) + f(y + c t)) / 2 with
    images at the free surface (same sign) and at the fixed bottom (opposite sign).
    """
    scene = box_scene("pulse", 0.4, 1.6, 24.0, gravity=1e-9, model="elastic", courant=courant, pic_rate=0.0,
                      stress_damping=0.0, local_time_stepping=local)  # fmt: skip
    solver = mpm.Solver(scene, graded_column(coarse, fine), threads=1)
    assert (solver.levels.count > 1) == local
    speed, start, length = solver.wave_speed, -15.0, 2.5

    def pulse(y):
        return 1e-6 * np.exp(-(((y - start) / length) ** 2))

    def exact(y, t):
        ways = (speed * t, -speed * t)
        return 0.5 * sum(pulse(y - way) + pulse(-y - way) - pulse(-48.0 - y - way) for way in ways)

    solver.points["velocity_solid_y"] = pulse(solver.points["y"])
    end = 6.0 / speed
    while solver.time < end * (1 - 1e-12):
        solver.step(end - solver.time)
    answer = exact(solver.points["y"], end)
    return float(np.sqrt(np.mean((solver.points["velocity_solid_y"] - answer) ** 2) / np.mean(answer**2)))


def test_wave_runs_through_the_border_of_levels():
    together, local, finer = pulse_error(False), pulse_error(True), pulse_error(True, coarse=0.2, fine=0.05)
    # What linear elements of 0.4 m make of the pulse. The border adds a reflection that is smaller than that,
    assert local < 1.5 * together
    # and vanishes with the mesh: second order, less what a border of any width takes.
    assert finer < 0.5 * local
