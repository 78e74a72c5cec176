"""What a run file holds: its groups, its variables with units and meaning."""

import re

from mpm.fields import CLAMPS, POINT
from structure.response import BOLT_FORCE, COORDINATES, RESPONSE

AXES = {"time": "T", "x": "X", "y": "Y"}
INFLOW = "inflow_mass"  # a coordinate along time, beside the time itself
DT_LIMITS = ("acoustic", "advective", "output", "other")
#: Variables on (time, [tunnel,] theta): name to (units, long_name). Interval means, resampled conservatively.
PRESSURES = {
    "soil_pressure": ("Pa", "effective soil pressure on the lining, compression positive"),
    "water_pressure": ("Pa", "water pressure on the lining, compression positive"),
    "soil_shear": ("Pa", "shear traction of the soil on the lining, clockwise positive"),
    "soil_pressure_std": ("Pa", "standard deviation of the soil pressure within the output interval"),
    "water_pressure_std": ("Pa", "standard deviation of the water pressure within the output interval"),
}
#: For linings that move in the soil computation: at the end of the interval and at theta, since the undisturbed ground.
MOTION = {
    "displacement_radial": ("m", "displacement of the lining's outer face, outward positive"),
    "displacement_tangential": ("m", "displacement of the lining's outer face, clockwise positive"),
}
#: And for those that deform: the ring's own forces, per metre of tunnel.
RING_FORCES = {
    "axial_force": ("N/m", "axial force of the lining that deforms, compression positive"),
    "shear_force": ("N/m", "shear force of the lining that deforms, -dM/ds"),
    "bending_moment": ("N m/m", "bending moment of the lining that deforms, tension on the outer face positive"),
}
#: Of jointed ones, on (time, [tunnel,] joint).
JOINT_STATES = {name: meaning for name, (axes, *meaning) in RESPONSE.items() if axes == ("time", "joint")}
#: And of their bolts, where there are any.
BOLT_STATES = {"joint_bolt_force": tuple(BOLT_FORCE.values())}
JOINTS = {name: COORDINATES[name] for name in ("joint", "joint_angle")}
#: Variables on (time,) that `/lining` repeats from `/history`, so that pressures can be compared at equal inflow.
PROGRESS = {
    "inflow_mass": ("kg/m", "grains inside the tunnel, per metre of tunnel"),
    "flow_zone_area": ("m^2", "area of soil displaced by more than 50 mm"),
    "disturbed_area": ("m^2", "area of soil displaced by 10 to 50 mm"),
}
#: Errors, largest so far: see :func:`mpm.errors.errors`.
ERRORS = {
    "water_lost": ("1", "water lost or made, over the water that came through the gate"),
    "momentum_error": (
        "1",
        "departure of the points' momentum from what the nodes received, over that of the flow zone",
    ),
    "energy_error": ("1", "kinetic energy that transfers took or gave, over that of the flow zone"),
    "overlap": ("1", "share of all material that stands where there is no room"),
    "flow_overlap": ("1", "share of the flow zone's material that stands where there is no room"),
}
#: What they come from, and the balances: see :meth:`mpm.Solver.balances`.
BALANCES = {
    "momentum_departure": ("N s/m", "momentum of the points less what the nodes received, size"),
    "flow_momentum": ("N s/m", "sum of the sizes of the momenta of grains and water in the flow zone"),
    "water_missing": ("kg/m", "water at the start, and what came through the sides, less that now"),
    "water_inflow": ("kg/m", "water that came through the outer face of the gate, that taken out included"),
    "flow_water": ("kg/m", "water of the flow zone"),
    "work_gravity": ("J/m", "work of gravity on grains and water since the gate opened"),
    "work_stress": ("J/m", "work of stresses and pore pressure since the gate opened, positive where it accelerates"),
    "work_drag": ("J/m", "work of the drag between water and grains since the gate opened"),
    "kinetic_energy_change": ("J/m", "change of the kinetic energy of grains and water since the gate opened"),
    "transfer_loss": ("J/m", "kinetic energy lost between points and nodes since the gate opened"),
    "moving_energy": ("J/m", "kinetic energy, and what the fall from the gate gave to what came in"),
    "material_volume": ("m^2", "area of all material in the mesh"),
    "flow_volume": ("m^2", "area of the material of the flow zone in the mesh"),
    "overlap_volume": ("m^2", "area of material that cells hold beyond their own"),
    "flow_overlap_volume": ("m^2", "the flow zone's part of the area of material that cells hold beyond their own"),
    "contact_error": ("1", "momentum at the lining that the recorded reactions do not explain, over their sum"),
    "largest_courant": ("1", "largest time step so far over the critical one of the state it led to"),
}
#: Variables on (time,) of `/history`.
HISTORY = {
    **PROGRESS,
    "grain_mass": ("kg/m", "mass of all grains, those taken out included; constant"),
    "suspended_fraction": ("1", "share of points whose grains do not touch"),
    "tip_fraction": (
        "1",
        "share of points at the tip of the Mohr-Coulomb cone: grains touch, unpressed, and bear nothing",
    ),
    "kinetic_energy": ("J/m", "kinetic energy of the grains"),
    "max_velocity": ("m/s", "largest velocity of the grains"),
    **ERRORS,
    **BALANCES,
    "dt": ("s", "mean time step in the interval"),
    "steps": ("1", "time steps since the gate opened"),
    "point_steps": ("1", "updates of one point by one step since the gate opened"),
    "cpu_seconds": ("s", "processor time since the simulation started"),
    "dt_limit": ("1", "what limited the time step most often in the interval"),
    **{f"clamp_{name}": ("1", f"point-steps that ended so since the start: {label}") for name, label in CLAMPS.items()},
}
INTEGERS = {"steps", "point_steps", *(f"clamp_{name}" for name in CLAMPS)}
#: Variables on (time, point) of `/points`, from the solver's own table.
POINTS = {
    **{name: (unit, meaning) for name, unit, meaning in POINT if not name.endswith("_initial")},
    "displacement_x": ("m", "horizontal displacement since the start"),
    "displacement_y": ("m", "vertical displacement since the start, upward positive"),
    "volume": ("m^2", "area that the point stands for, per metre of tunnel"),
    "soil": ("1", "number of the soil layer, from 0"),
}


def structure_group(model: str, tunnel: int | None = None) -> str:
    """Group of a response: `structure/<model>` for the tunnel with the gate, `structure_tunnel_<k>/<model>` for others.

    The model's name is made an identifier, so that it can be an attribute of a tree: "beam-spring" is `beam_spring`.

    tunnel : int or None, None: the one with the gate.
    """
    return f"{'structure' if tunnel is None else f'structure_tunnel_{tunnel}'}/{identifier(model)}"


def identifier(name: str) -> str:
    """A name as an identifier: every character that it may not have becomes `_`."""
    return re.sub(r"\W|^(?=\d)", "_", name)
