"""The command line refuses bad input with one message and code 2, and never overwrites without being asked."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
from running import gush

import coupling
import mpm
from coupling import datasets
from coupling.figures import draw_run
from coupling.files.folder import claimed, default_folder
from coupling.refused import Refused
from coupling.runs.memory import check_memory
from coupling.runs.progress_line import ProgressLine
from coupling.runs.run import run
from coupling.scenes.features import features
from verification.synthetic_run import make_quick_scene

HEAVY = ("numba", "xarray", "matplotlib", "pint", "scipy", "skfem", "gmsh", "numpy")


def test_help_loads_no_heavy_library():
    code = (
        "import sys\nfrom coupling.cli import app\n"
        "try:\n    app(['--help'])\nexcept SystemExit:\n    pass\n"
        f"sys.exit(', '.join(name for name in {HEAVY} if name in sys.modules) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr == "" and done.returncode == 0 and "plan" in done.stdout


def test_run_writes_everything_and_prints_a_table(simulated, tmp_path):
    result = gush("run", "quick", "--out", tmp_path / "a", "--json", tmp_path / "a.json")
    assert result.exit_code == 0, result.output
    assert "inflow mass" in result.output and "60 kg/m" in result.output
    assert {"run.nc", "mesh.vtu", "scene.toml", "run.log", "figures"} == {p.name for p in (tmp_path / "a").iterdir()}
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["status"] == "finished" and data["inflow_mass"] == 60.0 and len(data["figures"]) == 6
    assert data["soil_pressure"]["crown"]["initial"] == pytest.approx(180e3, rel=1e-3)
    assert data["response"]["axial_force"]["final"]["max"] > 0
    again = gush("respond", tmp_path / "a", "--json", tmp_path / "b.json")
    assert again.exit_code == 0, again.output
    assert json.loads((tmp_path / "b.json").read_text())["axial_force"] == data["response"]["axial_force"]


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_poor_error_is_a_warning_with_a_remedy_in_the_run_its_log_and_its_report(simulated, tmp_path, monkeypatch):
    from coupling.postprocess.quality import ERRORS

    fine = gush("run", "quick", "--out", tmp_path / "fine")
    assert fine.exit_code == 0 and "warning: water lost" not in fine.output
    monkeypatch.setitem(ERRORS, "water_lost", ERRORS["water_lost"]._replace(good=-1.0, fair=-1.0))
    poor = gush("run", "quick", "--out", tmp_path / "poor", "--json", tmp_path / "poor.json")
    told = "water lost 0.0% of what came in is poor"
    assert poor.exit_code == 0 and f"warning: {told}" in poor.output
    assert "points_per_element_gate" in poor.output
    assert told in (tmp_path / "poor" / "run.log").read_text()
    verdicts = json.loads((tmp_path / "poor.json").read_text())["verdicts"]
    assert verdicts["water_lost"] == "poor" and verdicts["momentum_error"] == "good"
    assert gush("report", tmp_path / "poor").exit_code == 0
    page = (tmp_path / "poor" / "report.html").read_text()
    assert "Outside what is expected: water lost" in page and "No warnings" not in page


@pytest.mark.slow
def test_values_of_the_scene_are_set_on_the_command_line(simulated, tmp_path):
    changes = ("--set", "gate.angle=45", "--set", "gate.width=15 cm", "--set", "soils.0.friction_angle=33")
    result = gush("run", "quick", *changes, "--out", tmp_path / "a", "--no-figures")
    assert result.exit_code == 0, result.output
    scene = coupling.load_scene(tmp_path / "a" / "scene.toml")
    assert (scene.gate.angle, scene.gate.width, scene.soils[0].friction_angle) == (45.0, 0.15, 33.0)
    refused = gush("run", "quick", "--set", "gate.angel=45", "--out", tmp_path / "b")
    assert refused.exit_code == 2 and "did you mean 'angle'" in refused.output and not (tmp_path / "b").exists()
    resumed = gush("run", "--resume", "--out", tmp_path / "a", "--set", "gate.angle=50")
    assert resumed.exit_code == 2 and "--set" in resumed.output


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_ring_that_fails_leaves_the_pictures_of_the_ground_and_says_what_failed(simulated, tmp_path):
    (tmp_path / "loose.toml").write_text(
        'base = "quick"\n[ring]\njoint_rotational_stiffness = 0.0\njoint_normal_stiffness = 0.0\n'
        "joint_shear_stiffness = 0.0\n"
    )
    result = gush("run", tmp_path / "loose.toml", "--out", tmp_path / "a")
    assert result.exit_code == 3
    assert "ring: no equilibrium" in result.output and "the ground is computed and drawn" in result.output
    assert "ring: no equilibrium" in (tmp_path / "a" / "run.log").read_text()
    whole = gush("run", "quick", "--out", tmp_path / "b", "--no-figures", "--no-response")
    assert whole.exit_code == 0
    drawn, of_ground = (sorted(path.name for path in place) for place in (
        (tmp_path / "a" / "figures").iterdir(), draw_run(tmp_path / "b", tmp_path / "b" / "figures")))  # fmt: skip
    assert drawn == of_ground and len(drawn) > 3
    assert coupling.read_run(tmp_path / "a").attrs["status"] == "finished"


def test_scene_file_of_a_run_gives_the_same_scene(simulated, tmp_path):
    import coupling

    scene = make_quick_scene()
    run(scene, tmp_path / "a")
    assert coupling.load_scene(tmp_path / "a" / "scene.toml") == scene


@pytest.mark.slow
def test_nothing_is_overwritten_without_being_asked(simulated, tmp_path):
    folder = tmp_path / "a"
    run(make_quick_scene(), folder)
    before = (folder / "run.nc").read_bytes()
    (folder / "notes.txt").write_text("mine")
    refused = gush("run", "quick", "--out", folder)
    assert refused.exit_code == 2 and "--overwrite" in refused.output
    assert (folder / "run.nc").read_bytes() == before
    assert gush("run", "quick", "--out", folder, "--overwrite", "--no-figures", "--quiet").exit_code == 0
    assert (folder / "notes.txt").read_text() == "mine"


@pytest.mark.slow
def test_default_folder_is_numbered_when_taken(simulated, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folders = [run(make_quick_scene()).attrs["run"] for _ in range(3)]
    assert folders == [os.path.join("runs", name) for name in ("quick", "quick-2", "quick-3")]
    assert str(default_folder("case-3")) == os.path.join("runs", "case-3")


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_folder_in_use_is_refused(simulated, tmp_path):
    with claimed(tmp_path / "a"):
        result = gush("run", "quick", "--out", tmp_path / "a", "--overwrite")
        assert result.exit_code == 2 and f"in use by another run (process {os.getpid()})" in result.output
    assert gush("run", "quick", "--out", tmp_path / "a", "--no-figures").exit_code == 0


def test_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    for out in (tmp_path / "file", tmp_path / "file" / "below", "/proc/gush"):
        result = gush("run", "quick", "--out", out)
        assert result.exit_code == 2 and "choose another --out" in result.output


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[soils]]\nporosity = 45", "porosity must lie in (0.05, 0.9), got 45; give a fraction, not percent"),
        ("[[soils]]\nporosity = 0.4", "replaces all soils of the base"),
        ("[[soils]]\nname = 'sand'\nhydraulic_conductivity = -1e-4",
         "soil 'sand': hydraulic_conductivity must lie in (0, 10] m/s, got -0.0001"),
        ("[gate]\nwidth = 5.0", "gate"),
        ("[[tunnels]]\nx = 60.0\ncover = 20.0\nouter_diameter = 6.6\ninner_diameter = 5.9\nfriction_coefficient = 0.2",
         "outside the box"),
        ("[water]\ndensty = 1000.0", "density"),
        ("[discretisation]\nelement_size = 0.001", "memory"),
        ("this is no TOML", "TOML"),
    ],
)  # fmt: skip
def test_bad_scene_is_refused_with_its_reason(tmp_path, text, message):
    file = tmp_path / "scene.toml"
    file.write_text('base = "quick"\n' + text)
    for command in (("run", file, "--out", tmp_path / "a"), ("plan", file)):
        result = gush(*command)
        assert result.exit_code == 2 and message in result.output, result.output
    assert not (tmp_path / "a").exists()


def test_unknown_scene_suggests_a_name():
    result = gush("run", "quik")
    assert result.exit_code == 2 and "did you mean 'quick'" in result.output


def test_truncated_run_is_refused(simulated, tmp_path):
    run(make_quick_scene(), tmp_path / "a")
    file = tmp_path / "a" / "run.nc"
    file.write_bytes(file.read_bytes()[:-100])
    result = gush("respond", tmp_path / "a")
    assert result.exit_code == 2 and "truncated" in result.output


def test_too_little_memory_is_refused(monkeypatch):
    monkeypatch.setattr("coupling.runs.memory.free_memory_bytes", lambda: 1_000_000)
    with pytest.raises(Refused, match="raise element_size"):
        check_memory(make_quick_scene())


@pytest.mark.usefixtures("undrawn")
def test_failed_run_keeps_its_output_and_says_where(simulated, tmp_path):
    simulated.ending = mpm.RunFailed("a material point became non-finite", 0.2, (1.0, -20.0))
    result = gush("run", "quick", "--out", tmp_path / "a")
    assert result.exit_code == 3
    assert "t = 0.2 s" in result.output and str(tmp_path / "a") in result.output
    assert datasets.read_attributes(tmp_path / "a")["status"] == "failed"
    assert datasets.read_pressures(tmp_path / "a").sizes["time"] == 3


def test_interrupted_run_keeps_its_output(simulated, tmp_path):
    simulated.ending = KeyboardInterrupt()
    assert gush("run", "quick", "--out", tmp_path / "a").exit_code == 130
    assert datasets.read_attributes(tmp_path / "a")["status"] == "interrupted"
    assert datasets.read_pressures(tmp_path / "a").sizes["time"] == 3


@pytest.mark.slow
def test_ctrl_c_in_a_real_run_leaves_a_readable_file(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-m", "coupling.cli", "run", "quick", "--out", str(tmp_path / "a"), "--no-figures"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        # a job in the background, as CI may be, hands down an ignored SIGINT
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    deadline = time.monotonic() + 120  # compilation on a busy machine
    while not _has_records(tmp_path / "a") and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    message = process.communicate(timeout=60)[1].decode()
    assert process.returncode == 130, message
    assert f"gush run --resume --out {tmp_path / 'a'}" in message
    assert datasets.read_attributes(tmp_path / "a")["status"] == "interrupted"
    assert datasets.read_pressures(tmp_path / "a").sizes["time"] >= 1


def _has_records(folder):
    try:
        return datasets.read_pressures(folder).sizes["time"] > 0
    except datasets.RunFileError:
        return False


def test_scenes_are_listed():
    result = gush("scenes", "--json", "-")
    names = [row["name"] for row in json.loads(result.stdout)["scenes"]]
    assert names[0] == "quick" and {"case-1", "case-10", "twin-tunnels"} <= set(names)


@pytest.mark.slow
def test_plan_says_what_is_left_out_and_why(tmp_path):
    result = gush("plan", "quick", "--json", tmp_path / "plan.json")
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "plan.json").read_text())
    assert data["points"] > data["elements"] > 0 and data["expected_steps"] <= data["steps_to_stop_time"]
    left_out = {row["feature"]: row["reason"] for row in data["features"] if not row["active"]}
    assert left_out["motion of the lining"] == "lining = 'fixed'"


def test_plan_says_which_lining_moves():
    scene = coupling.load_scene("twin-tunnels")
    held, ring = scene.tunnels[0], scene.tunnels[1].model_copy(update={"lining": "elastic"})
    mixed = coupling.load_scene("twin-tunnels", tunnels=[t.model_dump(exclude_none=True) for t in (held, ring)])
    line = next(row for row in features(mixed, 1) if row["feature"] == "motion of the lining")
    assert line["active"]
    assert line["reason"] == "tunnel 0: lining = 'fixed'; tunnel 1: lining = 'elastic', 34.5 GPa, 8 harmonics"


def test_progress_line_names_the_limit_and_the_time_left():
    line = ProgressLine()
    state = {"stage": "gush", "time": 0.1, "inflow_mass": 50.0, "dt": 1e-4, "dt_limit": "acoustic",
             "point_steps_per_second": 8e6, "share": 0.25}  # fmt: skip
    line.text(state)
    line._begin = line._begin[0] - 10.0, 0.0  # ten seconds for this quarter
    text = line.text(state)
    for part in ("t 0.100 s", "inflow 50 kg/m", "dt 100 µs (acoustic)", "8.0 M point-steps/s", "30 s left"):
        assert part in text


def events_of(text):
    return [json.loads(line) for line in text.splitlines() if line.startswith("{")]


@pytest.mark.slow
def test_events_tell_stages_warnings_and_the_result_as_json_lines(simulated, tmp_path):
    scene = tmp_path / "soft.toml"
    scene.write_text('base = "quick"\nname = "soft"\n[gate]\nwidth = 0.002\n')
    result = gush("run", scene, "--out", tmp_path / "a", "--no-figures", "--events", "-")
    assert result.exit_code == 0, result.output
    told = events_of(result.stdout)
    assert len(told) == len(result.stdout.splitlines()), "nothing else is printed"
    stages = [event["stage"] for event in told if event["event"] == "progress"]
    assert stages[0] == "mesh" and "gush" in stages
    (warned,) = [event for event in told if event["event"] == "warning"]
    assert "gate.width" in warned["message"] and warned["message"] in (tmp_path / "a" / "run.log").read_text()
    assert told[-1]["event"] == "result" and told[-1]["inflow_mass"] == 60.0


@pytest.mark.slow
def test_events_tell_how_a_run_failed(simulated, tmp_path):
    for ending, name, code in (
        (mpm.RunFailed("a material point became non-finite", 0.2, (1.0, -20.0)), "failed", 3),
        (KeyboardInterrupt(), "interrupted", 130),
    ):
        simulated.ending = ending
        file = tmp_path / f"{name}.jsonl"
        assert gush("run", "quick", "--out", tmp_path / name, "--events", file).exit_code == code
        last = events_of(file.read_text())[-1]
        assert (last["event"], last["exit_code"]) == (name, code) and last["message"]
    file = tmp_path / "refused.jsonl"
    assert gush("run", "cas-3", "--events", file).exit_code == 2
    assert events_of(file.read_text())[-1]["event"] == "refused"


@pytest.mark.slow
def test_quiet_run_prints_nothing_and_logs_all(simulated, tmp_path):
    result = gush("run", "quick", "--out", tmp_path / "a", "--no-figures", "--quiet")
    assert result.exit_code == 0 and result.output == ""
    assert "finished in" in (tmp_path / "a" / "run.log").read_text()


def test_progress_is_silent_where_there_is_no_terminal(capsys):
    with ProgressLine() as line:
        line({"stage": "mesh"})
    assert capsys.readouterr() == ("", "")


def test_text_of_unknown_origin_can_not_steer_the_terminal(tmp_path):
    scene = tmp_path / "mine.toml"
    scene.write_text('base = "quick"\n[gate]\n"\\u001b[2J" = 1\n')
    result = gush("plan", scene)
    assert result.exit_code == 2 and "\x1b[2J" not in result.output and "\\x1b[2J" in result.output
