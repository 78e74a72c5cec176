"""Stages shared by threads: every part is done once and after the stage before it, whoever comes and however late."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from mpm.machine.compile import kernel, kernel_part
from mpm.machine.team import meeting_width, next_part, next_stage, stage_at_hand, take_part

MOST_PARTS, STAGES = 5, 400


@kernel_part
def parts_of(s):
    """Stages of 2, 5 and 1 parts."""
    return 2 if s % 3 == 0 else (MOST_PARTS if s % 3 == 1 else 1)


@kernel
def count_parts(thread, meeting, stage, stages, done, too_early):
    """Count in `done` (n_stages, n_parts) who did a part, and in `too_early` (n_parts,) parts before their stage."""
    for s in range(stages):
        parts = parts_of(s)
        part = take_part(meeting, stage, thread, parts)
        while part >= 0:
            if s > 0 and done[s - 1, : parts_of(s - 1)].min() == 0:
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
    meeting, too_early = np.zeros(meeting_width(MOST_PARTS), np.int64), np.zeros(MOST_PARTS, np.int64)
    count_parts(0, meeting, 0, 0, np.zeros((1, MOST_PARTS), np.int64), too_early)  # compiles
    parts = np.array([(2, MOST_PARTS, 1)[s % 3] for s in range(STAGES)])
    asked = np.arange(MOST_PARTS) < parts[:, None]

    def late(thread, stage, done):
        time.sleep(delays[thread])
        count_parts(thread, meeting, stage, STAGES, done, too_early)

    for repetition in range(3):
        done, stage = np.zeros((STAGES, MOST_PARTS), np.int64), stage_at_hand(meeting)
        with ThreadPoolExecutor(len(delays)) as pool:
            for thread in range(len(delays)):
                pool.submit(late, thread, stage, done)
        assert np.isin(done[asked], 10 ** np.arange(len(delays))).all()
        assert not done[~asked].any() and not too_early.any()
        assert stage_at_hand(meeting) == (repetition + 1) * parts.sum()
