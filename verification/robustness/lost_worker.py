"""A study on a dask scheduler with two worker processes, one of them killed in the middle, against a serial run.

The study, of 4 runs at least, must end complete and equal to the serial one, bit for bit.
"""

import os
import signal
import time as clock

import numpy as np

import coupling
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


def lost_worker(place, count, _seed):
    """The study with a lost worker beside the serial one."""
    begin = clock.monotonic()
    parallel, _, killed = killed_study(count, place / "parallel")
    between = clock.monotonic()
    serial = coupling.study(plan(count), place / "serial", workers=0).load()
    end = clock.monotonic()
    different = [
        name
        for name in serial.data_vars
        if name not in MEASURED and not np.array_equal(serial[name], parallel[name], equal_nan=True)
    ]
    finished = int((parallel["status"] == "finished").sum())
    whole = killed and not different and finished == count
    return {
        "faults": [] if whole else ["not complete, not equal, or no worker was killed"], "finished": finished,
        "workers_killed": len(killed), "different_variables": different, "parallel_seconds": between - begin,
        "serial_seconds": end - between,
    }  # fmt: skip
