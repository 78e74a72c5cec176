"""All measurements of `gush bench`, in one process and some children, one after the other."""

import os
import time as clock

import numpy as np

from mpm.solver import cores
from verification.speed import processes
from verification.speed.passes import kernel_times
from verification.speed.reference import ReferenceLoop, copy_bandwidth
from verification.speed.stepping import (
    LARGEST,
    SECONDS_OF_WARM_UP,
    SIZES,
    configurations,
    prepared,
    rate,
    size_ladder,
    slope,
    timed,
)
from verification.speed.studies import study_seconds

ROUNDS, SECONDS = 3, 1.0
FEW_SECONDS = 0.3


def bench(scene, step_only=False, large=False, tell=lambda line: None, rounds=ROUNDS, seconds=SECONDS):
    """Measure what steps, sizes, starts and parallel runs cost.

    scene : coupling.Scene, gate open, from the geostatic state;
    step_only : bool, only the step of the whole scene beside the reference loop and the copy;
    large : bool, also three million points;
    tell : callable, called with a line of text now and then;
    rounds, seconds : int, float, the best of some rounds counts, each of so much processor time: other programs only
        ever slow one down.

    Returns a dict: step_points_per_second, reference_points_per_second: point-steps per second of processor time, one
    thread; step_to_reference_ratio; scene, points, elements, step_rounds, reference_rounds: all measurements;
    copy_bytes_per_second; bytes_per_point: memory of the solver; bytes_per_point_step: as counted;
    roofline_points_per_second: copy over bytes; kernels: name to processor seconds per point-step; load: mean number of
    running programs before and after. Unless `step_only` also configurations, threads, sizes, size_slope, imports [s],
    start [s], first_step_wall_seconds, throughput, study (`studies.study_seconds`).
    """
    import mpm

    load = [os.getloadavg()[0]]
    mesh = mpm.build_mesh(scene)
    solver = prepared(scene, mesh)
    data = {"scene": scene.name, **_beside_reference(solver, rounds, seconds)}
    data["elements"] = len(mesh.elements)
    data["bytes_per_point"] = solver.memory_bytes() / solver.n_points
    data["bytes_per_point_step"] = bytes_per_point_step(solver)
    data["roofline_points_per_second"] = data["copy_bytes_per_second"] / sum(data["bytes_per_point_step"].values())
    data["kernels"] = kernel_times(solver, seconds)
    del solver
    if not step_only:
        tell("what a scene has and has not")
        data["configurations"] = _configurations(scene, mesh, seconds)
        data["threads"] = _threads(scene, mesh, rounds, seconds)
        tell("sizes")
        data["sizes"] = size_ladder(scene, [*SIZES, LARGEST] if large else SIZES, FEW_SECONDS)
        data["size_slope"] = slope(data["sizes"])
        tell("starts")
        data["imports"] = processes.import_seconds()
        data["start"] = processes.start_seconds()
        data["first_step_wall_seconds"] = processes.first_step_wall_seconds()
        tell("runs at once")
        data["throughput"] = _throughput()
        data["study"] = study_seconds()
    data["load"] = [*load, os.getloadavg()[0]]
    data["cpu_seconds"] = sum(os.times()[:4])
    return data


def bytes_per_point_step(solver):
    """Bytes read and written per point and step [B] by points, elements and nodes: dict.

    What must come from memory and go back when nothing stays in the cache between passes, counted from the arrays. A
    point's row is read and written in each of the two passes over the points, with its place in the order and its
    soil's number; an element's record and a node's row are read once a pass.
    """
    points, mesh, passes = solver.n_points, solver.mesh, 2
    row = solver.points[0].nbytes
    of_points = passes * (2 * row + solver.order.itemsize + solver.soil_of_point.itemsize)
    record = solver.geometry[0].nbytes + mesh.elements[0].nbytes + solver.occupied.itemsize + solver.start.itemsize
    # contents are written by one pass, and read by both
    of_elements = passes * record + 3 * solver.contents[0].nbytes
    # written, read and cleared where a part of the mesh adds to a row; then read by the passes that interpolate
    row_of_sums = solver.sums[0, 0].nbytes + solver.momenta[0, 0].nbytes
    of_nodes = 3 * row_of_sums * np.count_nonzero(solver.touched) + (passes + 2) * solver.nodes.nbytes
    occupied = np.count_nonzero(np.diff(solver.start))
    return {"points": float(of_points), "elements": of_elements * occupied / points, "nodes": of_nodes / points}


def _beside_reference(solver, rounds, seconds):
    reference = ReferenceLoop(solver.n_points)
    reference.step()
    timed(reference.step, SECONDS_OF_WARM_UP)
    step_rounds, reference_rounds = [], []
    for _ in range(rounds):  # in turns: what slows the machine down slows both
        step_rounds.append(rate(solver, seconds)[0])
        count, used, _ = timed(reference.step, seconds)
        reference_rounds.append(count * solver.n_points / used)
    step, loop = max(step_rounds), max(reference_rounds)
    return {
        "points": int(solver.n_points), "step_points_per_second": step, "reference_points_per_second": loop,
        "step_to_reference_ratio": step / loop, "step_rounds": step_rounds, "reference_rounds": reference_rounds,
        "copy_bytes_per_second": copy_bandwidth(),
    }  # fmt: skip


def _configurations(scene, mesh, seconds):
    rows = []
    for name, variant in configurations(scene):
        solver = prepared(variant, mesh)
        per_second, _, simulated = max(rate(solver, 0.5 * seconds) for _ in range(2))
        rows.append({
            "configuration": name, "points_per_second": per_second, "simulated_per_cpu_second": simulated,
            "bytes_per_point": solver.memory_bytes() / solver.n_points,
        })  # fmt: skip
    return rows


def _threads(scene, mesh, rounds, seconds):
    solvers = [prepared(scene, mesh, threads) for threads in (1, None)]
    best = [(0.0, 0.0) for _ in solvers]
    for _ in range(rounds):  # in turns, as above
        for k, solver in enumerate(solvers):
            per_second, per_wall, _ = rate(solver, seconds)
            best[k] = max(best[k], (per_wall, per_second))
    rows = [
        {"threads": solver.threads, "points_per_second": per_second, "points_per_wall_second": per_wall}
        for solver, (per_wall, per_second) in zip(solvers, best, strict=True)
    ]
    rows[-1]["speed_up"] = rows[-1]["points_per_wall_second"] / rows[0]["points_per_wall_second"]
    return rows


def _throughput():
    count, begin = cores(), clock.perf_counter()
    one, alone = processes.throughput(1)
    many, shared = processes.throughput(count)
    return {
        "runs": count, "one_points_per_wall_second": one, "all_points_per_wall_second": many,
        "share_of_ideal": many / (count * one), "processor_share_of_one": alone, "processor_share_of_each": shared,
        "seconds": clock.perf_counter() - begin,
    }  # fmt: skip
