"""Pictures and tables of docs/ring.md: joint laws, an example of checks, errors of the beam-spring ring and its cost.

uv run python -m verification.reports ring [FOLDER]    # only the pictures, into a folder, when given
"""

import re
import time as clock
import tomllib
from pathlib import Path

import matplotlib
import numpy as np
import xarray as xr

from coupling.figures import GATE, INITIAL, NOW, RESOLUTION, SECOND
from coupling.figures.utilisations import checks
from coupling.scenes.scene import load_scene
from structure import BeamSpringLining, Limits, check
from structure.joint_laws import contact_moment, limited_shear
from verification.loads import falling_pressures
from verification.pages import DOCS, docs_page, picture, table
from verification.problems import exact_rings

BLOCKS = ("closed form", "cost")
STIFFNESS, HEIGHT, RECORDS = 5e8, 0.175, 1000  # N m/rad per metre, m
LINEAR = {"law": "linear", "two_way": True}
ALL = {"joint_contact_only": True, "joint_contact_height": 0.2, "joint_friction_coefficient": 0.12}
#: What is measured to changes of the ring of case 3 and of its ground.
CASES = {
    "linear joints, linear two-way ground": ({}, LINEAR),
    "linear joints, hyperbolic ground": ({}, {}),
    **{f"the same, {count} elements": ({"n_elements": count}, {}) for count in (180, 720, 1440)},
    "contact-only joints, hyperbolic ground": ({"joint_contact_only": True}, {}),
    "gaping joints, hyperbolic ground": ({"joint_contact_height": HEIGHT}, {}),
    "sliding joints, hyperbolic ground": ({"joint_friction_coefficient": 0.1}, {}),
    "all three, hyperbolic ground": (ALL, {}),
}


def case_ring(scene, changes, ground):
    """The ring of a scene with other numbers, its springs at the outer face."""
    soil = scene.ring.ground.model_copy(update={"slip_at": "outer_face"} | ground)
    return scene.ring.model_copy(update={"ground": soil} | changes)


def costs(scene, records):
    """CPU time, Newton steps and residual of every case, for so many records."""
    pressures = falling_pressures(scene, records, share=0.8)
    BeamSpringLining(case_ring(scene, {}, {})).respond(pressures.isel(time=slice(2)))  # what loads on first use
    for name, (changes, ground) in CASES.items():
        model, begin = BeamSpringLining(case_ring(scene, changes, ground)), clock.process_time()
        response = model.respond(pressures)
        spent, residual = clock.process_time() - begin, response["equilibrium_residual"].max().item()
        yield name, f"{spent:.2f}", sum(model.iterations), f"{residual:.1e}"


def closed_form_errors(scene):
    """Largest errors of N, Q, M and displacement under p cos(2 theta), over element count."""
    degrees = np.arange(0.0, 360.0, 0.1)
    load, zero = 6e4 * np.cos(2 * np.radians(degrees))[None], np.zeros((1, len(degrees)))
    fields = {"soil_pressure": load, "water_pressure": zero, "soil_shear": zero}
    pressures = xr.Dataset(
        {name: (("time", "theta"), values) for name, values in fields.items()}, {"time": [0.0], "theta": degrees}
    )
    plain = {"joint_angles": (), "concrete_unit_weight": 0.0, "ground": None, "support": "free"}
    for count in (24, 45, 90, 180, 360, 720, 1440):
        ring = scene.ring.model_copy(update=plain | {"n_elements": count})
        response = BeamSpringLining(ring).respond(pressures)
        on_centre_line, radius = 6e4 * ring.outer_radius / ring.centre_radius, ring.centre_radius
        exact = exact_rings.radial_cos2(on_centre_line, radius, np.radians(response["theta"].values))
        deflection = exact_rings.radial_cos2_displacement(
            on_centre_line, radius, ring.bending_stiffness, ring.axial_stiffness, ring.shear_stiffness
        )
        errors = [np.abs(response[name][0] - values).max() / np.abs(values).max() for name, values in
                  zip(exact._fields, exact, strict=True)]  # fmt: skip
        errors.append(abs(response["convergence_vertical"].item() / (-2 * deflection) - 1))
        yield count, *(f"{float(error):.1e}" for error in errors)


def joint_laws(path):
    """Moment over rotation for several axial forces, and shear over dislocation through one cycle."""
    with picture(path, 7.2, 3.1) as figure:
        left, right = figure.subplots(1, 2)
        rotation = np.linspace(0, 3e-3, 600)
        forces = np.array([0.3e6, 0.6e6, 0.9e6, 1.2e6, 1.5e6])
        for force, shade in zip(forces, np.linspace(0.35, 1.0, len(forces)), strict=True):
            moment = contact_moment(rotation, np.full_like(rotation, force), STIFFNESS, HEIGHT)[0]
            colour, end = matplotlib.colormaps["Blues"](shade), (3.0, moment[-1] / 1e3)
            left.plot(1e3 * rotation, moment / 1e3, color=colour)
            left.annotate(f"N = {force / 1e3:.0f}", end, (3, 0), textcoords="offset points", va="center", fontsize=7)
            left.axhline(force * HEIGHT / 2e3, color=colour, lw=0.6, ls=(0, (1, 2)))
        edge = forces * HEIGHT / 6
        left.plot(1e3 * edge / STIFFNESS, edge / 1e3, "o-", color=GATE, ms=3, lw=0.8, label="decompression, N h/6")
        left.plot([], [], color=INITIAL, lw=0.6, ls=(0, (1, 2)), label="on the edge, N h/2")
        left.set_title(f"gaping: k = {STIFFNESS / 1e6:.0f} MN m/rad per m, h = {HEIGHT} m, N in kN/m")
        left.set(xlabel="joint rotation [mrad]", ylabel="joint moment [kN m/m]", xlim=(0, 3.0), ylim=(0, 170))
        left.legend(loc="upper center", ncols=2)
        path = 1e-3 * np.concatenate([np.linspace(0, 4, 200), np.linspace(4, -4, 400), np.linspace(-4, 3, 350)])
        for friction, colour in ((0.1, NOW), (0.2, SECOND)):
            slip, shears = np.zeros(1), []
            for dislocation in path:
                shear, *_, slip = limited_shear(np.array([dislocation]), slip, np.array([1.2e6]), 8e7, friction)
                shears.append(shear[0] / 1e3)
            right.plot(1e3 * path, shears, color=colour, label=f"μ = {friction}")
        right.set_title("sliding: k = 80 MN/m per m, N = 1200 kN/m")
        right.set(xlabel="joint dislocation [mm]", ylabel="joint shear force [kN/m]")
        right.legend(loc="upper left")
        for axis in (left, right):
            axis.grid(True, color="0.9")
            axis.spines[["top", "right"]].set_visible(False)


def example_of_checks(scene, limits):
    """The checks of the ring with joints that gape whose pressures fall around the right waist."""
    ring = case_ring(scene, {"joint_normal_stiffness": 2e10, "joint_contact_height": HEIGHT}, {})
    pressures = falling_pressures(scene, 60, share=0.8)
    return checks(check(BeamSpringLining(ring).respond(pressures), limits))


def blocks(folder=None):
    """Everything, the example of limits being that of the page; no blocks where pictures go to a folder."""
    scene, images = load_scene("case-3"), Path(folder or DOCS / "images")
    (limits,) = re.findall(r'```toml title="limits.toml"\n(.*?)```', docs_page("ring").text, re.S)
    example = example_of_checks(scene, Limits.model_validate(tomllib.loads(limits)))
    example.savefig(images / "ring_checks.png", dpi=RESOLUTION)
    joint_laws(images / "joint_laws.png")
    return {} if folder is not None else {
        "closed form": table(("elements", "N", "Q", "M", "displacement"), closed_form_errors(scene)),
        "cost": table(("joints, ground", "CPU s", "Newton steps", "residual"), costs(scene, RECORDS)),
    }  # fmt: skip
