"""What a lining that floats or deforms in the soil computation changes, and what it costs: coarse case 3 to 100 kg/m.

uv run python -m verification.reports lining-in-mpm    # some two minutes; docs/lining-in-mpm.*
"""

import time as clock

import numpy as np
import xarray as xr

import coupling
import mpm
import structure
from coupling.datasets import MOTION, RING_FORCES, cell_centres, cell_mean_weights
from coupling.files.provenance import root_attributes
from structure.response import FORCES, PRESSURES
from verification.loads import theory_pressures
from verification.pages import DOCS, provenance, rendered, write_data
from verification.problems import exact_rings
from verification.speed.stepping import timed

BLOCKS = ("initial", "late", "why", "harmonics", "cost")
OTHER_K0 = 0.577  # 1 - sin(phi); the scenes have that of gravity loading
KINDS = ("fixed", "floating", "elastic", "jointed")
OWN_FORCES = ("elastic", "jointed")
PLACES = (("crown", 0.0), ("waist opposite", 270.0), ("invert", 180.0))
LATE = (80.0, 100.0)  # kg/m: pressures of single records ring, so a mean over these
ROUNDS, SECONDS = 3, 1.5


def on_grid(part):
    """A lining's nodal pressures as cell means of one degree, with its motion and forces: dict of (360,) arrays."""
    weights = cell_mean_weights(part["theta"])
    moved = {name: part[name] for name in part.keys() & {*MOTION, *RING_FORCES}}
    return {name: weights @ part[name] for name in PRESSURES} | moved


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
        return moment[np.argmin(np.abs((theta - angle + 180.0) % 360.0 - 180.0))]

    axial, shear = forces["axial_force"], forces["shear_force"]
    found = {
        "N_max": axial.max(), "N_min": axial.min(), "Q_max": np.abs(shear).max(), "M_max": moment.max(),
        "M_min": moment.min(), "M_crown": at(0.0), "M_invert": at(180.0),
    }  # fmt: skip
    return {name: float(value) / 1e3 for name, value in found.items()}


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
        "late": {name: np.mean([part[name] for part in late], axis=0) for name in late[0]},
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
    """Processor seconds per simulated one of each kind, in turns: what slows the machine slows all."""
    solvers, best = {}, dict.fromkeys(KINDS, float("inf"))
    for kind in KINDS:
        _, relaxation, solver = initial(scene.model_copy(update={"lining": kind}), mesh)
        solver.open_gate()
        timed(solver.step, SECONDS)  # compiles, and spreads the points
        solvers[kind] = solver, relaxation
    for _ in range(ROUNDS):
        for kind, (solver, _) in solvers.items():
            begin = solver.time
            _, used, _ = timed(solver.step, SECONDS)
            best[kind] = min(best[kind], used / (solver.time - begin))
    return {
        kind: {"seconds_a_second": best[kind], "relaxation_steps": relaxation, "points": solver.n_points}
        for kind, (solver, relaxation) in solvers.items()
    }


def of_event(kind, scene, mesh, ring, alone):
    """What an event with a lining of a kind came to."""
    states = event(scene.model_copy(update={"lining": kind}), mesh)
    row = {key: states[key] for key in states if key not in ("initial", "late")}
    for when in ("initial", "late"):
        values = states[when]
        now = row[when] = {name: {p: float(values[name][int(a)]) for p, a in PLACES} for name in PRESSURES}
        response = forces_of(ring, values)
        now["ring"], now["joints"] = extremes(response), [float(m) / 1e3 for m in response["joints"]]
        now["alone"] = extremes(forces_of(alone, balanced(values)))
        if kind != "fixed":
            up = values["displacement_radial"]
            now["rise"] = 1e3 * float(0.5 * (up[0] - up[180]))
            now["ovalisation"] = 1e3 * float(up[90] + up[270] - up[0] - up[180]) / 4
        if kind in OWN_FORCES:
            now["own"] = extremes(values)
    return row


def of_theory(scene, ring, alone):
    """What theory loads give on the ring, in springs and without."""
    softer, found = ring.ground.model_copy(update={"youngs_modulus": 0.1 * ring.ground.youngs_modulus}), {}
    models = {
        "in soil springs": ring, "in springs of a tenth of the modulus": ring.model_copy(update={"ground": softer}),
        "in soil springs, uplift not balanced": ring.model_copy(update={"balance_uplift": False}),
        "ring alone, no joints, no springs": alone,
    }  # fmt: skip
    for k0 in (OTHER_K0, scene.soils[0].elastic_k0):
        for name, model in models.items():
            response = forces_of(model, theory_pressures(scene, k0))
            joints = [float(m) / 1e3 for m in response["joints"]]
            found[f"K0 = {k0:.3f}, {name}"] = extremes(response) | {"joints": joints}
    return found


def of_elastic(scene, mesh):
    """Initial states of an elastic lining by contact, K0 and stiffness."""
    k0, found, rough = scene.soils[0].elastic_k0, {}, {"initial_contact": "frictional"}
    smooth = rough | {"friction_coefficient": 0.0}
    contacts = {"bonded": {}, "friction 0.2": rough, "no friction": smooth}
    cases = {f"{how}, K0 = {k:.3f}": {"k0": k, **c} for k in (OTHER_K0, k0) for how, c in contacts.items()}
    for often, modulus in (("ten", 34.5e10), ("hundred", 34.5e11)):
        cases[f"bonded, K0 = {k0:.3f}, {often} times as stiff"] = {"lining_modulus": modulus}
    for what, changes in cases.items():
        values, steps, _ = initial(changed(scene, **changes), mesh)
        found[what] = extremes(values) | {"relaxation_steps": steps}
    return found


def measure():
    """All numbers of the page."""
    scene = coupling.load_scene("quick", initial_contact="bonded", output={"interval": 0.01})
    fine = coupling.load_scene("case-3", initial_contact="bonded")
    mesh, ring = mpm.build_mesh(scene), scene.ring
    alone = ring.model_copy(update={"joint_angles": (), "ground": None, "support": "invert"})
    data = {"events": {kind: of_event(kind, scene, mesh, ring, alone) for kind in KINDS}}
    data["why"], data["harmonics"] = of_elastic(scene, mesh), {}
    for count in (2, 3, 4, 6, 8, 12, 16):
        values, _, _ = initial(changed(scene, lining_harmonics=count), mesh)
        data["harmonics"][count] = extremes(values)
    values, _, solver = initial(changed(fine, k0=OTHER_K0), mpm.build_mesh(fine))
    data["why"][f"bonded, K0 = {OTHER_K0:.3f}, mesh of case-3"] = extremes(values)
    data["theory"], data["einstein_schwartz"] = of_theory(scene, ring, alone), closed_forms(scene, ring)
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


def blocks():
    """Everything, and docs/lining-in-mpm.json."""
    data = measure()
    attributes, machine = root_attributes(coupling.load_scene("quick")), provenance()["machine"]
    data["provenance"] = {k: str(attributes[k]) for k in ("revision", "versions", "created")} | {"machine": machine}
    write_data(DOCS / "lining-in-mpm.json", data)
    return rendered("lining-in-mpm", **data)
