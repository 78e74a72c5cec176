"""Lining models by name, the example of the documentation, and their comparison from the command line."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from rings import case_3_pressures as pressures
from rings import case_3_ring as ring
from running import gush

import structure
from coupling.datasets import read_response
from coupling.runs.run import run
from structure import models
from verification.synthetic_run import make_quick_scene

DOCUMENT = Path(__file__).parents[2] / "docs" / "lining-models.md"


@pytest.fixture
def example(monkeypatch):
    """The documentation's own model, registered for one test."""
    monkeypatch.setattr(models, "_REGISTERED", {})
    code = re.search(r"## A model of your own.*?```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.S)[1]
    names = {}
    exec(code, names)
    return names["EfficiencyRing"]


def test_models_are_found_by_name():
    assert {"beam-spring", "continuum"} <= set(structure.lining_model_names())
    assert structure.lining_model("continuum") is structure.ContinuumLining
    with pytest.raises(ValueError, match="did you mean 'continuum'"):
        structure.lining_model("continum")
    with pytest.raises(ValueError, match="the name is taken"):
        structure.register_lining_model("continuum", structure.BeamSpringLining)


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_example_of_the_documentation_is_a_model(example, written, tmp_path):
    assert structure.lining_model("efficiency") is example
    response = structure.lining_model("efficiency")(ring()).respond(pressures())
    assert set(structure.lining.RESPONSE) <= set(response.data_vars)
    # Joints of a homogeneous ring do not turn: 1e-3 of what the jointed ring's do.
    jointed = structure.BeamSpringLining(ring()).respond(pressures())
    assert np.abs(response["joint_rotation"]).max() < 1e-3 * np.abs(jointed["joint_rotation"]).max()
    result = gush("compare", written, "--second", "efficiency", "--json", "-")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["models"] == ["beam-spring", "efficiency"]


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_model_in_a_file_of_your_own_answers_on_the_command_line(example, written, tmp_path, monkeypatch):
    monkeypatch.setattr(models, "_REGISTERED", {})
    code = re.search(r"## A model of your own.*?```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.S)[1]
    file = tmp_path / "mine.py"
    file.write_text(code)
    result = gush("respond", written, "--backend", f"{file}:EfficiencyRing", "--json", "-")
    assert result.exit_code == 0, result.output
    expected = example(ring()).respond(xr.load_dataset(written, engine="h5netcdf"))
    stored = xr.load_dataset(written.with_name("mine-EfficiencyRing.nc"), engine="h5netcdf")
    np.testing.assert_array_equal(stored["bending_moment"], expected["bending_moment"])
    monkeypatch.setattr(models, "_REGISTERED", {})
    result = gush("compare", written, "--second", f"{file}:EfficiencyRing", "--json", "-")
    assert json.loads(result.stdout)["models"] == ["beam-spring", "EfficiencyRing"]


@pytest.mark.parametrize(
    ("code", "name", "message"),
    [
        (None, "Mine", "there is no file"),
        ("1/0", "Mine", "fails with ZeroDivisionError"),
        ("class Mine: pass", "Mine", "derived from structure.LiningModel"),
        ("", "Mine", "derived from structure.LiningModel"),
    ],
)
def test_file_without_a_model_is_refused(written, tmp_path, code, name, message):
    if code is not None:
        (tmp_path / "mine.py").write_text(code)
    result = gush("respond", written, "--backend", f"{tmp_path / 'mine.py'}:{name}")
    assert result.exit_code == 2 and message in result.output.replace("\n", " "), result.output


LIMITS = "gasket_opening = 6e-3\ngasket_offset = 0.1\njoint_dislocation = 10e-3\nconvergence_per_mille = 5.0\n"


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["beam-spring", "continuum"])
def test_response_is_held_against_limits_of_a_file(written, tmp_path, backend):
    (tmp_path / "limits.toml").write_text(LIMITS)
    result = gush("respond", written, "--backend", backend, "--limits", tmp_path / "limits.toml", "--json", "-")
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    stored = xr.load_dataset(data["file"], engine="h5netcdf")
    # Straight from the definition: the larger change of the two diameters over 5 per mille of 6.6 m.
    change = np.maximum(np.abs(stored["convergence_horizontal"]), np.abs(stored["convergence_vertical"])).max().item()
    assert data["utilisations"]["convergence_utilisation"]["largest"] == pytest.approx(change / (5e-3 * 6.6))
    dislocation = data["utilisations"]["joint_dislocation_utilisation"]
    assert stored["joint_dislocation_utilisation"].sel(joint=dislocation["at"]["joint"]).max() == dislocation["largest"]
    assert "section_utilisation" not in data["utilisations"] and Path(data["figure"]).stat().st_size > 10_000


@pytest.mark.parametrize(
    ("text", "message"),
    [("gasket_openng = 1.0", "gasket_openng"), ("x =", "valid TOML"), ("joint_dislocation = -1", "greater than 0")],
)
def test_limits_that_mean_nothing_are_refused(written, tmp_path, text, message):
    (tmp_path / "limits.toml").write_text(text)
    result = gush("respond", written, "--limits", tmp_path / "limits.toml")
    assert result.exit_code == 2 and message in result.output, result.output
    missing = gush("respond", written, "--limits", tmp_path / "none.toml")
    assert missing.exit_code == 2 and "cannot be read" in missing.output


@pytest.mark.slow
def test_comparison_of_a_file_written_by_hand(written, tmp_path):
    result = gush("compare", written, "--out", tmp_path / "out", "--json", tmp_path / "data.json")
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "data.json").read_text())
    rows = {row["label"]: row for row in data["rows"]}
    assert rows["M"]["cause"].startswith("curved section")
    assert rows["M, curved section apart"]["relative"] < 0.01 < rows["M"]["relative"]
    assert rows["joint rotation"]["joint"] in range(1, 7) and rows["N"]["theta"] is not None
    assert {Path(name).name for name in data["figures"]} == {"forces.png", "joints.png"}
    assert data["cpu_seconds"]["continuum"] > 0
    with xr.open_dataset(data["differences"], engine="h5netcdf") as differences:
        beam, continuum = (
            structure.lining_model(name)(ring()).respond(xr.load_dataset(written, engine="h5netcdf"))
            for name in ("beam-spring", "continuum")
        )
        # 1e-6 N m/m: the same program twice.
        expected = continuum["bending_moment"] - beam["bending_moment"]
        np.testing.assert_allclose(differences["bending_moment"], expected, atol=1e-6)
        assert differences["bending_moment"].attrs["units"] == "N m/m"


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_run_keeps_the_responses_of_both_models(simulated, tmp_path):
    folder = tmp_path / "a"
    run(make_quick_scene(), folder)
    result = gush("respond", folder, "--backend", "continuum")
    assert result.exit_code == 0, result.output
    assert read_response(folder, "continuum").attrs["model"] == "continuum"
    assert gush("respond", folder).exit_code == 0
    result = gush("compare", folder)
    assert result.exit_code == 0, result.output
    assert read_response(folder).sizes == read_response(folder, "continuum").sizes
    assert (folder / "comparison" / "differences.nc").is_file()


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_open_gate_changes_the_continuum_only(written, tmp_path):
    whole, hole = tmp_path / "whole.json", tmp_path / "hole.json"
    assert gush("compare", written, "--json", whole).exit_code == 0
    assert gush("compare", written, "--open-gate", "0.2", "--json", hole).exit_code == 0
    moments = [json.loads(file.read_text())["rows"][2]["relative"] for file in (whole, hole)]
    assert moments[1] > 1.5 * moments[0]


def spoiled(file, change):
    with xr.load_dataset(file, engine="h5netcdf") as dataset:
        changed = change(dataset)
    changed.to_netcdf(file, engine="h5netcdf")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.drop_vars("soil_shear"), "soil_shear must be given"),
        (lambda d: d.assign(soil_pressure=d["soil_pressure"].assign_attrs(units="kg")), "must be in Pa"),
        (lambda d: d.isel(theta=slice(0, 4)), "at least 8 different angles"),
        (lambda d: d.assign_attrs(ring="{}"), "must describe a structure.Ring"),
        (lambda d: xr.Dataset(d.data_vars, d.coords), "give --scene"),
    ],
)
def test_file_that_does_not_follow_the_schema_is_refused(written, change, message):
    spoiled(written, change)
    for command in ("respond", "compare"):
        result = gush(command, written)
        assert result.exit_code == 2 and message in result.output.replace("\n", " "), result.output


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--second", "continum"), "did you mean 'continuum'"),
        (("--second", "beam-spring"), "models must differ"),
        (("--open-gate", "2"), "gate: cut"),
        (("--scene", "case-33"), "did you mean"),
    ],
)
def test_comparison_that_cannot_be_is_refused(written, options, message):
    result = gush("compare", written, *options)
    assert result.exit_code == 2 and message in result.output, result.output


def test_ring_without_equilibrium_fails_with_its_reason(written):
    spoiled(written, lambda d: d.assign({name: 100 * d[name] for name in ("soil_pressure", "water_pressure")}))
    result = gush("compare", written)
    assert result.exit_code == 3 and "no equilibrium at time 0 s" in result.output
