"""A study on a dask scheduler with two worker processes, one of them killed in the middle, against a serial run.

    uv run python -m verification.robustness.lost_worker           # 64 coarse runs; fewer, from 4 on, as an argument

The study must end complete and equal to the serial one, bit for bit. Prints what happened as JSON and writes its part
of docs/robustness.md and docs/robustness.json, with --print-only not.
"""

import argparse
import json
import os
import signal
import tempfile
import time as clock
from pathlib import Path

import numpy as np

import coupling
from verification.robustness.page import check_page, write_part
from verification.small_event import COARSE

#: Of every run: how far it differs from nothing but where and when it was computed.
MEASURED = ("cpu_seconds", "status", "message")


def plan(count):
    """The study: runs of a few hundred steps on a mesh of some hundred elements."""
    fixed = {f"discretisation.{name}": value for name, value in COARSE.items()}
    fixed |= {"numerics.relaxation_tolerance": 1e-3, "stop.inflow_mass": 8.0, "stop.time": 0.1, "output.interval": 0.01}
    angles, friction = np.linspace(30.0, 150.0, count), np.linspace(22.0, 38.0, count)
    return {
        "name": "lost-worker", "scene": "quick", "design": "list", "records": 5,
        "fixed": fixed | {"output.snapshot_interval": 1.0},
        "parameters": {"gate.angle": angles.tolist(), "soils.0.friction_angle": friction.tolist()},
    }  # fmt: skip


def killed_study(count, folder):
    """Run the study on a scheduler, kill a worker in the middle; dataset, lines told, pid killed."""
    import dask
    from distributed import Client, LocalCluster

    lines, killed = [], []
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", memory_limit=0
        ) as cluster,
        Client(cluster) as client,
    ):

        def progress(line):
            lines.append(line)
            if " done" in line and not killed:  # the first: later, and short runs would all be over
                worker = next(iter(client.run(os.getpid).values()))
                os.kill(worker, signal.SIGKILL)
                killed.append(worker)

        data = coupling.study(plan(count), folder, scheduler=cluster.scheduler_address, progress=progress).load()
    return data, lines, killed


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", type=int, nargs="?", default=64, help="number of runs, from 4 on")
    parser.add_argument("--print-only", action="store_true", help="leave docs/robustness.md as it is")
    chosen = parser.parse_args()
    count = chosen.count
    if not chosen.print_only:
        check_page()
    with tempfile.TemporaryDirectory() as place:
        begin = clock.monotonic()
        parallel, lines, killed = killed_study(count, Path(place) / "parallel")
        between = clock.monotonic()
        serial = coupling.study(plan(count), Path(place) / "serial", workers=0).load()
        end = clock.monotonic()
    different = [
        name
        for name in serial.data_vars
        if name not in MEASURED and not np.array_equal(serial[name], parallel[name], equal_nan=True)
    ]
    result = {
        "runs": count, "workers_killed": len(killed), "finished": int((parallel["status"] == "finished").sum()),
        "told_done": sum(line.endswith("done") for line in lines), "different_variables": different,
        "parallel_seconds": between - begin, "serial_seconds": end - between,
    }  # fmt: skip
    if not chosen.print_only:
        write_part("lost_worker", result)
    print(json.dumps(result, indent=1))
    raise SystemExit(0 if not different and result["finished"] == count and killed else 1)


if __name__ == "__main__":
    main()
