"""Two tunnels side by side: both rings answer, each to its own pressures, and both are drawn."""

import json
import re
import shutil

import numpy as np
import pytest
from running import gush

import coupling
from coupling.datasets import read_pressures, read_response
from coupling.postprocess.summary import summarise_run
from coupling.report import run_page
from coupling.report.page import write_report
from coupling.responses.respond import respond, respond_by_name
from coupling.scenes.plausibility import warnings_of
from coupling.scenes.rings import ring_of
from verification.small_event import COARSE

pytestmark = pytest.mark.slow

GATE = 1


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A short event of the twin tunnels on a very coarse mesh, with the gate in the right one."""
    scene = coupling.load_scene(
        "twin-tunnels",
        discretisation=COARSE,
        numerics={"relaxation_tolerance": 1e-3},
        stop={"inflow_mass": 20.0, "time": 0.3},
        output={"interval": 0.01, "snapshot_interval": 0.05},
        gate={"tunnel": GATE, "angle": 270.0},
    )
    folder = tmp_path_factory.mktemp("twin") / "run"
    coupling.run(scene, out=folder, figures=True, threads=1)
    return folder


def test_each_ring_answers_its_own_pressures(run):
    scene = coupling.load_scene("twin-tunnels", gate={"tunnel": GATE, "angle": 270.0})
    pressures = read_pressures(run)
    for tunnel, stored in ((GATE, read_response(run)), (0, read_response(run, tunnel=0))):
        alone = respond_by_name(scene.ring, pressures.isel(tunnel=tunnel, drop=True), "beam-spring")
        np.testing.assert_array_equal(stored["bending_moment"], alone["bending_moment"])
    assert not np.array_equal(read_response(run)["bending_moment"], read_response(run, tunnel=0)["bending_moment"])


def test_the_ring_without_the_gate_feels_the_event_less(run):
    def added(response):
        moment = response["bending_moment"]
        return float(np.abs(moment.isel(time=-1) - moment.isel(time=0)).max())

    assert 0 < added(read_response(run, tunnel=0)) < 0.5 * added(read_response(run))


def test_initial_state_is_its_mirror_image(run):
    # before the gate opens both tunnels differ only by the mesh, whose left half is not the image of its right half
    # near the gate: within 10 % of the largest moment on this coarse mesh
    right, left = (read_response(run, tunnel=t)["bending_moment"].isel(time=0).values for t in (None, 0))
    mirrored = np.interp(360.0 - read_response(run)["theta"].values, read_response(run)["theta"].values, left,
                         period=360.0)  # fmt: skip
    assert np.abs(right - mirrored).max() < 0.1 * np.abs(right).max()


def test_both_tunnels_are_drawn_and_read_with_the_run(run):
    names = {path.stem for path in (run / "figures").glob("*.png")}
    assert {"internal_forces", "internal_forces_tunnel_0", "pressures", "pressures_tunnel_0"} <= names
    assert {"fields", "fields_tunnel_0", "deformed_ring", "deformed_ring_tunnel_0"} <= names
    assert {"structure", "structure_tunnel_0"} <= set(coupling.read_run(run).children)


def test_a_tunnel_of_another_diameter_has_a_ring_of_its_own(run):
    tunnels = [tunnel.model_dump() for tunnel in coupling.load_scene("twin-tunnels").tunnels]
    tunnels[0] |= {"outer_diameter": 5.0, "inner_diameter": 4.4, "cover": 15.0}
    scene = coupling.load_scene("twin-tunnels", tunnels=tunnels, gate={"tunnel": GATE, "angle": 270.0})
    small, own = ring_of(scene, 0), ring_of(scene, GATE)
    assert own is scene.ring and (small.outer_diameter, small.inner_diameter) == (5.0, 4.4)
    assert small.concrete_modulus == own.concrete_modulus and small.joint_angles == own.joint_angles
    # buoyant weight down to the axis of each
    assert small.ground.vertical_stress / own.ground.vertical_stress == pytest.approx(17.5 / 26.4)
    assert any("tunnels[0] is not as wide as tunnel 1" in told for told in warnings_of(scene))
    pressures = read_pressures(run)
    answered = respond(scene, pressures, tunnel=0)
    alone = respond_by_name(small, pressures.isel(tunnel=0, drop=True), "beam-spring")
    np.testing.assert_array_equal(answered["bending_moment"], alone["bending_moment"])


@pytest.mark.usefixtures("undrawn")
def test_commands_answer_for_all_tunnels(run, tmp_path):
    copy = shutil.copytree(run, tmp_path / "run")
    done = gush("respond", copy, "--backend", "continuum", "--json", "-")
    assert done.exit_code == 0, done.output
    data = json.loads(done.stdout)
    for tunnel, told in ((None, data), (0, data["tunnels"]["0"])):
        stored = read_response(copy, "continuum", tunnel)
        assert told["bending_moment"]["final"]["max"] == float(stored["bending_moment"].isel(time=-1).max())
    compared = gush("compare", copy, "--out", tmp_path / "out", "--json", tmp_path / "compared.json")
    assert compared.exit_code == 0 and "tunnel 0" in compared.output, compared.output
    assert json.loads((tmp_path / "compared.json").read_text())["tunnels"]["0"]["rows"]
    assert (tmp_path / "out" / "tunnel-0" / "forces.png").is_file()
    apart = gush("respond", copy, "--out", tmp_path / "answer.nc")
    assert apart.exit_code == 0 and (tmp_path / "answer-tunnel-0.nc").is_file(), apart.output


def test_table_and_report_show_all_tunnels(run):
    summary, pressures = summarise_run(run), read_pressures(run)
    crown = float(pressures["soil_pressure"].isel(time=-1, tunnel=0).sel(theta=0))
    assert list(summary["tunnels"]) == [0]
    assert summary["tunnels"][0]["soil_pressure"]["crown"]["final"] == crown
    page = run_page.collect(run)
    numbers = {number.key: number for group in page["numbers"].values() for number in group}
    assert numbers["tunnel_0_soil_pressure_0"].final == crown
    for key, tunnel in (("bending_moment_max", None), ("tunnel_0_bending_moment_max", 0)):
        stored = read_response(run, tunnel=tunnel)["bending_moment"].isel(time=-1)
        assert numbers[key].final == float(stored.max())
    assert "Forces and deformation of the ring of tunnel 0, beam-spring" in page["numbers"]
    assert [(one["number"], len(one["models"])) for one in page["player"]["entries"]] == [(GATE, 1), (0, 1)]


def test_player_of_the_report_shows_the_ring_of_the_tunnel_that_is_chosen(run, browser, tmp_path):
    browser.complaints.clear()
    browser.open(write_report(run, tmp_path / "report.html"))
    moment = "document.getElementById('bending_moment').getAttribute('aria-label')"
    choose = "document.getElementById('none').click(); document.getElementById('case-%d').click()"
    seen = {}
    for tunnel in (GATE, 0, GATE):
        browser.evaluate(choose % tunnel)
        told = browser.evaluate(moment)
        largest = float(read_response(run, tunnel=None if tunnel == GATE else tunnel)["bending_moment"][-1].max()) / 1e3
        shown = float(re.search(r"max ([\d.]+) at", told)[1])
        assert shown == pytest.approx(largest, rel=1e-2)
        assert seen.setdefault(tunnel, told) == told
    assert seen[0] != seen[GATE] and browser.complaints == []
