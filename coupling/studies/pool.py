"""Worker processes on this machine: each runs one call after the other, and a lost one costs only its call."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from multiprocessing import Pipe
from multiprocessing.connection import wait
from typing import Any

from coupling.studies.worker import WorkerLost

#: Libraries take all cores for themselves unless they are told that others are at work.
ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
SECONDS_TO_STOP = 20.0  # a run that is stopped writes a checkpoint


class Pool:
    """So many processes that run calls, from now until the block ends."""

    def __init__(self, count: int):
        self._families, self._idle = [], []
        self._start(count)

    def _start(self, count):
        """One process more that forks `count` workers."""
        pipes = [Pipe() for _ in range(count)]
        theirs = [there.fileno() for _, there in pipes]
        path = os.pathsep.join(place or os.getcwd() for place in sys.path)
        self._families.append(
            subprocess.Popen(
                [sys.executable, "-m", "coupling.studies.worker", *map(str, theirs)],
                pass_fds=theirs, stdin=subprocess.DEVNULL, env={**ONE_THREAD, **os.environ, "PYTHONPATH": path},
            )
        )  # fmt: skip
        for here, there in pipes:
            there.close()  # so that the connection ends with the process
            self._idle.append(here)

    def __enter__(self):
        return self

    def __exit__(self, problem, *_):
        for connection in self._idle:
            connection.close()
        for family in self._families:
            if problem is not None:
                family.terminate()
            try:
                family.wait(SECONDS_TO_STOP)
            except subprocess.TimeoutExpired:
                family.kill()
                family.wait()

    def run(self, function: Callable, calls: dict[Any, tuple]) -> Iterator[tuple[Any, str]]:
        """Run `function` with the arguments of every call; yields a key and how it ended, in the order of the ends.

        The end is the text of what the function raised, empty for none, or a :class:`WorkerLost`; a lost worker is
        replaced. What the function returns is not handed over.
        """
        import cloudpickle  # of dask: takes also what a script defines itself

        waiting, running = list(reversed(calls.items())), {}
        while waiting or running:
            while waiting and self._idle:
                key, arguments = waiting.pop()
                connection = self._idle.pop(0)
                with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # its end says that it is lost
                    connection.send_bytes(cloudpickle.dumps((function, arguments)))
                running[connection] = key
            for connection in wait(list(running)):
                yield running.pop(connection), self._ended(connection)

    def _ended(self, connection):
        try:
            told = connection.recv()
        except (EOFError, ConnectionResetError):
            # all of its family
            connection.close()
            self._start(1)
            return WorkerLost("WorkerLost: its process is gone")
        self._idle.append(connection)
        return told
