"""What each omission saves: processor time of a step and memory, beside the scene with it in the same process.

uv run python benchmarks/left_out.py       # about four minutes; writes docs/left-out.md and docs/left-out.json
"""

import json
import os
import platform
import tempfile
import time as clock
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import coupling
import mpm
from coupling.datasets import RunWriter
from coupling.provenance import root_attributes

DOCS = Path(__file__).resolve().parent.parent / "docs"
WARM_UP, ROUNDS, SECONDS = 120, 3, 1.5
FULL, CROWN = "full", "gate at the crown, whole"


def variants(scene):
    """Name, what is left out and how, name of the scene it is compared with, and the scene without it."""
    elastic = tuple(soil.model_copy(update={"model": "elastic"}) for soil in scene.soils)
    tight = tuple(soil.model_copy(update={"hydraulic_conductivity": 1e-12}) for soil in scene.soils)
    smooth = tuple(tunnel.model_copy(update={"friction_coefficient": 0.0}) for tunnel in scene.tunnels)
    plain = scene.numerics.model_copy(update={"volumetric_smoothing": False})
    crown = {"gate": scene.gate.model_copy(update={"angle": 0.0})}

    def without(**changes):
        return scene.model_copy(update=changes)

    yield FULL, "nothing: two phases, Mohr-Coulomb, friction, smoothing, filter", FULL, scene
    yield "dry", "the water: compiled out", FULL, without(water=None)
    yield "elastic", "the return mapping: compiled out", FULL, without(soils=elastic)
    yield "dry, elastic", "both", FULL, without(water=None, soils=elastic)
    yield "no smoothing", "mean volume changes: compiled out of the points' update", FULL, without(numerics=plain)
    yield "frictionless", "nothing: contacts with a coefficient of 0", FULL, without(tunnels=smooth)
    yield "undrained", "nothing: both velocities at k = 1e-12 m/s", FULL, without(soils=tight)
    yield "sink", "the inside of the tunnel: not meshed", FULL, without(interior="sink")
    yield "no gate", "the gate and its fine mesh: not meshed; right half only", FULL, without(gate=None)
    yield "no gate, whole", "the gate and its fine mesh: not meshed", FULL, without(gate=None, symmetry="whole")
    yield CROWN, "nothing", CROWN, without(symmetry="whole", **crown)
    yield "gate at the crown, half", "x < 0: neither meshed nor filled", CROWN, without(**crown)


def snapshot_cost(scene):
    """Processor time [s] and bytes in the file of the first snapshot of the points, its copy included."""
    simulation = mpm.Simulation(scene.mpm, threads=1)
    record = simulation.begin()
    seconds, sizes = [], []
    with tempfile.TemporaryDirectory() as folder:
        for kept in (None, record.points):
            writer = RunWriter(Path(folder) / "run.nc", root_attributes(scene), scene.mpm)
            begin = clock.process_time()
            if kept is not None:
                simulation.solver.points_by_name()
            writer.append(replace(record, points=kept))
            writer.close("finished")
            seconds.append(clock.process_time() - begin)
            sizes.append((Path(folder) / "run.nc").stat().st_size)
    return seconds[1] - seconds[0], sizes[1] - sizes[0]


def main():
    rows = []
    solvers = {}
    case_3 = coupling.load_scene("case-3")
    for name, without, base, scene in variants(case_3.mpm):
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
                "compared_with": base,
                "points": int(solver.n_points),
                "elements": len(solver.mesh.elements),
                "dt": solver.time / solver.step_count,
                "bytes": solver.memory_bytes(),
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
    by_name = {row["name"]: row for row in rows}
    for row in rows:
        base = by_name[row["compared_with"]]
        row["time_of_base"] = row["seconds_a_step"] / base["seconds_a_step"]
        row["time_of_base_a_simulated_second"] = row["time_of_base"] * base["dt"] / row["dt"]
        row["bytes_of_base"] = row["bytes"] / base["bytes"]
    seconds, size = snapshot_cost(case_3)
    contacts, nodes = solvers[FULL].n_contact, len(solvers[FULL].mesh.nodes)
    page = [
        "# What leaving out saves",
        "",
        f"Made by `uv run python benchmarks/left_out.py` on {datetime.now(UTC):%Y-%m-%d}, revision "
        f"{root_attributes(case_3)['revision']}, {os.cpu_count()} cores, {platform.machine()}. Case 3, one thread, "
        f"{rows[0]['points']} points; processor time and memory of the solver relative to the full scene, for the half "
        "model relative to the whole of the same scene, in the same process.",
        "",
        "| scene | left out, and how | points | ms a step | of base | of base, a simulated second | MB | of base |",
        "|---|---|---|---|---|---|---|---|",
        *(
            f"| {r['name']} | {r['without']} | {r['points']} | {1e3 * r['seconds_a_step']:.2f} | "
            f"{r['time_of_base']:.2f} | {r['time_of_base_a_simulated_second']:.2f} | {r['bytes'] / 1e6:.1f} | "
            f"{r['bytes_of_base']:.2f} |"
            for r in rows
        ),
        "",
        f"Pressures only (`output.points = false`) saves {1e3 * seconds:.0f} ms and {size / 1e6:.2f} MB of the run's "
        "file a snapshot; the steps are the same.",
        "",
        f"Frictionless linings compile nothing away: {contacts} of {nodes} nodes touch a lining, and what they cost is "
        "in the noise. Undrained ground keeps both velocities: a step with one is another step, in which contact and "
        "gate do not tell grains from water, and could save at most what the dry scene saves. Drag is implicit, so "
        "undrained ground takes the time step of sand. Without smoothing the nodal means are still summed, since the "
        "pressure's projection needs them. A dry scene keeps the water's columns: a point is two cache lines, whatever "
        "it holds.",
    ]
    (DOCS / "left-out.md").write_text("\n".join(page) + "\n", encoding="utf-8")
    data = {"rows": rows, "snapshot": {"seconds": seconds, "bytes": size}, "contact_nodes": contacts, "nodes": nodes}
    (DOCS / "left-out.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    print("\n".join(page[4:]))


if __name__ == "__main__":
    main()
