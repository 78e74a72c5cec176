"""The event ends with the step that passes the inflow mass of its stop, and its last record is there."""

import numpy as np
import pytest

import mpm
from verification.small_event import small_scene


def steps_of(scene):
    """Records of an event, and of each of its calls: inflow before and after [kg/m], length [s], step possible [s]."""
    simulation = mpm.Simulation(scene, threads=1)
    records, calls = [simulation.begin()], []
    solver, advance = simulation.solver, simulation.solver.advance

    def watched(end, most):
        before, begin, shortest = solver.inflow_mass(), solver.time, solver.time_step_estimate()[0]
        limits = advance(end, most)
        calls.append((before, solver.inflow_mass(), solver.time - begin, shortest))
        return limits

    solver.advance = watched
    while not simulation.done:
        records.append(simulation.advance())
    return records, np.array(calls)


@pytest.mark.slow
@pytest.mark.parametrize("interval", [0.005, 0.5])
@pytest.mark.parametrize("target", [1.0, 20.0])
def test_event_ends_with_the_step_of_the_smallest_elements_that_passes_the_inflow(interval, target):
    scene = small_scene(stop={"inflow_mass": target, "time": 0.5}, output={"interval": interval})
    records, calls = steps_of(scene)
    before, after, length, shortest = calls[-1]
    assert before < target <= after == records[-1].inflow_mass
    # 1e-9: times are sums
    assert length <= shortest * (1 + 1e-9)
    assert (calls[:-1, 1] < target).all()


@pytest.mark.slow
def test_steps_are_not_shortened_far_from_the_stop():
    far, alone = (
        steps_of(small_scene(stop=stop, output={"interval": 0.02}))[0][-1].steps
        for stop in ({"inflow_mass": 500.0, "time": 0.1}, {"time": 0.1})
    )
    assert far == alone
