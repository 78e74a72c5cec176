"""Draw the figures of docs/ring.md.

uv run python -m verification.pictures.ring [FOLDER]    # docs/images when left out
"""

import sys
from pathlib import Path

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from coupling.figures import GATE, INITIAL, NOW, RESOLUTION, SECOND, STYLE
from coupling.figures.utilisations import checks
from mpm.fields import values
from structure import BeamSpringLining, CapacityRule, Ground, Limits, Ring, SegmentSection, check, theory
from structure.capacity import table_3_1
from structure.joint_laws import contact_moment, limited_shear
from verification.pages import DOCS

STIFFNESS, HEIGHT = 5e8, 0.175  # N m/rad per metre, m


def joint_laws():
    """Moment over rotation for several axial forces, and shear over dislocation through one cycle."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 3.1), layout="constrained")
        left, right = figure.subplots(1, 2)
        rotation = np.linspace(0, 3e-3, 600)
        forces = np.array([0.3e6, 0.6e6, 0.9e6, 1.2e6, 1.5e6])
        for force, shade in zip(forces, np.linspace(0.35, 1.0, len(forces)), strict=True):
            moment = contact_moment(rotation, np.full_like(rotation, force), STIFFNESS, HEIGHT)[0]
            colour = matplotlib.colormaps["Blues"](shade)
            left.plot(1e3 * rotation, moment / 1e3, color=colour)
            left.annotate(
                f"N = {force / 1e3:.0f}",
                (3.0, moment[-1] / 1e3),
                (3, 0),
                textcoords="offset points",
                va="center",
                fontsize=7,
            )
            left.axhline(force * HEIGHT / 2e3, color=colour, lw=0.6, ls=(0, (1, 2)))
        edge = forces * HEIGHT / 6
        left.plot(1e3 * edge / STIFFNESS, edge / 1e3, "o-", color=GATE, ms=3, lw=0.8, label="decompression, N h/6")
        left.plot([], [], color=INITIAL, lw=0.6, ls=(0, (1, 2)), label="on the edge, N h/2")
        left.set_title(f"gaping: k = {STIFFNESS / 1e6:.0f} MN m/rad per m, h = {HEIGHT} m, N in kN/m")
        left.set_xlabel("joint rotation [mrad]")
        left.set_ylabel("joint moment [kN m/m]")
        left.set_xlim(0, 3.0)
        left.set_ylim(0, 170)
        left.legend(loc="upper center", ncols=2)
        path = 1e-3 * np.concatenate([np.linspace(0, 4, 200), np.linspace(4, -4, 400), np.linspace(-4, 3, 350)])
        for friction, colour in ((0.1, NOW), (0.2, SECOND)):
            slip, shears = np.zeros(1), []
            for dislocation in path:
                shear, *_, slip = limited_shear(np.array([dislocation]), slip, np.array([1.2e6]), 8e7, friction)
                shears.append(shear[0] / 1e3)
            right.plot(1e3 * path, shears, color=colour, label=f"μ = {friction}")
        right.set_title("sliding: k = 80 MN/m per m, N = 1200 kN/m")
        right.set_xlabel("joint dislocation [mm]")
        right.set_ylabel("joint shear force [kN/m]")
        right.legend(loc="upper left")
        for axis in (left, right):
            axis.grid(True, color="0.9")
            values(axis.spines, ("top", "right")).set_visible(False)
    return figure


def example_of_checks():
    """The checks of a ring whose pressures fall around the right waist; section and limits are examples."""
    soil = Ground(
        youngs_modulus=40e6,
        poissons_ratio=0.3,
        cohesion=0.0,
        friction_angle=25.0,
        vertical_stress=2.07e5,
        horizontal_stress=8.9e4,
    )
    ring = Ring(
        outer_diameter=6.6,
        inner_diameter=5.9,
        concrete_modulus=34.5e9,
        concrete_poissons_ratio=0.2,
        concrete_unit_weight=25e3,
        joint_angles=(8.0, 73.0, 138.0, 222.0, 287.0, 352.0),
        joint_rotational_stiffness=STIFFNESS,
        joint_normal_stiffness=2e10,
        joint_shear_stiffness=8e7,
        joint_contact_height=HEIGHT,
        ground=soil,
    )
    base = theory.theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8900.0, coefficient_at_rest=3 / 7
    )
    fall = xr.DataArray(np.linspace(0, 0.8, 60), dims="time") * np.exp(-(((base["theta"] - 90) / 15) ** 2))
    loads = xr.Dataset({name: base[name].isel(time=0, drop=True) * (1 - fall) for name in base})
    loads = loads.assign_coords(time=np.arange(60.0))
    section = SegmentSection(
        concrete_strength=50e6,
        concrete_long_term_factor=0.85,
        concrete_partial_factor=1.5,
        **table_3_1(50e6),
        steel_area_outer=1.5e-3,
        steel_area_inner=1.5e-3,
        bar_depth_outer=0.05,
        bar_depth_inner=0.05,
        steel_strength=500e6,
        steel_partial_factor=1.15,
        steel_modulus=200e9,
        steel_strain_limit=0.045,
    )
    limits = Limits(
        segment=section,
        capacity=CapacityRule(
            axial_force_factor=1.0, moment_factor=1.35, minimum_eccentricity=0.02, utilisation="radial"
        ),
        gasket_opening=6e-3,
        gasket_offset=0.1,
        joint_dislocation=10e-3,
        convergence_per_mille=5.0,
    )
    return checks(check(BeamSpringLining(ring).respond(loads), limits))


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "images"
    joint_laws().savefig(folder / "joint_laws.png", dpi=RESOLUTION)
    example_of_checks().savefig(folder / "ring_checks.png", dpi=RESOLUTION)
