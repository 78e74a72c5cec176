"""What a lining that floats or deforms in the soil computation changes, and what it costs: coarse case 3 to 100 kg/m.

    uv run python -m verification.reports.lining_in_mpm    # some two minutes; writes docs/lining-in-mpm.md and .json

The prose of the page is here, its numbers are measured.
"""

import json
import textwrap
import time as clock

import numpy as np
import xarray as xr

import coupling
import mpm
import structure
from coupling.datasets import cell_centres, cell_mean_weights
from coupling.files.provenance import root_attributes
from structure import theory
from structure.response import FORCES, PRESSURES
from verification.pages import DOCS, made_by, need_docs, provenance
from verification.problems import exact_rings

OTHER_K0 = 0.577  # 1 - sin(phi); the scenes have that of gravity loading
KINDS = ("fixed", "floating", "elastic")
PLACES = (("crown", 0.0), ("waist opposite", 270.0), ("invert", 180.0))
PUBLISHED = -267.0  # kN m at the invert before the gate opens: Xie, Zhang & Zhou, text to their Table 3
PUBLISHED_JOINTS = (-178.0, 147.0)  # joints 1 and 2, their Table 3
SPRINGS, SOFT = "in soil springs", "in springs of a tenth of the modulus"
LIFTED = "in soil springs, uplift not balanced"
LATE = (80.0, 100.0)  # kg/m: pressures of single records ring, so a mean over these
WARM_UP, ROUNDS, SECONDS = 60, 3, 1.5


def on_grid(part):
    """A lining's nodal values as cell means of one degree: dict of (360,) arrays."""
    weights = cell_mean_weights(part["theta"])
    return {name: weights @ part[name] for name in part if name not in ("theta", "arc")}


def mean_of(parts):
    """Mean of dicts of arrays."""
    return {name: np.mean([part[name] for part in parts], axis=0) for name in parts[0]}


def as_pressures(values):
    """Pressures on the grid as the dataset that lining models take, one time."""
    fields = {name: (("time", "theta"), values[name][None], {"units": "Pa", "long_name": name}) for name in PRESSURES}
    time = ("time", [0.0], {"units": "s"})
    return xr.Dataset(fields, {"time": time, "theta": ("theta", cell_centres(), {"units": "degree"})})


def forces_of(ring, values):
    """Response of a beam-spring ring: N, Q, M (360,) and the joints' M."""
    pressures = values if isinstance(values, xr.Dataset) else as_pressures(values)
    response = structure.BeamSpringLining(ring).respond(pressures).isel(time=0)
    result = {name: response[name].values for name in (*FORCES, "theta")}
    return result | {"joints": response["joint_bending_moment"].values if "joint" in response.dims else []}


def balanced(values):
    """Pressures of a ring alone: without resultant to the side and torque, by sin(theta) and a uniform shear."""
    a = np.radians(cell_centres())
    side = np.mean(-(values["soil_pressure"] + values["water_pressure"]) * np.sin(a) + values["soil_shear"] * np.cos(a))
    shear = values["soil_shear"] - values["soil_shear"].mean()
    return values | {"soil_pressure": values["soil_pressure"] + 2 * side * np.sin(a), "soil_shear": shear}


def extremes(forces):
    """Largest and smallest N, Q, M, M at crown and invert, in kN and kN m."""
    theta = np.asarray(forces.get("theta", cell_centres()))
    moment = forces["bending_moment"]

    def at(angle):
        return float(moment[np.argmin(np.abs((theta - angle + 180.0) % 360.0 - 180.0))]) / 1e3

    return {
        "N_max": float(forces["axial_force"].max()) / 1e3,
        "N_min": float(forces["axial_force"].min()) / 1e3,
        "Q_max": float(np.abs(forces["shear_force"]).max()) / 1e3,
        "M_max": float(moment.max()) / 1e3,
        "M_min": float(moment.min()) / 1e3,
        "M_crown": at(0.0),
        "M_invert": at(180.0),
    }


def event(scene, mesh):
    """Initial and late state on the grid, time of the inflow, and processor seconds of both stages."""
    begin = clock.process_time()
    simulation = mpm.Simulation(scene, mesh, threads=1)
    first = simulation.begin()
    relaxed = clock.process_time() - begin
    records = []
    while not simulation.done:
        records.append(simulation.advance())
    late = [on_grid(r.lining[0]) for r in records if LATE[0] <= r.inflow_mass <= LATE[1]]
    mass, time = ([getattr(r, name) for r in records] for name in ("inflow_mass", "time"))
    span = [t for m, t in zip(mass, time, strict=True) if LATE[0] <= m <= LATE[1]]
    return {
        "late_seconds": len(span) * scene.output.interval,
        "initial": on_grid(first.lining[0]),
        "late": mean_of(late),
        "time": float(np.interp(LATE[1], mass, time)),
        "relaxation_seconds": relaxed,
        "seconds": clock.process_time() - begin - relaxed,
        "steps": records[-1].steps,
        "balances": records[-1].balances,
        "returned": int(records[-1].clamp_counts["returned_to_mesh"]),
    }


def initial(scene, mesh):
    """The relaxed initial state on the grid, steps of the relaxation, and the solver."""
    solver = mpm.Solver(scene, mesh, threads=1)
    steps, residual = solver.relax()
    assert residual <= scene.numerics.relaxation_tolerance, residual
    return on_grid(solver.lining_pressures(1.0)[0]), steps, solver


def changed(scene, *, k0=None, **tunnel):
    """The scene with an elastic lining whose keys, or whose K0, are others; `initial_contact` is one of the scene."""
    contact = tunnel.pop("initial_contact", scene.initial_contact)
    soils = tuple(soil.model_copy(update={} if k0 is None else {"k0": k0}) for soil in scene.soils)
    tunnels = tuple(t.model_copy(update=tunnel) for t in scene.tunnels)
    return scene.model_copy(
        update={"lining": "elastic", "initial_contact": contact, "soils": soils, "tunnels": tunnels}
    )


def step_costs(scene, mesh):
    """Processor seconds of a step of each kind, in turns: what slows the machine slows all."""
    solvers, best = {}, dict.fromkeys(KINDS, float("inf"))
    for kind in KINDS:
        _, relaxation, solver = initial(scene.model_copy(update={"lining": kind}), mesh)
        solver.open_gate()
        for _ in range(WARM_UP):
            solver.step()
        solvers[kind] = solver, relaxation
    for _ in range(ROUNDS):
        for kind, (solver, _) in solvers.items():
            begin, count = clock.process_time(), 0
            while clock.process_time() - begin < SECONDS:
                solver.step()
                count += 1
            best[kind] = min(best[kind], (clock.process_time() - begin) / count)
    return {
        kind: {"seconds_a_step": best[kind], "relaxation_steps": solvers[kind][1], "points": solver.n_points}
        for kind, (solver, _) in solvers.items()
    }


def measure():
    """All numbers of the page."""
    scene = coupling.load_scene("quick", initial_contact="bonded", output={"interval": 0.01})
    ring = scene.ring
    mesh = mpm.build_mesh(scene)
    alone = ring.model_copy(update={"joint_angles": (), "ground": None, "support": "invert"})
    data = {"events": {}, "why": {}, "harmonics": {}, "theory": {}}
    for kind in KINDS:
        case = scene.model_copy(update={"lining": kind})
        states = event(case, mesh)
        row = {
            k: states[k]
            for k in ("time", "relaxation_seconds", "seconds", "steps", "balances", "returned", "late_seconds")
        }
        for when in ("initial", "late"):
            values = states[when]
            row[when] = {name: {p: float(values[name][int(a)]) for p, a in PLACES} for name in PRESSURES}
            response = forces_of(ring, values)
            row[when]["ring"] = extremes(response)
            row[when]["joints"] = [float(m) / 1e3 for m in response["joints"]]
            row[when]["alone"] = extremes(forces_of(alone, balanced(values)))
            if kind != "fixed":
                up = values["displacement_radial"]
                row[when]["rise"] = 1e3 * float(0.5 * (up[0] - up[180]))
                row[when]["ovalisation"] = 1e3 * float(up[90] + up[270] - up[0] - up[180]) / 4
            if kind == "elastic":
                row[when]["own"] = extremes(values)
        data["events"][kind] = row
    k0 = scene.soils[0].elastic_k0
    contacts = (
        ("bonded", {}),
        ("friction 0.2", {"initial_contact": "frictional"}),
        ("no friction", {"initial_contact": "frictional", "friction_coefficient": 0.0}),
    )
    for what, changes in (
        *((f"{how}, K0 = {k:.3f}", {"k0": k, **contact}) for k in (OTHER_K0, k0) for how, contact in contacts),
        (f"bonded, K0 = {k0:.3f}, ten times as stiff", {"lining_modulus": 34.5e10}),
        (f"bonded, K0 = {k0:.3f}, hundred times as stiff", {"lining_modulus": 34.5e11}),
    ):
        values, steps, _ = initial(changed(scene, **changes), mesh)
        data["why"][what] = extremes(values) | {"relaxation_steps": steps}
    for count in (2, 3, 4, 6, 8, 12, 16):
        values, _, _ = initial(changed(scene, lining_harmonics=count), mesh)
        data["harmonics"][count] = extremes(values)
    fine = coupling.load_scene("case-3", initial_contact="bonded")
    values, _, solver = initial(changed(fine, k0=OTHER_K0), mpm.build_mesh(fine))
    data["why"][f"bonded, K0 = {OTHER_K0:.3f}, mesh of case-3"] = extremes(values)
    soil, tunnel = scene.soils[0], scene.tunnels[0]
    for k in (OTHER_K0, k0):
        pressures = theory.theoretical_pressures(
            outer_diameter=tunnel.outer_diameter, cover=tunnel.cover, coefficient_at_rest=k,
            buoyant_unit_weight=(1 - soil.porosity) * (soil.grain_density - scene.water.density) * scene.gravity,
        )  # fmt: skip
        softer = ring.ground.model_copy(update={"youngs_modulus": 0.1 * ring.ground.youngs_modulus})
        for name, model in (
            (SPRINGS, ring),
            (SOFT, ring.model_copy(update={"ground": softer})),
            (LIFTED, ring.model_copy(update={"balance_uplift": False})),
            ("ring alone, no joints, no springs", alone),
        ):
            response = forces_of(model, pressures)
            joints = [float(m) / 1e3 for m in response["joints"]]
            data["theory"][f"K0 = {k:.3f}, {name}"] = extremes(response) | {"joints": joints}
    data["einstein_schwartz"] = closed_forms(scene, ring)
    phi = np.radians(scene.soils[0].friction_angle)
    data["active_coefficient"] = float((1 - np.sin(phi)) / (1 + np.sin(phi)))
    data["cost"] = step_costs(fine, solver.mesh)
    return data


def closed_forms(scene, ring):
    """Largest M of Einstein & Schwartz with the effective overburden at the axis, in kN m: K0 and slip."""
    soil, tunnel = scene.soils[0], scene.tunnels[0]
    nu = soil.poissons_ratio
    buoyant = (1 - soil.porosity) * (soil.grain_density - scene.water.density) * scene.gravity
    scale = buoyant * tunnel.axis_depth * ring.centre_radius**2 / 1e3
    stiff = soil.youngs_modulus / (1 - nu**2)
    f, c = stiff * ring.centre_radius**3 / ring.bending_stiffness, stiff * ring.centre_radius / ring.axial_stiffness
    return {
        f"K0 = {k:.3f}": {
            "bonded": scale * exact_rings.einstein_schwartz_no_slip_moment(k, nu, f, c),
            "full slip": scale * exact_rings.einstein_schwartz_full_slip_moment(k, nu, f),
        }
        for k in (OTHER_K0, soil.elastic_k0)
    }


def kilo(value):
    return f"{value / 1e3:.0f}"


def table(head, rows):
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(r) + " |" for r in rows), ""]


def force_row(name, e):
    return [name, *(f"{e[k]:.0f}" for k in ("N_max", "N_min", "Q_max", "M_max", "M_min", "M_crown", "M_invert"))]


JOINTS = ("joint 1", "joint 2", "joint 3")
HEAD = ("", "N max", "N min", "largest abs. Q", "M max", "M min", "M crown", "M invert")


def page(data):
    """The report."""
    events = data["events"]
    lines = [
        "# The lining in the soil computation: held, floating, elastic",
        "",
        f"{made_by('uv run python -m verification.reports.lining_in_mpm')}. Case 3",
        "on the coarse mesh of `quick`, to 100 kg/m. Pressures in kPa, forces in kN and moments in kN m per metre.",
        "",
        *WHAT,
    ]
    for when, title in (("initial", "Before the gate opens"), ("late", "While 80 to 100 kg/m have flowed in")):
        rows = []
        for kind in KINDS:
            now = events[kind][when]
            cells = [f"{kilo(now[name][p])}" for name in ("soil_pressure", "water_pressure") for p, _ in PLACES]
            motion = f"{now['rise']:.1f}, {now['ovalisation']:.1f}" if "rise" in now else "held"
            rows.append([kind, *cells, motion])
        lines += [f"## {title}", ""]
        names = [f"{phase} {p}" for phase in ("soil", "water") for p, _ in PLACES]
        lines += table(["lining", *names, "rise, ovalisation mm"], rows)
        rows = [force_row(f"{kind}: jointed ring in soil springs", events[kind][when]["ring"]) for kind in KINDS]
        rows += [force_row(f"{kind}: ring alone, no joints, no springs", events[kind][when]["alone"]) for kind in KINDS]
        rows.append(force_row("elastic: the ring's own", events["elastic"][when]["own"]))
        lines += table(HEAD, rows)
        joints = [[kind, *(f"{m:.0f}" for m in events[kind][when]["joints"])] for kind in KINDS]
        lines += table(["M of joints, ring in soil springs", *"123456"], joints)
    span = [events[kind]["late_seconds"] for kind in KINDS]
    lines += [
        f"The second state is a mean over only {1e3 * min(span):.0f} to {1e3 * max(span):.0f} ms: waves of the water",
        "are not gone from it, so differences of its water pressures are not the lining's doing alone.",
        "",
        *READING,
    ]
    why = [[what, *(f"{e[k]:.0f}" for k in ("M_max", "M_crown", "M_invert"))] for what, e in data["why"].items()]
    lines += [f"## Does it explain the published {PUBLISHED:.0f} kN m at the invert?", "", *answer(data)]
    lines += table(["elastic lining, initial state", "M max", "M crown", "M invert"], why)
    rows = [
        [what, *(f"{e[k]:.0f}" for k in ("M_max", "M_crown", "M_invert")), *(f"{m:.0f}" for m in e["joints"][:3])]
        for what, e in data["theory"].items()
    ]
    rows = [row + [""] * (7 - len(row)) for row in rows]
    lines += table(["theory loads on the beam-spring ring", "M max", "M crown", "M invert", *JOINTS], rows)
    rows = [[what, f"{e['bonded']:.0f}", f"{e['full slip']:.0f}"] for what, e in data["einstein_schwartz"].items()]
    lines += table(["Einstein & Schwartz (1979), largest M", "bonded", "full slip"], rows)
    lines += ["## How many harmonics", ""]
    rows = [[str(n), *(f"{e[k]:.1f}" for k in ("M_max", "M_crown", "M_invert"))] for n, e in data["harmonics"].items()]
    lines += table(["harmonics", "M max", "M crown", "M invert"], rows)
    lines += ["## What it costs", ""]
    cost = data["cost"]
    # a long step of a held lining holds steps of all levels, one of a moving lining a single step of all elements
    work = {kind: events[kind]["seconds"] / events[kind]["time"] for kind in KINDS}
    rows = [
        [
            kind,
            f"{1e3 * cost[kind]['seconds_a_step']:.2f}",
            f"{work[kind] / work['fixed']:.1f}",
            str(cost[kind]["relaxation_steps"]),
            f"{events[kind]['relaxation_seconds']:.1f}",
            f"{events[kind]['seconds']:.1f}",
            f"{events[kind]['time']:.3f}",
            f"{events[kind]['steps']}",
            str(events[kind]["returned"]),
        ]
        for kind in KINDS
    ]
    head = (
        "lining", "case 3: ms a long step", "quick: work a simulated s over fixed", "relaxation steps",
        "quick: relaxation s", "stepping s", "s to 100 kg/m", "steps", "points put back at walls",
    )  # fmt: skip
    lines += table(head, rows)
    return "\n".join(lines)


WHAT = (
    '**How.** `lining = "fixed"`, `"floating"` or `"elastic"` in a scene, or per tunnel in `[[tunnels]]`, with',
    "`lining_density`, `lining_modulus`, `lining_poissons_ratio` and `lining_harmonics`. A floating lining is",
    "rigid (x, y, rotation). An elastic one is a homogeneous ring in plane strain: Winkler's curved",
    "Euler-Bernoulli bar, radial and tangential displacement as Fourier series (`mpm/lining.py`). The mesh and",
    "its normals stay: displacements are millimetres, elements decimetres. Points at the wall move with it",
    "relative to the mesh; what would leave the mesh is put back and counted.",
    "",
    "**Together, not in turns.** A node of the wall carries more soil than concrete, so a ring advanced with the",
    "reactions of the last velocity is unstable (added mass). `mpm/wall.py` finds the ring's velocity at which",
    "the reactions of soil and water, both phases with drag, unilateral and with Coulomb friction, are those that",
    "move the ring: Newton's method on piecewise linear equations, one or two iterations a step, half steps where",
    "contacts flip. The ring's stiffness acts as the mass dt^2/4 K, so no frequency of it limits the time step or",
    "is damped. Momentum passes between ring and ground to round-off (`tests/physics/test_moving_lining.py`), with",
    "rings from 1 to 100 000 kg/m3.",
    "",
    "**Initial state: wished in place.** The ground has its K0 stress, the ring stands in it stress-free, then",
    "carries that stress, its weight and the water, drained (`mpm/stages.py`); so the tunnel rises and ovalises,",
    "and the ground takes part of the load. The source loads ground and ring by gravity together, which also lets",
    "them share it; its Fig. 7 shows theoretical pressures.",
    "",
)

READING = (
    "The jointed ring in soil springs that is loaded with the pressures of an elastic lining counts the ground's",
    "reaction twice: those pressures are what is left after the ring has given way. Its consistent forces are the",
    "ring's own, and they are the ones that a ring alone has under these pressures (uplift and weight balanced):",
    "that row is computed from the pressures by other code. They differ by Winkler's curved section, N t^2/(12 R)",
    "in the moment, and by shear deformation.",
    "",
)


def answer(data):
    """The verdict on the published moment."""
    here = {kind: data["events"][kind]["initial"]["ring"]["M_invert"] for kind in KINDS}
    elastic = [e["M_invert"] for what, e in data["why"].items() if "stiff" not in what]
    ten, hundred = (e["M_invert"] for what, e in data["why"].items() if "stiff" in what)
    # of the two K0 the last, with which theory loads meet the published joints
    plain, soft, lifted = (
        [e for what, e in data["theory"].items() if what.endswith(end)][-1] for end in (SPRINGS, SOFT, LIFTED)
    )
    text = (
        f"**No.** A floating lining takes the uplift out of the invert's pressure: the moment there goes from "
        f"{here['fixed']:.0f} to {here['floating']:.0f}, away from the published one. An elastic ring gives way until "
        f"the ground carries the difference: its own moment is {max(elastic):.0f} to {min(elastic):.0f}, whatever "
        f"slips and whichever K0 is taken, about what Einstein & Schwartz have for elastic ground (more where K0 is "
        f"near the active {data['active_coefficient']:.3f}: the ground yields). Only a ring too stiff to give way "
        f"comes near ({ten:.0f} with ten times the modulus, {hundred:.0f} with a hundred times)."
    )
    more = (
        f"Nor do the springs of the structural model explain it. Theory loads in springs of a tenth of the ground's "
        f"modulus reach {soft['M_invert']:.0f} at the invert, but then joints 1 and 2 carry "
        f"{soft['joints'][0]:.0f} and {soft['joints'][1]:.0f}, published {PUBLISHED_JOINTS[0]:.0f} and "
        f"{PUBLISHED_JOINTS[1]:.0f}, which the springs as stated meet ({plain['joints'][0]:.0f} and "
        f"{plain['joints'][1]:.0f}). A second harmonic makes crown and invert alike; the published invert exceeds the "
        f"crown's joint by half. Uplift left to the springs goes that way ({lifted['M_invert']:.0f} at the invert, "
        f"{lifted['M_crown']:.0f} at the crown), but covers only part of it. So the motion of the lining is not what "
        f"theory loads miss, and none of the loads tried here gives all of the published moments."
    )
    return (*textwrap.wrap(text, 130), "", *textwrap.wrap(more, 130), "")


def main():
    need_docs()
    data = measure()
    attributes, machine = root_attributes(coupling.load_scene("quick")), provenance()["machine"]
    data["provenance"] = {k: str(attributes[k]) for k in ("revision", "versions", "created")} | {"machine": machine}
    (DOCS / "lining-in-mpm.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    (DOCS / "lining-in-mpm.md").write_text(page(data), encoding="utf-8")
    print(f"written to {DOCS / 'lining-in-mpm.md'}")


if __name__ == "__main__":
    main()
