"""CPU time of the beam-spring ring by joint law and number of elements, and its error against closed forms.

    uv run python -m verification.reports.ring [RECORDS]    # 1000 when left out

Prints two tables; in the first, pressures fall around 90 degrees as time goes on.
"""

import sys
import time

import numpy as np
import xarray as xr

from structure import BeamSpringLining, Ground, Ring, theory
from verification.problems import exact_rings

SOIL = dict(
    youngs_modulus=40e6,
    poissons_ratio=0.3,
    cohesion=0.0,
    friction_angle=25.0,
    vertical_stress=2.07e5,
    horizontal_stress=8.9e4,
)
RING = dict(
    outer_diameter=6.6,
    inner_diameter=5.9,
    concrete_modulus=34.5e9,
    concrete_poissons_ratio=0.2,
    concrete_unit_weight=25e3,
    joint_angles=(8.0, 73.0, 138.0, 222.0, 287.0, 352.0),
    joint_rotational_stiffness=5e8,
    joint_normal_stiffness=6e8,
    joint_shear_stiffness=8e7,
)
ELASTIC = dict(law="linear", two_way=True)
CASES = {
    "linear joints, linear two-way ground": ({}, ELASTIC),
    "linear joints, hyperbolic ground": ({}, {}),
    "  the same, 180 elements": (dict(n_elements=180), {}),
    "  the same, 720 elements": (dict(n_elements=720), {}),
    "  the same, 1440 elements": (dict(n_elements=1440), {}),
    "contact-only joints, hyperbolic ground": (dict(joint_contact_only=True), {}),
    "gaping joints, hyperbolic ground": (dict(joint_contact_height=0.175), {}),
    "sliding joints, hyperbolic ground": (dict(joint_friction_coefficient=0.1), {}),
    "all three, hyperbolic ground": (
        dict(joint_contact_only=True, joint_contact_height=0.2, joint_friction_coefficient=0.12),
        {},
    ),
}


def event(records):
    """Theory pressures of case 3 that fall by up to 80 % around the right waist."""
    base = theory.theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8900.0, coefficient_at_rest=3 / 7
    )
    fall = xr.DataArray(np.linspace(0, 0.8, records), dims="time") * np.exp(-(((base["theta"] - 90) / 15) ** 2))
    moved = {name: (base[name].isel(time=0, drop=True) * (1 - fall)).transpose("time", "theta") for name in base}
    return xr.Dataset(moved).assign_coords(time=np.arange(records, dtype=float))


def closed_form_errors():
    """Largest errors of N, Q, M and displacement under p cos(2 theta), over element count, with their CPU time."""
    degrees = np.arange(0.0, 360.0, 0.1)
    zero = np.zeros((1, len(degrees)))
    load = 6e4 * np.cos(2 * np.radians(degrees))[None]
    fields = dict(soil_pressure=load, water_pressure=zero, soil_shear=zero)
    pressures = xr.Dataset(
        {name: (("time", "theta"), values) for name, values in fields.items()},
        coords={"time": [0.0], "theta": degrees},
    )
    print(f"{'elements':>8s} {'N':>8s} {'Q':>8s} {'M':>8s} {'w':>8s} {'CPU [s]':>8s}")
    for count in (24, 45, 90, 180, 360, 720, 1440):
        ring = Ring(**RING | dict(joint_angles=(), concrete_unit_weight=0.0), n_elements=count)
        model = BeamSpringLining(ring)
        start = time.process_time()
        response = model.respond(pressures)
        spent = time.process_time() - start
        on_centre_line, radius = 6e4 * ring.outer_radius / ring.centre_radius, ring.centre_radius
        exact = exact_rings.radial_cos2(on_centre_line, radius, np.radians(response["theta"].values))
        deflection = exact_rings.radial_cos2_displacement(
            on_centre_line, radius, ring.bending_stiffness, ring.axial_stiffness, ring.shear_stiffness
        )
        errors = [np.abs(response[name][0] - values).max() / np.abs(values).max() for name, values in
                  zip(exact._fields, exact, strict=True)]  # fmt: skip
        errors.append(abs(response["convergence_vertical"].item() / (-2 * deflection) - 1))
        print(f"{count:8d} " + " ".join(f"{float(error):8.1e}" for error in errors) + f" {spent:8.3f}")


def main(records):
    """Measure every case and print the tables."""
    pressures = event(records)
    BeamSpringLining(Ring(**RING, ground=Ground(**SOIL))).respond(pressures.isel(time=slice(2)))
    print(f"{'case':42s} {'CPU [s]':>8s} {'steps':>8s} {'residual':>9s}")
    for name, (changes, soil) in CASES.items():
        model = BeamSpringLining(Ring(**RING | changes, ground=Ground(**SOIL | soil)))
        start = time.process_time()
        response = model.respond(pressures)
        spent = time.process_time() - start
        residual = response["equilibrium_residual"].max().item()
        print(f"{name:42s} {spent:8.2f} {sum(model.iterations):8d} {residual:9.1e}")
    print()
    closed_form_errors()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
