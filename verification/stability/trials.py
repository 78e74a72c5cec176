"""Small scenes that extremes are tried on: a block in a closed box, a lump that flies, a coarse tunnel with a gate."""

import math

import numpy as np

from mpm.fields import block
from mpm.meshing import build_mesh
from mpm.scene import Scene
from mpm.solver import Solver
from verification.problems.boxes import box_mesh
from verification.stability.extremes import follow
from verification.stability.monitor import Monitor

REST = 0.01  # [m/s]: ground that has moved for a second at this speed has not moved by an element

SOIL = {
    "name": "soil", "top_depth": 0.0, "model": "mohr-coulomb", "youngs_modulus": 4e7, "poissons_ratio": 0.3,
    "cohesion": 0.0, "friction_angle": 25.0, "dilatancy_angle": 0.0, "tensile_strength": 0.0, "porosity": 0.45,
    "loose_porosity": 0.55, "grain_density": 2650.0, "hydraulic_conductivity": 1e-4, "k0": 0.577,
}  # fmt: skip
NUMERICS = ("courant", "pic_rate", "pressure_filter", "stress_damping")


def box_scene(size, bulk_modulus=8e7, gravity=9.81, table_depth=0.0, points=3, drainage="two-phase", **settings):
    """Scene of a box of 12 by 8 cells of the given size [m]; other settings go to the soil or to [numerics]."""
    numerics = {k: settings.pop(k) for k in NUMERICS if k in settings}
    sizes = {f"element_size{part}": size for part in ("", "_lining", "_interior")}
    water = {"table_depth": table_depth, "density": 1000.0, "bulk_modulus": bulk_modulus, "drainage": drainage}
    return Scene.model_validate({
        "name": "box",
        "gravity": gravity,
        "box": {"width": 12 * size, "depth": 8 * size},
        "water": None if bulk_modulus is None else water,
        "soils": [SOIL | settings],
        "discretisation": {**sizes, "gate_radius": size, "points_per_element": points},
        "numerics": numerics,
        "stop": {"time": 1.0},
        "output": {"interval": 1.0},
    })  # fmt: skip


def box_of(size, left, right, bottom, top):
    """Closed box of 12 by 8 cells, ground surface y = 0; filled between the given lines, in cells from lower left."""
    x, y = np.arange(13) * size, (np.arange(9) - 8) * size

    def inside(cx, cy):
        column, row = cx / size, cy / size + 8
        return (column > left) & (column < right) & (row > bottom) & (row < top)

    return box_mesh(x, y, inside)


def collapse(size=0.1, seconds=0.5, positions="layout", **settings):
    """A block, six cells wide and high, with K0 and hydrostatic stress, loses its support on one side."""
    scene = box_scene(size, **settings)
    solver = Solver(scene, box_of(size, 0, 6, 0, 6), threads=1)
    top = 2 * size  # the surface of the block lies below that of the scene: stresses as from its own
    _unload(solver, top)
    if positions != "layout":
        _place(solver, positions)
    monitor = Monitor(solver)
    faults, measures = follow(monitor, seconds)
    if scene.gravity == 0.0 and monitor.most_speed > 0.0:
        faults.append(f"moves at {monitor.most_speed:.2g} m/s without any load")
    return faults, measures


def slurry(size=0.1, seconds=0.5, **settings):
    """The same block with its grains apart (porosity 0.7): a heavy liquid."""
    scene = box_scene(size, **settings)
    solver = Solver(scene, box_of(size, 0, 6, 0, 6), threads=1)
    _unload(solver, 2 * size)
    solver.points["grain_mass"] *= (1 - 0.7) / (1 - solver.points["porosity"])
    solver.points["porosity"] = 0.7
    solver.points[["stress_xx", "stress_yy", "stress_zz", "stress_xy"]] = 0.0
    return follow(Monitor(solver), seconds)


def jet(size=0.1, speed=30.0, seconds=0.3, **settings):
    """A lump of three by three cells flies at a wall, nine cells away."""
    scene = box_scene(size, **settings)
    solver = Solver(scene, box_of(size, 0, 3, 3, 6), threads=1)
    _free(solver)
    solver.points["velocity_solid_x"] = speed
    if scene.water is not None:
        solver.points["velocity_liquid_x"] = speed
    return follow(Monitor(solver), seconds)


def one_point(size=0.1, seconds=2.0, **settings):
    """One point in an otherwise empty box: it falls, lands and lies still."""
    scene = box_scene(size, points=1, **settings)
    mesh = box_of(size, 5, 6, 4, 5)
    mesh.region[np.flatnonzero(mesh.region == 0)[1:]] = 3
    solver = Solver(scene, mesh, threads=1)
    _free(solver)
    start = float(solver.points["y"][0])
    monitor = Monitor(solver)
    lowest = [start]

    def look():
        lowest.append(float(solver.points["y"][0]))

    looks = [(t, look) for t in np.linspace(0, seconds, 200, endpoint=False)]
    faults, measures = follow(monitor, seconds, events=looks)
    fallen = start - min(lowest)
    if fallen < 3 * size:
        faults.append(f"fell {fallen:.3g} m of {4 * size:.3g} m")
    landing = math.sqrt(2 * scene.gravity * 4 * size)
    if monitor.most_speed > 1.1 * landing:
        faults.append(f"reached {monitor.most_speed:.3g} m/s, free fall gives {landing:.3g} m/s")
    return faults, measures | {"fallen": fallen}


def coarse_tunnel(
    diameter=6.6, cover=1.0, width=0.2, angle=90.0, water=True, gravity=9.81, bulk_modulus=8e7, interior="resolved",
    drainage="two-phase", **soil,
):  # fmt: skip
    """Scene of one tunnel with a gate on the coarsest mesh that makes sense; `cover` in diameters."""
    box_width, depth = 5 * diameter, (cover + 2.5) * diameter
    pore_water = {"table_depth": 0.0, "density": 1000.0, "bulk_modulus": bulk_modulus, "drainage": drainage}
    return Scene.model_validate({
        "name": "tunnel",
        "gravity": gravity,
        "interior": interior,
        "box": {"width": box_width, "depth": depth},
        "water": pore_water if water else None,
        "soils": [SOIL | soil],
        "tunnels": [{
            "x": 0.0, "cover": cover * diameter, "outer_diameter": diameter, "inner_diameter": 0.9 * diameter,
            "friction_coefficient": 0.2,
        }],
        "gate": {"angle": angle, "width": width},
        "discretisation": {
            "element_size": 0.45 * diameter, "element_size_lining": 0.12 * diameter,
            "element_size_interior": 0.08 * diameter, "elements_across_gate": 2, "gate_radius": 0.1 * diameter,
            "size_growth": 0.3,
        },
        "stop": {"time": 1.0},
        "output": {"interval": 1.0},
    })  # fmt: skip


def gate(seconds=0.3, close_at=None, reopen_at=None, **settings):
    """Open the gate of the coarse tunnel, perhaps close and reopen it."""
    scene = coarse_tunnel(**settings)
    solver = Solver(scene, build_mesh(scene), threads=1)
    steps, residual = solver.relax()
    if residual > scene.numerics.relaxation_tolerance:
        return [f"the initial state did not settle: residual {residual:.2g} after {steps} steps"], {}
    solver.open_gate()
    monitor = Monitor(solver)
    events = [(time, call) for time, call in ((close_at, solver.close_gate), (reopen_at, solver.open_gate)) if time]
    faults, measures = follow(monitor, seconds, events=events)
    return faults + _inflow_faults(monitor, close_at, reopen_at), measures


def filled_tunnel(seconds=0.3, **settings):
    """Soil everywhere, inside the tunnel too, with isotropic stress of level ground: the open gate changes nothing."""
    scene = coarse_tunnel(k0=1.0, **settings)  # any other stress slips along the lining's friction
    mesh = build_mesh(scene)
    mesh.region[mesh.nodes[mesh.elements].mean(axis=1)[:, 1] < 0.0] = 0  # all but what lies above the ground
    solver = Solver(scene, mesh, threads=1)
    solver.open_gate()
    monitor = Monitor(solver)
    faults, measures = follow(monitor, seconds)
    moved = measures["inflow_mass"] / monitor.inflow[0]
    if abs(moved) > 1e-3:
        faults.append(f"{moved:.2%} of the content came in through the gate of a full tunnel")
    # the wall bears the corners of the gate in one direction only, so they give way at first
    last = math.sqrt(2 * monitor.kinetic / float(np.sum(solver.points["grain_mass"])))
    if last > REST:
        faults.append(f"does not come to rest: {last:.2g} m/s")
    return faults, measures | {"last_speed": last}


def _inflow_faults(monitor, close_at, reopen_at):
    """Inflow that goes backwards, or is faster than free discharge under the whole head through the gate."""
    scene, faults = monitor.solver.scene, []
    time, mass = np.array(monitor.times), np.array(monitor.inflow)
    tunnel, soil = scene.tunnels[0], scene.soils[0]
    head = tunnel.axis_depth - tunnel.outer_radius * math.cos(math.radians(scene.gate.angle))
    density = (1 - soil.porosity) * soil.grain_density
    total = density + soil.porosity * (scene.water.density if scene.water else 0.0)
    light = scene.water.density if scene.water else soil.grain_density
    speed = math.sqrt(2 * scene.gravity * head * total / light)
    most = density * scene.gate.width * speed * time[-1]
    if mass[-1] > most:
        faults.append(f"inflow {mass[-1]:.4g} kg/m, free discharge under the total head gives {most:.4g} kg/m")
    if mass[-1] < 0.0:
        faults.append("negative inflow")
    if close_at is not None:
        shut = (time > close_at + 0.02) & (time < (reopen_at or math.inf))
        late = np.ptp(mass[shut]) if shut.any() else 0.0
        in_channel = density * scene.gate.width * (tunnel.outer_radius - tunnel.inner_radius)
        if late > in_channel:
            faults.append(f"{late:.3g} kg/m came in through a closed gate, its channel holds {in_channel:.3g} kg/m")
    return faults


def _unload(solver, depth):
    """Move the initial stress down by `depth` [m]: that of a surface at y = -depth."""
    from mpm.points import initial_stress

    below = np.maximum(-solver.points["y"] - depth, 0.0)
    vertical, pressure = initial_stress(solver.scene, below)
    solver.points["pore_pressure"] = pressure
    solver.points["stress_yy"] = -vertical
    solver.points["stress_xx"] = solver.points["stress_zz"] = (
        -solver.scene.soils[0].lateral_pressure_coefficient(vertical) * vertical
    )


def _free(solver):
    """No stress at all."""
    solver.points[["stress_xx", "stress_yy", "stress_zz", "stress_xy", "pore_pressure"]] = 0.0


def _place(solver, positions):
    """Put every point exactly on a vertex or an edge of its element, or anywhere in it."""
    rng = np.random.default_rng(1)
    count = len(solver.points)
    weight = rng.dirichlet([1.0, 1.0, 1.0], count)
    k = rng.integers(3, size=count)
    if positions == "edges":
        weight[np.arange(count), k] = 0.0
        weight /= weight.sum(axis=1)[:, None]
    elif positions == "vertices":
        weight = np.eye(3)[k]
    corners = solver.mesh.nodes[solver.mesh.elements[solver.element_of_point]]
    block(solver.points, "x", "y")[:] = np.einsum("pk,pkd->pd", weight, corners)
