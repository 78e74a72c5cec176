"""Small scenes that extremes are tried on: a block in a closed box, a lump that flies, a coarse tunnel with a gate."""

import math

import numpy as np

from mpm.k0_procedure import initial_stress
from mpm.mesh.build import build_mesh
from mpm.scene import Scene
from mpm.solver import Solver
from verification.boxes import (
    STRESS,
    box_mesh,
    box_scene,
    box_tables,
    clear_stress,
    place,
    put,
    set_porosity,
    state,
)
from verification.monitor import Monitor, follow

REST = 0.01  # [m/s]: ground that has moved for a second at this speed has not moved by an element

SOIL = {
    "model": "mohr-coulomb", "youngs_modulus": 4e7, "poissons_ratio": 0.3, "cohesion": 0.0, "friction_angle": 25.0,
    "dilatancy_angle": 0.0, "tensile_strength": 0.0, "porosity": 0.45, "loose_porosity": 0.55, "grain_density": 2650.0,
    "hydraulic_conductivity": 1e-4, "k0": 0.577,
}  # fmt: skip


def block_scene(size, **settings):
    """Scene of a box of 12 by 8 cells of the given size [m]; settings as of `verification.boxes.box_scene`."""
    return box_scene("soil", size, 12 * size, 8 * size, **SOIL | {"bulk_modulus": 8e7} | settings)


def box_of(size, left, right, bottom, top):
    """Closed box of 12 by 8 cells, ground surface y = 0; filled between the given lines, in cells from lower left."""

    def filled(cx, cy):
        column, row = cx / size, cy / size + 8
        return (column > left) & (column < right) & (row > bottom) & (row < top)

    return box_mesh(np.arange(13) * size, (np.arange(9) - 8) * size, filled)


def block(size, settings, left=0, right=6, bottom=0, top=6):
    """A solver of such a box."""
    return Solver(block_scene(size, **settings), box_of(size, left, right, bottom, top), threads=1)


def collapse(size=0.1, seconds=0.5, positions="layout", **settings):
    """A block, six cells wide and high, with K0 and hydrostatic stress, loses its support on one side."""
    solver = block(size, settings)
    _unload(solver, 2 * size)  # the surface of the block lies below that of the scene: stresses as from its own
    place(solver, positions, seed=1)
    monitor = Monitor(solver)
    faults, measures = follow(monitor, seconds)
    if solver.scene.gravity == 0.0 and monitor.most_speed > 0.0:
        faults.append(f"moves at {monitor.most_speed:.2g} m/s without any load")
    return faults, measures


def slurry(size=0.1, seconds=0.5, **settings):
    """The same block with its grains apart (porosity 0.7): a heavy liquid."""
    solver = block(size, settings)
    _unload(solver, 2 * size)
    set_porosity(solver, 0.7)
    put(solver, **dict.fromkeys(STRESS, 0.0))
    return follow(Monitor(solver), seconds)


def jet(size=0.1, speed=30.0, seconds=0.3, **settings):
    """A lump of three by three cells flies at a wall, nine cells away."""
    solver = block(size, settings, right=3, bottom=3)
    clear_stress(solver)
    put(solver, velocity_solid_x=speed)
    if solver.scene.water is not None:
        put(solver, velocity_liquid_x=speed)
    return follow(Monitor(solver), seconds)


def one_point(size=0.1, seconds=2.0, **settings):
    """One point in an otherwise empty box: it falls, lands and lies still."""
    scene, mesh = block_scene(size, points=1, **settings), box_of(size, 5, 6, 4, 5)
    mesh.region[np.flatnonzero(mesh.region == 0)[1:]] = 3
    solver = Solver(scene, mesh, threads=1)
    clear_stress(solver)
    heights, monitor = [state(solver, "y")[0]], Monitor(solver)
    looks = [(t, lambda: heights.append(state(solver, "y")[0])) for t in np.linspace(0, seconds, 200, endpoint=False)]
    faults, measures = follow(monitor, seconds, events=looks)
    fallen = float(heights[0] - min(heights))
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
    modulus = bulk_modulus if water else None
    return Scene.model_validate(box_tables(
        "soil", 0.45 * diameter, 5 * diameter, (cover + 2.5) * diameter, gravity,
        **SOIL | {"bulk_modulus": modulus, "drainage": drainage} | soil,
    ) | {
        "interior": interior,
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
    last = math.sqrt(2 * monitor.kinetic / float(np.sum(state(solver, "grain_mass"))))
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
    vertical, pressure = initial_stress(solver.scene, np.maximum(-state(solver, "y") - depth, 0.0))
    lateral = -solver.scene.soils[0].lateral_pressure_coefficient(vertical) * vertical
    put(solver, pore_pressure=pressure, stress_yy=-vertical, stress_xx=lateral, stress_zz=lateral)
