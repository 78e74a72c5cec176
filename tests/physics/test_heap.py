"""Material that falls inside a tunnel: it lands, comes to rest, and takes up the area that its grains need."""

import numpy as np
import pytest

from coupling.postprocess import filled
from mpm.fields import values
from mpm.scene import Scene
from mpm.solver import Solver
from verification import boxes

GRAIN_DENSITY, POROSITY, LOOSE = 2650.0, 0.45, 0.55


def box_mesh(width, height, size, block):
    """Crossed squares in a closed box; only the elements inside `block` (x0, x1, y0, y1) are filled."""
    x0, x1, y0, y1 = block
    return boxes.box_mesh(
        np.linspace(-width / 2, width / 2, round(width / size) + 1), np.linspace(-height, 0, round(height / size) + 1),
        lambda x, y: (x > x0) & (x < x1) & (y > y0) & (y < y1),
    )  # fmt: skip


def dropped_block(width=1.6, size=0.1):
    """A stress-free block of sand and water, 0.6 m by 0.6 m, released 0.3 m above the floor of a box."""
    scene = Scene.model_validate({
        "name": "block",
        "box": {"width": width, "depth": 2.0},
        "water": {"table_depth": 0.0, "density": 1000.0, "bulk_modulus": 8e7},
        "soils": [{
            "name": "sand", "top_depth": 0.0, "model": "mohr-coulomb", "youngs_modulus": 4e7, "poissons_ratio": 0.3,
            "cohesion": 0.0, "friction_angle": 25.0, "dilatancy_angle": 0.0, "tensile_strength": 0.0,
            "porosity": POROSITY, "loose_porosity": LOOSE, "grain_density": GRAIN_DENSITY,
            "hydraulic_conductivity": 1e-4, "k0": 0.5,
        }],
        "discretisation": {
            "element_size": size, "element_size_lining": size, "element_size_interior": size, "gate_radius": size,
        },
        "stop": {"time": 1.0},
        "output": {"interval": 1.0},
    })  # fmt: skip
    solver = Solver(scene, box_mesh(width, 2.0, size, (-0.3, 0.3, -1.7, -1.1)))
    solver.points[["pore_pressure", "stress_xx", "stress_yy", "stress_zz", "stress_xy"]] = 0.0
    return solver


@pytest.mark.slow
def test_dropped_block_lands_and_takes_up_the_area_its_grains_need():
    solver = dropped_block()
    mass = np.sum(solver.points["grain_mass"])
    fastest = 0.0
    while solver.time < 6.0:  # its slopes slide a little now and then until 5 s
        solver.step()
        fastest = max(fastest, speed(solver)) if solver.step_count % 100 == 0 else fastest
    assert fastest > 0.7 * np.sqrt(2 * 9.81 * 0.3)  # it did fall
    assert speed(solver) < 0.02 * fastest
    assert np.sum(solver.points["grain_mass"]) == mass
    element, area = solver.element_of_point, solver.geometry["area"]
    volume = np.bincount(element, solver.points_by_name()["volume"], len(area))
    solid = np.bincount(element, solver.points["grain_mass"] / GRAIN_DENSITY, len(area))
    heap = filled(volume, area, solver.mesh.elements)
    # the rest lies in elements of the surface that are less than half full
    assert solid[heap].sum() > 0.9 * mass / GRAIN_DENSITY
    # from as dense as it fell to just touching
    assert 0.9 * POROSITY < 1 - solid[heap].sum() / area[heap].sum() < 1.1 * LOOSE


def speed(solver):
    """Root mean square of the grains' velocity [m/s]."""
    return float(np.sqrt(np.mean(np.sum(values(solver.points, ("velocity_solid_x", "velocity_solid_y")) ** 2, axis=1))))
