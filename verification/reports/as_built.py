"""Numbers and pictures of docs/rings-as-built.md: joints in contact, extreme rings, what each detail changes.

uv run python -m verification.reports rings-as-built    # ten minutes; writes into docs/rings-as-built.md
"""

import time as clock
from unittest.mock import patch

import numpy as np
import xarray as xr

from coupling.scenes.scene import load_scene
from structure import BeamSpringLining, Bolts, ContinuumLining, LiningFailure, Neighbour, Ring, joint_laws
from verification.loads import falling_pressures
from verification.pages import DOCS, picture, table
from verification.reports.lining_models import changes
from verification.robustness.random_rings import extreme_ring, growing_load

IMAGES = DOCS / "images"
HEIGHT = 0.3  # of contact in the joints [m]
FACE = {"joint_contact": "face", "joint_contact_height": HEIGHT}
SECTION = {"joint_contact_only": True, "joint_contact_height": HEIGHT}
COMPARED = {
    "N": "axial_force", "M": "bending_moment", "opening": "joint_opening", "dislocation": "joint_dislocation",
    "rotation": "joint_rotation",
}  # fmt: skip


def case_3(**values):
    """The ring of case 3 with other joints; faces turn as stiffly as they press."""
    given = load_scene("case-3").ring.model_dump()
    if values.get("joint_contact") == "face":
        del given["joint_rotational_stiffness"]
    return Ring(**(given | values))


def answers(ring, loads, columns=180):
    """Of both models to every load that both carry, along `load`, and how many they refuse."""
    models, found, refused = (BeamSpringLining(ring), ContinuumLining(ring, columns=columns)), [], 0
    for load in loads:
        try:
            found.append([model.respond(load) for model in models])
        except LiningFailure:
            refused += 1
    return [xr.concat(each, "load") for each in zip(*found, strict=True)], refused


def apart(pair):
    """Largest difference of the models over the largest value, in per cent, as texts."""
    return [
        f"{100 * float(np.abs(pair[0][name] - pair[1][name]).max() / np.abs(pair[0][name]).max()):.2f}"
        for name in COMPARED.values()
    ]


def shares(response, friction):
    """Per cent of the joints that gape and that slide under the whole of the loads, as texts."""
    whole = response.isel(time=-1)
    axial, moment, shear = (np.abs(whole[f"joint_{name}"]) for name in ("axial_force", "bending_moment", "shear_force"))
    gaping, sliding = moment > axial * HEIGHT / 6, shear > (1 - 1e-9) * friction * axial
    return [f"{100 * float(each.mean()):.0f}" for each in (gaping, sliding)]


def fifty_loads():
    """Both models under random loads, contact by section and by face."""
    rows = []
    for label, laws in {"section": SECTION, "face": FACE | {"joint_normal_stiffness": 1e10}}.items():
        for friction in (0.1, 0.06):
            rng = np.random.default_rng(0)
            pair, refused = answers(
                case_3(**laws, joint_friction_coefficient=friction), [growing_load(rng) for _ in range(50)]
            )
            rows.append((label, friction, *shares(pair[1], friction), refused, *apart(pair)))
    head = ("joint_contact", "friction", "gape [%]", "slide [%]", "refused", *(f"{name} [%]" for name in COMPARED))
    return table(head, rows)


def stiff_faces():
    """Both models under ten loads with faces of other stiffness: what the concrete beside a joint adds."""
    rows = []
    for stiffness in (6e8, 1e10, 3.4e10, 1e12):
        rng = np.random.default_rng(0)
        ring = case_3(**FACE, joint_normal_stiffness=stiffness, joint_friction_coefficient=0.1)
        pair, _ = answers(ring, [growing_load(rng) for _ in range(10)])
        rows.append((f"{stiffness:.1e}", *apart(pair)))
    return table(("k_n [N/m2]", *(f"{name} [%]" for name in COMPARED)), rows)


def points_of_a_face():
    """Error of the beams' joints against run time, over the points of a face."""
    ring = case_3(**FACE, joint_normal_stiffness=1e10, joint_friction_coefficient=0.1)

    def measure(count):
        rng = np.random.default_rng(0)
        loads = [growing_load(rng) for _ in range(10)]
        with patch.object(joint_laws, "FACE_POINTS", count):
            begin, model = clock.process_time(), BeamSpringLining(ring)
            response = xr.concat([model.respond(load) for load in loads], "load")
        return response, clock.process_time() - begin

    truth, rows = measure(640)[0], []
    for count in (5, 10, 20, 40, 80, 160):
        response, seconds = measure(count)
        rows.append((count, f"{seconds:.2f}", *apart((truth, response))))
    return table(("points", "CPU time for 30 times [s]", *(f"{name} [%]" for name in COMPARED)), rows)


DETAILS = {
    "bolts 200 MN/m, hand-tight": {"joint_bolts": Bolts(offset=-0.05, length=0.4, stiffness=2e8)},
    "bolts 200 MN/m, tightened to 1 MN/m": {"joint_bolts": Bolts(offset=-0.05, length=0.4, stiffness=2e8, preload=1e6)},
    "contact by section": SECTION | {"joint_friction_coefficient": 0.5},
    "joint 2 ten times softer": {"joint_rotational_stiffness": (5e8, 5e7, 5e8, 5e8, 5e8, 5e8)},
    "key at the crown, faces lean 6 degrees": {
        "joint_inclinations": (-6.0, 0.0, 0.0, 0.0, 0.0, 6.0), "joint_friction_coefficient": 0.5,
    },
    "staggered by 32.5 degrees, 100 MN/m per m": {
        "neighbour": Neighbour(rotation=32.5, ring_width=1.2, radial_stiffness=1e8, tangential_stiffness=1e8)
    },
    "staggered by 32.5 degrees, 1 GN/m per m": {
        "neighbour": Neighbour(rotation=32.5, ring_width=1.2, radial_stiffness=1e9, tangential_stiffness=1e9)
    },
}  # fmt: skip


def what_details_change():
    """Changes of the plain ring of case 3 at the end of falling pressures, by both models."""
    loads, rows = falling_pressures(load_scene("case-3"), 11), []
    for name, model in (("beam-spring", BeamSpringLining), ("continuum", ContinuumLining)):
        plain = model(case_3()).respond(loads).isel(time=-1)
        for label, values in DETAILS.items():
            rows.append((label, name, *changes(plain, model(case_3(**values)).respond(loads).isel(time=-1))))
    rows.sort(key=lambda row: list(DETAILS).index(row[0]))
    return table(("ring", "model", "N", "Q", "M", "radial displacement", "joint rotation"), rows)


def extreme_rings():
    """64 rings of extreme joints by both models."""
    rng, counts, worst = np.random.default_rng(0), {}, 0.0
    ground, loads = load_scene("case-3").ring.ground, falling_pressures(load_scene("case-3"), 4)
    begin = clock.process_time()
    for _ in range(64):
        ring = extreme_ring(rng, ground)
        pair = [_answer(model, ring, loads) for model in (BeamSpringLining, _coarse)]
        verdicts = tuple("refused" if isinstance(answer, str) else "solved" for answer in pair)
        counts[verdicts] = counts.get(verdicts, 0) + 1
        worst = max([worst, *(answer for answer in pair if not isinstance(answer, str))])
    rows = [(*verdicts, count) for verdicts, count in sorted(counts.items(), reverse=True)]
    return [
        *table(("beam-spring", "continuum", "rings"), rows), "",
        f"Largest equilibrium residual {worst:.1e} of the loads; {clock.process_time() - begin:.0f} CPU s in all.",
    ]  # fmt: skip


def _answer(model, ring, loads):
    """Largest residual of all times, or the reason of a refusal."""
    try:
        return float(model(ring).respond(loads)["equilibrium_residual"].max())
    except LiningFailure as failure:
        return str(failure)


def _coarse(ring):
    return ContinuumLining(ring, columns=60)


def draw():
    """Moments of a staggered ring and its neighbour, and the pressure between the faces of a joint."""
    loads = falling_pressures(load_scene("case-3"), 11)
    last = loads.isel(time=[-1])
    pair = BeamSpringLining(case_3(**DETAILS["staggered by 32.5 degrees, 1 GN/m per m"])).respond(loads).isel(time=-1)
    alone = BeamSpringLining(case_3()).respond(loads).isel(time=-1)
    ring = case_3(**FACE, joint_normal_stiffness=1e10)
    with picture(IMAGES / "rings_as_built.png", 7.4, 3.1) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(2, 1))
        left.plot(alone["theta"], alone["bending_moment"] / 1e3, color="0.6", label="the ring alone")
        left.plot(pair["theta"], pair["bending_moment"] / 1e3, color="#0b5394", label="between turned rings")
        left.plot(pair["theta"], pair["neighbour_bending_moment"] / 1e3, color="#d98200", label="the ring beside")
        for angle in ring.joint_angles:
            left.axvline(angle, color="0.8", lw=0.7, zorder=0)
        left.set(xlabel="angle from the crown [degrees]", ylabel="M [kN m/m]", xlim=(0, 360), xticks=range(0, 361, 60))
        left.legend(fontsize=7)
        for label, model, colour in (
            ("beam-spring", BeamSpringLining(ring), "0.6"), ("continuum", ContinuumLining(ring), "#c1272d"),
        ):  # fmt: skip
            field = model.contact_field(last).isel(time=0)
            here = field["joint"] == 2
            right.plot(field["contact_pressure"][here] / 1e6, 1e3 * field["lever"][here], color=colour, label=label)
        right.set(xlabel="pressure in joint 2 [MPa]", ylabel="outward from the centre line [mm]")
        right.legend(fontsize=7)


BLOCKS = {
    "fifty loads": fifty_loads, "stiff faces": stiff_faces, "points": points_of_a_face,
    "details": what_details_change, "extreme rings": extreme_rings,
}  # fmt: skip


def blocks():
    """Everything, in the order of the document."""
    draw()
    return {name: measure() for name, measure in BLOCKS.items()}
