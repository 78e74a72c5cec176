"""What moves the inflow of case 3: numerical choices, which must not, beside properties of the ground, which must.

    uv run python -m verification.reports inflow-sensitivity    # some ten minutes
    uv run python -m verification.reports case-3-sensitivity    # half an hour

Scene `quick` until 300 kg/m, or `case-3` until 1000 kg/m, one thing changed at a time; of `case-3` also the values at
mesh size zero with error bars. Runs are kept in studies/sensitivity and not repeated.
"""

from pathlib import Path

import numpy as np

import coupling
from verification.pages import DOCS, table, write_data
from verification.sensitivity.choices import AS_IT_IS, COARSER, PHYSICS, of_case_3, of_quick
from verification.sensitivity.variants import at_size_zero, quantities, run_variants, value_at

BLOCKS = ("numerics", "spread")
MARKS = {"quick": (100.0, 200.0, 300.0), "case-3": (100.0, 300.0, 1000.0)}  # kg/m
FIXED = {"output.interval": 0.005, "output.points": False, "stop.time": 30.0}
FOLDER = Path("studies/sensitivity")


def measured(name, variants, folder):
    """Rows of the tables: name of a quantity to (n_variants,) values, of the last mark, the times of all of them."""
    marks, scene = MARKS[name], coupling.load_scene(name)
    data = run_variants(name, variants, marks[-1], folder, tell=print, **FIXED)
    found = [quantities(data, mark, scene.gate.angle) for mark in marks]
    times = {key: values for state in found for key, values in state.items() if key.startswith("time to")}
    seconds = data["cpu_seconds"].values
    last = data["time"].max("progress").values  # [s], also of runs that did not reach the last mark
    return times | found[-1] | {"CPU s a simulated s": seconds / last}


def measured_table(variants, found):
    """All quantities of all variants; what a variant did not reach is empty."""
    rows = zip(variants, *(values for values in found.values()), strict=True)
    shown = ([what, *("" if np.isnan(value) else f"{value:.4g}" for value in values)] for what, *values in rows)
    return table(("changed", *found), shown)


def spread(found):
    """One sentence: how far the numerical choices move what is reported, from the first row."""
    moved = {name: 100 * (values / values[0] - 1) for name, values in found.items() if not name.endswith(" s")}
    parts = [f"{name.partition(' [')[0]} {np.nanmin(v):+.1f} .. {np.nanmax(v):+.1f} %" for name, v in moved.items()]
    return "From the first row: " + ", ".join(parts) + "."


def error_bars(variants, found):
    """Values at mesh size zero, their error bars by mesh, and by all other choices.

    Straight line through the four finest of the meshes of which all sizes change; its bar as of
    `verification.accuracy.orders.extrapolate`. The other bar is the largest change that another choice makes, but a
    coarser one.
    """
    names, scaled = list(variants), {AS_IT_IS: 1.0}
    scaled |= {what: float(what.split()[2]) for what in names if what.startswith("all elements")}
    finest = sorted(scaled, key=scaled.get)[:4]
    meshes = [names.index(what) for what in finest]
    others = [k for k, what in enumerate(names) if what not in (*scaled, *COARSER) and not what.startswith("water")]
    asked = {key: values[meshes] for key, values in found.items() if key.endswith("]")}  # what a run costs is no answer
    zeros = at_size_zero([scaled[what] for what in finest], asked)
    rows = []
    for name, zero in zeros.items():
        here = found[name][0]
        bar = np.nanmax(np.abs(found[name][others] - here))
        together, above = (100 * part / abs(here) for part in (np.hypot(zero.error, bar), here - zero.value))
        rows.append((name, f"{here:.4g}", f"{zero.value:.4g}", f"{zero.error:.2g}", f"{bar:.2g}", f"{together:.0f}",
                     f"{above:+.0f}"))  # fmt: skip
    head = ("", "scene", "size zero", "bar: mesh", "bar: all other choices", "together %", "scene less size zero %")
    return table(head, rows)


def seepage(scene, conductivity):
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
    return scene.water.density * 2 * np.pi * conductivity * head / resistance


def beside_seepage(name, variants, found):
    """Inflow rates of ground of other permeability beside `seepage`."""
    scene, (first, *_, last) = coupling.load_scene(name), MARKS[name]
    begin, end = (found[f"time to {mark:g} kg/m [s]"] for mark in (first, last))
    key, rows = "soils.0.hydraulic_conductivity", []
    for k, (what, changes) in enumerate(variants.items()):
        if set(changes) <= {key}:
            conductivity = changes.get(key, value_at(scene, key))
            rate = (last - first) / (end[k] - begin[k])
            rows.append((what, f"{rate:.0f}", f"{seepage(scene, conductivity):.3g}"))
    head = ("ground and water, first to last mark kg/m/s", "water through ground that rests kg/m/s")
    return table(("changed", *head), rows)


def blocks(name, folder=FOLDER):
    """Run the variants of a scene; besides :data:`BLOCKS` "ground" and "seepage" of `quick`, "size zero" of case 3."""
    quick, scene, folder = name == "quick", coupling.load_scene(name), Path(folder) / name
    variants = of_quick(scene) if quick else of_case_3(scene)
    found = measured(name, variants, folder)
    filled = {"numerics": measured_table(variants, found), "spread": spread(found)}
    data = {"numerics": {"variants": list(variants)} | {key: values.tolist() for key, values in found.items()}}
    if quick:
        ground = {AS_IT_IS: {}} | PHYSICS
        moved = measured(name, ground, folder)
        data["physics"] = {"variants": list(ground)} | {key: values.tolist() for key, values in moved.items()}
        filled |= {"ground": measured_table(ground, moved), "seepage": beside_seepage(name, ground, moved)}
    else:
        filled["size zero"] = error_bars(variants, found)
    write_data(DOCS / f"{'inflow' if quick else name}-sensitivity.json", data)
    return filled
