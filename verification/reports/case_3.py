"""Everything that the main job must show, from one run of case 3: a table, its data and the pictures for the docs.

    uv run python -m verification.reports case-3           # runs case 3 into runs/case-3 (minutes), then reports
    uv run python -m verification.reports case-3 FOLDER    # reports on a finished run

Writes docs/case-3.md, docs/case-3.json and docs/images/case-3-*.png.
"""

import shutil
from pathlib import Path

import numpy as np
import xarray as xr

import coupling
import mpm
from coupling import postprocess
from coupling.datasets import (
    read_attributes,
    read_group,
    read_history,
    read_mesh,
    read_points,
    read_pressures,
    read_response,
)
from structure.response import FORCES
from verification.boxes import run_to
from verification.loads import theory_pressures
from verification.pages import DOCS, made_by, provenance, table, write_data

BLOCKS = ("measured", "forces")
SETTLING = 3.0  # s
PICTURES = ("fields", "pressures", "internal_forces", "inflow")


def measured(folder):
    """The numbers of the report: list of (what, wanted, value as text, met or None), and the same as a dict."""
    history, pressures, mesh = read_history(folder), read_pressures(folder), read_mesh(folder)
    scene = coupling.load_scene(Path(folder) / "scene.toml")
    gate, rows, data = scene.gate.angle, [], {}

    def row(key, what, wanted, value, met, text):
        rows.append((what, wanted, text, met))
        data[key] = {"value": value, "wanted": wanted, "met": met}

    bonded = _bonded(scene)
    theory = theory_pressures(scene, theta=bonded["theta"]).isel(time=0)
    for name, limit in (("soil_pressure", 0.02), ("water_pressure", 0.01)):
        error = float(np.abs(bonded[name] / theory[name].values - 1).max())
        row(f"initial_{name}_error", f"{name.replace('_', ' ')} of bonded ground at rest against theory, worst angle",
            f"<= {limit:.0%}", error, bool(error <= limit), f"{error:.2%}")  # fmt: skip
    smallest = float(np.diff(history["inflow_mass"].values).min())
    row("inflow_monotonic", "inflow mass grows from record to record", "always", smallest, smallest >= 0,
        f"smallest step {smallest:.3g} kg/m")  # fmt: skip
    rate, r_squared = postprocess.inflow_linearity(history, 100, 1000)
    row("inflow_r_squared", "straight line through 100 .. 1000 kg/m, R2", ">= 0.98", r_squared, r_squared >= 0.98,
        f"{r_squared:.4f} at {rate:.0f} kg/m/s")  # fmt: skip
    end, time = (float(history[name][-1]) for name in ("inflow_mass", "time"))
    row("end_of_run", "stable to", "2000 kg/m", end, end >= 2000, f"{end:.0f} kg/m at {time:.2f} s")
    mass = history["grain_mass"].values
    lost = float(np.abs(mass / mass[0] - 1).max())
    row("grain_mass_error", "grain mass conserved", "1e-10", lost, lost <= 1e-10, f"{lost:.1e}")
    width = np.degrees(scene.gate.width / scene.tunnels[0].outer_radius)
    for name in ("soil_pressure", "water_pressure"):
        for angle, where in ((5.0, "5 degrees beside the gate"), (width, "one gate width from its middle")):
            ratio = postprocess.ratio_to_initial(pressures, name, 1000, [gate - angle, gate + angle])
            row(f"{name}_at_{angle:.1f}_degrees", f"{name.replace('_', ' ')} {where} at 1000 kg/m over initial",
                "< 1/3", ratio, ratio < 1 / 3, f"{ratio:.2f}")  # fmt: skip
    for angle, where in ((0, "crown"), (180, "invert")):
        ratio = postprocess.ratio_to_initial(pressures, "soil_pressure", 1000, [angle])
        row(f"soil_pressure_{where}", f"soil pressure at the {where} at 1000 kg/m over initial", "> 1", ratio,
            ratio > 1, f"{ratio:.2f}")  # fmt: skip
    areas = [float(postprocess.at_inflow(history, m)["flow_zone_area"]) for m in (250, 500, 1000, 1500, 2000)]
    early, rapid, late = areas[1] / 500, (areas[2] - areas[1]) / 500, (areas[4] - areas[3]) / 500
    row("flow_zone_stages", "flow zone grows slowly, rapidly, levels off", "slow < rapid > late",
        [early, rapid, late], bool(early < rapid and late < rapid),
        f"{early * 1000:.0f}, {rapid * 1000:.0f}, {late * 1000:.0f} m2 per 1000 kg/m "
        f"(to 500, 500 .. 1000, 1500 .. 2000 kg/m)")  # fmt: skip
    _smoothness(row, folder, mesh)
    after = f"{SETTLING:g} s after the gate was shut at 1000 kg/m"
    for key, heap, when in (
        ("heap_porosity", postprocess.heap(read_points(folder, -1), mesh), "at the end of the run"),
        ("settled_heap_porosity", _settled_heap(scene, mesh), after),
    ):
        text = f"{heap['porosity']:.2f} over {heap['area']:.2f} m2; median speed {heap['speed']:.2f} m/s"
        row(key, f"porosity of the heap in the tunnel, by area, {when}", "0.4 .. 0.6", heap["porosity"],
            bool(0.4 <= heap["porosity"] <= 0.6), text)  # fmt: skip
    return rows, data


def _settled_heap(scene, mesh):
    """The heap of 1000 kg/m some time after the gate was shut: what the jet stirs does not rest."""
    simulation = mpm.Simulation(scene.model_copy(update={"stop": mpm.scene.Stop(inflow_mass=1000.0, time=60.0)}))
    simulation.begin()
    while not simulation.done:
        simulation.advance()
    solver = simulation.solver
    solver.close_gate()
    run_to(solver, solver.time + SETTLING)
    points = {name: ("point", values) for name, values in solver.points_by_name().items()}
    return postprocess.heap(xr.Dataset(points), mesh)


def _smoothness(row, folder, mesh):
    masses = np.interp(
        read_group(folder, "points")["time"], *(read_history(folder)[k] for k in ("time", "inflow_mass"))
    )
    snapshot = int(np.argmin(np.abs(masses - 1000)))
    points = read_points(folder, snapshot)
    for nearest, furthest in ((1, 2), (2, 6)):
        steps = postprocess.pore_pressure_steps(points, mesh, nearest, furthest)
        jump, off = (float(np.quantile(steps[k], 0.9)) for k in ("jump", "deviation"))
        row(f"pore_pressure_jump_{nearest}_{furthest}",
            f"pore pressure of neighbouring elements {nearest} .. {furthest} m from the gate at {masses[snapshot]:.0f} "
            "kg/m, 90 % below", "< 10 %", jump, jump < 0.1,
            f"{jump:.1%}; off the plane through their neighbours {off:.1%}")  # fmt: skip


def _bonded(scene):
    """Pressures on the lining before the shear that friction does not bear slips away: of these there is a theory."""
    solver = mpm.Solver(scene.model_copy(update={"initial_contact": "bonded"}), mpm.build_mesh(scene))
    solver.relax()
    return solver.lining_pressures(1.0)[0]


def forces(folder):
    """Extreme forces of the ring at some inflow masses: a row a mass."""
    response = read_response(folder)
    for mass in (0, 100, 500, 1000, 1500, 2000):
        if mass > float(response["inflow_mass"][-1]):
            break
        now, cells = response.isel(time=0) if mass == 0 else postprocess.at_inflow(response, mass), []
        for name in FORCES:
            for pick in ("max", "min"):
                index = int(getattr(now[name].values, f"arg{pick}")())
                cells.append(f"{float(now[name][index]) / 1e3:.0f} ({float(now['theta'][index]):.0f})")
        yield mass, *cells, " ".join(f"{v * 1e3:.2f}" for v in now["joint_rotation"].values)


def blocks(folder=None):
    """Everything, with the data of the page and its pictures."""
    if folder is None:
        folder = Path("runs/case-3")
        coupling.run(coupling.load_scene("case-3"), out=folder, overwrite=True, figures=True)
    rows, data = measured(folder)
    attributes, history = read_attributes(folder), read_history(folder)
    steps, points = int(history["steps"][-1]), int(history["point_steps"][-1])
    seconds, wall = (float(attributes[f"{kind}_seconds"]) for kind in ("cpu", "wall"))
    verdict = {True: "yes", False: "**no**"}
    made = made_by("uv run python -m verification.reports case-3", attributes["revision"])
    data["provenance"] = {key: str(attributes[key]) for key in ("revision", "versions", "created", "scene_sha256")} | {
        "machine": provenance()["machine"], "cpu_seconds": seconds, "steps": steps, "point_steps": points,
    }  # fmt: skip
    write_data(DOCS / "case-3.json", data)
    for name in PICTURES:
        shutil.copy(Path(folder) / "figures" / f"{name}.png", DOCS / "images" / f"case-3-{name.replace('_', '-')}.png")
    return {
        "made": f"{made} {steps} steps, {points / 1e9:.2f} thousand million point-steps, {seconds:.0f} s of processor "
        f"time, {wall:.0f} s by the clock.",
        "measured": table(
            ("what", "wanted", "measured", "met"),
            ((what, wanted, text, verdict[bool(met)]) for what, wanted, text, met in rows),
        ),
        "forces": table(
            ("inflow kg/m", "N max kN", "N min kN", "Q max kN", "Q min kN", "M max kN m", "M min kN m",
             "joint rotations mrad"), forces(folder),
        ),
    }  # fmt: skip
