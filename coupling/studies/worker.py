"""Processes that run what they are given, one call after the other, and tell how each ended (`coupling.studies.pool`).

One process loads the program and forks all workers, so that it is loaded once. Nothing of the script that asked for
them is imported here, so a script needs no guard around its study.
"""

import contextlib
import os
import pickle
import signal
import sys
from importlib import import_module
from multiprocessing.connection import Connection

#: What a case needs and takes long to load; none of it starts a thread.
LOADED = (
    "coupling.runs.run", "coupling.studies.case", "mpm.mesh.build", "mpm.simulation", "structure.beams.lining",
    "scipy.interpolate", "scipy.optimize", "gmsh", "meshio", "h5netcdf", "pint", "xarray", "dask.array",
)  # fmt: skip
INTERRUPTED, ALONE = 130, 131
#: Exit codes after which nobody waits for a worker.
ENDINGS = (0, INTERRUPTED, ALONE)


class WorkerLost(str):
    """How the process that ran a call ended in the middle of it."""


def serve(descriptors):
    """Fork a worker for every connection, and another one for that of a worker that is lost, once that is told."""
    for module in LOADED:
        import_module(module)
    workers = {_forked(descriptor, descriptors): descriptor for descriptor in descriptors}
    signal.signal(signal.SIGTERM, lambda *_: [os.kill(pid, signal.SIGTERM) for pid in workers])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the workers and who asked for them get it too
    while workers:
        pid, status = os.wait()
        descriptor, code = workers.pop(pid), os.waitstatus_to_exitcode(status)
        if code not in ENDINGS and _told(descriptor, WorkerLost(f"WorkerLost: its process {_ending(code)}")):
            workers[_forked(descriptor, descriptors)] = descriptor
        else:
            os.close(descriptor)
            descriptors.remove(descriptor)


def _ending(code):
    if code > 0:
        return f"ended with code {code}"
    name = signal.Signals(-code).name
    return f"was killed ({name}{'; is there enough memory?' if name == 'SIGKILL' else ''})"


def _told(descriptor, message):
    connection = Connection(os.dup(descriptor))
    with connection, contextlib.suppress(OSError):  # nobody is there any more
        connection.send(message)
        return True
    return False


def _forked(descriptor, descriptors):
    """Number of a new process that lives as the worker of a connection."""
    pid = os.fork()
    if pid:
        return pid
    code = 0
    try:
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, signal.default_int_handler)  # a run that is stopped writes a checkpoint
        for other in descriptors:
            if other != descriptor:
                os.close(other)
        work(Connection(descriptor))
    except KeyboardInterrupt:  # who asked for the work says so
        code = INTERRUPTED
    except OSError:  # nobody is there any more
        code = ALONE
    finally:
        os._exit(code)


def work(connection):
    """Calls that arrive as pickled (function, arguments), answered by the text of what they raised, empty for none."""
    while True:
        try:
            function, arguments = pickle.loads(connection.recv_bytes())
        except EOFError:
            return
        try:
            function(*arguments)
        except Exception as failure:  # whatever goes wrong in a case is reported and costs only that case
            connection.send(f"{type(failure).__name__}: {failure}")
        else:
            connection.send("")


if __name__ == "__main__":
    # by its name, as the other side knows the class of what it is told
    import_module("coupling.studies.worker").serve([int(each) for each in sys.argv[1:]])
    os._exit(0)  # nothing is left that would have to be tidied up
