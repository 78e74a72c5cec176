"""What `plan` foretells is what a run then does."""

import pytest

import coupling
import mpm.solver
from coupling.datasets import read_history
from coupling.runs.plan import expected_time, plan, rough_plan
from verification.small_event import COARSE, small_scene


@pytest.mark.parametrize("intervals", [1, 4, 10])
@pytest.mark.slow
def test_planned_steps_are_those_that_are_run(tmp_path, intervals):
    """Steps are cut so that each output interval takes a whole number of them, in powers of two of the levels."""
    stop = {"time": 0.027, "inflow_mass": 1e9}
    scene = small_scene(gate="none", stop=stop, output={"interval": 0.027 / intervals})
    planned = plan(scene, threads=1)
    coupling.run(scene, tmp_path / "run", threads=1)
    history = read_history(tmp_path / "run").isel(time=-1)
    # nothing flows without a gate, so that the critical step stays that of the first state
    assert planned["expected_steps"] == int(history["steps"])
    assert planned["expected_point_steps"] == int(history["point_steps"])
    assert planned["steps_to_stop_time"] == planned["expected_steps"] and planned["records"] == 1 + intervals
    assert planned["expected_seconds"] == planned["expected_point_steps"] / planned["point_steps_per_second"]


@pytest.mark.slow
def test_planned_steps_of_a_gate_that_gushes_are_within_a_half_of_those_that_are_run(tmp_path):
    """The flow begins from rest; its critical step is some fifth shorter than that of ground at rest."""
    scene = small_scene(stop={"inflow_mass": 20.0, "time": 1.0}, output={"interval": 0.02})
    planned = plan(scene, threads=1)
    coupling.run(scene, tmp_path / "run", threads=1)
    last = read_history(tmp_path / "run").isel(time=-1)
    assert planned["expected_time"] == pytest.approx(float(last["time"]), rel=0.5)
    assert planned["expected_steps"] == pytest.approx(int(last["steps"]), rel=0.5)


@pytest.mark.parametrize(("inflow_mass", "time"), [(100.0, 0.238), (300.0, 0.564), (1000.0, 1.578)])
def test_expected_time_of_case_3_is_that_of_its_runs(inflow_mass, time):
    # docs/case-3-sensitivity.md, the mesh of the scene; a fifth: one share of free discharge for all of it
    scene = coupling.load_scene("case-3", stop={"inflow_mass": inflow_mass})
    assert expected_time(scene) == pytest.approx(time, rel=0.2)


@pytest.mark.slow
def test_plan_tells_the_threads_and_why_it_is_one_with_and_without_a_mesh(monkeypatch):
    monkeypatch.setattr(mpm.solver, "cores", lambda: 2)

    def threads(found):
        (row,) = (row for row in found["features"] if row["feature"] == "several threads")
        return row["active"], row["reason"]

    small = coupling.load_scene("quick", discretisation=COARSE)
    for found in (plan(small), rough_plan(small)):
        active, reason = threads(found)
        assert not active and reason.endswith("elements, a second thread pays from 4000")
    assert threads(rough_plan("quick")) == (True, "2 threads")
    assert threads(rough_plan("quick", threads=1)) == (False, "one was asked for")
    monkeypatch.setattr(mpm.solver, "cores", lambda: 1)
    assert threads(rough_plan("quick")) == (False, "one core")
