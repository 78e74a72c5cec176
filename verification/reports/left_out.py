"""What each omission saves: processor time of a simulated second and memory, beside the scene with it, in one process.

Scenes are compared over the same simulated time: steps of scenes differ in length, and long steps in the number of
short ones within them.

    uv run python -m verification.reports.left_out    # about four minutes; writes docs/left-out.md and .json
"""

import json
import statistics
import tempfile
import time as clock
from dataclasses import replace
from pathlib import Path

import coupling
import mpm
from coupling.datasets import RunWriter
from coupling.files.provenance import root_attributes
from verification.pages import DOCS, made_by, need_docs

BEGIN, ROUNDS, SPELL = 0.15, 12, 0.015  # simulated seconds after the gate opened, and of a round
FULL, CROWN, TIGHT = "full", "gate at the crown, whole", "k = 1e-12 m/s"


def variants(scene):
    """Name, what is left out and how, name of the scene it is compared with, and the scene without it."""
    elastic = tuple(soil.model_copy(update={"model": "elastic"}) for soil in scene.soils)
    tight = tuple(soil.model_copy(update={"hydraulic_conductivity": 1e-12}) for soil in scene.soils)
    smooth = tuple(tunnel.model_copy(update={"friction_coefficient": 0.0}) for tunnel in scene.tunnels)
    unfiltered = scene.numerics.model_copy(update={"pressure_filter": 0.0})
    undamped = scene.numerics.model_copy(update={"stress_damping": 0.0})
    tied = scene.water.model_copy(update={"drainage": "undrained"})
    crown = {"gate": scene.gate.model_copy(update={"angle": 0.0})}

    def without(**changes):
        return scene.model_copy(update=changes)

    yield FULL, "nothing: two phases, Mohr-Coulomb, friction, filter, damping", FULL, scene
    yield "dry", "the water: compiled out", FULL, without(water=None)
    yield "elastic", "the return mapping: compiled out", FULL, without(soils=elastic)
    yield "dry, elastic", "both", FULL, without(water=None, soils=elastic)
    yield "no filter", "the pressure that nodes feel: not asked for", FULL, without(numerics=unfiltered)
    yield "no damping", "what stress runs ahead by: not summed; longer steps", FULL, without(numerics=undamped)
    yield "frictionless", "nothing: contacts with a coefficient of 0", FULL, without(tunnels=smooth)
    yield TIGHT, "nothing: both velocities", FULL, without(soils=tight)
    yield "undrained", "velocity and momentum of the water, drag: compiled out", TIGHT, without(water=tied)
    yield "sink", "the inside of the tunnel: not meshed", FULL, without(interior="sink")
    yield "no gate", "the gate and its fine mesh: not meshed; right half only", FULL, without(gate=None)
    yield "no gate, whole", "the gate and its fine mesh: not meshed", FULL, without(gate=None, symmetry="whole")
    yield CROWN, "nothing", CROWN, without(symmetry="whole", **crown)
    yield "gate at the crown, half", "x < 0: neither meshed nor filled", CROWN, without(**crown)


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
    """Step until a simulated time [s]; returns processor seconds, point-steps and steps of the smallest elements."""
    begin, work, steps = clock.process_time(), solver.point_steps, solver.step_count
    while solver.time < time * (1 - 1e-12):
        solver.step(time - solver.time)
    return {
        "seconds": clock.process_time() - begin,
        "point_steps": solver.point_steps - work,
        "steps": solver.step_count - steps,
    }


def main():
    need_docs()
    rows, solvers = [], {}
    case_3 = coupling.load_scene("case-3")
    for name, without, base, scene in variants(case_3):
        solver = mpm.Solver(scene, mpm.build_mesh(scene), threads=1)
        if scene.gate is not None:
            solver.open_gate()
        advance(solver, BEGIN)
        solvers[name] = solver
        rows.append(
            {
                "name": name,
                "without": without,
                "compared_with": base,
                "points": int(solver.n_points),
                "elements": len(solver.mesh.elements),
                "levels": solver.levels.count,
                "bytes": solver.memory_bytes(),
                "bytes_a_point": solver.memory_bytes() / solver.n_points,
            }
        )
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
        base = by_name[row["compared_with"]]
        for key in ("seconds_a_second", "seconds_a_point_step", "bytes"):
            row[f"{key}_of_base"] = row[key] / base[key]
    seconds, size = snapshot_cost(case_3)
    contacts, nodes = solvers[FULL].n_contact, len(solvers[FULL].mesh.nodes)
    page = [
        "# What leaving out saves",
        "",
        f"{made_by('uv run python -m verification.reports.left_out')}. Case 3, one thread, "
        f"from {BEGIN:g} to {BEGIN + ROUNDS * SPELL:g} s after the gate opened; processor time a simulated second "
        'and a point-step, and memory of the solver. "Of base" is relative to the full scene; undrained ground is '
        "compared with a conductivity of 1e-12 m/s, the half model with the whole of the same scene. Lower quartile of "
        "rounds in turns, in one process.",
        "",
        "| scene | left out, and how | points | levels | smallest step [us] | CPU s a simulated s | of base "
        "| ns a point-step | of base | MB | of base |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
        *(
            f"| {r['name']} | {r['without']} | {r['points']} | {r['levels']} | {1e6 * r['dt']:.0f} | "
            f"{r['seconds_a_second']:.2f} | {r['seconds_a_second_of_base']:.2f} | "
            f"{1e9 * r['seconds_a_point_step']:.0f} | {r['seconds_a_point_step_of_base']:.2f} | "
            f"{r['bytes'] / 1e6:.1f} | {r['bytes_of_base']:.2f} |"
            for r in rows
        ),
        "",
        f"Pressures only (`output.points = false`) saves {1e3 * seconds:.0f} ms and {size / 1e6:.2f} MB of the run's "
        "file a snapshot; the steps are the same.",
        "",
        f"Frictionless linings compile nothing away: {contacts} of {nodes} nodes touch a lining, and what they cost is "
        'in the noise. Drag is implicit, so tight ground takes the time step of sand and `drainage = "undrained"` '
        "changes only the work of a step. A dry scene keeps the water's columns: a point is two cache lines, whatever "
        "it holds.",
        "",
        "Levels follow the mesh, so steps of two meshes do not compare one by one: with a sink the finest level holds "
        f"fewer points and its step is another one ({1e6 * by_name['sink']['dt']:.0f} us, {by_name['sink']['levels']} "
        f"levels) than in the full scene ({1e6 * by_name[FULL]['dt']:.0f} us, {by_name[FULL]['levels']} levels), which "
        "says nothing about the cost of a simulated second.",
    ]
    (DOCS / "left-out.md").write_text("\n".join(page) + "\n", encoding="utf-8")
    data = {"rows": rows, "snapshot": {"seconds": seconds, "bytes": size}, "contact_nodes": contacts, "nodes": nodes}
    (DOCS / "left-out.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    print("\n".join(page[4:]))


if __name__ == "__main__":
    main()
