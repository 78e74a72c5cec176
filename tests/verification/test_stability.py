"""Linear stability of the step, and a dozen of the extremes of `gush stability`; all of them: docs/stability.md."""

import json
import math
from dataclasses import asdict

import numpy as np
import pytest

from mpm.fields import block
from mpm.solver import Solver
from verification.monitor import Monitor, follow
from verification.pages import templated_page
from verification.stability.amplification import STABLE as NO_GROWTH
from verification.stability.amplification import Amplification, Column
from verification.stability.linear import critical_map
from verification.stability.report import families, write
from verification.stability.small_scenes import block_scene, box_of
from verification.stability.trials import Case, cases
from verification.stability.verdicts import BUG, STABLE, judge, judge_apart

pytestmark = pytest.mark.slow

REPRESENTATIVE = [name for name, case in cases().items() if case.representative]
COLUMNS = {
    "as it is": {},
    "real water": {"bulk_modulus": 2.2e9},
    "dry": {"bulk_modulus": None},
    "clay": {"hydraulic_conductivity": 1e-12},
    "undrained": {"drainage": "undrained"},
    "gravel": {"hydraulic_conductivity": 10.0},
    "stiff and loose": {"youngs_modulus": 1e10, "porosity": 0.89, "hydraulic_conductivity": 1e-8},
    "one point": {"points": 1},
    "edges": {"positions": "edges"},
    "stress ahead by two steps": {"stress_damping": 2.0},
    "stress ahead by two steps, gravel": {"stress_damping": 2.0, "hydraulic_conductivity": 10.0},
    "no damping": {"stress_damping": 0.0},
    "vertices, flat, no damping": {"positions": "vertices", "aspect": 3.0, "stress_damping": 0.0},
    "full filter": {"pressure_filter": 1.0},
    "full filter, skew, random": {"pressure_filter": 1.0, "skew": 0.2, "positions": "random"},
    "pure PIC": {"pic_rate": 1e6},
    "skew": {"skew": 0.2},
    "1 mm": {"size": 1e-3},
    "10 m": {"size": 10.0},
}


@pytest.mark.parametrize("settings", COLUMNS.values(), ids=COLUMNS)
def test_spectral_step_lies_between_seven_tenths_and_all_of_the_exact_critical_step(settings):
    column = Amplification(Column(**settings))
    for share in (0.1, 0.3, 0.5, 0.7, 0.85, 1.0):  # the critical step is the first at which something grows
        assert column.spectral_radius(share * column.spectral) < 1 + NO_GROWTH, share
    assert column.spectral_radius(column.spectral / 0.7) > 1 + NO_GROWTH
    assert column.leak < 1e-8  # the matrix is exact: round-off over the size of a perturbation


def test_growth_begins_at_the_critical_step():
    column = Amplification(Column())
    exact = column.critical_time_step(accuracy=1e-3)
    assert column.spectral_radius(0.98 * exact) < 1 + 1e-6  # round-off of a double eigenvalue at 1
    assert column.spectral_radius(1.02 * exact) > 1.1  # -1 splits like the root of the excess


def test_matrix_predicts_the_solver():
    # one step of the solver from a random state of the matrix's space is the matrix times that state
    column = Amplification(Column(hydraulic_conductivity=1e-2))
    dt = 0.5 * column.altitude
    matrix = column.matrix(dt)
    state = np.random.default_rng(3).standard_normal(column.size) * 1e-2
    assert column.step(state, dt) == pytest.approx(matrix @ state, abs=1e-8)


def test_undrained_critical_step_does_not_depend_on_permeability_and_scales_with_the_cell():
    small, large = (
        Amplification(Column(hydraulic_conductivity=1e-12, size=size)).critical_time_step() for size in (1e-2, 1.0)
    )
    assert large == pytest.approx(100 * small, rel=0.01)  # twice the accuracy of the bisection


def test_map_is_a_dataset_with_units():
    found = critical_map([("dry", Column(bulk_modulus=None)), ("wet", Column())])
    assert found.sizes["configuration"] == 2
    assert found.actual.attrs["units"] == "s"
    assert math.isnan(found.bulk_modulus[0]) and (found.leak < 1e-8).all()


def test_a_run_with_spectral_steps_takes_longer_ones_to_the_same_end():
    ends = {}
    for way in ("altitude", "spectral"):
        scene = block_scene(0.1)
        numerics = scene.numerics.model_copy(update={"critical_step": way})
        solver = Solver(scene.model_copy(update={"numerics": numerics}), box_of(0.1, 0, 12, 0, 8), threads=1)
        solver.points["velocity_solid_x"] = 1e-3 * np.cos(np.pi * solver.points["x"] / 1.2)  # a long wave
        while solver.time < 0.02 * (1 - 1e-12):
            solver.step(0.02 - solver.time)
        ends[way] = solver.step_count, solver.points_by_name()["pore_pressure"]
    # the altitude does not know of the damping, which lowers the critical step
    assert ends["spectral"][0] < 0.6 * math.sqrt(1 + 2 * numerics.stress_damping) * ends["altitude"][0]
    change = np.ptp(ends["altitude"][1])
    assert np.abs(ends["spectral"][1] - ends["altitude"][1]).max() < 0.02 * change


@pytest.mark.parametrize("name", REPRESENTATIVE)
def test_extreme_is_stable(name):
    verdict = judge(cases()[name])
    assert verdict.verdict == STABLE, verdict.reason


def test_page_and_data_hold_the_map_and_the_extremes(tmp_path):
    found = critical_map([("dry", Column(bulk_modulus=None)), ("wet", Column())])
    verdict = judge(Case("still", "nothing happens", lambda: (["moves"], {})))
    data = {"linear": families(found), "reading": {}, "extremes": [asdict(verdict)]}
    page = templated_page(tmp_path, "stability")
    files = write(page, data, None)
    text = (tmp_path / "stability.md").read_text()
    assert "| still | nothing happens | bug |" in text and "1 bug" in text and "moves" in text
    assert json.loads((tmp_path / "stability.json").read_text()) == data
    assert files == sorted([str(tmp_path / "stability.md"), str(tmp_path / "stability.json")])


def test_energy_from_nothing_is_found():
    # grains that are pushed on behind the back of the solver: a per cent of their velocity each step
    class Pushed(Solver):
        def step(self, dt_max=math.inf):
            done = super().step(dt_max)
            block(self.points, "velocity_solid_x", "velocity_solid_y")[:] *= 1.01
            return done

    faults = {}
    for kind in (Solver, Pushed):
        solver = kind(block_scene(0.1, bulk_modulus=None), box_of(0.1, 0, 6, 0, 6), threads=1)
        solver.points["velocity_solid_x"] = 1e-3 * np.cos(np.pi * solver.points["x"] / 0.6)
        faults[kind], _ = follow(Monitor(solver), 0.1)
    assert not any("energy from nothing" in fault for fault in faults[Solver])
    faults = faults[Pushed]
    assert any("energy from nothing" in fault for fault in faults)


def test_a_crash_and_a_hang_become_verdicts():
    def fails():
        raise ZeroDivisionError("on purpose")

    assert judge(Case("x", "", fails)).verdict == BUG
    assert judge_apart(cases()["collapse,ten times"], limit=0.5).reason == "not done after 0.5 s"
