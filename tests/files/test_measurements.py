"""A run against measurements: a known misfit is found again, and what is wrong in a table is named by its line."""

import json

import numpy as np
import pytest
import xarray as xr
from running import gush

from coupling.datasets import read_history, read_points, read_pressures, read_response
from coupling.measurements import QUANTITIES, misfit, read_measurements
from coupling.postprocess import at_inflow, surface_settlement
from coupling.refused import Refused
from verification import synthetic_run

HEAD = "quantity,place,time,inflow_mass,value,unit,error,change,sensor\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A synthetic run with both models' answers, some of whose points are at the surface and settle."""
    path, moved = tmp_path_factory.mktemp("measured") / "run.nc", synthetic_run.points

    def points(time):
        found = moved(time)
        x = np.linspace(-20.5, 20.5, 42)
        found["x"][:42], found["displacement_x"][:42] = x, 0.0
        found["displacement_y"][:42] = -0.05 * time**2 * np.exp(-((x / 8.0) ** 2))
        found["y"][:42] = -0.5 + found["displacement_y"][:42]
        return found

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(synthetic_run, "points", points)
        return synthetic_run.write_run(path)


def exact(run):
    """Lines of a table without errors: quantity, place, time, value in SI, taken from the datasets by xarray."""
    response, pressures, history = read_response(run), read_pressures(run), read_history(run)
    total = (pressures["soil_pressure"] + pressures["water_pressure"]).rename("total_pressure")
    rows = []
    for time in np.linspace(0.03, 0.97, 12).tolist():
        for field, dim, places in (
            (response["convergence_horizontal"], None, [None]),
            (response["joint_opening"], "joint", [1, 4]),
            (total, "theta", [45.5, 130.0, 200.25]),
            (history["inflow_mass"].reset_coords(drop=True).rename("inflow_mass"), None, [None]),
        ):
            now = field.interp(time=time)
            for place in places:
                value = now if dim is None else now.interp({dim: place})
                rows.append((str(field.name), place, time, float(value)))
    return rows


def table(rows, error, noise, units, shift=None):
    """The CSV text of such lines in other units, with noise of `error` each, a quantity shifted by some errors."""
    text = "# made by the test\n" + HEAD
    for (name, place, time, value), draw in zip(rows, noise.tolist(), strict=True):
        unit, factor = units[name]
        value += error[name] * (draw + (shift or {}).get(name, 0.0))
        text += (
            f"{name},{'' if place is None else place},{time!r},,{value * factor!r},{unit},{error[name] * factor!r},,\n"
        )
    return text


UNITS = {
    "convergence_horizontal": ("mm", 1e3),
    "joint_opening": ("cm", 1e2),
    "total_pressure": ("bar", 1e-5),
    "inflow_mass": ("t/m", 1e-3),
}
ERRORS = {"convergence_horizontal": 1e-4, "joint_opening": 2e-5, "total_pressure": 2e3, "inflow_mass": 5.0}


@pytest.mark.slow
def test_noise_of_the_stated_errors_gives_a_chi_square_of_one_and_a_shift_is_found(run, tmp_path):
    rows = exact(run)
    noise = np.random.default_rng(7).normal(size=len(rows))
    path = tmp_path / "field.csv"
    path.write_text(table(rows, ERRORS, noise, UNITS))
    found = misfit(run, path)
    # the run is exact, so what is left is the noise; 1e-6 of an error is lost in the text and in interpolation
    np.testing.assert_allclose(found["residual"], -noise, atol=1e-6)
    # standard deviation of the mean of 84 squares of normal numbers: sqrt(2 / 84) = 0.15
    assert found.attrs["count"] == len(rows) == 84 and found.attrs["chi_square"] == pytest.approx(1.0, abs=0.3)
    assert found.attrs["probability"] > 0.05 and found.attrs["not_reached"] == 0
    assert set(found["quantity"].values) == set(UNITS) and set(found["count"].values) == {12, 24, 36}

    path.write_text(table(rows, ERRORS, noise, UNITS, {"joint_opening": 4.0}))
    shifted = misfit(run, path)
    worst = shifted.isel(quantity=0)
    assert worst["quantity"] == "joint_opening" and worst["count"] == 24
    assert float(worst["mean_residual"]) == pytest.approx(-4.0, abs=3 / 24**0.5)
    assert float(worst["chi_square"]) == pytest.approx(17.0, abs=5.0) and float(worst["probability"]) < 1e-20
    rest = found["chi_square"].sel(quantity=list(set(UNITS) - {"joint_opening"}))
    xr.testing.assert_allclose(shifted["chi_square"].sel(quantity=rest["quantity"]), rest)


def test_state_at_an_inflow_mass_and_change_since_the_start(run, tmp_path):
    response, points = read_response(run), read_points(run)
    then = at_inflow(response, 120.0)["convergence_vertical"]
    changed = float(then - response["convergence_vertical"].isel(time=0))
    assert changed != 0
    settled = surface_settlement(points).isel(time=2).dropna("x")
    x = float(settled["x"][int(settled.argmax("x"))])
    text = HEAD + f"convergence_vertical,,,120,{1e3 * changed!r},mm,0.1,yes,tape\n"
    text += f"surface_settlement,{100 * x:g} cm,0.5 s,,{float(settled.max())!r},m,0.001,,L1\n"
    text += "convergence_vertical,,,300.5,0,mm,0.1,yes,later than the run\n"
    (tmp_path / "a.csv").write_text(text)
    found = misfit(run, tmp_path / "a.csv")
    np.testing.assert_allclose(found["residual"].values[:2], 0.0, atol=1e-9)
    assert found["sensor"].values.tolist()[:2] == ["tape", "L1"] and found["line"].values[0] == "line 2"
    assert float(found["run_time"][0]) == pytest.approx(0.4) and np.isnan(found["computed"][2])
    assert (found.attrs["count"], found.attrs["not_reached"]) == (2, 1)


class Grid:
    """Triangles 10 m wide, without a hole for the lining."""

    x, y = np.meshgrid(np.linspace(-20.0, 20.0, 5), np.linspace(-40.0, 0.0, 5), indexing="ij")
    nodes = np.column_stack([x.ravel(), y.ravel()])
    corners = np.array([(5 * i + j, 5 * i + j + 5, 5 * i + j + 6, 5 * i + j + 1) for i in range(4) for j in range(4)])
    elements = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    region = np.zeros(len(elements), int)


@pytest.mark.slow
def test_cell_in_the_ground_reads_a_linear_field_where_it_is(tmp_path, monkeypatch):
    def points(time):
        centres = Grid.nodes[Grid.elements].mean(axis=1)
        found = original(time, count=len(centres))
        found["x"], found["y"], found["removed"] = *centres.T, np.zeros(len(centres), bool)
        found["stress_yy"] = 9e3 * found["y"] + 1e3 * found["x"]
        found["pore_pressure"] = -9.81e3 * found["y"] * (1 - 0.1 * time)
        return found

    original = synthetic_run.points
    monkeypatch.setattr(synthetic_run, "points", points)
    monkeypatch.setattr(synthetic_run, "TwoTriangles", Grid)
    run = synthetic_run.write_run(tmp_path / "run.nc", models=())
    head = "quantity,place,depth,time,value,unit,error\n"
    effective, water = 15 * 9.0 - 12.0, 15 * 9.81
    text = f"total_stress_vertical,12 m,15 m,0,{effective + water!r},kPa,1\n"
    text += f"soil_stress_vertical,12,1500 cm,0.5 s,{effective!r},kPa,1\n"
    text += f"pore_pressure,12,15,0.5,{0.95 * water!r},kPa,1\n"
    (tmp_path / "a.csv").write_text(head + text)
    # a linear field is met exactly between centres of elements; points are stored as float32
    np.testing.assert_allclose(misfit(run, tmp_path / "a.csv")["residual"], 0.0, atol=1e-4)
    for line, message in (
        ("pore_pressure,0,23.3,0,1,kPa,1", "line 2: place and depth: must lie in the ground, outside of the linings"),
        ("pore_pressure,12,60,0,1,kPa,1", "at most 40 m deep, got x 12 m, 60 m deep"),
        ("pore_pressure,12,,0,1,kPa,1", "line 2: depth: pore_pressure must have one"),
        ("water_pressure,90,3,0,1,kPa,1", "line 2: depth: water_pressure has none, got 3"),
    ):
        (tmp_path / "a.csv").write_text(head + line + "\n")
        with pytest.raises(Refused) as refused:
            misfit(run, tmp_path / "a.csv")
        assert message in str(refused.value)


def test_errors_of_one_calibration_count_as_one(run, tmp_path):
    """40 readings of a cell that is off by 3 common errors: chi square of 3^2 once more, not 40 times."""
    pressure = read_pressures(run)["water_pressure"].sel(theta=90.0)
    draw = np.random.default_rng(5).normal(size=40)
    times = np.linspace(0.02, 0.98, 40)
    values = pressure.interp(time=times).values + 500.0 * draw + 3 * 6000.0
    numbers = zip(times.tolist(), values.tolist(), strict=True)
    rows = [f"water_pressure,90,{time!r},{value!r},Pa,500,6000,P1" for time, value in numbers]
    path = tmp_path / "field.csv"
    path.write_text("quantity,place,time,value,unit,error,common_error,sensor\n" + "\n".join(rows) + "\n")
    found = misfit(run, path)
    # common and independent part of an equal shift c of n readings: n c^2 / (s^2 + n t^2) = 9 but for s^2 / (n t^2)
    scatter = np.sum((draw - draw.mean()) ** 2)
    assert found.attrs["chi_square"] * 40 == pytest.approx(scatter + 40 * (draw.mean() + 36.0) ** 2 / (1 + 40 * 144.0))
    np.testing.assert_allclose(found["residual"], -(values - pressure.interp(time=times)) / np.hypot(500, 6000))
    path.write_text(path.read_text().replace(",P1", ","))
    with pytest.raises(Refused, match="line 2: sensor: must be named where a common_error is given"):
        misfit(run, path)


def test_dataset_with_errors_is_taken_as_the_table_is(run, tmp_path):
    response = read_response(run).isel(time=[1, 3])
    given = response[["joint_opening"]].reset_coords("inflow_mass", drop=True)
    given["joint_opening"] = 1e3 * given["joint_opening"] + 0.3
    given["joint_opening"][0, 2] = np.nan  # one was not measured
    given["joint_opening"].attrs["units"] = "mm"
    given["joint_opening_error"] = ((), 0.1, {"units": "mm"})
    found = misfit(run, given)
    assert found.sizes["measurement"] == response["joint_opening"].size - 1
    np.testing.assert_allclose(found["residual"], -3.0, rtol=1e-9)
    assert found["place"].values[2] == "joint 4"
    shared = given.assign(joint_opening_common_error=((), 0.4, {"units": "mm"}))
    np.testing.assert_allclose(misfit(run, shared)["residual"], -0.3 / np.hypot(0.1, 0.4), rtol=1e-9)
    given.to_netcdf(tmp_path / "field.nc", engine="h5netcdf")
    xr.testing.assert_equal(misfit(run, tmp_path / "field.nc"), found)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("convergence_vertcal,,1,,2,mm,1", "line 3: quantity: must be"),
        ("convergence_vertical,,1,,2,mm", "line 3: error: missing"),
        ("convergence_vertical,,1,,2,mm,0", "line 3: error: must be greater than 0, got 0"),
        ("convergence_vertical,,1,,2,kPa,1", "line 3: value: must be a quantity in m, got '2 kPa'"),
        ("convergence_vertical,,1,,\"2,5\",mm,1", "line 3: value: must have a decimal point"),
        ("convergence_vertical,,1,,2,5,mm,1,,,", "line 3: must have the 9 cells of the first line, got 11"),
        ("convergence_vertical,,1,,\"2,mm,1", "line 3: must be cells of a table"),
        ("convergence_vertical,,,,2,mm,1", "line 3: time or inflow_mass: one must be given, got neither"),
        ("convergence_vertical,,1,30,2,mm,1", "line 3: time or inflow_mass: one must be given, got both"),
        ("convergence_vertical,90,1,,2,mm,1", "line 3: place: convergence_vertical has none"),
        ("joint_opening,,1,,2,mm,1", "line 3: place: joint_opening must have one"),
        ("joint_opening,9,1,,2,mm,1", "line 3: place: must be one of the ring's joints (1, 2, 3, 4, 5, 6), got 9"),
        ("surface_settlement,900,1,,2,mm,1", "line 3: place: must lie on the ground"),
        ("inflow_mass,,,20,20,kg/m,1", "line 3: time: inflow_mass as a quantity"),
        ("joint_opening,1,-1,,2,mm,1", "line 3: time: must be greater than or equal to 0"),
    ],
)  # fmt: skip
def test_damaged_line_is_named_with_rule_value_and_remedy(run, tmp_path, line, message):
    path = tmp_path / "field.csv"
    path.write_text(HEAD + "inflow_mass,,0.5,,150,kg/m,1\n" + line + "\n")
    with pytest.raises(Refused) as refused:
        misfit(run, path)
    assert message in str(refused.value), refused.value
    assert ";" in str(refused.value).rpartition("line 3")[2]  # a remedy


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must hold a measurement, got none"),
        (HEAD, "must hold a measurement, got none"),
        ("quantity,value,unti,error\n", "line 1: unknown column 'unti'; did you mean 'unit'?"),
        ("quantity,value,error\n", "got none of unit"),
        ("quantity,value,unit,error,error\n", "got error twice"),
        (HEAD + "inflow_mass,,2,,1,kg/m,1\n", "it ends before all of them"),
    ],
)
def test_table_that_means_nothing_is_refused(run, tmp_path, text, message):
    path = tmp_path / "field.csv"
    path.write_text(text)
    with pytest.raises(Refused, match=message.replace("?", r"\?")):
        misfit(run, path)


def test_text_of_another_encoding_and_a_missing_file_are_refused(tmp_path):
    (tmp_path / "latin.csv").write_bytes(HEAD.encode() + "inflow_mass,,1,,1,kg/m,1,,Gerät\n".encode("latin-1"))
    with pytest.raises(Refused, match="line 2: must be UTF-8 text"):
        read_measurements(tmp_path / "latin.csv")
    with pytest.raises(Refused, match="must be a readable file"):
        read_measurements(tmp_path / "none.csv")


def test_all_mistakes_are_told_at_once(run, tmp_path):
    path = tmp_path / "field.csv"
    path.write_text(HEAD + "inflow_mass,,1,,1,kg,1\ninflow_mass,,1,,1,kg/m,1\njoint_opening,one,1,,1,mm,1\n")
    with pytest.raises(Refused) as refused:
        misfit(run, path)
    assert "2 mistakes" in str(refused.value) and "line 2: value" in str(refused.value)
    assert "line 4: place" in str(refused.value)


@pytest.mark.slow
def test_command_prints_residuals_and_writes_dataset_and_picture(run, tmp_path):
    rows = exact(run)
    noise = np.random.default_rng(3).normal(size=len(rows))
    (tmp_path / "field.csv").write_text(table(rows, ERRORS, noise, UNITS, {"total_pressure": 5.0}))
    before = run.read_bytes()
    result = gush("misfit", run, tmp_path / "field.csv", "--out", tmp_path / "out", "--json", tmp_path / "a.json")
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["quantities"][0]["name"] == "total_pressure" and len(data["rows"]) == 84
    assert "chi square per measurement" in result.output and "the largest 20 of 84" in result.output
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"misfit.nc", "residuals.png"}
    with xr.open_dataset(data["data"], engine="h5netcdf") as stored:
        assert stored.attrs["chi_square"] == data["chi_square"]
    assert run.read_bytes() == before
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "residuals.png").write_text("somebody's")
    refused = gush("misfit", run, tmp_path / "field.csv", "--out", tmp_path / "mine")
    assert refused.exit_code == 2 and "residuals.png" in refused.output
    unknown = gush("misfit", run, tmp_path / "field.csv", "--model", "shell")
    assert unknown.exit_code == 2 and "beam-spring, continuum" in unknown.output


@pytest.mark.slow
def test_every_quantity_can_be_read_of_a_run(run):
    from coupling.measurements.quantities import computed

    for name, known in QUANTITIES.items():
        field = computed(run, name)
        place = {"ground": "element"}.get(known.place, known.place)
        assert field.dims == ("time", *([place] if place else [])), name
