"""A run whose process was killed says so wherever its status is read, and how it can be continued."""

import signal
import subprocess
import sys
import time as clock

import pytest
from typer.testing import CliRunner

from coupling import cli
from coupling.commands.describe import describe
from coupling.datasets import RunFileError, read_attributes, read_history
from verification.small_event import small_scene


@pytest.mark.slow
def test_killed_run_is_interrupted_and_offers_to_resume(tmp_path):
    scene, out = tmp_path / "small.toml", tmp_path / "run"
    scene.write_text(small_scene(stop={"time": 4000.0, "inflow_mass": 1e9}, output={"interval": 0.005}).source)
    command = [sys.executable, "-m", "coupling.cli", "run", str(scene), "--out", str(out), "--no-figures"]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as process:
        try:
            while _records(out) < 3 and process.poll() is None:
                clock.sleep(0.1)
            assert read_attributes(out)["status"] == "running"
            assert describe(out)["facts"]["status"] == "running"
        finally:
            process.send_signal(signal.SIGKILL)
    resume = f"gush run --resume --out {out}"
    found = describe(out)
    assert found["facts"]["status"].startswith("interrupted") and found["next"][0] == resume
    result = CliRunner().invoke(cli.app, ["info", str(out), "--json", "-"])
    assert resume in result.output
    attributes = read_attributes(out)
    assert attributes["status"] == "interrupted" and resume in attributes["status_message"]


def _records(out):
    try:
        return read_history(out).sizes["time"]
    except RunFileError:
        return 0
