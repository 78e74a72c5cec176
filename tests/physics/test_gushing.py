"""The gate opens: what must hold whatever the numbers are."""

import itertools
import math

import numpy as np
import pytest

import coupling
import mpm
import mpm.scene
import mpm.solver
from mpm.fields import values
from mpm.simulation import STEPS_BETWEEN_CHECKS
from verification.small_event import small_scene

pytestmark = pytest.mark.slow


def quick(**changes):
    return coupling.load_scene("quick").model_copy(update=changes)


def test_inflow_grows_and_grains_are_conserved(event):
    _, records = event
    inflow = [r.inflow_mass for r in records]
    assert all(b >= a for a, b in itertools.pairwise(inflow)) and inflow[-1] >= 60.0
    mass = np.array([r.grain_mass for r in records])
    assert np.abs(mass / mass[0] - 1).max() < 1e-10


def test_pressure_leaves_the_gate_for_its_surroundings(event):
    scene, records = event
    first, last = records[0].lining[0], records[-1].lining[0]

    def ratio(name, *angles):
        here = [int(np.argmin(np.abs(first["theta"] - a))) for a in angles]
        return np.mean(last[name][here]) / np.mean(first[name][here])

    gate = scene.gate.angle
    assert ratio("water_pressure", gate - 4, gate + 4) < 1 / 3
    assert ratio("soil_pressure", 0.0) > 1.0 and ratio("soil_pressure", 180.0) > 1.0
    # slip along the lining has given the crown 5 % more than the weight above it before: against that weight
    crown = last["soil_pressure"][np.argmin(np.cos(np.radians(last["theta"] - 180.0)))]
    assert crown > 1.05 * scene.vertical_stress(scene.tunnels[0].cover)
    assert ratio("soil_pressure", gate - 30, gate + 30) > 1.2  # the arch


def test_flow_zone_grows(event):
    _, records = event
    area = [r.flow_zone_area for r in records]
    assert area[0] == 0.0 and all(b >= a - 1e-9 for a, b in itertools.pairwise(area)) and area[-1] > 0.3


def test_result_has_the_same_bits_for_any_number_of_threads_and_of_steps_at_once():
    scene = coupling.load_scene("quick")
    mesh = mpm.build_mesh(scene)
    solvers, batches = [], []
    for threads, most_substeps in ((1, 1), (2, math.inf), (4, 100)):
        solver = mpm.Solver(scene, mesh, threads=threads)
        solver.relax()
        solver.open_gate()
        batches.append(0)
        while solver.time < 0.05:
            limits = solver.advance(0.05, most_substeps)
            assert limits and set(limits) <= {"acoustic", "advective", "output"}
            batches[-1] += 1
        solvers.append(solver)
    assert len(mesh.elements) > mpm.solver.SMALLEST_PARALLEL  # else the other runs were serial too
    assert batches[0] == solvers[0].long_step_count >= 25
    assert batches[0] > batches[2] > batches[1]
    for other in solvers[1:]:
        assert other.long_step_count == solvers[0].long_step_count and other.time == solvers[0].time
        for name in ("points", "nodes", "sums", "impulse", "ledger", "clamps"):
            assert np.array_equal(getattr(other, name), getattr(solvers[0], name)), name


def test_gate_on_the_left_mirrors_the_gate_on_the_right():
    scene = small_scene()
    mesh = mpm.build_mesh(scene)
    left = scene.model_copy(update={"gate": scene.gate.model_copy(update={"angle": 270.0})})
    pressures = []
    for case, its_mesh in ((scene, mesh), (left, mesh.mirrored())):
        solver = mpm.Solver(case, its_mesh)
        solver.relax()
        solver.open_gate()
        while solver.time < 0.05:
            solver.step(0.05 - solver.time)
        lining = solver.lining_pressures(solver.time)[0]
        theta = lining["theta"] if case is scene else (360.0 - lining["theta"]) % 360.0
        order = np.argsort(theta)
        pressures.append(np.array([lining[k][order] for k in ("soil_pressure", "water_pressure")]))
    right, left = pressures
    assert np.abs(left - right).max() < 1e-6 * right.max()


def test_run_that_goes_wrong_names_cause_time_and_place():
    solver = mpm.Solver(quick(), mpm.build_mesh(quick()))
    solver.relax()
    solver.open_gate()
    solver.step()
    solver.points["velocity_solid_x"][1000] = np.nan
    with pytest.raises(mpm.RunFailed) as failure:
        solver.step()
    assert "non-finite" in str(failure.value) and failure.value.time == solver.time
    assert np.all(np.abs(failure.value.place) < 100)


def test_run_with_a_point_faster_than_weight_can_make_it_stops_as_unstable():
    simulation = mpm.Simulation(quick())
    simulation.begin()
    while simulation.solver.step_count < 2 * STEPS_BETWEEN_CHECKS:  # without the push it goes on
        simulation.advance()
    simulation.solver.points[["velocity_solid_x", "velocity_solid_y"]][1000] = 2e3
    place = values(simulation.solver.points[1000], ("x", "y")).copy()
    with pytest.raises(mpm.RunFailed, match="unstable") as failure:
        while not simulation.done:
            simulation.advance()
    assert failure.value.time > 0
    assert np.hypot(*(failure.value.place - place)) < 5


def test_sink_takes_material_out_and_counts_it():
    scene = small_scene(interior="sink")
    mesh = mpm.build_mesh(scene)
    solver = mpm.Solver(scene, mesh)
    total = np.sum(solver.points["grain_mass"])
    solver.relax()
    solver.open_gate()
    while solver.time < 0.25:
        solver.step()
    gone = solver.element_of_point < 0
    tunnel = scene.tunnels[0]
    radius = np.hypot(solver.points["x"] - tunnel.x, solver.points["y"] + tunnel.axis_depth)
    # what has passed the inner face's circle, but not yet the edge of its polygon, is inside as well
    came = np.sum(solver.points["grain_mass"][gone | (radius < tunnel.inner_radius)])
    assert gone.any() and solver.inflow_mass() == pytest.approx(came, rel=1e-12)
    assert np.sum(solver.points["grain_mass"]) == pytest.approx(total, rel=1e-12)
    assert radius[~gone].min() > 0.98 * tunnel.inner_radius
