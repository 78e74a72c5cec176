"""Numbers and pictures of docs/lining-models.md: both lining models compared, their cost, and the open gate.

uv run python -m verification.reports lining-models    # under a minute; writes into docs/lining-models.md
"""

import time as clock
from functools import cache
from types import SimpleNamespace

import numpy as np
from matplotlib.collections import PolyCollection

from coupling.figures.comparison import forces_compared, joints_compared
from coupling.figures.picture import legend_outside
from coupling.responses.comparison import compare
from coupling.scenes.scene import load_scene
from structure import BeamSpringLining, Bolts, ContinuumLining, LiningFailure
from structure.response import FORCES
from structure.theory import curved_section_moment
from verification.loads import GATE, falling_pressures
from verification.pages import DOCS, picture, table

IMAGES = DOCS / "images"
WIDTH = 0.2  # of the gate [m]
BOLTS = Bolts(offset=-0.05, length=0.4, stiffness=2e8, preload=1e6)
MOVED = (*FORCES, "displacement_radial", "joint_rotation")


def cost(scene):
    """CPU seconds of both models for 1000 times, construction included."""
    loads, rows = falling_pressures(scene, 1000), []
    for name, model in {"beam-spring": BeamSpringLining, "continuum": ContinuumLining}.items():
        begin = clock.process_time()
        model(scene.ring).respond(loads)
        rows.append((name, f"{clock.process_time() - begin:.2f}"))
    return table(("model", "CPU time for 1000 times [s]"), rows)


def difference_table(scene):
    """The table of `gush compare`, and its pictures."""
    source = SimpleNamespace(ring=scene.ring, pressures=falling_pressures(scene, 100), file="synthetic")
    comparison, rows = compare(source), []
    for row in comparison.rows:
        where = f"joint {row['joint']}" if row["theta"] is None else f"{row['theta']:g}°"
        size, share = f"{row['difference'] * row['scale']:+.3g} {row['unit']}", f"{100 * row['relative']:.2f} %"
        rows.append((row["label"], size, share, where, f"{row['inflow_mass']:.0f} kg/m", row["cause"] or "-"))
    forces_compared(comparison.responses).savefig(IMAGES / "lining_models_forces.png", dpi=110)
    joints_compared(comparison.responses).savefig(IMAGES / "lining_models_joints.png", dpi=110)
    return table(("quantity", "largest difference", "of the extreme", "where", "when", "known cause"), rows)


def changes(one, other):
    """Largest change of forces, displacement and rotation, in per cent of the extreme, as texts."""
    moved = ((np.abs(other[name] - one[name]).max() / np.abs(one[name]).max()).item() for name in MOVED)
    return [f"{100 * share:.1f} %" for share in moved]


def open_gate(scene):
    """What neglecting the gate costs, for holes of some shares of the tunnel's length."""
    loads, rows = falling_pressures(scene, 2), []
    whole = ContinuumLining(scene.ring).respond(loads)
    for cut in (0.05, 1 / 6, 0.5, 0.9, 1.0):
        try:
            hole = ContinuumLining(scene.ring, gate=(GATE, WIDTH, cut)).respond(loads)
        except LiningFailure as failure:
            rows.append((f"{cut:.2f}", "initial", failure, "", "", "", ""))
            continue
        for time, when in ((0, "initial"), (1, "final")):
            rows.append((f"{cut:.2f}", when, *changes(whole.isel(time=time), hole.isel(time=time))))
    return table(("cut", "pressures", "N", "Q", "M", "radial displacement", "joint rotation"), rows)


def joint_details(scene):
    """What grooves and bolts change of the plain ring, and the largest hoop stress near joint 2."""
    loads, rows, plain = falling_pressures(scene, 2).isel(time=[1]), [], None
    bolted = scene.ring.model_copy(update={"joint_bolts": BOLTS})
    groove, name = {"groove": (0.05, 0.04, 0.02)}, "bolts 200 MN/m per m, tightened to 1 MN/m"
    cases = {
        "plain": (scene.ring, {}),
        "groove 50/40/20 mm": (scene.ring, groove),
        name: (bolted, {}),
        "both": (bolted, groove),
    }
    for label, (ring, options) in cases.items():
        model = ContinuumLining(ring, layers=8, **options)
        response, stress = model.respond(loads).isel(time=0), model.stress_field(loads).isel(time=0)
        near = np.abs(stress["theta"] - scene.ring.joint_angles[1]) < 0.4
        pressed = f"{-float(stress['stress_tt'].where(near).min()) / 1e6:.1f}"
        rows.append((label, *(["-"] * 5 if plain is None else changes(plain, response)), pressed))
        plain = response if plain is None else plain
    head = ("N", "Q", "M", "radial displacement", "joint rotation", "compression near joint 2 [MPa]")
    return table(("joints", *head), rows)


def error_over_time(scene):
    """Error of M and of the radial displacement against CPU seconds for 50 times, over element counts."""
    loads = falling_pressures(scene, 50)

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
        ring, ends = model.ring, response.isel(time=[0, -1]).copy()
        if corrected:
            ends["bending_moment"] = ends["bending_moment"] + curved_section_moment(ends["axial_force"], ring)
        truth = reference(ring.n_elements)
        errors = [
            float(np.nanmax(np.abs(ends[name].values - truth[name].values)) / np.abs(truth[name]).max())
            for name in ("bending_moment", "displacement_radial")
        ]
        curves.setdefault(label, []).append((seconds, *errors, count))

    # what loads on first use is no cost of a time step
    BeamSpringLining(scene.ring).respond(loads)
    for count in (45, 90, 180, 360, 720, 1440):
        ring = scene.ring.model_copy(update={"n_elements": count})
        for label, corrected in (("beam-spring", False), ("beam-spring + curved section", True)):
            measure(label, lambda ring=ring: BeamSpringLining(ring), count, corrected)
    for layers, counts in ((1, (45, 90, 180, 360, 720)), (2, (45, 90, 180, 360, 720)), (4, (45, 90, 180, 360))):
        for count in counts:
            name = f"continuum, {layers} layer{'s' * (layers > 1)}"
            measure(name, lambda n=count, k=layers: ContinuumLining(scene.ring, columns=n, layers=k), count)
    _draw_errors(curves)
    head = ("model", "elements around", "CPU time for 50 times [s]", "error of M", "error of displacement")
    return table(head, (
        (label, count, f"{s:.2f}", f"{moment:.1e}", f"{w:.1e}")
        for label, rows in curves.items() for s, moment, w, count in rows
    ))  # fmt: skip


def _draw_errors(curves):
    with picture(IMAGES / "lining_models_error.png", 7.4, 3.4) as figure:
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
            axis.set(title=f"{title}: largest error / extreme", xlabel="CPU seconds for 50 times")
            axis.grid(True)
        legend_outside(figure, axes[0], columns=3)


def joint_stresses(scene):
    """Hoop stress around joint 2, where the ring opens on the outside."""
    model = ContinuumLining(scene.ring, columns=720, layers=6)
    stress = model.stress_field(falling_pressures(scene, 2).isel(time=[1])).isel(time=0)
    mesh = model.mesh
    nodes = mesh.element_nodes()[:4]
    corners = np.stack([mesh.node_radius * np.sin(mesh.node_angle), mesh.node_radius * np.cos(mesh.node_angle)], axis=1)
    with picture(IMAGES / "lining_models_stress.png", 7.4, 3.3) as figure:
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
            axis.set(xlim=middle[0] + [-0.8, 0.6], ylim=middle[1] + [-0.8, 0.8], aspect="equal")
            axis.set(title=title, xlabel="x [m]")
            figure.colorbar(patches, ax=axis)
        axes[0].set_ylabel("y from the axis [m]")


BLOCKS = {
    "differences": difference_table, "cost": cost, "errors": error_over_time, "open gate": open_gate,
    "details": joint_details,
}  # fmt: skip


def blocks():
    """Everything, in the order of the document."""
    scene = load_scene("case-3")
    joint_stresses(scene)
    return {name: measure(scene) for name, measure in BLOCKS.items()}
