"""What the numerical choices do to the inflow and the pressures of case 3, one at a time, on the coarse scene.

    uv run python benchmarks/inflow_sensitivity.py       # some ten minutes; writes docs/inflow-sensitivity.{md,json}

None of them should decide the answer. Compared at 100 kg/m; mesh: every length near the gate halved or doubled.
"""

import json
import os
import platform
import time as clock
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

import coupling
import mpm
from coupling.provenance import root_attributes

DOCS = Path(__file__).resolve().parent.parent / "docs"
INFLOW = 100.0  # kg/m
VARIATIONS = (
    ("as the scene has it", {}, {}),
    ("2 elements across the gate", {"across": 2}, {}),
    ("8 elements across the gate", {"across": 8}, {}),
    ("12 points an element everywhere", {"points": 12}, {}),
    ("pic_rate 0 (pure FLIP)", {}, {"pic_rate": 0.0}),
    ("pic_rate 30 /s", {}, {"pic_rate": 30.0}),
    ("pic_rate 100 /s", {}, {"pic_rate": 100.0}),
    ("pressure_filter 0.05", {}, {"pressure_filter": 0.05}),
    ("pressure_filter 0.5", {}, {"pressure_filter": 0.5}),
    ("pressure_filter 0 (off)", {}, {"pressure_filter": 0.0}),
    ("volumetric_smoothing off", {}, {"volumetric_smoothing": False}),
    ("courant 0.25", {}, {"courant": 0.25}),
)


def varied(changes, numerics):
    """Scene `quick` with another mesh near the gate and other numerics."""
    scene = coupling.load_scene("quick").mpm
    mesh = scene.discretisation
    factor = mesh.elements_across_gate / changes.get("across", mesh.elements_across_gate)
    update = {
        "elements_across_gate": changes.get("across", mesh.elements_across_gate),
        "element_size_lining": mesh.element_size_lining * factor,
        "element_size_interior": mesh.element_size_interior * factor,
        "points_per_element": changes.get("points", mesh.points_per_element),
    }
    return scene.model_copy(
        update={
            "discretisation": mesh.model_copy(update=update),
            "numerics": scene.numerics.model_copy(update=numerics),
        }
    )


def measure(scene):
    """Time of the inflow, mean pressures over some arcs just before it, and processor time."""
    solver = mpm.Solver(scene, mpm.build_mesh(scene), threads=1)
    solver.relax()
    solver.open_gate()
    begin, last_time, last_inflow = clock.process_time(), 0.0, 0.0
    since = 0.0
    while True:
        for _ in range(20):
            solver.step()
        inflow = solver.inflow_mass()
        if inflow >= INFLOW:
            break
        if inflow < 0.8 * INFLOW:
            solver.impulse[:] = 0.0
            since = solver.time
        last_time, last_inflow = solver.time, inflow
    share = (INFLOW - last_inflow) / (inflow - last_inflow)
    lining = solver.lining_pressures(solver.time - since)[0]
    result = {"time": last_time + share * (solver.time - last_time), "points": int(solver.n_points)}
    for name in ("soil_pressure", "water_pressure"):
        for centre in (0, 60, 120, 180):
            near = np.abs((lining["theta"] - centre + 180) % 360 - 180) <= 8
            result[f"{name}_{centre}"] = float(np.average(lining[name][near], weights=lining["arc"][near]))
    return result | {"steps": solver.step_count, "cpu_seconds": clock.process_time() - begin}


def main():
    rows = []
    for label, changes, numerics in VARIATIONS:
        rows.append({"what": label} | measure(varied(changes, numerics)))
        print(rows[-1], flush=True)
    attributes = root_attributes(coupling.load_scene("quick"))
    page = [
        "# What the numerical choices do to the inflow",
        "",
        f"Made by `uv run python benchmarks/inflow_sensitivity.py` on {datetime.now(UTC):%Y-%m-%d}, revision "
        f"{attributes['revision']}, {os.cpu_count()} cores, {platform.machine()}. Scene `quick` at {INFLOW:.0f} kg/m; "
        "pressures in kPa, means over 16 degrees and the last fifth of the inflow.",
        "",
        "| what is changed | time s | soil 0 | soil 60 | soil 120 | soil 180 "
        "| water 0 | water 60 | water 120 | water 180 | points | steps | CPU s |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        pressures = [f"{row[k] / 1e3:.0f}" for k in row if "pressure_" in k]
        cells = [
            row["what"],
            f"{row['time']:.3f}",
            *pressures,
            row["points"],
            row["steps"],
            f"{row['cpu_seconds']:.0f}",
        ]
        page.append("| " + " | ".join(map(str, cells)) + " |")
    (DOCS / "inflow-sensitivity.md").write_text("\n".join(page) + "\n", encoding="utf-8")
    (DOCS / "inflow-sensitivity.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
