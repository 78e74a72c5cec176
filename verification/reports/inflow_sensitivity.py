"""What moves the inflow of case 3: numerical choices, which must not, beside properties of the ground, which must.

    uv run python -m verification.reports.inflow_sensitivity           # some ten minutes; docs/inflow-sensitivity.*
    uv run python -m verification.reports.inflow_sensitivity case-3    # half an hour; docs/case-3-sensitivity.*

Scene `quick` until 300 kg/m, or `case-3` until 1000 kg/m, one thing changed at a time: the times of three inflow
masses, the extremes of the ring's forces at the last, the pressures, and how rough and noisy the soil pressure on the
ring is; of `case-3` also the values at mesh size zero with error bars.
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
from coupling.responses.respond import respond
from verification.accuracy.orders import extrapolate
from verification.pages import DOCS, made_by, need_docs

MARKS = {"quick": (100.0, 200.0, 300.0), "case-3": (100.0, 300.0, 1000.0)}  # kg/m
INTERVAL = 0.005  # between looks at the inflow [s]
AVERAGED = 0.9  # of the last mark: pressures are means from there on
BESIDE_GATE = 25.0  # degrees that roughness and noise leave out
BESIDE = 10  # degrees to both sides that they compare with
PATIENCE = 30.0  # simulated seconds
K0 = coupling.load_scene("quick").soils[0].elastic_k0
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
CASE_3 = (
    ("as the scene has it", {}),
    *((f"all elements {size:g} times as large", {"size": size}) for size in (2.0, 1.4, 0.7, 0.5)),
    ("half the elements across the gate", {"across": 0.5}),
    ("twice the elements across the gate", {"across": 2.0}),
    ("12 points an element everywhere", {"discretisation": {"points_per_element": 12}}),
    ("3 points an element everywhere", {"discretisation": {"points_per_element_gate": 3}}),
    ("25 points an element before the gate", {"discretisation": {"points_per_element_gate": 25}}),
    ("pressure_filter 0 (off)", {"numerics": {"pressure_filter": 0.0}}),
    ("pressure_filter 0.8", {"numerics": {"pressure_filter": 0.8}}),
    ("stress_damping 0 (off)", {"numerics": {"stress_damping": 0.0}}),
    ("stress_damping 1", {"numerics": {"stress_damping": 1.0}}),
    ("pic_rate 0 (pure FLIP)", {"numerics": {"pic_rate": 0.0}}),
    ("pic_rate 10 /s", {"numerics": {"pic_rate": 10.0}}),
    ("courant 0.4", {"numerics": {"courant": 0.4}}),
    ("slipping corners of the gate", {"gate": {"corners": "slipping"}}),
    ("sink instead of the interior", {"interior": "sink"}),
    ("water four times as stiff", {"water": {"bulk_modulus": 3.2e8}}),
)
#: Coarser than the scene: in the tables, and in no error bar.
COARSER = ("half the elements across the gate", "3 points an element everywhere")
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


def varied(name, changes):
    """A built-in scene with these changes."""
    scene = coupling.load_scene(name)
    ground = scene.model_dump()
    ground["soils"] = [ground["soils"][0] | changes.get("soil", {})]
    for part in ("numerics", "water", "gate", "discretisation"):
        ground[part] |= changes.get(part, {})
    ground["interior"] = changes.get("interior", ground["interior"])
    mesh, factor = ground["discretisation"], changes.get("size", 1.0)
    for name in ("element_size", "element_size_lining", "element_size_interior", "size_growth"):
        mesh[name] *= factor
    across = changes.get("across", 1.0 / factor)
    mesh["elements_across_gate"] = max(2, round(mesh["elements_across_gate"] * across))
    return coupling.Scene.model_validate(ground)


def measure(name, what, changes):
    """One row of the table: times [s], forces [N/m], moments [N m/m], pressures [Pa], roughness [-], cost."""
    scene = varied(name, changes)
    simulation = mpm.Simulation(scene, threads=1)
    simulation.begin()
    solver = simulation.solver
    solver.impulse[:] = 0.0
    begin, since, inflow, marks, times = clock.process_time(), 0.0, 0.0, list(MARKS[name]), []
    while marks and solver.time < PATIENCE:
        end = solver.time + INTERVAL
        before, time = inflow, solver.time
        while solver.time < end * (1 - 1e-12):
            solver.advance(end)
        inflow = solver.inflow_mass()
        while marks and inflow >= marks[0]:
            times.append(time + (solver.time - time) * (marks.pop(0) - before) / (inflow - before))
        if inflow < AVERAGED * MARKS[name][-1]:
            solver.impulse[:], since = 0.0, solver.time
    lining = solver.lining_pressures(max(solver.time - since, INTERVAL))[0]
    weights, theta = cell_mean_weights(lining["theta"]), cell_centres()
    pressures = xr.Dataset(
        {
            key: (("time", "theta"), (weights @ lining[key])[None], {"units": "Pa"})
            for key in ("soil_pressure", "water_pressure", "soil_shear")
        },
        {"time": ("time", [solver.time], {"units": "s"}), "theta": ("theta", theta, {"units": "degree"})},
    )
    forces = respond(scene, pressures)
    gate = scene.gate.angle
    soil, water = pressures.soil_pressure.values[0], pressures.water_pressure.values[0]
    mean, parabola = (savgol_filter(soil, 2 * BESIDE + 1, order, mode="wrap") for order in (0, 2))
    far = np.abs((theta - gate + 180) % 360 - 180) > BESIDE_GATE
    return {
        "what": what,
        "times": times + [None] * len(marks),
        "inflow": inflow,
        "moment_max": float(forces.bending_moment.max()),
        "moment_min": float(forces.bending_moment.min()),
        "axial_max": float(forces.axial_force.max()),
        "axial_min": float(forces.axial_force.min()),
        "shear_max": float(forces.shear_force.max()),
        "shear_min": float(forces.shear_force.min()),
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
    ("N max / min kN/m", lambda r: f"{r['axial_max'] / 1e3:.0f} / {r['axial_min'] / 1e3:.0f}"),
    ("Q max / min kN/m", lambda r: f"{r['shear_max'] / 1e3:.0f} / {r['shear_min'] / 1e3:.0f}"),
    ("M max / min kN m/m", lambda r: f"{r['moment_max'] / 1e3:.0f} / {r['moment_min'] / 1e3:.0f}"),
    ("soil crown / invert / 10 deg kPa", lambda r: " / ".join(
        f"{r[k] / 1e3:.0f}" for k in ("soil_crown", "soil_invert", "soil_beside_gate"))),
    ("water crown / 10 deg kPa", lambda r: f"{r['water_crown'] / 1e3:.0f} / {r['water_beside_gate'] / 1e3:.0f}"),
    ("roughness / noise %", lambda r: f"{100 * r['off_mean']:.1f} / {100 * r['off_parabola']:.1f}"),
    ("points", lambda r: str(r["points"])),
    ("CPU s a simulated s", lambda r: f"{r['cpu_per_second']:.1f}"),
)  # fmt: skip


#: What is told of the spread, and extrapolated: key of a row, label, unit, factor to it.
TOLD = (
    ("axial_max", "largest axial force", "kN/m", 1e-3), ("shear_max", "largest shear force", "kN/m", 1e-3),
    ("moment_max", "largest moment", "kN m/m", 1e-3), ("moment_min", "least moment", "kN m/m", 1e-3),
    ("soil_crown", "soil pressure at the crown", "kPa", 1e-3),
    ("soil_invert", "soil pressure at the invert", "kPa", 1e-3),
    ("soil_beside_gate", "soil pressure 10 degrees beside the gate", "kPa", 1e-3),
)  # fmt: skip


def table(name, rows, columns=COLUMNS):
    """Markdown lines of the rows."""
    head = ["changed", *(f"{m:.0f} kg/m at s" for m in MARKS[name]), *(label for label, _ in columns)]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in rows:
        shown = [f"{t:.3f}" if t is not None else f"> {PATIENCE:g}" for t in row["times"]]
        lines.append("| " + " | ".join([row["what"], *shown, *(show(row) for _, show in columns)]) + " |")
    return lines


def seepage(scene):
    """Water that seeps steadily to the gate through ground that does not move [kg/s per metre].

    A line sink under a level water table. Stream lines come from all sides beyond the tunnel, and from one side of its
    wall near the gate: head = q / (2 pi k) (ln(2 head / R) + 2 ln(4 R / width)), R the tunnel's outer radius. A slot in
    a plane wall drains as a half cylinder of a quarter of its width. Source: Muskat (1937), The flow of homogeneous
    fluids through porous media.
    """
    gate, tunnel = scene.gate, scene.tunnels[scene.gate.tunnel]
    radius = tunnel.outer_radius
    head = tunnel.axis_depth - radius * np.cos(np.radians(gate.angle)) - scene.water.table_depth
    resistance = np.log(2 * head / radius) + 2 * np.log(4 * radius / gate.width)
    return scene.water.density * 2 * np.pi * scene.soils[0].hydraulic_conductivity * head / resistance


def beside_seepage(name, rows, choices):
    """Markdown lines: inflow rates of ground of other properties beside `seepage`."""
    lines = ["| changed | ground and water, first to last mark kg/m/s | water through ground that rests kg/m/s |"]
    lines.append("|" + "---|" * 3)
    for row, (what, changes) in zip(rows, choices, strict=True):
        rate = (MARKS[name][-1] - MARKS[name][0]) / (row["times"][-1] - row["times"][0])
        lines.append(f"| {what} | {rate:.0f} | {seepage(varied(name, changes)):.3g} |")
    return lines


def quantities(name):
    """What is compared between rows: list of (label, unit, function of a row to its value or None)."""
    times = [(f"time to {mark:.0f} kg/m", "s", lambda row, k=k: row["times"][k]) for k, mark in enumerate(MARKS[name])]
    return times + [(label, unit, lambda row, k=key, f=f: row[k] * f) for key, label, unit, f in TOLD]


def spread(name, rows):
    """One sentence: how far the numerical choices move what is reported, from the first row."""
    sentences = []
    for label, _, value in quantities(name):
        moved = [value(row) / value(rows[0]) - 1 for row in rows if value(row) is not None]
        sentences.append(f"{label} {100 * min(moved):+.1f} .. {100 * max(moved):+.1f} %")
    return "From the first row: " + ", ".join(sentences) + "."


def at_size_zero(name, rows, choices):
    """Markdown lines: values at mesh size zero, their error bars by mesh, and by all other choices, of `choices`.

    Straight line through the four finest of the meshes of which all sizes change; its bar as of
    `verification.accuracy.orders.extrapolate`. The other bar is the largest change that another choice makes, but a
    coarser one. The stiffness of the water is no choice of ours: the source states it.
    """
    sizes = [(changes.get("size", 1.0), row) for row, (_, changes) in zip(rows, choices, strict=True)
             if set(changes) <= {"size"}]  # fmt: skip
    sizes = sorted(sizes, key=lambda pair: pair[0])[:4]
    others = [
        row
        for row, (what, changes) in zip(rows, choices, strict=True)
        if not set(changes) <= {"size", "water"} and what not in COARSER
    ]
    lines = [
        "| | scene | size zero | bar: mesh | bar: all other choices | together % | scene less size zero % |",
        "|" + "---|" * 7,
    ]
    for label, unit, value in quantities(name):
        zero = extrapolate([size for size, _ in sizes], [value(row) for _, row in sizes])
        here = value(rows[0])
        bar = max(abs(value(row) - here) for row in others)
        together, above = (100 * part / abs(here) for part in (np.hypot(zero.error, bar), here - zero.value))
        numbers = f"{here:.4g} | {zero.value:.4g} | {zero.error:.2g} | {bar:.2g} | {together:.0f} | {above:+.0f}"
        lines.append(f"| {label} [{unit}] | {numbers} |")
    return lines


SEEPAGE = (
    "Beside the estimate by seepage, a line sink at the gate under a level water table: water through ground that",
    "rests is nothing beside what flows in, grains and water together, up to a conductivity of 1e-3 m/s, and more than",
    "half of it at 1e-1 m/s. In tight ground the inflow does not depend on the conductivity (undrained); where water",
    "can be sucked in by the ground that loosens it is faster.",
)


def introduction(name):
    """What was computed, how, and what the columns mean."""
    command = "uv run python -m verification.reports.inflow_sensitivity" + (" case-3" if name == "case-3" else "")
    return (
        f"{made_by(command)}. Scene `{name}` with K0 = nu/(1 - nu), hydraulic conductivity 1e-4 m/s, until "
        f"{MARKS[name][-1]:.0f} kg/m; pressures and forces are means over the last tenth of it; roughness and noise: "
        f"rms of the soil pressure on the ring off its mean, and off the parabola, over {BESIDE} degrees each side, "
        f"beyond {BESIDE_GATE:.0f} degrees from the gate; where slip lines meet the ring the pressure has kinks that "
        "the mean leaves out and the parabola follows."
    )


def write(file, page, data):
    """Write a page and its data into the docs."""
    (DOCS / f"{file}.md").write_text("\n".join(page) + "\n", encoding="utf-8")
    (DOCS / f"{file}.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def main():
    name = sys.argv[1] if len(sys.argv) > 1 else "quick"
    parts = {"numerics": NUMERICS, "physics": PHYSICS} if name == "quick" else {"numerics": CASE_3}
    need_docs()
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        jobs = {part: [pool.submit(measure, name, *row) for row in choices] for part, choices in parts.items()}
        rows = {}
        for part, its in jobs.items():
            rows[part] = []
            for job in its:
                rows[part].append(job.result())
                print(rows[part][-1], flush=True)
    numerics = rows["numerics"]
    page = [
        "",
        introduction(name),
        "",
        "## Numerical choices",
        "",
        *table(name, numerics),
        "",
        spread(name, numerics),
        "",
    ]
    if name == "quick":
        page += ["## The ground", "", *table(name, [numerics[0], *rows["physics"]]), "", *SEEPAGE, ""]
        permeable = [k for k, (what, _) in enumerate(PHYSICS) if what.startswith("conductivity")]
        at = [numerics[0], *(rows["physics"][k] for k in permeable)]
        page += beside_seepage(name, at, [NUMERICS[0], *(PHYSICS[k] for k in permeable)])
        write("inflow-sensitivity", ["# What moves the inflow, and what must not", *page], rows)
    else:
        page += [
            "The last row is physics: the source gives its water 80 MPa, less than a twentieth of the real stiffness.",
            "",
        ]
        page += ["## At mesh size zero", "", f"Without what is coarser than the scene ({', '.join(COARSER)})."]
        page += ["", *at_size_zero(name, numerics, CASE_3)]
        write("case-3-sensitivity", ["# Case 3: how wrong its numbers may be", *page], rows)


if __name__ == "__main__":
    main()
