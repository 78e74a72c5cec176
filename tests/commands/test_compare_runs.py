"""Runs side by side: a difference that was put in is found with its place, at equal inflow mass or equal time."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from running import gush

from coupling.datasets import read_response
from coupling.postprocess import at_inflow
from coupling.refused import Refused
from coupling.report.study_page import collect_runs
from coupling.studies.side_by_side import side_by_side
from verification import synthetic_run

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """`slow` takes twice as long for the same states; `other` also has 7 kPa more water pressure around 120 degrees."""
    folder, made = tmp_path_factory.mktemp("runs"), synthetic_run.moving_record

    def slow(time):
        return replace(made(time / 2), time=time)

    def other(time):
        found = slow(time)
        for part in found.lining:
            part["water_pressure"] = part["water_pressure"] + 7e3 * (np.abs(part["theta"] - 120) < 10)
        return found

    for name, record in {"base": made, "slow": slow, "other": other}.items():
        (folder / name).mkdir()
        times = np.linspace(0.0, 1.0, 9) if name == "base" else np.linspace(0.0, 1.5, 7)  # the same states
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(synthetic_run, "moving_record", record)
            synthetic_run.write_run(folder / name / "run.nc", times=times)
    return folder


def test_what_differs_is_found_and_nothing_else_at_equal_inflow(folder):
    compared = side_by_side([folder / name for name in ("base", "slow", "other")])
    rows = {(row["run"], row["name"]): row for row in compared.rows}
    # the slow run has the same states; 1e-6 of the largest is lost between records
    same = [row["relative"] for (run, name), row in rows.items() if run == "slow" and name != "time"]
    assert len(same) > 10 and max(same) < 1e-6
    late = rows["slow", "time"]
    assert late["difference"] == pytest.approx(0.75) and late["inflow_mass"] == pytest.approx(225.0)
    water = rows["other", "water_pressure"]
    assert water["difference"] == pytest.approx(7e3, rel=1e-6) and 110 < water["theta"] < 130
    assert rows["other", "bending_moment"]["relative"] > 1e-3
    assert rows["other", "joint_opening"]["joint"] in range(1, 7)


def test_states_are_those_of_the_runs_at_equal_inflow_and_equal_time(folder):
    runs = [folder / "base", folder / "slow"]
    masses = side_by_side(runs).dataset()
    assert masses["run"].values.tolist() == ["base", "slow"] and float(masses["inflow_mass"].max()) == pytest.approx(
        225.0
    )
    then = at_inflow(read_response(runs[1]), float(masses["inflow_mass"][1, 20]))
    found = masses["bending_moment"].sel(run="slow", model="beam-spring").isel(progress=20)
    np.testing.assert_allclose(found, then["bending_moment"], rtol=1e-9)
    times = side_by_side(runs, "time")
    np.testing.assert_allclose(times.states[0]["inflow_mass"], 2 * times.states[1]["inflow_mass"], rtol=1e-9)
    (inflow,) = (row for row in times.rows if row["name"] == "inflow_mass")
    assert inflow["difference"] == pytest.approx(-150.0) and inflow["time"] == pytest.approx(1.0)


def test_command_prints_rows_and_writes_states_and_one_page(folder, tmp_path):
    names = ("base", "slow", "other")
    runs, out = [folder / name for name in names], tmp_path / "out"
    before = [(run / "run.nc").read_bytes() for run in runs]
    result = gush("compare", *runs, "--out", out, "--json", tmp_path / "a.json")
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["names"] == list(names) and data["to"] == pytest.approx(225.0) and data["model"] == "beam-spring"
    assert "slow less base" in result.output and "other less base" in result.output
    page = (out / "report.html").read_text()
    assert "3 runs side by side" in page and "What is compared" in page and all(f"run {name}" in page for name in names)
    with xr.open_dataset(out / "runs.nc", engine="h5netcdf") as stored:
        assert stored["soil_pressure"].sizes["run"] == 3
    assert before == [(run / "run.nc").read_bytes() for run in runs]
    timed = gush("compare", *runs, "--along", "time", "--out", out, "--json", tmp_path / "b.json")
    assert timed.exit_code == 0, timed.output
    assert json.loads((tmp_path / "b.json").read_text())["report"] == str(out / "report.html")
    page = (out / "report.html").read_text()
    assert "Compared at equal time, to 1 s" in page and "Cases at this time" in page and "inflow masses" not in page


def test_slider_of_runs_at_equal_time_stops_at_times_and_curves_are_those_of_the_runs(folder, tmp_path):
    compared = side_by_side([folder / "base", folder / "slow"], "time", records=5)
    player = collect_runs(compared, tmp_path)["player"]
    assert player["stops"]["along"] == "time" and player["stops"]["told"][-1] == "1 s"
    np.testing.assert_allclose(player["stops"]["values"], [0.0, 0.25, 0.5, 0.75, 1.0])
    for one, states in zip(player["entries"], compared.states, strict=True):
        assert one["at"] == [0, 1, 2, 3, 4]
        pressure, level = states["water_pressure"].values, np.ptp(states["water_pressure"].values) / 6e4
        np.testing.assert_allclose(one["curves"]["water_pressure"].values(), pressure, rtol=0, atol=level)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("base", "base"), "must differ"),
        (("base", "slow", "--along", "angle"), "must be 'inflow_mass' or 'time'"),
        (("base", "slow", "--first", "continuum"), "--first: is for comparing one run"),
        (("base", "--along", "time"), "--along: is for comparing several runs"),
        (("base", "nowhere"), "there is no such file"),
    ],
)
def test_comparison_that_means_nothing_is_refused(folder, tmp_path, monkeypatch, options, message):
    monkeypatch.chdir(folder)
    result = gush("compare", *options, "--out", tmp_path / "out")
    assert result.exit_code == 2 and message in result.output.replace("\n", " "), result.output
    assert not (tmp_path / "out").exists()


def test_run_without_inflow_is_compared_along_time_only(folder, tmp_path):
    synthetic_run.write_run(tmp_path / "still.nc", times=(0.0,))
    with pytest.raises(Refused, match="must get beyond the initial state"):
        side_by_side([folder / "base", tmp_path / "still.nc"])


def test_runs_that_no_lining_model_answered_in_common_are_compared_each_by_its_own(tmp_path):
    for name, model in (("beams", "beam-spring"), ("solid", "continuum")):
        (tmp_path / name).mkdir()
        synthetic_run.write_run(tmp_path / name / "run.nc", models=(model,))
    compared = side_by_side([tmp_path / "beams", tmp_path / "solid"])
    rows = {row["name"]: row for row in compared.rows}
    assert rows["soil_pressure"]["difference"] == 0.0
    assert 0.0 < rows["displacement_radial"]["relative"] < 0.05  # sections that also shear give way more
    assert [list(states["model"].values) for states in compared.states] == [["each run its own"]] * 2
