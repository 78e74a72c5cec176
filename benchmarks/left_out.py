"""What each omission saves: processor time of a step and memory a point, beside the full scene in the same process.

uv run python benchmarks/left_out.py       # about two minutes; writes docs/left-out.md and docs/left-out.json
"""

import json
import os
import platform
import time as clock
from datetime import UTC, datetime
from pathlib import Path

import coupling
import mpm
from coupling.provenance import root_attributes

DOCS = Path(__file__).resolve().parent.parent / "docs"
WARM_UP, ROUNDS, SECONDS = 120, 3, 1.5


def variants(scene):
    """Name, what is left out, and the scene without it."""
    elastic = tuple(soil.model_copy(update={"model": "elastic"}) for soil in scene.soils)
    numerics = scene.numerics
    yield "full", "nothing: two phases, Mohr-Coulomb, smoothing, filter", scene
    yield "dry", "the water", scene.model_copy(update={"water": None})
    yield "elastic", "the return mapping", scene.model_copy(update={"soils": elastic})
    yield (
        "no smoothing",
        "mean volume changes",
        scene.model_copy(update={"numerics": numerics.model_copy(update={"volumetric_smoothing": False})}),
    )
    yield "sink", "the inside of the tunnel", scene.model_copy(update={"interior": "sink"})
    yield "no gate", "the gate and its fine mesh", scene.model_copy(update={"gate": None})
    yield "dry, elastic", "water and return mapping", scene.model_copy(update={"water": None, "soils": elastic})


def main():
    rows = []
    solvers = {}
    for name, without, scene in variants(coupling.load_scene("case-3").mpm):
        solver = mpm.Solver(scene, mpm.build_mesh(scene), threads=1)
        if scene.gate is not None:
            solver.open_gate()
        for _ in range(WARM_UP):
            solver.step()
        solvers[name] = solver
        rows.append(
            {
                "name": name,
                "without": without,
                "points": int(solver.n_points),
                "elements": len(solver.mesh.elements),
                "dt": solver.time / solver.step_count,
                "bytes_a_point": solver.memory_bytes() / solver.n_points,
                "seconds_a_step": float("inf"),
            }
        )
    for _ in range(ROUNDS):  # in turns: what slows the machine down slows all of them
        for row in rows:
            solver, begin, count = solvers[row["name"]], clock.process_time(), 0
            while clock.process_time() - begin < SECONDS:
                solver.step()
                count += 1
            row["seconds_a_step"] = min(row["seconds_a_step"], (clock.process_time() - begin) / count)
    full = rows[0]
    for row in rows:
        row["time_of_full"] = row["seconds_a_step"] / full["seconds_a_step"]
        row["time_of_full_a_simulated_second"] = row["time_of_full"] * full["dt"] / row["dt"]
    page = [
        "# What leaving out saves",
        "",
        f"Made by `uv run python benchmarks/left_out.py` on {datetime.now(UTC):%Y-%m-%d}, revision "
        f"{root_attributes(coupling.load_scene('case-3'))['revision']}, {os.cpu_count()} cores, {platform.machine()}. "
        f"Case 3, one thread, {full['points']} points; processor time relative to the full scene in the same process.",
        "",
        "| scene | left out | ms a step | of full, a step | of full, a simulated second | bytes a point |",
        "|---|---|---|---|---|---|",
        *(
            f"| {r['name']} | {r['without']} | {1e3 * r['seconds_a_step']:.2f} | {r['time_of_full']:.2f} | "
            f"{r['time_of_full_a_simulated_second']:.2f} | {r['bytes_a_point']:.0f} |"
            for r in rows
        ),
    ]
    (DOCS / "left-out.md").write_text("\n".join(page) + "\n", encoding="utf-8")
    (DOCS / "left-out.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    print("\n".join(page[4:]))


if __name__ == "__main__":
    main()
