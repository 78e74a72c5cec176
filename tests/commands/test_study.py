"""Studies: designs, content addresses, failures that cost one case, a lost worker, one dataset out of it all."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from running import gush

import coupling
from coupling.commands.describe import describe
from coupling.datasets import read_response
from coupling.studies import case as case_module
from coupling.studies import execute
from coupling.studies.case import at_inflow_masses
from coupling.studies.cases import cases
from coupling.studies.collect import units_of
from coupling.studies.design import Study, StudyError, load_study, study_names
from coupling.studies.pool import Pool
from coupling.studies.progress import CaseProgress, study_state
from coupling.studies.sensitivity import scatter, sensitivity, tornado
from verification.small_event import COARSE, small_scene

pytestmark = pytest.mark.slow

K0 = 0.3 / (1 - 0.3)  # of gravity loading in the built-in scenes
TINY = {
    "name": "tiny",
    "scene": "quick",
    "records": 3,
    "parameters": {"gate.angle": [60.0, 90.0], "soils.0.k0": [0.5, 0.6]},
}


def made_up(source, folder, backends, records, threads):
    """What `run_case` writes, from a formula: the moment is K0 times the angle; K0 = 0.6 at 60 degrees fails."""
    import tomllib

    scene = coupling.make_scene(tomllib.loads(source))
    angle, k0 = scene.gate.angle, scene.soils[0].lateral_pressure_coefficient(1.0)
    if k0 == 0.6 and angle == 60.0:
        raise RuntimeError("made to fail")
    mass = np.linspace(0, 100, records)
    result = xr.Dataset(
        {
            "bending_moment": (("progress",), k0 * angle * mass, {"units": "N m/m", "long_name": "moment"}),
            "time": (("progress",), mass / 100, {"units": "s"}),
            "cpu_seconds": ((), 1.0),
        },
        coords={"progress": mass / 100, "inflow_mass": ("progress", mass)},
    )
    os.makedirs(folder, exist_ok=True)
    result.to_netcdf(os.path.join(folder, case_module.CASE_FILE), engine="h5netcdf")
    return folder


def suicidal(source, folder, backends, records, threads):
    """Kills its worker the first time, and always at 60 degrees with K0 = 0.6."""
    import tomllib

    scene = coupling.make_scene(tomllib.loads(source))
    mark = folder + ".seen"
    doomed = scene.soils[0].k0 == 0.6 and scene.gate.angle == 60.0
    if doomed or not os.path.exists(mark):
        with open(mark, "w"):
            pass
        os.kill(os.getpid(), signal.SIGKILL)
    return made_up(source, folder, backends, records, threads)


@pytest.fixture
def fast(monkeypatch):
    monkeypatch.setattr(execute, "run_case", made_up)


def test_designs_give_their_combinations():
    factorial = load_study(TINY).combinations()
    assert [tuple(c.values()) for c in factorial] == [(60.0, 0.5), (60.0, 0.6), (90.0, 0.5), (90.0, 0.6)]
    assert [tuple(c.values()) for c in load_study(TINY | {"design": "list"}).combinations()] == [
        (60.0, 0.5),
        (90.0, 0.6),
    ]
    alone = load_study(TINY | {"design": "one-at-a-time"})
    assert alone.combinations() == [
        {}, {"gate.angle": 60.0}, {"gate.angle": 90.0}, {"soils.0.k0": 0.5}, {"soils.0.k0": 0.6},
    ]  # fmt: skip
    # what a case leaves as it is stands with it all the same; 90 degrees are the base once more
    assert [c.parameters["soils.0.k0"] for c in cases(alone)] == [K0, K0, 0.5, 0.6]
    ranges = {
        "gate.angle": {"low": 0, "high": 180},
        "soils.0.hydraulic_conductivity": {"low": 1e-5, "high": 1e-3, "scale": "log"},
    }
    for design in ("latin-hypercube", "sobol"):
        plan = load_study({"name": "s", "design": design, "samples": 16, "seed": 3, "parameters": ranges})
        values = np.array([list(c.values()) for c in plan.combinations()])
        assert values[:, 0].min() >= 0 and values[:, 0].max() <= 180
        # one sample in each of sixteen strips, also of the logarithm
        for shares in (values[:, 0] / 180, np.log(values[:, 1] / 1e-5) / np.log(100)):
            assert sorted(np.floor(16 * shares).astype(int)) == list(range(16))
        assert plan.combinations() == plan.combinations()  # equal seeds, equal cases


def test_parameters_reach_the_scene_and_what_follows_from_it():
    stiff = cases(load_study({"name": "s", "parameters": {"soils.0.youngs_modulus": [4e7, 8e7], "scene": ["case-1"]}}))
    assert [c.scene.soils[0].youngs_modulus for c in stiff] == [4e7, 8e7]
    assert [c.scene.ring.ground.youngs_modulus for c in stiff] == [4e7, 8e7]  # derived from the soil
    assert stiff[0].scene.name == "case-1" and stiff[0].key != stiff[1].key
    again = cases(load_study({"name": "other", "parameters": {"soils.0.youngs_modulus": [4e7], "scene": ["case-1"]}}))
    assert again[0].key == stiff[0].key  # the study's name does not decide a result
    both = cases(
        load_study(
            {
                "name": "s",
                "backends": ["continuum"],
                "parameters": {"soils.0.youngs_modulus": [4e7], "scene": ["case-1"]},
            }
        )
    )
    assert both[0].key != stiff[0].key


def test_fixed_values_hold_in_every_case():
    plan = load_study(TINY | {"fixed": {"stop.inflow_mass": 7.0}})
    assert {case.scene.stop.inflow_mass for case in cases(plan)} == {7.0}
    with pytest.raises(StudyError, match="must not vary"):
        load_study(TINY | {"fixed": {"gate.angle": 7.0}})


@pytest.mark.parametrize("name", ["backend", "mesh", "permeability", "sensitivity", "table-2"])
def test_ready_studies_are_valid(name):
    assert name in study_names() and len(cases(load_study(name))) >= 5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parameters": {"gate.angle": {"low": 0, "high": 1}}}, "must be a list of values"),
        ({"design": "sobol", "samples": 12, "parameters": {"gate.angle": {"low": 0, "high": 1}}}, "use 16"),
        ({"design": "sobol", "parameters": {"gate.angle": {"low": 0, "high": 1}}}, "samples: must be given"),
        ({"design": "list", "parameters": {"gate.angle": [1.0], "soils.0.k0": [0.5, 0.6]}}, "equally long"),
        ({"parameters": {"gate.angel": [1.0]}}, "did you mean 'angle'"),
        ({"parameters": {"soils.3.k0": [0.5]}}, "below 1, the length"),
        ({"parameters": {"soils.0.porosity": [0.4, 45.0]}}, "case 1 (soils.0.porosity = 45.0)"),
        ({"scene": "quik"}, "did you mean 'quick'"),
        (
            {"parameters": {"gate.angle": 45.0}},
            "gate.angle: must be a list of values or a range, got 45.0; write [45.0]",
        ),
        ({"parameters": {"gate.width": ["20 kg"]}}, "must be a quantity in m, got '20 kg'"),
        ({"parameters": {"gate.width": ["0,2 m"]}}, "write it like '0.2 m'"),
        ({"parameters": {"soils.0.k0": [True]}}, "must not be a truth value"),
        (
            {"design": "sobol", "samples": 4, "parameters": {"gate.width": {"low": "1 kg", "high": 2}}},
            "gate.width: must be a quantity in m",
        ),
        ({"samples": 4}, "leave samples out"),
        ({"desing": "list"}, "desing"),
    ],
)
def test_impossible_study_is_refused_before_it_runs(change, message):
    with pytest.raises(StudyError) as refusal:
        cases(load_study(TINY | change))
    assert message in str(refusal.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"backends": "continuum"}, "backends: must be a list, got 'continuum'; correct it"),
        ({"records": 2.5}, "records: must be a valid integer, got a number with a fractional part, got 2.5; correct"),
        ({"parameters": {}}, "parameters: must have at least 1 entry"),
        ({"parameters": {"gate": {"angle": [10.0]}}}, "gate: must be a list of values or a range; angle: unknown key"),
        ({"design": "sobol", "samples": 4, "parameters": {"gate.width": {"low": "20 cm", "high": 0.15}}},
         "gate.width: must be a list of values or a range; low must be below high, got 0.2 and 0.15; swap them"),
        ({"desing": "list"}, "desing: unknown key, got 'list'; did you mean 'design'?"),
    ],
)  # fmt: skip
def test_mistakes_of_a_study_are_told_in_words(change, message):
    with pytest.raises(StudyError) as caught:
        load_study(TINY | change)
    assert message in str(caught.value) and "Input should" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"workers": -1}, "workers: must be a whole number from 0, got -1"),
        ({"workers": "two"}, "workers: must be a whole number from 0, got 'two'"),
        ({"out": 3}, "out: must be the path of a folder, got 3"),
    ],
)
def test_study_refuses_arguments_of_a_wrong_type_before_it_starts(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(StudyError, match=message):
        coupling.study(TINY, **arguments)
    assert not list(tmp_path.iterdir())


def test_failed_case_costs_only_itself_and_the_rest_is_not_run_again(fast, tmp_path, monkeypatch):
    lines = []
    data = coupling.study(TINY, tmp_path, workers=0, progress=lines.append)
    assert data["status"].values.tolist() == ["finished", "failed", "finished", "finished"]
    assert "made to fail" in str(data["message"].values[1])
    assert np.isnan(data["bending_moment"].values[1]).all()
    np.testing.assert_allclose(data["bending_moment"].isel(progress=-1).values[[0, 2, 3]], [3000, 4500, 5400])
    assert data["gate_angle"].values.tolist() == [60, 60, 90, 90] and data.attrs["failed"] == 1
    calls = []
    monkeypatch.setattr(execute, "run_case", lambda *a: calls.append(a) or made_up(*a))
    wider = TINY | {"parameters": TINY["parameters"] | {"soils.0.k0": [0.5, 0.6, 0.7]}}
    coupling.study(wider, tmp_path, workers=0)
    assert len(calls) == 3  # what failed, and the two new ones
    read = coupling.read_study(tmp_path)
    assert read.sizes["case"] == 6 and read.attrs["failed"] == 1


def test_lost_workers_cost_only_their_case(tmp_path, monkeypatch):
    monkeypatch.setattr(execute, "run_case", suicidal)
    plan = TINY | {
        "parameters": {"gate.angle": [60.0], "soils.0.k0": [0.5, 0.6]}
    }  # each loss costs a family of processes
    data = coupling.study(plan, tmp_path / "parallel", workers=2)
    assert data["status"].values.tolist() == ["finished", "failed"]
    assert "killed (SIGKILL" in str(data["message"].values[1])
    monkeypatch.setattr(execute, "run_case", made_up)
    serial = coupling.study(plan, tmp_path / "serial", workers=0)
    xr.testing.assert_identical(data["bending_moment"].load(), serial["bending_moment"].load())


def test_script_without_a_guard_runs_its_study_in_processes_and_in_silence(tmp_path):
    script = tmp_path / "mine.py"
    script.write_text(
        f"import sys\nsys.path.insert(0, {str(Path(__file__).parents[2])!r})\n"
        "import coupling\nfrom verification.small_event import COARSE\n"
        "fixed = {f'discretisation.{name}': value for name, value in COARSE.items()}\n"
        "fixed |= {'numerics.relaxation_tolerance': 1e-3, 'stop.time': 0.01, 'stop.inflow_mass': 1.0}\n"
        "study = coupling.study({'name': 's', 'records': 2, 'fixed': fixed | {'output.interval': 0.005},\n"
        "    'parameters': {'gate.angle': [60.0, 90.0, 120.0]}}, out=sys.argv[1], workers=2)\n"
        "print(study.status.values.tolist(), study.case_name.values.tolist())\n"
    )
    command = [sys.executable, script, tmp_path / "out"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stderr == "" and done.returncode == 0
    assert done.stdout == "['finished', 'finished', 'finished'] ['angle 60', 'angle 90', 'angle 120']\n"


def test_workers_load_what_a_case_needs_once_and_no_scheduler(tmp_path):
    # six short cases take longer by two workers than in a loop where each worker loads libraries for itself
    code = (
        "import sys\nfrom importlib import import_module\nfrom coupling.studies.worker import LOADED\n"
        "for name in LOADED:\n    import_module(name)\n"
        "def heavy(): return {name.split('.')[0] for name in sys.modules} | {n for n in sys.modules if 'scipy.' in n}\n"
        "before = heavy()\nfrom coupling.studies.case import run_case\n"
        "run_case(sys.stdin.read(), sys.argv[1], ('beam-spring',), 2)\n"
        "print(*{n for n in heavy() - before if n.count('.') < 2 and n.split('.')[-1][0] != '_'})\n"
        "print('distributed' in sys.modules)"
    )
    scene = small_scene(stop={"inflow_mass": 1.0, "time": 0.01}).source
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", code, tmp_path], input=scene, capture_output=True,
                          text=True, check=True)  # fmt: skip
    loaded, scheduler = done.stdout.splitlines()
    assert set(loaded.split()) <= {"threadpoolctl"} and scheduler == "False"


def test_interrupted_study_leaves_no_process_behind(tmp_path):
    class Stopped(Exception):
        pass

    def stop(key, ended):
        raise Stopped

    marks = [tmp_path / str(k) for k in range(2)]
    with pytest.raises(Stopped), Pool(2) as pool:
        for ending in pool.run(sleeper, {k: (str(mark), str(marks[0]) if k else None) for k, mark in enumerate(marks)}):
            stop(*ending)
    pids = [int(mark.read_text()) for mark in marks]
    assert not [pid for pid in pids if os.path.exists(f"/proc/{pid}")]


def sleeper(mark, until):
    """Leave the number of the process, then wait for that of another one; without another for a minute."""
    Path(f"{mark}.new").write_text(str(os.getpid()))
    os.replace(f"{mark}.new", mark)
    end = time.monotonic() + 60.0
    while time.monotonic() < end and not (until and os.path.exists(until)):
        time.sleep(0.01)


def test_progress_of_all_cases_is_read_from_their_folders(tmp_path):
    numbers = {"a": 0, "b": 1, "c": 2, "d": 3}
    for key in numbers:
        (tmp_path / key).mkdir()
    (tmp_path / "a" / case_module.CASE_FILE).touch()
    report = CaseProgress(tmp_path / "b")
    report({"stage": "gush", "time": 1.0, "inflow_mass": 30.0, "share": 0.5})
    state = study_state(tmp_path, numbers, {"c": "made to fail"})
    assert (state.total, state.done, state.failed) == (4, 1, 1)
    assert state.running == {1: {"stage": "gush", "time": 1.0, "inflow_mass": 30.0, "share": 0.5}}
    assert state.share == pytest.approx(2.5 / 4)
    os.utime(tmp_path / "b" / "progress.json", (0, 0))  # a worker that was lost long ago
    assert study_state(tmp_path, numbers, {}).running == {}
    report.end()
    assert not list((tmp_path / "b").iterdir())


def test_study_tells_how_far_it_is(fast, tmp_path):
    states = []
    coupling.study(TINY, tmp_path, workers=0, watch=states.append)
    assert (states[-1].done, states[-1].failed, states[-1].share) == (3, 1, 1.0)


def test_killed_case_is_continued_not_begun_anew(tmp_path, monkeypatch):
    scene = small_scene(stop={"inflow_mass": 20.0, "time": 0.3}, output={"interval": 0.005, "snapshot_interval": None})
    plain = tmp_path / "plain"
    case_module.run_case(scene.source, str(plain), (), 3)

    class Killed(BaseException):
        """Stands for SIGKILL: nothing is tidied up after it."""

    def report(self, state):
        if state.get("share", 0.0) > 0.5:
            raise Killed

    monkeypatch.setattr(CaseProgress, "__call__", report)
    monkeypatch.setattr("coupling.runs.recorded_simulation.RecordedSimulation._close_if_possible", lambda *a, **k: None)
    monkeypatch.setattr("mpm.simulation.SECONDS_BETWEEN_REPORTS", 0.0)
    with pytest.raises(Killed):
        case_module.run_case(scene.source, str(tmp_path / "killed"), (), 3)
    monkeypatch.undo()
    case_module.run_case(scene.source, str(tmp_path / "killed"), (), 3)
    assert "continued from step" in (tmp_path / "killed" / "run" / "run.log").read_text()
    both = [xr.open_dataset(place / case_module.CASE_FILE).load() for place in (plain, tmp_path / "killed")]
    for one in both:
        for stamp in ("created", "history"):  # when each was made
            del one.attrs[stamp]
    xr.testing.assert_identical(*(one.drop_vars("cpu_seconds") for one in both))


def test_study_that_was_stopped_says_so_and_goes_on_from_its_folder(fast, tmp_path, monkeypatch):
    def stopped(*arguments):
        if len(list((tmp_path / "out" / "cases").glob("*/case.nc"))) == 2:
            raise KeyboardInterrupt
        return made_up(*arguments)

    monkeypatch.setattr(execute, "run_case", stopped)
    with pytest.raises(KeyboardInterrupt) as stop:
        coupling.study(TINY, tmp_path / "out", workers=0)
    assert stop.value.__notes__ == [f"what is done is kept; go on with: gush study {tmp_path / 'out'}"]
    found = describe(tmp_path / "out")
    assert found["facts"]["finished"] == 2 and found["next"][0] == f"gush study {tmp_path / 'out'}"
    monkeypatch.setattr(execute, "run_case", made_up)
    shown = gush(*found["next"][0].split()[1:], "--workers", "0")
    assert "4 cases, 2 of them are there already" in shown.output
    whole = coupling.study(TINY, tmp_path / "whole", workers=0)
    xr.testing.assert_identical(coupling.read_study(tmp_path / "out")["bending_moment"], whole["bending_moment"])
    for empty in (tmp_path, tmp_path / "out" / "cases"):
        with pytest.raises(StudyError, match=r"must hold study\.json, got none"):
            load_study(empty)


def test_command_runs_a_study_file(fast, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('name = "mine"\nrecords = 3\n[parameters]\n"gate.angle" = [90.0, 120.0, 150.0]\n')
    result = gush("study", file, "--out", tmp_path / "out", "--workers", "0", "--json", tmp_path / "data.json")
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "data.json").read_text())
    assert [case["status"] for case in data["cases"]] == ["finished"] * 3
    with xr.open_dataset(data["data"], engine="h5netcdf") as stored:
        assert stored.sizes["case"] == 3
    result = gush("study", "permeabilty")
    assert result.exit_code == 2 and "did you mean 'permeability'" in result.output
    file.write_text("name = ")
    assert "must be valid TOML" in gush("study", file).output


def test_table_of_a_study_shows_forces_by_what_its_cases_change(tmp_path):
    file = tmp_path / "short.toml"
    file.write_text(
        'name = "short"\nrecords = 2\n[fixed]\n"stop.inflow_mass" = 1.0\n"stop.time" = 0.004\n'
        '"output.interval" = 0.004\n"numerics.relaxation_tolerance" = 1e-3\n'
        + "".join(f'"discretisation.{name}" = {value}\n' for name, value in COARSE.items())
        + '[parameters]\n"gate.angle" = [60.0, 90.0]\n"soils.0.k0" = [0.5]\n'
    )
    result = gush("study", file, "--out", tmp_path / "out", "--workers", "2", "--json", tmp_path / "data.json")
    assert result.exit_code == 0 and "Nanny" not in result.output and "arning" not in result.output, result.output
    shown = gush("study", file, "--out", tmp_path / "out", "--workers", "2").output
    data = json.loads((tmp_path / "data.json").read_text())
    for case, angle in zip(data["cases"], (60, 90), strict=True):
        assert case["name"] == f"angle {angle}, k0 0.5" and case["name"] in shown
        response = read_response(tmp_path / "out" / "cases" / folder_of(tmp_path / "out", case["case"]) / "run")
        moment, force = (response[name].isel(time=0) for name in ("bending_moment", "axial_force"))
        assert case["bending_moment"] == {"max": float(moment.max()), "min": float(moment.min())}
        assert case["axial_force"]["max"] == float(force.max())
        assert f"{force.max() / 1e3:.0f}" in shown and f"{moment.min() / 1e3:.0f} to {moment.max() / 1e3:.0f}" in shown


def folder_of(out, number):
    """Key of a case by its number."""
    return list(json.loads((out / "status.json").read_text()))[number]


def test_case_is_taken_at_inflow_masses_and_unknown_beyond_them():
    time = np.array([0.0, 1.0, 2.0, 3.0])
    theta = np.arange(0.0, 360.0, 45.0)
    history = xr.Dataset(
        {
            "inflow_mass": ("time", [0.0, 0.0, 40.0, 60.0]),
            "flow_zone_area": ("time", 10 * time),
            "cpu_seconds": ("time", time),
        },
        coords={"time": time},
    )
    pressures = xr.Dataset(
        {
            name: (("time", "theta"), time[:, None] + 0 * theta, {"units": "Pa"})
            for name in ("soil_pressure", "water_pressure", "soil_shear")
        },
        coords={"time": time, "theta": theta},
    )
    found = at_inflow_masses(pressures, history, {}, np.array([0.0, 20.0, 50.0, 100.0]))
    np.testing.assert_allclose(found["time"], [0.0, 1.5, 2.5, np.nan])
    np.testing.assert_allclose(found["flow_zone_area"], [0.0, 15.0, 25.0, np.nan])
    np.testing.assert_allclose(found["soil_pressure"].isel(theta=3), [0.0, 1.5, 2.5, np.nan])
    assert found["soil_pressure"].attrs["units"] == "Pa"


def test_one_real_case_with_both_models(tmp_path):
    plan = {
        "name": "real",
        "records": 2,
        "backends": ["beam-spring", "continuum"],
        "parameters": {"stop.time": [0.004], "stop.inflow_mass": [1.0], "output.interval": [0.002]},
    }
    data = coupling.study(plan, tmp_path, workers=0)
    assert data["status"].values.tolist() == ["finished"]
    moment = data["bending_moment"].isel(case=0, progress=0)
    assert moment.dims == ("model", "theta") and moment.sizes == {"model": 2, "theta": 360}
    beam, continuum = moment.sel(model="beam-spring"), moment.sel(model="continuum")
    assert float(abs(beam - continuum).max()) < 0.05 * float(abs(beam).max())
    assert np.isnan(data["soil_pressure"].isel(case=0, progress=1)).all()  # 1 kg/m is not reached in 4 ms
    assert float(data["quality_grain_mass_error"][0]) == 0.0


def test_sensitivity_ranks_parameters_by_their_effect():
    generator = np.random.default_rng(0)
    one, two = generator.random(64), generator.random(64)
    data = xr.Dataset(coords={"case": np.arange(64), "strong": ("case", one), "weak": ("case", two)})
    quantity = xr.DataArray(10 * one - two, dims="case", attrs={"units": "N", "long_name": "made up"})
    result = sensitivity(data, quantity)
    assert result["parameter"].values.tolist() == ["strong", "weak"]
    # means of the halves of a uniform parameter differ by half its range, up to the sampling of the other
    assert float(result["effect"][0]) == pytest.approx(5, abs=0.6)
    assert float(result["rank_correlation"][0]) > 0.95 and result["effect"].attrs["units"] == "N"
    assert len(tornado(result).axes[0].patches) == 2 and len(scatter(data, quantity).axes) == 2
    with pytest.raises(ValueError, match="at least 3 cases"):
        sensitivity(data, quantity.where(quantity.case < 2))


def test_effects_of_a_sampled_linear_function_are_in_the_ratio_of_its_sobol_indices():
    from scipy.stats import sobol_indices, uniform

    factors = np.array([4.0, 2.0, 1.0])
    n = 1024
    indices = sobol_indices(func=lambda x: factors @ x, n=n, dists=[uniform()] * 3, rng=0).first_order
    ranges = {name: {"low": 0.0, "high": 1.0} for name in "abc"}
    shares = load_study({"name": "s", "design": "sobol", "samples": n, "parameters": ranges}).combinations()
    coords = {name: ("case", np.array([row[name] for row in shares])) for name in ranges}
    data = xr.Dataset(coords={"case": np.arange(n), **coords})
    effects = sensitivity(
        data, xr.DataArray(sum(f * data[k] for f, k in zip(factors, "abc", strict=True)), dims="case")
    )
    squares = effects["effect"].sel(parameter=[*"abc"]).values ** 2
    # the indices of 16/21, 4/21, 1/21 by a thousand samples are known to some thousandths
    np.testing.assert_allclose(squares / squares.sum(), indices, atol=0.01)
    np.testing.assert_allclose(squares / squares.sum(), factors**2 / (factors**2).sum(), atol=2e-3)


def one_at_a_time(parameters, quantity):
    """Dataset of such a study as `coupling.study` returns it: parameters by name to their values, the base first."""
    definition = {"name": "s", "design": "one-at-a-time", "parameters": {name: [0] for name in parameters}}
    coords = {"case": np.arange(len(quantity)), **{name: ("case", values) for name, values in parameters.items()}}
    data = xr.Dataset(coords=coords, attrs={"study": json.dumps(definition)})
    return data, xr.DataArray(np.array(quantity, float), dims="case", attrs={"units": "N", "long_name": "made up"})


def test_sensitivities_of_one_at_a_time_are_differences_from_the_base():
    data, quantity = one_at_a_time({"a": [1.0, 2.0, 1.0], "b": [5.0, 5.0, 4.0]}, [10, 20, 0])
    result = sensitivity(data, quantity)
    found = {
        str(name): tuple(float(result[key].sel(parameter=name)) for key in ("low", "high", "effect"))
        for name in result["parameter"].values
    }
    assert found == {"a": (10.0, 20.0, 10.0), "b": (0.0, 10.0, 10.0)}
    assert float(result["base"]) == 10.0
    bars = tornado(result).axes[0].patches
    assert sorted((bar.get_x(), bar.get_x() + bar.get_width()) for bar in bars) == [(0.0, 10.0), (10.0, 20.0)]


def test_what_other_parameters_do_does_not_enter_a_one_at_a_time_sensitivity():
    # q = 3 a + 100 b: three values of a on both sides of the base, one of b; texts count too
    a = [0.0, -1.0, 1.0, 2.0, 0.0, 0.0]
    b = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    kind = ["fixed"] * 5 + ["elastic"]
    quantity = [3 * x + 100 * y - 7 * (k == "elastic") for x, y, k in zip(a, b, kind, strict=True)]
    data, quantity = one_at_a_time({"a": a, "b": b, "kind": kind}, quantity)
    result = sensitivity(data, quantity)
    assert result["parameter"].values.tolist() == ["b", "a", "kind"]
    assert result["low"].values.tolist() == [0.0, -3.0, -7.0] and result["high"].values.tolist() == [100.0, 6.0, 0.0]
    assert float(result["rank_correlation"].sel(parameter="a")) == pytest.approx(1.0)
    assert len(scatter(data, quantity).axes) == 3
    with pytest.raises(ValueError, match="must have its base"):
        sensitivity(data, quantity.where(quantity.case > 0))


def test_effects_of_a_grid_are_those_of_a_linear_function_also_where_cases_are_missing():
    a, b = (values.ravel() for values in np.meshgrid([1.0, 2.0, 3.0], [10.0, 20.0], indexing="ij"))
    data = xr.Dataset(coords={"case": np.arange(6), "a": ("case", a), "b": ("case", b)})
    result = sensitivity(data, xr.DataArray(5 * a + b, dims="case"))
    # means over the grid: from a = 1 to 3, from b = 10 to 20
    assert {str(n): float(result["effect"].sel(parameter=n)) for n in "ab"} == {"a": 10.0, "b": 10.0}
    # the median of a parameter may be one of its values: both halves still hold different cases
    thin = xr.Dataset(coords={"case": np.arange(3), "a": ("case", [1.0, 2.0, 2.0])})
    assert float(sensitivity(thin, xr.DataArray([0.0, 8.0, 8.0], dims="case"))["effect"][0]) == 8.0


def test_parameters_with_units_are_numbers_of_the_dataset(fast, tmp_path):
    plan = TINY | {"parameters": {"gate.angle": ["1 rad", "60 deg"], "soils.0.k0": [0.5, 0.55]}}
    data = coupling.study(plan, tmp_path, workers=0)
    np.testing.assert_allclose(data["gate_angle"], np.degrees([1, 1, np.pi / 3, np.pi / 3]))
    assert (data["gate_angle"].attrs["units"], data["soils_0_k0"].attrs["units"]) == ("degree", "1")
    moment = data["bending_moment"].isel(progress=-1)
    assert set(sensitivity(data, moment)["parameter"].values) == {"gate_angle", "soils_0_k0"}
    ranges = {"gate.width": {"low": "15 cm", "high": "0.2 m"}, "ring.concrete_modulus": {"low": "20 GPa", "high": 3e10}}
    sampled = load_study({"name": "s", "design": "sobol", "samples": 4, "parameters": ranges})
    values = np.array([list(c.parameters.values()) for c in cases(sampled)])
    assert 0.15 <= values[:, 0].min() and values[:, 0].max() <= 0.2
    assert 2e10 <= values[:, 1].min() and values[:, 1].max() <= 3e10


@pytest.mark.parametrize(
    ("name", "units"),
    [("gate.width", "m"), ("soils.0.grain_density", "kg/m^3"), ("stop.inflow_mass", "kg/m"), ("soils.0.porosity", "1"),
     ("ring.joint_rotational_stiffness", "N m/rad/m"), ("ring.ground.cohesion", "Pa"), ("scene", "1")],
)  # fmt: skip
def test_units_of_a_parameter_are_those_of_its_key(name, units):
    assert units_of(name) == units


def test_effect_beside_a_k0_that_varies_with_depth_is_that_of_the_own_parameter():
    # a K0 at the yield surface is no single number: nan in the base and wherever it is left as it is
    data = xr.Dataset(
        coords={
            "case": np.arange(4), "case_name": ("case", ["as it is", "a 2", "a 3", "k0 0.5"]),
            "a": ("case", [1.0, 2.0, 3.0, 1.0]), "k0": ("case", [np.nan, np.nan, np.nan, 0.5]),
        },
        attrs={"study": json.dumps({"design": "one-at-a-time"})},
    )  # fmt: skip
    found = sensitivity(data, xr.DataArray([0.0, 2.0, 4.0, 9.0], dims="case"))
    assert float(found["effect"].sel(parameter="a")) == 4.0


def test_what_a_one_at_a_time_study_repeats_is_no_case_more():
    plan = {"name": "s", "design": "one-at-a-time", "parameters": {
        "gate.width": [0.15, "200 mm", 0.2], "soils.0.k0": ["none", 0.5], "water": ["none"]}}  # fmt: skip
    found = cases(load_study(plan))
    assert [case.name for case in found] == ["as it is", "width 0.15", "k0 0.5", "water none"]
    assert [case.index for case in found] == [0, 1, 2, 3] and len({case.key for case in found}) == 4


def test_lining_models_are_known_before_the_first_simulation(fast, tmp_path):
    for backends, message in ((["beam-sprin"], "did you mean 'beam-spring'"), (["continuum"] * 2, "must differ"),
                              ([f"{tmp_path / 'none.py'}:Mine"], "there is no file")):  # fmt: skip
        with pytest.raises(StudyError, match=message):
            coupling.study(TINY | {"backends": backends}, tmp_path / "out", workers=0)
    assert not (tmp_path / "out").exists()


def test_definition_travels_with_the_data(fast, tmp_path):
    data = coupling.study(TINY, tmp_path, workers=0)
    assert Study.model_validate(json.loads(data.attrs["study"])) == load_study(TINY)


def test_study_without_workers_says_so_instead_of_waiting(monkeypatch):
    class NoCluster:
        def scheduler_info(self, n_workers):
            return {"workers": {}}

    class NothingReady:
        def has_ready(self):
            return False

    monkeypatch.setattr(execute, "LONGEST_WITHOUT_WORKERS", 0.2)
    with pytest.raises(StudyError, match=r"no worker has been there for 0.2 s; what is done is kept"):
        execute._wait(NoCluster(), NothingReady())
