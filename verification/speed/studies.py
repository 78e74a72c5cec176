"""A study of six short cases by two workers beside a plain loop over `coupling.run` of the same cases.

    uv run python -m verification.speed.studies            # --rounds 3; --print-only leaves docs/performance.md alone

Both answer with the ring and draw no pictures. Each is a process of its own that begins with compiled kernels and
bytecode, as any start but the first; they run in turns, and the fastest of each counts, since other programs only slow
them down. Where they do so all the time, the processor time on the longest path tells what two idle cores would take.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time as clock

from verification.pages import DOCS, docs_page, provenance, rendered, write_data

ANGLES = [15.0, 30.0, 45.0, 60.0, 75.0, 90.0]
#: About two seconds of processor time a case, half of it for files and the ring.
TINY = {
    "discretisation.element_size": 4.0, "discretisation.element_size_lining": 0.8,
    "discretisation.element_size_interior": 0.5, "discretisation.size_growth": 0.4,
    "stop.inflow_mass": 20.0, "stop.time": 0.1, "output.interval": 0.02,
}  # fmt: skip
LOOP = """
import sys, coupling
from verification.speed.studies import ANGLES, TINY
for angle in ANGLES:
    scene = coupling.load_scene("quick", **TINY, **{"gate.angle": angle})
    coupling.run(scene, f"{sys.argv[1]}/{angle:g}", response=True, threads=int(sys.argv[2]) or None)
"""
STUDY = """
import os, sys, time, coupling
from verification.speed.studies import ANGLES, TINY
plan, told = {"name": "tiny", "fixed": TINY, "records": 3, "parameters": {"gate.angle": ANGLES}}, []
study = coupling.study(
    plan, sys.argv[1], workers=int(sys.argv[2]), progress=lambda line: told.append(time.process_time())
)
assert (study["status"] == "finished").all() and "bending_moment" in study, study["message"].values
print(told[0], time.process_time() - told[-1], sum(os.times()[2:4]))
"""
LOAD = """
import time
from importlib import import_module
from coupling.studies.worker import LOADED
for name in LOADED:
    import_module(name)
print(time.process_time())
"""
WAYS = {"loop, all cores": (LOOP, "0"), "loop, one thread": (LOOP, "1"), "study, two workers": (STUDY, "2")}


def study_seconds(rounds=3, tell=lambda line: None):
    """What each of `WAYS` takes.

    Returns a dict: rounds, best: name to wall and processor time [s]; path: processor time of the study before its
    workers start, while they load, of a half of their cases, and after the last one [s]; share_of_loop: of the wall
    time of the faster loop; share_on_idle_cores: of path over the processor time of the loop of one thread; load,
    provenance.
    """
    load = [os.getloadavg()[0]]
    found, paths = {name: [] for name in WAYS}, []
    with tempfile.TemporaryDirectory() as place:
        kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        environment = {**kept, "PYTHONPYCACHEPREFIX": f"{place}/bytecode", "PYTHONWARNINGS": "ignore"}
        for number in range(-1, rounds):  # the first compiles
            for name, (code, argument) in WAYS.items():
                wall, used = clock.perf_counter(), sum(os.times()[2:4])
                folder = f"{place}/{number}-{name}"
                done = _python(environment, code, folder, argument)
                seconds = [clock.perf_counter() - wall, sum(os.times()[2:4]) - used]
                tell(f"{name}: {seconds[0]:.1f} s by the clock, {seconds[1]:.1f} s of processor time")
                if number >= 0:
                    found[name].append(seconds)
                if number >= 0 and code is STUDY:
                    before, after, workers = done
                    (loading,) = _python(environment, LOAD)
                    paths.append([before, loading, (workers - loading) / 2, after])
    best = {name: min(times) for name, times in found.items()}
    path, loop = min(paths, key=sum), min(best["loop, all cores"], best["loop, one thread"])
    return {
        "rounds": found, "best": best, "path": path, "share_of_loop": best["study, two workers"][0] / loop[0],
        "share_on_idle_cores": sum(path) / min(used for _, used in found["loop, one thread"]),
        "load": [*load, os.getloadavg()[0]], **provenance(),
    }  # fmt: skip


def _python(environment, *arguments):
    command = [sys.executable, "-c", *arguments]
    done = subprocess.run(command, check=True, env=environment, stdout=subprocess.PIPE, text=True)
    return [float(word) for word in done.stdout.split()]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--print-only", action="store_true", help="leave docs/performance.md as it is")
    chosen = parser.parse_args()
    page = None if chosen.print_only else docs_page("performance", "study")
    data = study_seconds(chosen.rounds, lambda line: print(line, file=sys.stderr, flush=True))
    if page is not None:
        page.fill(rendered("performance", study=data))
        numbers = DOCS / "performance.json"
        write_data(numbers, json.loads(numbers.read_text(encoding="utf-8")) | {"study": data})
    print(json.dumps(data, indent=1))


if __name__ == "__main__":
    main()
