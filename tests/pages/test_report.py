"""What the page about a run is made of: key numbers, warnings, and the datasets' values within a budget of bytes."""

import base64
import hashlib
import json
import shutil
import zlib
from importlib import resources

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import coupling
import structure
from coupling import datasets
from coupling.cli import app
from coupling.datasets.geometry import Gate, Tunnel
from coupling.postprocess import mesh_ladder
from coupling.postprocess.answer import Extreme, answers
from coupling.refused import Refused
from coupling.report import curves, ground, numbers, page, run_page, trust
from coupling.report.packing import evenly, levels, packed
from coupling.report.ring_drawing import ring_drawing
from structure.response import FORCES
from verification.synthetic_run import TIMES, points, write_run


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("run") / "run.nc")


@pytest.fixture(scope="module")
def tree(run):
    return coupling.read_run(run)


# -- the numbers ------------------------------------------------------------------------------------


def test_scatter_leaves_a_trend_out_and_finds_the_noise():
    noise = np.random.default_rng(1).normal(scale=3.0, size=2000)
    # of 400 records; standard deviation of the estimate 3 / sqrt(800) times about 1.2
    assert numbers.scatter(noise + 50.0 * np.arange(2000), 0.0) == pytest.approx(3.0, abs=0.4)
    assert numbers.scatter(2.0 * np.arange(20), 4.0) == pytest.approx(4.0)
    assert numbers.scatter(np.arange(4.0), 1.0) is None


def test_inflow_rate_of_a_straight_line_has_no_error():
    time = np.linspace(0, 2, 41)
    history = xr.Dataset({"inflow_mass": ("time", 300 * np.maximum(time - 0.5, 0))}, coords={"time": time})
    rate, error = numbers.inflow_rate(history)
    assert rate == pytest.approx(300.0) and error < 1e-9
    assert numbers.inflow_rate(history.isel(time=slice(0, 12))) is None


def test_quality_of_triangles():
    mesh = xr.Dataset({
        "x": ("node", [0.0, 1.0, 0.5, 1.0]), "y": ("node", [0.0, 0.0, np.sqrt(0.75), 1.0]),
        "element_nodes": (("element", "corner"), [[0, 1, 2], [0, 1, 3]]), "region": ("element", [0, 0]),
    })  # fmt: skip
    shown = ground.mesh_picture(mesh)
    assert shown["min_altitude"] == pytest.approx(np.sqrt(0.5)) and shown["min_angle"] == pytest.approx(45.0)


def test_initial_theory_is_given_only_where_it_holds(quick_scene):
    theta = np.array([0.0, 90.0])
    theory = trust.initial_theory(quick_scene, theta)
    vertical = (1 - 0.45) * (2650 - 1000) * 9.81 * np.array([20.0, 23.3])
    np.testing.assert_allclose(theory["soil_pressure"][0], [vertical[0], 3 / 7 * vertical[1]])
    np.testing.assert_allclose(theory["water_pressure"][0], 9810.0 * np.array([20.0, 23.3]))
    assert trust.initial_theory(coupling.load_scene("twin-tunnels"), theta) is None


@pytest.mark.slow
def test_leading_model_is_the_runs_own_or_the_one_asked_for_whichever_was_written_last(tmp_path):
    file = write_run(tmp_path / "run.nc", models=("continuum", "beam-spring"))
    own = {name: float(datasets.read_response(file, name)["bending_moment"].isel(time=-1).max()) for name in
           ("beam-spring", "continuum")}  # fmt: skip
    assert own["beam-spring"] != own["continuum"]

    def leading(**asked):
        groups = run_page.collect(file, **asked)["numbers"]
        (title,) = [title for title in groups if title.startswith("Forces and deformation of the ring")]
        (moment,) = [number.final for number in groups[title] if number.key == "bending_moment_max"]
        return title.rpartition(", ")[2], moment

    for last in ("beam-spring", "continuum"):
        datasets.write_response(file, datasets.read_response(file, last), last)
        assert leading() == ("beam-spring", own["beam-spring"])
        assert leading(model="continuum") == ("continuum", own["continuum"])
    result = CliRunner().invoke(app, ["report", str(file), "--model", "continum"])
    assert result.exit_code == 2 and "there are beam-spring, continuum" in result.output.replace("\n", " ")


@pytest.mark.slow
def test_warnings_name_what_is_missing_or_off(run, tree, tmp_path):
    good = run_page.collect(run)
    assert [text for text in good["warnings"] if "records" not in text and "revision" not in text] == [
        text for text in good["warnings"] if text.startswith("Outside")
    ]
    # the synthetic pressures are no K0 state, which must be said where friction bears that state
    lining = tree["lining"].to_dataset()
    for friction, verdict in ((0.2, None), (0.5, False)):
        scene = coupling.load_scene("quick", **{"tunnels.0.friction_coefficient": friction})
        (soil, _, found), *_ = trust.against_theory(lining.isel(time=0), scene)
        assert soil.startswith("initial soil pressure against theory") and found is verdict
    short = write_run(tmp_path / "run.nc", times=(0.0, 0.5), models=(), status="interrupted")
    told = " ".join(run_page.collect(short)["warnings"])
    assert "'interrupted'" in told and "No lining model" in told and "Only 2 records" in told
    datasets.write_response(short, tree["structure/beam_spring"].to_dataset().isel(time=[0]))
    assert "beam-spring holds 1 of 2 records" in " ".join(run_page.collect(short)["warnings"])


def test_the_library_is_the_one_that_its_makers_published():
    """Apache ECharts 6.1.0, dist/echarts.min.js of the npm package, with its licences."""
    folder = resources.files("coupling.report") / "templates" / "library"
    digest = hashlib.sha256((folder / "echarts.min.js").read_bytes()).hexdigest()
    assert digest == "b66b25aeb4df84e33199dc21694014d336d222cbd9deb0e5a7c14bd6aa0d0fd0"
    for name, text in (("LICENSE-echarts", "Apache License"), ("NOTICE-echarts", "Apache ECharts"),
                       ("LICENSE-d3", "Bostock")):  # fmt: skip
        assert text in (folder / name).read_text()


# -- the answer --------------------------------------------------------------------------------------


def test_largest_forces_are_those_of_all_records_with_the_other_model_beside(tree):
    found = answers(tree)[None]
    assert (found.model, found.others, found.governing) == ("beam-spring", ["continuum"], None)
    for extreme in found.forces:
        values, other = (tree[f"structure/{name}"][extreme.name] for name in ("beam_spring", "continuum"))
        pick = {"max": lambda v: v.max(), "min": lambda v: v.min(), "size": lambda v: abs(v).max()}[extreme.kind]
        shown = abs(extreme.value) if extreme.kind == "size" else extreme.value
        assert shown == float(pick(values)), extreme.name
        there = {key: place for key, place in extreme.at.items() if key != "inflow_mass"}
        assert float(values.sel(there)) == extreme.value
        if extreme.kind != "size":
            assert extreme.apart == pytest.approx(float(pick(other) - pick(values)), abs=1e-12)
    assert {"axial_force", "shear_force", "bending_moment", "joint_opening"} <= {one.name for one in found.forces}


@pytest.mark.slow
def test_governing_check_is_the_largest_utilisation_and_the_page_begins_with_it(run, tmp_path):
    limits = structure.Limits(joint_dislocation=1e-6, own={"bending_moment": 1e9})
    checked = structure.check(datasets.read_response(run), limits)
    datasets.write_response(copied := shutil.copy(run, tmp_path), checked)
    shown = run_page.collect(copied)["answer"]["rings"][0]
    worst = float(checked["joint_dislocation_utilisation"].max())
    assert shown["bad"] is True and shown["governing"].startswith(f"Joint dislocation: utilisation {worst:.2f} at ")
    assert "passes 1 at 0 s" in shown["governing"]
    html = page.rendered(run_page.collect(copied))
    assert html.index("Governing check") < html.index('id="numbers"') and html.index("The answer") < html.index(
        "Warnings"
    )


def test_mesh_error_is_the_distance_from_size_zero_and_its_bar(run, tree, tmp_path):
    ladder = xr.Dataset(
        {"value": (("mesh", "inflow_mass", "quantity"), [[[90.0], [95.0]], [[80.0], [85.0]]]),
         "extrapolated": (("inflow_mass", "quantity"), [[70.0], [92.0]]),
         "error_bar": (("inflow_mass", "quantity"), [[1.0], [2.0]])},
        {"factor": ("mesh", [2.0, 1.0]), "inflow_mass": [0.0, 300.0], "quantity": ["M max [kN m/m]"]},
        {"title": "mesh ladder of quick"},
    )  # fmt: skip
    ladder.to_netcdf(tmp_path / "quick-ladder.nc", engine="h5netcdf")
    read = mesh_ladder.read_ladder(tmp_path / "quick-ladder.nc", "quick")
    at = lambda mass, name="bending_moment": Extreme(name, "max", 1e5, {"time": 1.0, "inflow_mass": mass}, None)  # noqa: E731
    # the scene's own mesh is 80 and 85 kN m/m
    assert mesh_ladder.mesh_error(read, at(10.0)) == pytest.approx(1e3 * (abs(80 - 70) + 1))
    assert mesh_ladder.mesh_error(read, at(290.0)) == pytest.approx(1e3 * (abs(85 - 92) + 2))
    assert mesh_ladder.mesh_error(read, at(10.0, "axial_force")) is None
    rows = {
        row["name"]: row["mesh"]
        for row in run_page.collect(run, ladder=tmp_path / "quick-ladder.nc")["answer"]["rings"][0]["rows"]
    }
    assert rows["bending moment M, largest"].startswith("± ") and rows["axial force N, largest"] is None
    for path, told in ((tmp_path / "none.nc", "no such file"), (run, "must be that of scene")):
        with pytest.raises(Refused, match=told):
            mesh_ladder.read_ladder(path, "quick")


def test_ring_is_drawn_from_joint_to_joint_with_its_key():
    tunnel = Tunnel(0.0, -20.0, 4.0, 3.6)
    made = ring_drawing(tunnel, [10.0, 100.0, 190.0, 350.0], Gate(0, 90.0, 0.4))
    assert [one["key"] for one in made["segments"]] == [False, False, False, True]  # 20 degrees from 350 to 10
    assert made["segments"][2]["path"].count("0 0 1") == 1  # 160 degrees: the small arc
    assert made["joints"][1]["ends"][0] == pytest.approx((98.48, 17.36)) and made["joints"][1]["number"] == 2
    assert made["gate"]["half"] == pytest.approx(5.0) and made["gate"]["inner"] == pytest.approx(90.0)
    whole = ring_drawing(tunnel, [], None)
    assert len(whole["segments"]) == 2 and not whole["joints"] and whole["gate"] is None
    assert not any(one["key"] for one in ring_drawing(tunnel, [0.0, 120.0, 240.0], None)["segments"])


# -- what is put into the page ----------------------------------------------------------------------


def test_evenly_chosen_records_hold_the_ends():
    np.testing.assert_array_equal(evenly(5, 9), np.arange(5))
    chosen = evenly(1000, 7)
    assert len(chosen) == 7 and chosen[0] == 0 and chosen[-1] == 999 and np.ptp(np.diff(chosen)) <= 1


def within_half_a_level(kept, values):
    np.testing.assert_allclose(kept.values(), values, rtol=0, atol=0.5001 * np.nanmax(np.ptp(values)) / 65534)


def test_curves_are_within_half_a_level_and_series_equal_the_dataset(run, tree):
    (entry,) = run_page.collect(run)["player"]["entries"]
    assert entry["records"] == entry["at"] == list(range(len(TIMES))) and entry["gate"] == 90.0
    for name in datasets.PRESSURES:
        if name in entry["curves"]:
            within_half_a_level(entry["curves"][name], tree["lining"][name].values)
    assert set(entry["curves"]) == set(curves.PRESSURES)
    np.testing.assert_array_equal(entry["series"]["inflow_mass"], tree["history"]["inflow_mass"])
    for model in entry["models"]:
        response = tree[f"structure/{datasets.identifier(model['name'])}"]
        assert set(model["curves"]) == {*FORCES, "displacement_radial"}
        for name in FORCES:
            within_half_a_level(model["curves"][name], response[name].values)
        for name, values in model["joints"].items():
            np.testing.assert_array_equal(values, response[name].values)
        moment, largest = response["bending_moment"], model["series"]["bending_moment_max"]
        np.testing.assert_array_equal(largest, moment.max("theta"))
        at = moment.sel(theta=model["series"]["bending_moment_max_angle"]).values.diagonal()
        np.testing.assert_array_equal(at, largest)
        for name in ("convergence_vertical", "settlement"):
            np.testing.assert_array_equal(model["series"][name], response[name])


def test_a_ring_that_moves_as_a_whole_does_not_deform():
    angle = np.radians(np.arange(360.0))
    oval = 0.01 * np.cos(2 * angle)
    moved = {"displacement_radial": oval + 0.03 * np.sin(angle) - 0.02 * np.cos(angle),
             "displacement_tangential": 0.03 * np.cos(angle) + 0.02 * np.sin(angle)}  # fmt: skip
    states = xr.Dataset({name: (("progress", "theta"), [values]) for name, values in moved.items()},
                        coords={"theta": np.degrees(angle)})  # fmt: skip
    np.testing.assert_allclose(curves.shape_of_ring(states)["displacement_radial"][0], oval, atol=1e-15)


def test_a_response_that_stops_early_is_missing_afterwards(tree):
    short = tree["structure/beam_spring"].to_dataset().isel(time=slice(0, 2))
    cut = xr.DataTree.from_dict({**tree.to_dict(), "/structure/beam_spring": short})
    states = curves.run_states(cut, None, np.arange(len(TIMES))).sel(model="beam-spring")
    np.testing.assert_array_equal(states["axial_force"][:2], short["axial_force"])
    assert np.isnan(states["axial_force"][2:]).all()


def test_numbers_of_a_page_are_read_back_as_they_were():
    rng = np.random.default_rng(7)
    exact, coarse = rng.normal(size=(5, 3)), rng.normal(size=(4, 7))
    coarse[1, 2] = np.nan
    data = {"name": "<a>", "nested": [{"exact": exact}, levels(coarse)], "bytes": np.arange(5, dtype="u1")}
    raw = zlib.decompress(base64.b64decode(packed(data)))
    head = int.from_bytes(raw[:4], "little")
    found, body = json.loads(raw[4 : 4 + head]), raw[4 + head :]

    def array(entry):
        dtype, count = np.dtype(f"<{entry['kind']}"), int(np.prod(entry["shape"]))
        return np.frombuffer(body, dtype, count, entry["at"]).reshape(entry["shape"])

    assert found["name"] == "<a>" and array(found["bytes"]).tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_array_equal(array(found["nested"][0]["exact"]), exact.astype("f4"))
    kept = found["nested"][1]
    values = np.where(array(kept) == 65535, np.nan, kept["low"] + kept["step"] * array(kept))
    np.testing.assert_allclose(values, coarse, rtol=0, atol=0.5001 * kept["step"])


def test_embedded_fields_are_within_half_a_step_of_the_points(tree):
    stored = tree["points"].to_dataset()
    shots = ground.field_snapshots(stored)
    view = shots["view"]
    for k, snapshot in enumerate(shots["snapshots"]):
        shot = stored.isel(time=k)
        near = (np.abs(shot["x"] - view["x"]) < view["half"]) & (np.abs(shot["y"] - view["y"]) < view["half"])
        shot = shot.isel(point=np.flatnonzero(near))
        step = 2 * view["half"] / 65535
        x = view["x"] - view["half"] + step * snapshot["x"].astype(float)
        order = np.argsort(x, kind="stable")
        np.testing.assert_allclose(x[order], np.sort(shot["x"].values), atol=0.5 * step + 1e-5)
        scale = shots["fields"]["pore_pressure"]
        width = (scale["high"] - scale["low"]) / 255
        shown = scale["low"] + width * np.sort(snapshot["pore_pressure"]).astype(float)
        expected = np.minimum(np.sort(np.maximum(shot["pore_pressure"].values / 1e3, 0)), scale["high"])
        np.testing.assert_allclose(shown, expected, atol=0.5 * width + 1e-3)
        scale = shots["fields"]["displacement"]
        assert scale["log"] and (scale["low"], scale["high"]) == (1.0, 1000.0)
        size = np.clip(1e3 * np.hypot(shot["displacement_x"], shot["displacement_y"]), 1.0, 1000.0)
        shown = 10 ** (3 / 255 * np.sort(snapshot["displacement"]).astype(float))
        # half of 255 steps over three decades
        np.testing.assert_allclose(shown, np.sort(size), rtol=10 ** (1.5 / 255) - 1 + 1e-6)


@pytest.mark.slow
def test_the_page_of_a_long_run_stays_under_six_megabytes(run, tree, monkeypatch):
    """Of noise, which cannot be compressed."""
    records, theta, rng = 5000, np.arange(360.0), np.random.default_rng(2)
    time = np.linspace(0, 100, records)
    noise = rng.normal(size=(records, 360)).astype("f4")
    pressures = {name: (("time", "theta"), noise) for name in datasets.PRESSURES}
    progress = {name: ("time", np.linspace(0, 1, records)) for name in datasets.PROGRESS}
    geometry = tree["lining"].attrs
    lining = xr.Dataset({**pressures, **progress}, coords={"time": time, "theta": theta}, attrs=geometry)
    history = xr.Dataset({name: ("time", rng.uniform(size=records)) for name in datasets.HISTORY},
                         coords={"time": time})  # fmt: skip
    response = tree["structure/beam_spring"].to_dataset().isel(time=np.zeros(records, int)).assign_coords(time=time)
    response = response.map(lambda part: part * rng.uniform(size=part.shape))
    shot = {name: np.tile(values, 250) * rng.uniform(0.9, 1.1, 250 * len(values))
            for name, values in points(1.0).items() if name != "removed"}  # fmt: skip
    many = xr.Dataset({name: (("time", "point"), np.stack([values] * 30)) for name, values in shot.items()},
                      coords={"time": np.linspace(0, 100, 30)}, attrs=geometry)  # fmt: skip
    nodes = rng.uniform(size=(2, 200_000))
    mesh = xr.Dataset({"x": ("node", nodes[0]), "y": ("node", nodes[1]), "region": ("element", np.zeros(400_000, "i1")),
                       "element_nodes": (("element", "corner"), np.arange(1_200_000).reshape(-1, 3) % 200_000)},
                      attrs=geometry)  # fmt: skip
    models = {
        f"/{datasets.structure_group(name)}": response.assign_attrs(model=name)
        for name in ("beam-spring", "continuum", "third")
    }
    long = xr.DataTree.from_dict({"/lining": lining, "/history": history, "/points": many, "/mesh": mesh, **models})
    long.attrs = tree.attrs
    monkeypatch.setattr(run_page, "read_run", lambda file: long)
    data = run_page.collect(run)
    (entry,) = data["player"]["entries"]
    assert entry["records"][-1] == run_page.MOST_RECORDS - 1 and len(entry["records"]) > 20
    assert 4e6 < len(page.rendered(data)) < 6e6


@pytest.mark.slow
def test_only_an_earlier_report_is_replaced(run, tmp_path):
    path = page.write_report(run, tmp_path)
    assert path == tmp_path / "report.html" and page.is_report(path)
    (tmp_path / "mine.html").write_text("<p>mine</p>")
    for out, message in ((tmp_path / "mine.html", "is no report"), (tmp_path / "no" / "a.html", "does not exist")):
        refused = CliRunner().invoke(app, ["report", str(run), "--out", str(out)])
        assert refused.exit_code == 2 and message in refused.output
    assert (tmp_path / "mine.html").read_text() == "<p>mine</p>"
    done = CliRunner().invoke(app, ["report", str(run), "--out", str(path), "--json", "-"])
    assert done.exit_code == 0 and json.loads(done.stdout)["bytes"] == path.stat().st_size < 3e6


def test_a_file_without_a_record_is_refused(tmp_path):
    empty = write_run(tmp_path / "run.nc", times=(), models=())
    for path, message in ((empty, "no complete record yet"), (tmp_path / "none", "no such file")):
        refused = CliRunner().invoke(app, ["report", str(path)])
        assert refused.exit_code == 2 and message in refused.output
