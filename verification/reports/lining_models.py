"""Numbers and pictures of docs/lining-models.md: both lining models compared, their cost, and the open gate.

uv run python -m verification.reports.lining_models    # under a minute; writes into docs/lining-models.md
"""

import re
import time as clock
from functools import cache
from types import SimpleNamespace

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from coupling.figures import RESOLUTION, STYLE
from coupling.figures.comparison import forces_compared, joints_compared
from coupling.responses.comparison import compare
from coupling.scenes.scene import load_scene
from structure import BeamSpringLining, ContinuumLining, LiningFailure
from structure.response import FORCES
from structure.theory import curved_section_moment, theoretical_pressures
from verification.pages import DOCS, made_by, need_docs

IMAGES = DOCS / "images"
GATE = (90.0, 0.2)


def pressures(scene, n_times):
    """Theory pressures of a scene; around the gate they fall to a tenth, gaussian 15 degrees wide."""
    tunnel, soil = scene.tunnels[0], scene.soils[0]
    buoyant = (1 - soil.porosity) * (soil.grain_density - scene.water.density) * scene.gravity
    base = theoretical_pressures(
        outer_diameter=tunnel.outer_diameter,
        cover=tunnel.cover,
        buoyant_unit_weight=buoyant,
        coefficient_at_rest=soil.lateral_pressure_coefficient(buoyant * tunnel.axis_depth),
        water_unit_weight=scene.water.density * scene.gravity,
    )
    share = xr.DataArray(np.linspace(0, 0.9, n_times), dims="time")
    fall = share * np.exp(-(((base["theta"] - GATE[0]) / 15) ** 2))
    loads = base.isel(time=0, drop=True).map(lambda part: (part * (1 - fall)).transpose("time", "theta"))
    loads = loads.assign_coords(time=("time", np.arange(n_times, dtype=float), {"units": "s"}))
    loads["inflow_mass"] = ("time", np.linspace(0, 1000, n_times), {"units": "kg/m"})
    return loads


def write(name, lines):
    """Replace the block of that name in the document, between its two comments."""
    document = DOCS / "lining-models.md"
    text = document.read_text(encoding="utf-8")
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
    if begin not in text:
        raise ValueError(f"{document}: block {name!r} must be marked by '{begin.strip()}', got none")
    body = "\n".join(lines) + "\n"
    text = re.sub(re.escape(begin) + ".*?" + re.escape(end), lambda _: begin + body + end, text, flags=re.S)
    document.write_text(text, encoding="utf-8")
    print(body)


def cost(scene):
    """CPU seconds of both models for 1000 times, construction included."""
    loads = pressures(scene, 1000)
    lines = ["| model | CPU time for 1000 times [s] |", "|---|---|"]
    for name, model in {"beam-spring": BeamSpringLining, "continuum": ContinuumLining}.items():
        begin = clock.process_time()
        model(scene.ring).respond(loads)
        lines.append(f"| {name} | {clock.process_time() - begin:.2f} |")
    write("cost", lines)


def difference_table(scene):
    """The table of `gush compare`, and its pictures."""
    source = SimpleNamespace(ring=scene.ring, pressures=pressures(scene, 100), file="synthetic")
    comparison = compare(source)
    lines = ["| quantity | largest difference | of the extreme | where | when | known cause |", "|---" * 6 + "|"]
    for row in comparison.rows:
        where = f"joint {row['joint']}" if row["theta"] is None else f"{row['theta']:g}°"
        lines.append(
            f"| {row['label']} | {row['difference'] * row['scale']:+.3g} {row['unit']} | {100 * row['relative']:.2f} %"
            f" | {where} | {row['inflow_mass']:.0f} kg/m | {row['cause'] or '-'} |"
        )
    write("differences", lines)
    forces_compared(comparison.responses).savefig(IMAGES / "lining_models_forces.png", dpi=110)
    joints_compared(comparison.responses).savefig(IMAGES / "lining_models_joints.png", dpi=110)


def open_gate(scene):
    """What neglecting the gate costs, for holes of some shares of the tunnel's length."""
    loads = pressures(scene, 2)
    whole = ContinuumLining(scene.ring).respond(loads)
    lines = ["| cut | pressures | N | Q | M | radial displacement | joint rotation |", "|---" * 7 + "|"]
    for cut in (0.05, 1 / 6, 0.5, 0.9, 1.0):
        try:
            hole = ContinuumLining(scene.ring, gate=(*GATE, cut)).respond(loads)
        except LiningFailure as failure:
            lines.append(f"| {cut:.2f} | initial | {failure} | | | | |")
            continue
        for time, state in ((0, "initial"), (1, "final")):
            cells = []
            for name in (*FORCES, "displacement_radial", "joint_rotation"):
                one, other = whole[name].isel(time=time), hole[name].isel(time=time)
                cells.append(f"{100 * float(np.abs(other - one).max() / np.abs(one).max()):.1f} %")
            lines.append(f"| {cut:.2f} | {state} | " + " | ".join(cells) + " |")
    write("open gate", lines)


def joint_details(scene):
    """What grooves and bolts change of the plain ring, and the largest hoop stress near joint 2."""
    loads = pressures(scene, 2).isel(time=[1])
    cases = {
        "plain": {},
        "groove 50/40/20 mm": dict(groove=(0.05, 0.04, 0.02)),
        "bolts 200 MN/m per m": dict(bolts=(-0.05, 0.4, 2e8)),
        "both": dict(groove=(0.05, 0.04, 0.02), bolts=(-0.05, 0.4, 2e8)),
    }
    lines = [
        "| joints | N | Q | M | radial displacement | joint rotation | compression near joint 2 [MPa] |",
        "|---" * 7 + "|",
    ]
    plain = None
    for label, options in cases.items():
        model = ContinuumLining(scene.ring, layers=8, **options)
        response, stress = model.respond(loads).isel(time=0), model.stress_field(loads).isel(time=0)
        plain = response if plain is None else plain
        cells = []
        for name in (*FORCES, "displacement_radial", "joint_rotation"):
            change = float(np.abs(response[name] - plain[name]).max() / np.abs(plain[name]).max())
            cells.append("-" if response is plain else f"{100 * change:.1f} %")
        near = np.abs(stress["theta"] - scene.ring.joint_angles[1]) < 0.4
        cells.append(f"{-float(stress['stress_tt'].where(near).min()) / 1e6:.1f}")
        lines.append(f"| {label} | " + " | ".join(cells) + " |")
    write("details", lines)


def error_over_time(scene):
    """Error of M and of the radial displacement against CPU seconds for 50 times, over element counts."""
    loads = pressures(scene, 50)
    names = ("bending_moment", "displacement_radial")

    @cache
    def reference(n_angles):
        # on the angles of the model measured: nothing is interpolated across a joint, where displacements jump
        ring = scene.ring.model_copy(update={"n_elements": n_angles})
        return ContinuumLining(ring, columns=1440, layers=4).respond(loads.isel(time=[0, -1]))

    curves = {}

    def measure(label, build, count, corrected=False):
        begin = clock.process_time()
        model = build()
        response = model.respond(loads)
        seconds = clock.process_time() - begin
        ring = model.ring
        ends = response.isel(time=[0, -1]).copy()
        if corrected:
            ends["bending_moment"] = ends["bending_moment"] + curved_section_moment(
                ends["axial_force"],
                ring.thickness,
                ring.centre_radius,
                ring.bending_stiffness,
                len(ring.joint_angles),
                ring.joint_rotational_stiffness,
            )
        truth = reference(ring.n_elements)
        errors = [
            float(np.nanmax(np.abs(ends[name].values - truth[name].values)) / np.abs(truth[name]).max())
            for name in names
        ]
        curves.setdefault(label, []).append((seconds, *errors, count))

    # what loads on first use is no cost of a time step
    BeamSpringLining(scene.ring).respond(loads)
    for count in (45, 90, 180, 360, 720, 1440):
        ring = scene.ring.model_copy(update={"n_elements": count})
        measure("beam-spring", lambda ring=ring: BeamSpringLining(ring), count)
        measure("beam-spring + curved section", lambda ring=ring: BeamSpringLining(ring), count, corrected=True)
    for layers in (1, 2, 4):
        for count in (45, 90, 180, 360, 720):
            if layers == 4 and count > 360:
                continue
            measure(
                f"continuum, {layers} layer{'s' * (layers > 1)}",
                lambda count=count, layers=layers: ContinuumLining(scene.ring, columns=count, layers=layers),
                count,
            )
    lines = [
        "| model | elements around | CPU time for 50 times [s] | error of M | error of displacement |",
        "|---" * 5 + "|",
    ]
    for label, rows in curves.items():
        lines += [f"| {label} | {count} | {s:.2f} | {moment:.1e} | {w:.1e} |" for s, moment, w, count in rows]
    write("errors", lines)
    _draw_errors(curves)


def _draw_errors(curves):
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.4, 3.4), layout="constrained")
        axes = figure.subplots(1, 2, sharex=True)
        colours = dict(zip(curves, ("0.25", "0.6", "#d98200", "#c1272d", "#0b5394"), strict=True))
        for label, rows in curves.items():
            seconds, moment, displacement, counts = np.array(rows).T
            for axis, errors in zip(axes, (moment, displacement), strict=True):
                axis.loglog(seconds, errors, "o-", ms=3, color=colours[label], label=label)
                for k in (0, -1):
                    axis.annotate(f"{counts[k]:.0f}", (seconds[k], errors[k]), (3, 4), textcoords="offset points",
                                  fontsize=6.5, color=colours[label])  # fmt: skip
        for axis, title in zip(axes, ("bending moment", "radial displacement"), strict=True):
            axis.set_title(f"{title}: largest error / extreme")
            axis.set_xlabel("CPU seconds for 50 times")
            axis.grid(True)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        figure.savefig(IMAGES / "lining_models_error.png", dpi=RESOLUTION)


def joint_stresses(scene):
    """Hoop stress around joint 2, where the ring opens on the outside."""
    model = ContinuumLining(scene.ring, columns=720, layers=6)
    stress = model.stress_field(pressures(scene, 2).isel(time=[1])).isel(time=0)
    mesh = model.mesh
    nodes = mesh.element_nodes()[:4]
    corners = np.stack([mesh.node_radius * np.sin(mesh.node_angle), mesh.node_radius * np.cos(mesh.node_angle)], axis=1)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.4, 3.3), layout="constrained")
        axes = figure.subplots(1, 2, sharex=True, sharey=True)
        joint = np.radians(scene.ring.joint_angles[1])
        middle = 3.125 * np.array([np.sin(joint), np.cos(joint)])
        for axis, name, title in zip(
            axes, ("stress_tt", "stress_rt"), ("hoop stress [MPa], tension positive", "shear stress [MPa]"), strict=True
        ):
            values = stress[name].values.reshape(-1, 4).mean(1) / 1e6
            near = np.hypot(*(corners[nodes[0]] - middle).T) < 1.2
            limit = np.abs(values[near]).max()
            patches = PolyCollection(corners[nodes[:, near].T], array=values[near], cmap="RdBu_r", edgecolors="face")
            patches.set_clim(-limit, limit)
            axis.add_collection(patches)
            axis.set_aspect("equal")
            axis.set_xlim(middle[0] - 0.8, middle[0] + 0.6)
            axis.set_ylim(middle[1] - 0.8, middle[1] + 0.8)
            axis.set_title(title)
            axis.set_xlabel("x [m]")
            figure.colorbar(patches, ax=axis)
        axes[0].set_ylabel("y from the axis [m]")
        figure.savefig(IMAGES / "lining_models_stress.png", dpi=RESOLUTION)


def main():
    """Everything, in the order of the document."""
    need_docs()
    scene = load_scene("case-3")
    difference_table(scene)
    cost(scene)
    error_over_time(scene)
    open_gate(scene)
    joint_details(scene)
    joint_stresses(scene)
    write("provenance", [f"{made_by('uv run python -m verification.reports.lining_models')}."])


if __name__ == "__main__":
    main()
