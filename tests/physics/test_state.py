"""A simulation continued from its state gives the bits of one that was never stopped."""

import itertools

import numpy as np
import pytest

import mpm
import mpm.solver
from mpm.state import ARRAYS, NUMBERS
from verification.small_event import small_scene

pytestmark = pytest.mark.slow

#: Attributes of a solver that its state leaves out: built from scene and mesh, or by sorting the points.
BUILT = {
    "scene", "mesh", "soils", "parts", "geometry", "neighbours", "fixed", "sides", "contact_of_node", "n_contact",
    "contact", "_contact_open", "_contact_closed", "lining", "threads", "initial_grain_mass", "initial", "workers",
    "needs",
    "_long_step", "_extremes_of_soils", "_empty", "_water_density", "_water_modulus", "start", "order", "occupied",
    "n_occupied", "n_active", "_cuts", "levels", "copies", "mirror_line",
    "moving", "wall", "clock", "_layout", "touched", "_spectrum", "_altitude",
}  # fmt: skip
#: Written by each step before it is read.
SCRATCH = {
    "tied_means", "momenta", "status", "_spare", "_left", "_counts", "_measures",
    "_suspended", "_bad", "_n_left", "_first_left",
}  # fmt: skip
STATE = {*ARRAYS, *NUMBERS, "gate_open", "_mapped", "_limits", "mode"}


@pytest.fixture(scope="module", params=["resolved", "sink", "altitude", "one step for all", "elastic lining"])
def scene(request):
    if request.param == "altitude":
        return small_scene(numerics={"critical_step": "altitude"})
    if request.param == "one step for all":
        return small_scene(numerics={"local_time_stepping": False})
    if request.param == "elastic lining":
        return small_scene(lining="elastic")
    return small_scene(interior=request.param)


@pytest.fixture(scope="module")
def mesh(scene):
    return mpm.build_mesh(scene)


def copied(state):
    return {name: value.copy() if isinstance(value, np.ndarray) else value for name, value in state.items()}


@pytest.fixture(scope="module")
def whole(scene, mesh):
    """Records and last state of an uninterrupted simulation, and states on the way, some inside of intervals."""
    simulation = mpm.Simulation(scene, mesh, threads=1)
    records, states = [simulation.begin()], []
    states.append((1, copied(simulation.state())))
    steps = itertools.count(1)
    while not simulation.done:
        record = simulation.advance(lambda: next(steps) % 7 == 0)
        if record is None:
            states.append((len(records), copied(simulation.state())))
        else:
            records.append(record)
    last = copied(simulation.state())
    assert (last["removed_mass"] > 0) == (scene.interior == "sink")
    return records, states, last


def assert_same_bits(value, other, where=""):
    if isinstance(value, dict):
        assert value.keys() == other.keys(), where
        for name in value:
            assert_same_bits(value[name], other[name], f"{where}.{name}")
    elif isinstance(value, list | tuple):
        assert len(value) == len(other), where
        for k, (a, b) in enumerate(zip(value, other, strict=True)):
            assert_same_bits(a, b, f"{where}[{k}]")
    elif isinstance(value, np.ndarray):
        assert value.shape == other.shape and value.tobytes() == other.tobytes(), where
    elif not where.endswith("cpu_seconds"):
        assert value == other, where


@pytest.mark.parametrize(("which", "threads"), [(0, 2), (2, 1), (-1, 2)])
def test_continued_simulation_gives_the_bits_of_the_whole(scene, mesh, whole, which, threads, monkeypatch):
    monkeypatch.setattr(mpm.solver, "SMALLEST_PARALLEL", 0)  # else a second thread would not be used
    records, states, last = whole
    count, state = states[which]
    simulation = mpm.Simulation(scene, mesh, threads)
    if simulation.solver.moving is not None:
        simulation.solver.wall[:] = np.nan
    for name in SCRATCH - {"_spare", "_left"}:
        array = getattr(simulation.solver, name)
        array[...] = np.nan if array.dtype.kind == "f" else 99
    simulation.restore(state)
    again = []
    while not simulation.done:
        again.append(simulation.advance())
    assert_same_bits([vars(r) for r in records[count:]], [vars(r) for r in again], "records")
    assert_same_bits(last, simulation.state(), "state")


def test_every_attribute_of_the_solver_is_stored_built_or_scratch(scene, mesh):
    # a new attribute that decides the future and is not stored would make resumed runs differ, perhaps rarely
    simulation = mpm.Simulation(scene, mesh)
    simulation.solver.map_points()
    assert vars(simulation.solver).keys() == STATE | BUILT | SCRATCH
    begun = vars(simulation).keys() - {"scene", "solver", "_progress", "_last_report"}
    stored = {
        "done",
        "_cpu_begin",
        "_interval",
        "_inside",
        "_begin",
        "_limits",
        "_next_snapshot",
        "_inflow",
        "_begin_substeps",
        "_checked",
        "_near",
        "_largest",
        "unborne_shear",
        "_reached",
    }
    assert begun == stored


def test_state_of_another_mesh_is_refused(scene, whole):
    coarser = small_scene(discretisation={"element_size": 4.0})
    with pytest.raises(ValueError, match="points must be"):
        mpm.Simulation(coarser).restore(whole[1][0][1])
