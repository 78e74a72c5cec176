"""What each omission saves: processor time of a simulated second and memory, beside the scene with it, in one process.

Scenes are compared over the same simulated time: steps of scenes differ in length, and long steps in the number of
short ones within them.

    uv run python -m verification.reports left-out    # about four minutes; writes docs/left-out.md and .json
"""

import statistics
import tempfile
import time as clock
from dataclasses import replace
from pathlib import Path

import coupling
import mpm
from coupling.datasets import RunWriter
from coupling.files.provenance import root_attributes
from verification.boxes import run_to
from verification.pages import DOCS, rendered, write_data
from verification.speed.stepping import FULL, variants

BLOCKS = ("rows", "snapshot")
BEGIN, ROUNDS, SPELL = 0.15, 12, 0.015  # simulated seconds after the gate opened, and of a round


def snapshot_cost(scene):
    """Processor time [s] and bytes in the file of the first snapshot of the points, its copy included."""
    simulation = mpm.Simulation(scene, threads=1)
    record = simulation.begin()
    seconds, sizes = [], []
    with tempfile.TemporaryDirectory() as folder:
        for kept in (None, record.points):
            writer = RunWriter(Path(folder) / "run.nc", root_attributes(scene), scene)
            begin = clock.process_time()
            if kept is not None:
                simulation.solver.points_by_name()
            writer.append(replace(record, points=kept))
            writer.close("finished")
            seconds.append(clock.process_time() - begin)
            sizes.append((Path(folder) / "run.nc").stat().st_size)
    return seconds[1] - seconds[0], sizes[1] - sizes[0]


def advance(solver, time):
    """Step until a simulated time [s]; processor seconds, point-steps and steps of the smallest elements."""
    work, steps = solver.point_steps, solver.step_count
    seconds = run_to(solver, time)
    return {"seconds": seconds, "point_steps": solver.point_steps - work, "steps": solver.step_count - steps}


def measure(scene):
    """A row a variant, and the solver of the full scene."""
    rows, solvers = [], {}
    for name, without, base, variant in variants(scene):
        solver = solvers[name] = mpm.Solver(variant, mpm.build_mesh(variant), threads=1)
        if variant.gate is not None:
            solver.open_gate()
        advance(solver, BEGIN)
        rows.append({
            "name": name, "without": without, "compared_with": base, "points": int(solver.n_points),
            "elements": len(solver.mesh.elements), "levels": solver.levels.count, "bytes": solver.memory_bytes(),
            "bytes_a_point": solver.memory_bytes() / solver.n_points,
        })  # fmt: skip
    # in turns: what slows the machine down slows all of them
    spells = [
        {name: advance(solver, BEGIN + (k + 1) * SPELL) for name, solver in solvers.items()} for k in range(ROUNDS)
    ]
    by_name = {row["name"]: row for row in rows}
    for row in rows:
        mine = [spell[row["name"]] for spell in spells]
        # other work on the machine only adds to the cost of a point-step; how many there are does not depend on it
        row["seconds_a_point_step"] = statistics.quantiles((m["seconds"] / m["point_steps"] for m in mine), n=4)[0]
        row["point_steps_a_second"] = sum(m["point_steps"] for m in mine) / (ROUNDS * SPELL)
        row["seconds_a_second"] = row["seconds_a_point_step"] * row["point_steps_a_second"]
        row["dt"] = ROUNDS * SPELL / sum(m["steps"] for m in mine)
    for row in rows:
        for key in ("seconds_a_second", "seconds_a_point_step", "bytes"):
            row[f"{key}_of_base"] = row[key] / by_name[row["compared_with"]][key]
    return rows, solvers[FULL]


def blocks():
    """Everything, and docs/left-out.json."""
    scene = coupling.load_scene("case-3")
    rows, full = measure(scene)
    seconds, size = snapshot_cost(scene)
    data = {"rows": rows, "snapshot": {"seconds": seconds, "bytes": size}, "contact_nodes": full.n_contact,
            "nodes": len(full.mesh.nodes)}  # fmt: skip
    write_data(DOCS / "left-out.json", data)
    return rendered("left-out", **data)
