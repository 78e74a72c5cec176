"""Stages shared by threads: every part is done once and after the stage before it, whoever comes and however late."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from mpm.jit import kernel
from mpm.meeting import LINE, meeting_width, next_part, next_stage, take_part

PARTS, STAGES = 3, 400


@kernel
def count_parts(thread, meeting, stage, parts, stages, done, too_early):
    """Count in `done` (n_stages, n_parts) who did a part, and in `too_early` (n_parts,) parts before their stage."""
    for s in range(stages):
        part = take_part(meeting, stage, thread, parts)
        while part >= 0:
            if s > 0 and done[s - 1].min() == 0:
                too_early[part] += 1
            work = 0.0
            for k in range(200 * (part + 1)):
                work += np.sqrt(work + k)
            if work > 0.0:
                done[s, part] += 10**thread
            part = next_part(meeting, stage, thread, parts)
        stage = next_stage(meeting, stage, parts)


@pytest.mark.parametrize("delays", [(0.0,), (0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.002), (0.0, 0.05), (0.05, 0.0)])
def test_every_part_is_done_once_and_after_the_stage_before(delays):
    meeting, too_early = np.zeros(meeting_width(PARTS), np.int64), np.zeros(PARTS, np.int64)
    count_parts(0, meeting, 0, PARTS, 0, np.zeros((1, PARTS), np.int64), too_early)  # compiles

    def late(thread, stage, done):
        time.sleep(delays[thread])
        count_parts(thread, meeting, stage, PARTS, STAGES, done, too_early)

    for repetition in range(3):
        done = np.zeros((STAGES, PARTS), np.int64)
        with ThreadPoolExecutor(len(delays)) as pool:
            for thread in range(len(delays)):
                pool.submit(late, thread, repetition * STAGES, done)
        assert np.isin(done, 10 ** np.arange(len(delays))).all()
        assert not too_early.any()
        assert (meeting[::LINE][:PARTS] == (repetition + 1) * STAGES).all()
