"""A run stopped at any moment, in any way, goes on to the bits of one that was never stopped."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
import warnings

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

import coupling
from coupling import datasets
from coupling.cli import app
from coupling.files import checkpoint, provenance
from coupling.refused import Refused
from coupling.runs.rerun import compare_bits
from verification.small_event import small_scene

pytestmark = pytest.mark.slow

OFTEN = {"checkpoint_interval": 0.0}  # the time that checkpoints may take is limited too: some ten of them
KILLED = 9


@pytest.fixture(scope="module")
def scene():
    return small_scene(interior="sink", stop={"time": 0.08})


@pytest.fixture(scope="module")
def whole(scene, tmp_path_factory):
    """The folder of an uninterrupted run."""
    folder = tmp_path_factory.mktemp("resume") / "whole"
    coupling.run(scene, folder)
    return folder


@pytest.fixture(scope="module")
def stopped(scene, tmp_path_factory):
    """The folder of a run killed after some checkpoints, with records behind the last one."""
    folder = tmp_path_factory.mktemp("resume") / "stopped"

    def kill_later():
        append, count = datasets.RunWriter.append, iter(range(100))

        def counted(writer, record):
            append(writer, record)
            if next(count) == 12:
                os._exit(KILLED)

        datasets.RunWriter.append = counted

    assert in_child(lambda: coupling.run(scene, folder, **OFTEN), kill_later) == KILLED
    assert len(checkpoint.checkpoints(folder)) == 2
    assert len(times(folder)) == 13
    return folder


def in_child(work, prepare=lambda: None):
    """Exit code of a process of its own that does some work: 0, 1 for an OSError, 2 for anything else."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # a fork with threads: none of them is at work here
        child = os.fork()
    if child == 0:
        code = 2
        try:
            datasets.writer.SECONDS_BETWEEN_WRITES = 0.0
            prepare()
            work()
            code = 0
        except OSError:
            code = 1
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def times(folder):
    return datasets.raw_groups(folder, ("history",))["history"]["time"]


def assert_same(folder, whole):
    comparison = compare_bits(whole, folder)
    assert comparison["identical"], comparison["differences"]
    assert comparison["records_run"] == comparison["records_rerun"]
    assert datasets.read_attributes(folder)["status"] == "finished"
    left = {path.name for path in folder.iterdir()}
    assert left == {"run.nc", "scene.toml", "mesh.vtu", "run.log"}, "checkpoints and journals are cleared away"


def kill_at(call):
    """Ends the process, as kill -9 does, before it asks for the `call`th time to make something last."""

    def prepare():
        count, fsync = iter(range(1, 10_000)), os.fsync

        def counted(handle):
            if next(count) == call:
                os._exit(KILLED)
            fsync(handle)

        os.fsync = counted

    return prepare


# every kind of moment: scene, run file, journal, change, checkpoint, their folders, the status at the end
@pytest.mark.parametrize("first", [2, 9, 31])
def test_killed_again_and_again_it_still_ends_with_the_same_bits(scene, whole, tmp_path, first):
    folder, records = tmp_path / "a", 0
    assert in_child(lambda: coupling.run(scene, folder, **OFTEN), kill_at(first)) == KILLED
    for call in range(first + 9, 10_000, 23):
        if (folder / "run.nc").exists():
            now = len(times(folder))
            assert now >= records, "records that were written are lost"
            records = now
        code = in_child(lambda: coupling.run(out=folder, resume=True, **OFTEN), kill_at(call))
        if code == 0:
            break
        assert code == KILLED
    assert code == 0
    assert_same(folder, whole)


def test_killed_before_anything_was_written_it_is_started_again(scene, tmp_path):
    folder = tmp_path / "a"
    assert in_child(lambda: coupling.run(scene, folder), kill_at(1)) == KILLED
    with pytest.raises(Refused, match="--overwrite"):
        coupling.run(out=folder, resume=True)


def test_kill_9_of_the_command_at_a_random_moment(tmp_path):
    scene, folder, file = small_scene(stop={"time": 0.2}), tmp_path / "a", tmp_path / "scene.toml"
    file.write_text(scene.source)
    command = [sys.executable, "-m", "coupling.cli", "run", "--no-figures", "--quiet", "--checkpoint-interval", "0"]
    process = subprocess.Popen([*command, file, "--out", folder])
    deadline = time.monotonic() + 100
    while len(checkpoint.checkpoints(folder)) < 2 and time.monotonic() < deadline:
        time.sleep(0.005)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    done = subprocess.run([*command, "--resume", "--out", folder], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    coupling.run(scene, tmp_path / "whole")
    assert_same(folder, tmp_path / "whole")
    assert datasets.read_attributes(folder)["resumed"]


def flip(path, offset):
    data = bytearray(path.read_bytes())
    data[offset] ^= 0x10
    path.write_bytes(data)


def truncate(path, share):
    os.truncate(path, int(share * path.stat().st_size))


DAMAGES = [(flip, 3), (flip, 30), (flip, 600), (flip, -1), (truncate, 0), (truncate, 0.001), (truncate, 0.99)]


@pytest.mark.parametrize(("damage", "where"), DAMAGES)
def test_damaged_checkpoint_is_recognised_and_the_one_before_it_used(stopped, whole, tmp_path, damage, where):
    folder, told = shutil.copytree(stopped, tmp_path / "a"), []
    last, before = checkpoint.checkpoints(folder)
    damage(last, where)
    coupling.run(out=folder, resume=True, warn=told.append)
    assert len(told) == 1 and last.name in told[0] and "damaged" in told[0] and "the one before it" in told[0]
    step = int(before.stem.split("-")[1])
    assert f"continued from step {step}" in (folder / "run.log").read_text()
    assert_same(folder, whole)


def test_without_any_good_checkpoint_it_begins_anew(stopped, whole, tmp_path):
    folder, told = shutil.copytree(stopped, tmp_path / "a"), []
    for path in checkpoint.checkpoints(folder):
        truncate(path, 0.5)
    coupling.run(out=folder, resume=True, warn=told.append)
    assert len(told) == 2
    assert_same(folder, whole)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.999])
def test_truncated_run_file_is_kept_aside_and_computed_again(stopped, whole, tmp_path, share):
    folder, told = shutil.copytree(stopped, tmp_path / "a"), []
    truncate(folder / "run.nc", share)
    size = (folder / "run.nc").stat().st_size
    coupling.run(out=folder, resume=True, warn=told.append)
    assert len(told) == 1 and "run.nc.damaged" in told[0] and "begins anew" in told[0]
    kept = folder / "run.nc.damaged"
    assert kept.stat().st_size == size
    kept.unlink()
    assert_same(folder, whole)


def test_older_run_file_than_the_checkpoint_is_not_built_upon(stopped, whole, tmp_path):
    folder, told = shutil.copytree(stopped, tmp_path / "a"), []
    with h5py.File(folder / "run.nc", "a") as file:
        for group in ("history", "lining"):
            file[group]["time"][:] = np.nan  # as if no record had ever been written
    coupling.run(out=folder, resume=True, warn=told.append)
    assert len(told) == 2 and all("the run file holds 0" in message for message in told)
    assert_same(folder, whole)


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_signal_ends_with_a_run_that_continues_where_it_was(scene, whole, tmp_path, monkeypatch, name):
    folder = tmp_path / "a"
    with monkeypatch.context() as patch:
        # a job in the background, as CI may be, hands down an ignored SIGINT
        former = {
            n: signal.signal(n, signal.default_int_handler) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        }
        append = datasets.RunWriter.append

        def stop_after(writer, record):
            append(writer, record)
            if record.time > 0.04:
                signal.raise_signal(getattr(signal, name))

        patch.setattr(datasets.RunWriter, "append", stop_after)
        try:
            with pytest.raises(KeyboardInterrupt) as interrupt:
                coupling.run(scene, folder)
        finally:
            for number, handler in former.items():
                signal.signal(number, handler)
    assert f"gush run --resume --out {folder}" in interrupt.value.__notes__[0]
    attributes, history = datasets.read_attributes(folder), datasets.raw_groups(folder)["history"]
    assert attributes["status"] == "interrupted"
    state, about = checkpoint.read_checkpoint(checkpoint.checkpoints(folder)[0])
    assert about["records"] == len(history["time"]) and state["step_count"] >= int(history["steps"][-1])
    coupling.run(out=folder, resume=True)
    assert_same(folder, whole)


def test_second_ctrl_c_ends_at_once_and_loses_nothing(scene, whole, tmp_path, monkeypatch):
    folder = tmp_path / "a"
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    append = datasets.RunWriter.append

    def stop_twice(writer, record):
        append(writer, record)
        if record.time > 0.04:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(datasets.RunWriter, "append", stop_twice)
        try:
            with pytest.raises(KeyboardInterrupt):
                coupling.run(scene, folder)
        finally:
            signal.signal(signal.SIGINT, former)
    assert times(folder)[-1] > 0.04
    coupling.run(out=folder, resume=True)
    assert_same(folder, whole)


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_full_disk_ends_with_a_run_that_continues(scene, whole, tmp_path, share):
    folder, size = tmp_path / "a", (whole / "run.nc").stat().st_size

    def limit():
        hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(share * size), hard))

    assert in_child(lambda: coupling.run(scene, folder, **OFTEN), limit) == 1
    records = len(times(folder)) if (folder / "run.nc").exists() else 0
    assert not list(folder.glob("*.tmp"))
    coupling.run(out=folder, resume=True)
    assert_same(folder, whole)
    assert records <= len(times(folder))


def test_threads_may_change_on_the_way(stopped, whole, tmp_path, monkeypatch):
    import mpm.solver

    monkeypatch.setattr(mpm.solver, "SMALLEST_PARALLEL", 0)
    folder = shutil.copytree(stopped, tmp_path / "a")
    coupling.run(out=folder, resume=True, threads=2)
    assert_same(folder, whole)


def gush(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_changed_scene_is_refused(stopped, tmp_path):
    folder = shutil.copytree(stopped, tmp_path / "a")
    text = (folder / "scene.toml").read_text()
    (folder / "scene.toml").write_text(text.replace("time = 0.08", "time = 0.09"))
    refused = gush("run", "--resume", "--out", folder)
    assert refused.exit_code == 2
    for part in ("[stop]", "time = 0.08 became time = 0.09", "take the change back"):
        assert part in refused.output, refused.output
    (folder / "scene.toml").write_text(text)
    refused = gush("run", "quick", "--resume", "--out", folder)
    assert refused.exit_code == 2 and "leave SCENE out" in refused.output
    assert len(checkpoint.checkpoints(folder)) == 2


def test_changed_version_is_refused(stopped, tmp_path, monkeypatch):
    folder = shutil.copytree(stopped, tmp_path / "a")
    version = provenance._version
    monkeypatch.setattr(provenance, "_version", lambda name: "0.1" if name == "numba" else version(name))
    refused = gush("run", "--resume", "--out", folder)
    assert refused.exit_code == 2
    assert "numba" in refused.output and "now 0.1" in refused.output and "start a new run" in refused.output
    monkeypatch.undo()
    monkeypatch.setattr(provenance, "solver_sha256", lambda: "0" * 64)
    refused = gush("run", "--resume", "--out", folder)
    assert refused.exit_code == 2 and "solver_sha256" in refused.output


def test_another_processor_is_told_not_refused(stopped, whole, tmp_path, monkeypatch):
    folder, told = shutil.copytree(stopped, tmp_path / "a"), []
    monkeypatch.setattr(provenance, "_processor", lambda: "abacus")
    coupling.run(out=folder, resume=True, warn=told.append)
    assert len(told) == 1 and "abacus" in told[0]
    assert_same(folder, whole)


def test_what_cannot_be_resumed_is_refused_with_a_reason(whole, tmp_path):
    for arguments, reason in (
        (("--out", tmp_path / "absent"), "must hold the run to resume"),
        ((), "give it as --out DIR"),
        (("--out", whole, "--overwrite"), "no --overwrite"),
    ):
        refused = gush("run", "--resume", *arguments)
        assert refused.exit_code == 2 and reason in refused.output, refused.output
    folder = shutil.copytree(whole, tmp_path / "failed")
    datasets.write_attributes(folder / "run.nc", status="failed", status_message="a point became non-finite")
    refused = gush("run", "--resume", "--out", folder)
    assert refused.exit_code == 2 and "a point became non-finite" in refused.output
    with pytest.raises(Refused, match="scene"):
        coupling.run(out=tmp_path / "b")


def test_finished_run_is_left_as_it_is(whole, tmp_path):
    folder = shutil.copytree(whole, tmp_path / "a")
    before = (folder / "run.nc").read_bytes()
    assert gush("run", "--resume", "--out", folder, "--no-figures", "--no-response").exit_code == 0
    assert (folder / "run.nc").read_bytes() == before


def test_rerun_repeats_a_run_bit_for_bit_and_says_so(whole, stopped, tmp_path):
    same = gush("rerun", whole, "--out", tmp_path / "a", "--json", tmp_path / "a.json")
    assert same.exit_code == 0, same.output
    assert "identical bit for bit" in same.output
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["identical"] and data["changed"] == {} and data["records"] == data["records_run"] == 17
    partial = gush("rerun", stopped, "--out", tmp_path / "b", "--json", "-")
    assert partial.exit_code == 0 and json.loads(partial.stdout)["records"] == 13


def test_rerun_finds_the_last_bit_of_one_number(whole, tmp_path):
    folder = shutil.copytree(whole, tmp_path / "a")
    with h5py.File(folder / "run.nc", "a") as file:
        pressure = file["lining/soil_pressure"]
        pressure[5, 100] = np.nextafter(pressure[5, 100], np.inf)
        instant = float(file["lining/time"][5])
    different = gush("rerun", folder, "--out", tmp_path / "b", "--json", tmp_path / "b.json")
    assert different.exit_code == 1 and "different" in different.output
    (row,) = json.loads((tmp_path / "b.json").read_text())["differences"]
    assert row["variable"] == "lining/soil_pressure" and row["time"] == instant and 0 < row["largest"] < 1e-9
