"""What other processes show: the parts of a start, and many runs at once beside one alone."""

import os
import subprocess
import sys
import tempfile
import time as clock

IMPORTS = {
    "numba": "import numba",
    "mpm over numba": "import numba; begin(); import mpm.solver",
    "coupling.cli": "import coupling.cli",
    "xarray": "import xarray",
}
START = """
import time
def used(): return time.process_time()
from coupling.scenes.scene import load_scene
scene = load_scene("quick")
loaded = used()
import mpm
mesh = mpm.build_mesh(scene)
meshed = used()
solver = mpm.Solver(scene, mesh, threads=1)
filled = used()
solver.map_points()
first = used()
solver.relax()
relaxed = used()
solver.open_gate()
solver.step()
print(loaded, meshed - loaded, filled - meshed, first - filled, relaxed - first, used() - relaxed, used())
"""
PARTS = ("imports and scene", "mesh", "points", "first kernels", "initial stage", "first step", "sum")
EVENT = """
import sys, time
import mpm
from verification.speed.stepping import steps
from coupling.scenes.scene import load_scene
scene = load_scene("quick")
solver = mpm.Solver(scene, mpm.build_mesh(scene), threads=1)
solver.open_gate()
for _ in range(5):
    solver.step()
print("ready", flush=True)
sys.stdin.readline()
done, end = solver.point_steps, time.perf_counter() + float(sys.argv[1])
begin, used = time.perf_counter(), time.process_time()
while time.perf_counter() < end:
    steps(solver)
print((solver.point_steps - done) / (time.perf_counter() - begin), (time.process_time() - used) / (end - begin))
"""


def _python(code, *arguments, **environment):
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, **environment},
    )  # fmt: skip


def _answer(process):
    out, _ = process.communicate()
    if process.returncode:
        raise RuntimeError(f"bench: a measuring process ended with exit code {process.returncode}")
    return [float(word) for word in out.split()]


def import_seconds(names=tuple(IMPORTS)):
    """Processor time of imports in a process of their own [s]: dict of those of `names`, keys of `IMPORTS`."""
    frame = "import time\nt = [time.process_time()]\ndef begin(): t[0] = time.process_time()\n{}\n"
    used = "print(time.process_time() - t[0])"
    return {name: _answer(_python(frame.format(IMPORTS[name]) + used))[0] for name in names}


def start_seconds():
    """Processor time from process start to the first step of the scene quick [s]: cold and warm, by part."""
    with tempfile.TemporaryDirectory() as folder:
        result = {}
        for name in ("cold", "warm"):
            result[name] = dict(zip(PARTS, _answer(_python(START, NUMBA_CACHE_DIR=folder)), strict=True))
        result["compilation"] = result["cold"]["sum"] - result["warm"]["sum"]
        return result


def first_step_wall_seconds():
    """Wall time of `gush run quick` from process start to the first step of the initial stage [s], warm."""
    code = (
        "import sys, os\nfrom mpm import stages\n"
        "def stop(*_): print('1', flush=True); os._exit(0)\n"
        "stages.relax = stop\nimport coupling.cli as c\n"
        "sys.argv = ['gush', 'run', 'quick', '--quiet', '--out', sys.argv[1]]\nc.main()"
    )
    with tempfile.TemporaryDirectory() as folder:
        begin = clock.perf_counter()
        _answer(_python(code, os.path.join(folder, "run")))
        return clock.perf_counter() - begin


def throughput(count, seconds=4.0):
    """Point-steps per wall second of `count` independent runs at once, one thread each.

    Returns total : float, summed over the processes;  share : float, processor time over wall time of a process; below
    1 the machine was busy with something else.
    """
    processes = [_python(EVENT, str(seconds)) for _ in range(count)]
    for process in processes:
        if process.stdout.readline().strip() != "ready":
            raise RuntimeError("bench: a measuring process did not start")
    for process in processes:
        process.stdin.write("\n")
        process.stdin.flush()
    answers = [_answer(process) for process in processes]
    return sum(a[0] for a in answers), sum(a[1] for a in answers) / count
