"""Limits as a table of a scene: units, mistakes before a run, and the checks in a run, its tables and its JSON."""

import json
import tomllib

import numpy as np
import pytest
import xarray as xr
from running import gush

import coupling
from coupling import SceneError
from coupling.datasets import read_response
from coupling.figures import draw_run
from coupling.postprocess.summary import summarise_response
from coupling.responses.respond import respond
from coupling.scenes.plausibility import warnings_of
from structure import Limits, check, utilisations
from verification.loads import theory_pressures
from verification.synthetic_run import write_run

LIMITS = """
[limits]
gasket_opening = "6 mm"
gasket_offset = "10 cm"
joint_dislocation = "3 mm"
crack_width = "0.2 mm"
crack_duration = "long-term"
convergence_per_mille = 1.0
joint_contact_height = 0.2

[limits.own]
bending_moment = "120 kN*m"

[limits.capacity]
axial_force_factor = 1.0
moment_factor = 1.35
minimum_eccentricity = "20 mm"
utilisation = "radial"
shear = true

[limits.segment]
code = "EN 1992-1-1"
concrete = "C50/60"
steel = "B500B"
cover_outer = "42 mm"
cover_inner = "42 mm"
bar_diameter_outer = "16 mm"
bar_diameter_inner = "16 mm"
bar_spacing_outer = "12.5 cm"
bar_spacing_inner = "12.5 cm"
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "checked.toml"
    path.write_text('base = "quick"\n' + LIMITS, encoding="utf-8")
    return coupling.load_scene(path)


@pytest.fixture(scope="module")
def folder(scene, tmp_path_factory):
    place = tmp_path_factory.mktemp("runs") / "checked"
    place.mkdir()
    write_run(place / "run.nc", scene, models=("beam-spring",))
    return place


def test_limits_take_strings_with_units(scene):
    limits = scene.limits
    assert limits.gasket_opening == pytest.approx(6e-3) and limits.gasket_offset == pytest.approx(0.1)
    assert limits.crack_width == pytest.approx(2e-4) and limits.segment.bar_spacing_outer == pytest.approx(0.125)
    assert limits.own == {"bending_moment": pytest.approx(120e3)}
    assert limits.capacity.minimum_eccentricity == pytest.approx(0.02)


def test_complete_scene_holds_its_limits(scene):
    data = tomllib.loads(scene.source)
    assert Limits.model_validate(data["limits"]) == scene.limits
    assert coupling.load_scene("quick").limits is None
    assert scene.changed(limits="none").limits is None
    assert scene.changed(**{"limits.crack_width": "0.3 mm"}).limits.crack_width == pytest.approx(3e-4)
    assert "C50/60 and B500B after EN 1992-1-1, M-N, shear, bearing of joints" in str(scene)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[limits]\ncrack_widt = 0.2\n", r"line 3: limits\.crack_widt: unknown key, got 0\.2; did you mean 'crack_wid"),
        ("[limits]\njoint_dislocation = '3 kg'\n", r"limits\.joint_dislocation: must be a quantity in m, got '3 kg'"),
        ("[limits]\n", "limits must hold at least one limit, got none"),
        ("limits = 3\n", "limits: must be a table, got 3"),
        ("[limits]\ngasket_opening = 0.006\ngasket_offset = 0.3\n", "gasket_offset must be at most half the thickness"),
        ("ring = 'none'\n[limits]\nconvergence_per_mille = 5\n", "limits: must come with a ring, got none; add"),
        (
            "[ring]\njoint_angles = []\n[limits]\njoint_dislocation = 0.003\n",
            "must be left out of a ring without joints",
        ),
        (LIMITS.replace("C50/60", "C50"), r"limits\.segment\.concrete: .* got 'C50'; did you mean 'C50/60'"),
        (LIMITS.replace("shear = true", ""), r"limits\.capacity: shear missing; it decides the answer"),
    ],
)
def test_limits_that_mean_nothing_are_refused_before_a_run(tmp_path, text, message):
    path = tmp_path / "wrong.toml"
    path.write_text('base = "quick"\n' + text, encoding="utf-8")
    with pytest.raises(SceneError, match=message):
        coupling.load_scene(path)


def test_stability_takes_cover_and_unit_weight_of_the_scene():
    factors = {"uplift_factor": 1.0, "weight_factor": 0.9, "bearing_factor": 1.4}
    scene = coupling.load_scene("quick", limits={"stability": factors})
    soil, cover = scene.soils[0], scene.tunnels[0].cover
    buoyant = (1 - soil.porosity) * (soil.grain_density - scene.water.density) * scene.gravity
    given = {"cover": cover, "buoyant_unit_weight": buoyant}
    loads = theory_pressures(scene)
    derived, stated = (respond(each, loads) for each in (scene, scene.changed(limits={"stability": factors | given})))
    for name in ("flotation_utilisation", "ground_bearing_utilisation"):
        xr.testing.assert_allclose(derived[name], stated[name], rtol=1e-12)
    assert json.loads(derived.attrs["limits"])["stability"]["cover"] == cover


def test_millimetres_without_their_unit_are_warned_of(scene):
    wrong = scene.changed(**{"limits.segment.bar_diameter_inner": 0.0016})
    (told,) = (text for text in warnings_of(wrong) if "bar_diameter" in text)
    assert "bar_diameter_inner is unusual, got 0.0016" in told


def test_response_of_a_run_is_held_against_the_limits_of_its_scene(scene, folder):
    stored = read_response(folder)
    again = check(stored.drop_vars([name for name in stored.data_vars if "utilisation" in name]), scene.limits)
    xr.testing.assert_allclose(stored["largest_utilisation"], again["largest_utilisation"])
    found = summarise_response(stored)["utilisations"]
    assert list(found) == list(utilisations(stored)) and len(found) == 8
    moment = np.abs(stored["bending_moment"].values)
    assert found["bending_moment_utilisation"]["largest"] == pytest.approx(moment.max() / 120e3)
    assert "inflow_mass" in found["bending_moment_utilisation"]["at"]


@pytest.mark.slow
def test_run_draws_its_checks(folder, tmp_path):
    names = {path.name for path in draw_run(folder, tmp_path)}
    assert "checks.png" in names


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_response_again_keeps_the_limits_of_the_scene_and_others_take_their_place(folder, tmp_path):
    result = gush("respond", folder)
    assert result.exit_code == 0 and "bearing of" in result.output and "passes 1" in result.output
    (tmp_path / "other.toml").write_text("convergence_per_mille = 0.001\n")
    result = gush("respond", folder, "--limits", tmp_path / "other.toml", "--json", "-")
    data = json.loads(result.stdout)
    assert list(data["utilisations"]) == ["convergence_utilisation"]
    passes = data["utilisations"]["convergence_utilisation"]["passes"]
    assert passes["time"] == 0 and passes["inflow_mass"] == 0
    assert gush("respond", folder).exit_code == 0


def test_page_of_the_run_tells_and_draws_its_limits(folder):
    from coupling.report import page, run_page

    shown = run_page.collect(folder)
    found = utilisations(read_response(folder))
    rows = {cells[0]: (cells, beyond) for cells, beyond in shown["limits"]["rows"]}
    assert len(rows) == 8
    cells, beyond = rows["joint opening at the gasket"]
    assert cells[1] == f"{found['gasket_utilisation']['largest']:.2f}"
    assert beyond == (found["gasket_utilisation"]["largest"] > 1)
    series = shown["player"]["entries"][0]["models"][0]["series"]["crack_utilisation"]
    np.testing.assert_array_equal(series, read_response(folder)["crack_utilisation"].max("theta"))
    html = page.rendered(shown)
    assert '<h2 id="limits">Limits</h2>' in html and 'data-chart="crack_utilisation"' in html
    assert not np.isinf(shown["player"]["entries"][0]["models"][0]["series"]["bearing_utilisation"]).any()


@pytest.mark.slow
def test_page_of_a_run_without_limits_has_no_such_section(tmp_path):
    from coupling.report import page, run_page

    write_run(tmp_path / "run.nc", models=("beam-spring",))
    assert 'id="limits"' not in page.rendered(run_page.collect(tmp_path / "run.nc"))
