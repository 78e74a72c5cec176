"""What moves the inflow of case 3: numerical choices, which must not, beside properties of the ground, which must.

    uv run python -m verification.reports.inflow_sensitivity    # some ten minutes; writes docs/inflow-sensitivity.*

Scene `quick`, one thing changed at a time, until 300 kg/m: the times of 100, 200 and 300 kg/m, the ring's largest and
least moment there, the pressures, and how rough and noisy the soil pressure on the ring is.
"""

import json
import sys
import time as clock
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import xarray as xr
from scipy.signal import savgol_filter

import coupling
import mpm
from coupling.datasets import cell_centres, cell_mean_weights
from coupling.run import respond
from verification.pages import DOCS, made_by, need_docs

MARKS = (100.0, 200.0, 300.0)  # kg/m
INTERVAL = 0.005  # between looks at the inflow [s]
AVERAGED = 0.9  # of the last mark: pressures are means from there on
BESIDE_GATE = 25.0  # degrees that roughness and noise leave out
BESIDE = 10  # degrees to both sides that they compare with
PATIENCE = 30.0  # simulated seconds
K0 = coupling.load_scene("quick").mpm.soils[0].elastic_k0
NUMERICS = (
    ("as the scene has it", {}),
    ("half the elements across the gate", {"across": 0.5}),
    ("twice the elements across the gate", {"across": 2.0}),
    ("all elements twice as large", {"size": 2.0}),
    ("all elements 1.4 times as large", {"size": 1.4}),
    ("all elements 0.7 times as large", {"size": 0.7}),
    ("elements half as large but across the gate", {"size": 0.5, "across": 1.0}),
    ("12 points an element everywhere", {"discretisation": {"points_per_element": 12}}),
    ("3 points an element everywhere", {"discretisation": {"points_per_element_gate": 3}}),
    ("pressure_filter 0 (off)", {"numerics": {"pressure_filter": 0.0}}),
    ("pressure_filter 0.1", {"numerics": {"pressure_filter": 0.1}}),
    ("pressure_filter 0.8", {"numerics": {"pressure_filter": 0.8}}),
    ("stress_damping 0 (off)", {"numerics": {"stress_damping": 0.0}}),
    ("stress_damping 0.25", {"numerics": {"stress_damping": 0.25}}),
    ("stress_damping 1", {"numerics": {"stress_damping": 1.0}}),
    ("pic_rate 0 (pure FLIP)", {"numerics": {"pic_rate": 0.0}}),
    ("pic_rate 10 /s", {"numerics": {"pic_rate": 10.0}}),
    ("pic_rate 100 /s", {"numerics": {"pic_rate": 100.0}}),
    ("courant 0.4", {"numerics": {"courant": 0.4}}),
    ("one time step for all elements", {"numerics": {"local_time_stepping": False}}),
    ("slipping corners of the gate", {"gate": {"corners": "slipping"}}),
    ("sink instead of the interior", {"interior": "sink"}),
    ("K0 changed by a thousandth", {"soil": {"k0": K0 * 1.001}}),
    ("conductivity changed by a thousandth", {"soil": {"hydraulic_conductivity": 1.001e-4}}),
)
PHYSICS = (
    *((f"conductivity {k:g} m/s", {"soil": {"hydraulic_conductivity": k}}) for k in (1e-6, 1e-5, 1e-3, 1e-2, 1e-1)),
    ("water as stiff as it is, 2.2 GPa", {"water": {"bulk_modulus": 2.2e9}}),
    ("dilatancy 2 degrees", {"soil": {"dilatancy_angle": 2.0}}),
    ("dilatancy 5 degrees", {"soil": {"dilatancy_angle": 5.0}}),
    ("friction 23 degrees", {"soil": {"friction_angle": 23.0}}),
    ("friction 30 degrees", {"soil": {"friction_angle": 30.0}}),
    ("K0 0.577", {"soil": {"k0": 0.577}}),
    ("K0 0.8", {"soil": {"k0": 0.8}}),
    ("loose porosity 0.50", {"soil": {"loose_porosity": 0.50}}),
    ("loose porosity 0.60", {"soil": {"loose_porosity": 0.60}}),
)


def varied(changes):
    """Scene `quick` with these changes."""
    scene = coupling.load_scene("quick")
    ground = scene.mpm.model_dump()
    ground["soils"] = [ground["soils"][0] | changes.get("soil", {})]
    for part in ("numerics", "water", "gate", "discretisation"):
        ground[part] |= changes.get(part, {})
    ground["interior"] = changes.get("interior", ground["interior"])
    mesh, factor = ground["discretisation"], changes.get("size", 1.0)
    for name in ("element_size", "element_size_lining", "element_size_interior", "size_growth"):
        mesh[name] *= factor
    across = changes.get("across", 1.0 / factor)
    mesh["elements_across_gate"] = max(2, round(mesh["elements_across_gate"] * across))
    return scene.model_copy(update={"mpm": mpm.Scene.model_validate(ground)})


def measure(what, changes):
    """One row of the table: times [s], moments [N m/m], pressures [Pa], roughness [-], cost."""
    scene = varied(changes)
    simulation = mpm.Simulation(scene.mpm, threads=1)
    simulation.begin()
    solver = simulation.solver
    solver.impulse[:] = 0.0
    begin, since, inflow, marks, times = clock.process_time(), 0.0, 0.0, list(MARKS), []
    while marks and solver.time < PATIENCE:
        end = solver.time + INTERVAL
        before, time = inflow, solver.time
        while solver.time < end * (1 - 1e-12):
            solver.advance(end)
        inflow = solver.inflow_mass()
        while marks and inflow >= marks[0]:
            times.append(time + (solver.time - time) * (marks.pop(0) - before) / (inflow - before))
        if inflow < AVERAGED * MARKS[-1]:
            solver.impulse[:], since = 0.0, solver.time
    lining = solver.lining_pressures(max(solver.time - since, INTERVAL))[0]
    weights, theta = cell_mean_weights(lining["theta"]), cell_centres()
    pressures = xr.Dataset(
        {
            name: (("time", "theta"), (weights @ lining[name])[None], {"units": "Pa"})
            for name in ("soil_pressure", "water_pressure", "soil_shear")
        },
        {"time": ("time", [solver.time], {"units": "s"}), "theta": ("theta", theta, {"units": "degree"})},
    )
    moment = respond(scene, pressures).bending_moment.values
    gate = scene.mpm.gate.angle
    soil, water = pressures.soil_pressure.values[0], pressures.water_pressure.values[0]
    mean, parabola = (savgol_filter(soil, 2 * BESIDE + 1, order, mode="wrap") for order in (0, 2))
    far = np.abs((theta - gate + 180) % 360 - 180) > BESIDE_GATE
    return {
        "what": what,
        "times": times + [None] * len(marks),
        "inflow": inflow,
        "moment_max": float(moment.max()),
        "moment_min": float(moment.min()),
        "soil_crown": float(mean[0]),
        "soil_invert": float(mean[180]),
        "soil_beside_gate": float(soil[int(gate) + 10]),
        "water_crown": float(water[0]),
        "water_beside_gate": float(water[int(gate) + 10]),
        "off_mean": float(np.sqrt(np.mean((soil / mean - 1)[far] ** 2))),
        "off_parabola": float(np.sqrt(np.mean((soil / parabola - 1)[far] ** 2))),
        "points": int(solver.n_points),
        "smallest": float(solver.mesh.quality["min_altitude"]) if hasattr(solver.mesh, "quality") else None,
        "cpu_seconds": clock.process_time() - begin,
        "cpu_per_second": (clock.process_time() - begin) / solver.time,
    }


COLUMNS = (
    ("M max / min kN m", lambda r: f"{r['moment_max'] / 1e3:.0f} / {r['moment_min'] / 1e3:.0f}"),
    ("soil crown / invert / 10 deg kPa", lambda r: " / ".join(
        f"{r[k] / 1e3:.0f}" for k in ("soil_crown", "soil_invert", "soil_beside_gate"))),
    ("water crown / 10 deg kPa", lambda r: f"{r['water_crown'] / 1e3:.0f} / {r['water_beside_gate'] / 1e3:.0f}"),
    ("roughness / noise %", lambda r: f"{100 * r['off_mean']:.1f} / {100 * r['off_parabola']:.1f}"),
    ("points", lambda r: str(r["points"])),
    ("CPU s a simulated s", lambda r: f"{r['cpu_per_second']:.1f}"),
)  # fmt: skip


def table(rows):
    """Markdown lines of the rows."""
    head = ["changed", *(f"{m:.0f} kg/m at s" for m in MARKS), *(name for name, _ in COLUMNS)]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in rows:
        shown = [f"{t:.3f}" if t is not None else f"> {PATIENCE:g}" for t in row["times"]]
        lines.append("| " + " | ".join([row["what"], *shown, *(show(row) for _, show in COLUMNS)]) + " |")
    return lines


def spread(rows):
    """One sentence: how far the numerical choices move what is reported, from the first row."""
    first, sentences = rows[0], []
    for k, mark in enumerate(MARKS):
        values = [row["times"][k] for row in rows if row["times"][k] is not None]
        low, high = min(values) / first["times"][k] - 1, max(values) / first["times"][k] - 1
        sentences.append(f"time to {mark:.0f} kg/m {100 * low:+.0f} .. {100 * high:+.0f} %")
    for name, label in (("moment_max", "largest moment"), ("moment_min", "least moment")):
        values = [row[name] / first[name] - 1 for row in rows]
        sentences.append(f"{label} {100 * min(values):+.1f} .. {100 * max(values):+.1f} %")
    return "From the first row: " + ", ".join(sentences) + "."


def main():
    parts = {"numerics": NUMERICS, "physics": PHYSICS}
    chosen = [parts[name] for name in sys.argv[1:] or parts]
    need_docs()
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        jobs = [[pool.submit(measure, *row) for row in part] for part in chosen]
        rows = []
        for part in jobs:
            rows.append([])
            for job in part:
                rows[-1].append(job.result())
                print(rows[-1][-1], flush=True)
    if len(rows) < 2:
        return
    numerics, physics = rows
    page = [
        "# What moves the inflow, and what must not",
        "",
        f"{made_by('uv run python -m verification.reports.inflow_sensitivity')}. Scene `quick` with K0 = nu/(1 - nu), "
        f"hydraulic conductivity 1e-4 m/s, until {MARKS[-1]:.0f} kg/m; pressures are means over the last tenth of it; "
        f"roughness and noise: rms of the soil pressure on the ring off its mean, and off the parabola, over {BESIDE} "
        f"degrees to both sides, beyond {BESIDE_GATE:.0f} degrees from the gate; where slip lines meet the ring the "
        "pressure has kinks that the mean leaves out and the parabola follows.",
        "",
        "## Numerical choices",
        "",
        *table(numerics),
        "",
        spread(numerics),
        "",
        "## The ground",
        "",
        *table([numerics[0], *physics]),
    ]
    (DOCS / "inflow-sensitivity.md").write_text("\n".join(page) + "\n", encoding="utf-8")
    stored = json.dumps({"numerics": numerics, "physics": physics}, indent=1)
    (DOCS / "inflow-sensitivity.json").write_text(stored + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
