"""A real study on a dask scheduler with two workers, one killed in the middle; the benchmark does 64 runs."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


def test_study_with_a_killed_worker_equals_the_serial_one():
    result = subprocess.run(
        [sys.executable, "-m", "verification.robustness.lost_worker", "4", "--print-only"],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    data = json.loads(result.stdout)
    assert data["workers_killed"] == 1 and data["finished"] == data["told_done"] == 4
    assert data["different_variables"] == []
