"""Kill a small run at random moments, resume it, and compare with the uninterrupted run bit for bit.

Every run is the command `gush run` in a process of its own that ends by SIGKILL at a moment drawn evenly over the life
of the uninterrupted one: meshing, relaxation, stepping, writing, checkpoints, closing. Moments are measured in
processor time of the run itself, which a busy machine does not stretch, and a kill counts only if the run's file does
not say "finished" yet; others are drawn again. Processes are forked from one that has compiled the kernels, so that the
kill falls into the run and not into its start.
"""

import os
import random
import shutil
import signal
import time
from collections import Counter
from pathlib import Path

KILLED_AGAIN = 0.25  # share of the resumed runs that are killed once more
FINISHED = "finished"
PEEK = os.WEXITED | os.WNOHANG | os.WNOWAIT  # look for the end of a process without taking its exit code


def kill_and_resume(place, count, seed):
    """Kill and resume until so many kills have struck a run at work."""
    from coupling.runs.rerun import compare_bits
    from verification.small_event import small_scene

    draw, scene = random.Random(seed), place / "scene.toml"
    scene.write_text(small_scene(interior="sink", stop={"time": 0.08}).source, encoding="utf-8")
    command = ["run", "--no-figures", "--quiet", "--threads", "1", "--checkpoint-interval", "0"]
    # twice: the first run compiles
    run_here([*command, str(scene), "--out", str(place / "compiled")])
    life = life_of(forked([*command, str(scene), "--out", str(place / "whole")]), place / "whole")
    struck, late, faults, codes, found = 0, 0, [], Counter(), Counter()
    while struck < count:
        folder = place / "killed"
        shutil.rmtree(folder, ignore_errors=True)
        start, again = [*command, str(scene), "--out", str(folder)], [*command, "--resume", "--out", str(folder)]
        code = ended(forked(start), draw.uniform(0.0, life))
        while code == -signal.SIGKILL:
            state = state_of(folder)
            if state == FINISHED:
                late += 1
            else:
                struck += 1
                found[state] += 1
            # a run killed before it had written its scene has nothing to resume
            if not (folder / "scene.toml").exists():
                again = [*start, "--overwrite"]
            once_more = struck < count and draw.random() < KILLED_AGAIN
            code = ended(forked(again), draw.uniform(0.0, life) if once_more else None)
        codes[code] += 1
        comparison = compare_bits(place / "whole", folder) if code == 0 else {"identical": False, "differences": code}
        if not comparison["identical"] or comparison["records_run"] != comparison["records_rerun"]:
            faults.append(str(comparison["differences"]))
    runs = sum(codes.values())
    return {"verdicts": dict(found), "faults": faults, "runs": runs, "identical": runs - len(faults), "late": late,
            "life_seconds": life}  # fmt: skip


def life_of(child, folder):
    """Processor time that an uninterrupted run takes until its file says "finished" [s]; waits for its end."""
    used = 0.0
    while state_of(folder) != FINISHED:
        used = processor_time(child)
        time.sleep(0.02)
    assert ended(child, None) == 0, "the uninterrupted run must succeed"
    return used


def processor_time(child):
    """Processor time that a process has taken [s]; it may have ended, but must not have been waited for."""
    # proc(5): utime and stime are fields 14 and 15; the name before them may hold spaces
    fields = Path(f"/proc/{child}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def state_of(folder):
    """What a run that was killed left behind, as a user would find it."""
    from coupling.datasets import RunFileError, raw_groups, read_attributes

    if not (folder / "scene.toml").exists():
        return "nothing yet"
    try:
        records = len(raw_groups(folder, ("history",))["history"]["time"])
        status = read_attributes(folder)["status"]
    except RunFileError:
        return "scene, no records yet"
    if status == FINISHED:
        return FINISHED
    kept = len(list(folder.glob("checkpoint-*.h5")))
    return f"{'records' if records else 'no records'}, {kept} checkpoint{'s' * (kept != 1)}"


def forked(arguments):
    """Process that runs the command `gush` with these arguments."""
    child = os.fork()
    if child == 0:
        os._exit(run_here(arguments))
    return child


def run_here(arguments):
    """Exit code of the command in this process."""
    from coupling.cli import app

    try:
        app(arguments)
    except SystemExit as done:
        return done.code or 0
    return 0


def ended(child, moment):
    """Exit code of a process; minus the signal where it was killed once it had taken that much processor time [s]."""
    if moment is not None:
        # one thread takes no more processor time than passes on the clock
        while (left := moment - processor_time(child)) > 0 and os.waitid(os.P_PID, child, PEEK) is None:
            time.sleep(max(left, 0.001))
        os.kill(child, signal.SIGKILL)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
