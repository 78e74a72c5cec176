"""Balances of a run: energies of a fall by hand, conservation while material gushes, and how they reach the user."""

import re

import numpy as np
import pytest
from test_gushing import quick
from test_heap import dropped_block

from coupling.commands.describe import describe
from coupling.datasets import read_attributes, read_history, read_response, write_attributes
from coupling.postprocess.quality import (
    ERRORS,
    poor_errors,
    quality,
    quality_attributes,
    quality_line,
    states_line,
    verdicts,
)
from coupling.runs.run import run
from mpm import simulate
from mpm.errors import COMPARED, errors, largest_so_far
from mpm.scene import Numerics
from verification.small_event import small_scene
from verification.synthetic_run import make_quick_scene

pytestmark = pytest.mark.slow


def test_fall_turns_the_work_of_gravity_into_motion():
    solver = dropped_block()
    solver.initial = solver.sums_over_points()  # the block was made free of pressure after it was built
    while solver.time < 0.2:
        solver.step(0.2 - solver.time)
    balances = solver.balances()
    grains = solver.points["grain_mass"].sum()
    mass = grains + solver.initial["water"]
    # m g h with h = g t^2/2; 1e-12: no stress, no drag, no wall, so only rounding
    assert balances["work_gravity"] == pytest.approx(mass * 9.81 * 0.5 * 9.81 * 0.2**2, rel=1e-12)
    assert balances["kinetic_energy_change"] == pytest.approx(balances["work_gravity"], rel=1e-12)
    for name in ("work_stress", "work_drag", "transfer_loss"):
        assert abs(balances[name]) < 1e-9 * balances["work_gravity"]
    received = mass * 9.81 * 0.2
    assert balances["momentum_departure"] < 1e-12 * received
    assert abs(balances["water_missing"]) < 1e-12 * solver.initial["water"]
    # all of it fell by 0.2 m, more than the 50 mm of the flow zone, as one block
    assert balances["flow_momentum"] == pytest.approx(received, rel=1e-12)
    assert balances["moving_energy"] == pytest.approx(balances["work_gravity"], rel=1e-12)
    assert balances["flow_water"] == pytest.approx(solver.initial["water"], rel=1e-12)
    assert balances["overlap_volume"] < 1e-9 and solver.tip_fraction() == pytest.approx(1.0)


def test_impact_takes_the_energy_of_the_fall():
    solver = dropped_block()
    while solver.time < 1.0:
        solver.step(1.0 - solver.time)
    balances = solver.balances()
    # At rest again what gravity gave is in stress, drag, walls and transfers; motion keeps less than a twentieth.
    assert 0 <= balances["kinetic_energy_change"] < 0.05 * balances["work_gravity"]
    assert balances["work_stress"] < 0 and balances["work_drag"] <= 0


def test_balances_while_material_gushes(event):
    _, records = event
    last = records[-1].balances
    errors = records[-1].errors
    # The grains' momentum is conserved to rounding. The water's is that of its points, whose water content changes as
    # water flows through them. Water flows between points; what one loses another gets up to the quadrature of the
    # divergence. With three elements across the gate that is ten times what the shipped scenes have; not nothing,
    # which would show that they are compared with the wrong thing.
    assert 1e-3 < errors["momentum_error"] < 0.15 and 1e-4 < errors["water_lost"] < 0.15
    assert 1e-3 < errors["flow_overlap"] < 0.15 and errors["overlap"] < 1e-2 * errors["flow_overlap"]
    assert last["contact_error"] < 1e-13
    # At most the scene's Courant number by the state before; the jet may speed up by a tenth within a step.
    courant = Numerics().courant
    assert 0.5 * courant <= last["largest_courant"] < 1.2 * courant
    # stress that counts with area works on other volumes than those of the points: it gives and takes a little
    assert 1e-3 < errors["energy_error"] < 0.05


def test_transfers_take_the_energy_that_flutter_feeds(event):
    scene, records = event
    undamped = scene.changed(numerics={"stress_damping": 0.0}, stop={"inflow_mass": 40.0})  # the error only grows
    with_it, without = (some[-1].errors["energy_error"] for some in (records, list(simulate(undamped))))
    assert with_it < ERRORS["energy_error"].good and without > 2 * with_it


def test_overlap_is_what_a_cell_holds_beyond_its_area():
    solver = dropped_block()
    cells = solver.element_of_point // 4
    assert solver.flow_amounts()["overlap_volume"] == 0.0
    one = cells == cells[0]
    area = solver._volumes()[one].sum()
    solver.points["grain_mass"][one] *= 1.25
    solver.points["y_initial"][np.flatnonzero(one)[: one.sum() // 2]] += 1.0  # half of its points came from elsewhere
    amounts = solver.flow_amounts()
    assert amounts["overlap_volume"] == pytest.approx(0.25 * area, rel=1e-9)
    assert amounts["flow_overlap_volume"] == pytest.approx(0.125 * area, rel=1e-9)
    assert amounts["flow_volume"] == pytest.approx(0.625 * area, rel=1e-9)


def test_water_lost_is_a_share_of_what_came_through_the_gate():
    amounts = {name: 1.0 for departure, others in COMPARED.values() for name in (departure, *others)}
    before = largest_so_far({}, amounts | {"water_missing": -3.0, "water_inflow": 0.0, "flow_water": 30.0})
    assert errors(before)["water_lost"] == pytest.approx(0.1)  # while none came in, of what moved
    after = largest_so_far(before, amounts | {"water_missing": 1.0, "water_inflow": 6.0, "flow_water": 300.0})
    assert errors(after)["water_lost"] == pytest.approx(0.5)  # water made and lost again was made
    dry = dict.fromkeys(amounts, 0.0)
    assert set(errors(largest_so_far({}, dry)).values()) == {0.0}


def test_jet_at_rest_keeps_the_error_that_it_made():
    amounts = {name: 1.0 for departure, others in COMPARED.values() for name in (departure, *others)}
    moving = largest_so_far({}, amounts | {"momentum_departure": 2.0, "flow_momentum": 40.0})
    at_rest = largest_so_far(moving, amounts | {"momentum_departure": 2.0, "flow_momentum": 0.0})
    assert errors(at_rest)["momentum_error"] == errors(moving)["momentum_error"] == pytest.approx(0.05)


def test_sink_takes_momentum_and_water_that_are_accounted_for():
    records = list(simulate(small_scene(interior="sink")))
    last = records[-1]
    assert last.inflow_mass > 30.0  # taken out at the inner end of the channel
    # water of 30 kg/m of grains is 10 kg/m; left out of the account it would be lost, all of it
    assert last.balances["water_inflow"] > 10.0
    assert last.errors["water_lost"] < 0.3 and last.errors["momentum_error"] < 0.3


def test_sand_that_is_not_pressed_together_is_at_the_tip_of_the_cone(event):
    _, records = event
    assert records[0].tip_fraction == 0.0  # at rest everything is pressed together
    # a few per cent of the points, though more of the point-steps: points that flow are small and step often
    assert 0.001 < records[-1].tip_fraction < 0.2
    values = {"tip_fraction": 0.02, "clamps": {"tension": 0.14, "cavitated": 0.03, "porosity_floor": 0.0}}
    assert states_line({"clamps": {}}) == "none"
    assert states_line(values) == (
        "tip of the Mohr-Coulomb cone 2.0% of points, 14.00% of point-steps; pores not full 3.00% of point-steps"
    )


def test_verdicts_by_their_limits_and_a_remedy_for_what_is_poor():
    for name, judged in ERRORS.items():
        for value, verdict in ((judged.good, "good"), (1.001 * judged.fair, "poor"), (np.nan, "poor")):
            assert verdicts({name: value}) == {name: verdict}
        told = poor_errors({name: 1.001 * judged.fair})
        assert len(told) == 1 and told[0].startswith(judged.label) and told[0].endswith(judged.remedy)
        assert not poor_errors({name: judged.fair})
    assert quality_line({"water_lost": 0.06}) == "water lost 6.0% of what came in (fair)"


def test_knobs_that_remedies_name_are_of_the_scene():
    scene = quick()
    for judged in ERRORS.values():
        for table, knob in re.findall(r"(numerics|discretisation)\.(\w+)", judged.remedy):
            assert hasattr(getattr(scene, table), knob), knob


@pytest.mark.usefixtures("undrawn")
def test_quality_is_in_the_file_the_log_and_the_line(simulated, tmp_path):
    folder = tmp_path / "run"
    run(make_quick_scene(), folder, figures=True)
    values = quality(read_history(folder), read_response(folder))
    attributes = read_attributes(folder)
    for name, value in quality_attributes(values).items():
        assert attributes[name] == pytest.approx(value)
    line = quality_line(values)
    assert "water lost 0.0% of what came in (good)" in line and "grain mass 0e+00 (good)" in line
    assert "lining equilibrium" in line and line in (folder / "run.log").read_text()
    facts = describe(folder)["facts"]
    assert facts["errors"] == line and "warning 1" not in facts
    write_attributes(folder / "run.nc", quality_water_lost=0.4)
    assert "40.0% of what came in (poor)" in describe(folder)["facts"]["errors"]
    assert "points_per_element_gate" in describe(folder)["facts"]["warning 1"]


def test_quality_reports_the_worst_record():
    class History(dict):
        def isel(self, time):
            return {name: values[time] for name, values in self.items()}

    class Values(np.ndarray):
        values = property(np.asarray)

    names = ("point_steps", "largest_courant", *COMPARED)
    history = History({name: np.array([0.0, 1.0, 4.0]).view(Values) for name in names})
    for clamp in ("tension", "suspended", "cavitated", "porosity_floor", "porosity_ceiling", "returned_to_mesh"):
        history[f"clamp_{clamp}"] = np.array([0, 1, 2]).view(Values)
    history |= {
        "grain_mass": np.array([2.0, 2.2, 2.0]).view(Values),
        "contact_error": np.array([0.0, 0.5, 0.1]).view(Values),
        "suspended_fraction": np.array([0.0, 0.5, 0.1]).view(Values),
        "tip_fraction": np.array([0.0, 0.3, 0.1]).view(Values),
    }
    values = quality(History(history))
    assert values["grain_mass_error"] == pytest.approx(0.1) and values["contact_error"] == 0.5
    assert values["suspended_fraction"] == 0.5 and values["tip_fraction"] == 0.3
    # these already are the largest so far
    assert values["water_lost"] == values["momentum_error"] == values["energy_error"] == 4.0
    # two of four updates met each clamp; three of them are faults, the others states
    assert values["held_fraction"] == 1.5 and values["clamps"]["tension"] == 0.5
