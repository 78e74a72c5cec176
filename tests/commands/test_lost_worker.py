"""A real study on a dask scheduler with two workers, one killed in the middle; the benchmark does 64 runs."""

import numpy as np
import pytest

import coupling
from verification.robustness.lost_worker import MEASURED, killed_study, plan

pytestmark = pytest.mark.slow


def test_study_with_a_killed_worker_equals_the_serial_one(tmp_path):
    parallel, lines, killed = killed_study(4, tmp_path / "parallel")
    assert len(killed) == 1 and parallel["status"].values.tolist() == ["finished"] * 4
    assert sum(line.endswith("done") for line in lines) == 4
    serial = coupling.study(plan(4), tmp_path / "serial", workers=0).load()
    for name in set(serial.data_vars) - set(MEASURED):
        np.testing.assert_array_equal(parallel[name], serial[name], err_msg=name)
