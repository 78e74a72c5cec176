"""The state before the gate opens: equilibrium to round-off, and the theoretical pressures on the lining."""

import numpy as np
import pytest
from scipy.special import erfc

import coupling
import mpm
from mpm.fields import values
from mpm.k0_procedure import initial_stress
from verification.small_event import COARSE
from verification.stability.amplification import Column

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def closed_case_3():
    scene = coupling.load_scene("case-3", initial_contact="bonded")
    solver = mpm.Solver(scene, mpm.build_mesh(scene))
    solver.relax()
    return scene, solver


def theory(scene, theta):
    tunnel = scene.tunnels[0]
    a = np.radians(theta)
    vertical, water = initial_stress(scene, tunnel.axis_depth - tunnel.outer_radius * np.cos(a))
    k0 = 0.3 / 0.7  # gravity loads an elastic body of nu = 0.3
    return (
        vertical * (np.cos(a) ** 2 + k0 * np.sin(a) ** 2),
        water,
        vertical * (1 - k0) * np.sin(a) * np.cos(a),
        vertical,
    )


def test_initial_pressures_are_the_theoretical_ones_at_every_angle(closed_case_3):
    scene, solver = closed_case_3
    lining = solver.lining_pressures(1.0)[0]
    soil, water, shear, vertical = theory(scene, lining["theta"])
    assert lining["soil_pressure"] == pytest.approx(soil, rel=0.02)  # the polygon's error is below 0.5 %
    assert lining["water_pressure"] == pytest.approx(water, rel=0.01)
    assert np.abs(lining["soil_shear"] - shear).max() < 0.02 * vertical.max()


def test_lining_carries_the_uplift_of_the_displaced_ground(closed_case_3):
    scene, solver = closed_case_3
    part = solver.lining[0]
    wall, reaction = solver.contact[part.rows], solver.impulse[part.rows]
    vertical = -(reaction["soil"] + reaction["water"]) * wall["normal_y"] + reaction["shear"] * wall["normal_x"]
    soil = scene.soils[0]
    weight = 9.81 * ((1 - soil.porosity) * soil.grain_density + soil.porosity * scene.water.density)
    position = solver.mesh.nodes[solver.mesh.outer_nodes[0]]
    x, y = position.T
    area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    # the polygon's own area: equilibrium of the mesh is exact
    assert vertical.sum() == pytest.approx(weight * area, rel=1e-6)


def test_ground_with_a_rough_lining_stays_at_rest():
    source = coupling.load_scene("quick", discretisation=COARSE)
    rough = source.tunnels[0].model_copy(update={"friction_coefficient": 0.6})  # K0 shear needs 0.44
    scene = source.model_copy(update={"tunnels": (rough,)})
    solver = mpm.Solver(scene, mpm.build_mesh(scene))
    solver.relax()
    before = solver.points.copy()
    for _ in range(500):
        solver.step()
    change = np.abs(
        values(solver.points, ("pore_pressure", "porosity", "stress_xx", "stress_yy", "stress_zz", "stress_xy"))
        - values(before, ("pore_pressure", "porosity", "stress_xx", "stress_yy", "stress_zz", "stress_xy"))
    ).max()
    assert change < 1e-6 * before["pore_pressure"].max()
    assert (
        np.abs(
            values(solver.points, ("velocity_solid_x", "velocity_solid_y", "velocity_liquid_x", "velocity_liquid_y"))
        ).max()
        < 1e-9
    )  # m/s: round-off of 5e5 Pa over 500 steps
    lining = solver.lining_pressures(solver.time)[0]
    soil, _water, _, _ = theory(scene, lining["theta"])
    assert np.all(np.isfinite(lining["soil_pressure"])) and soil.min() > 0


def change_in(solver, time):
    """Largest changes of the pore pressure that acts and of the effective stresses until a time [Pa]."""
    before = by_place(solver)
    while solver.time < time * (1 - 1e-12):
        solver.advance(time)
    after = by_place(solver)
    pressures = np.maximum(after["pore_pressure"], 0.0) - np.maximum(before["pore_pressure"], 0.0)
    return np.abs(pressures).max(), np.abs(
        values(after, ("stress_xx", "stress_yy", "stress_zz", "stress_xy"))
        - values(before, ("stress_xx", "stress_yy", "stress_zz", "stress_xy"))
    ).max()


def by_place(solver):
    return solver.points[np.lexsort((solver.points["x_initial"], solver.points["y_initial"]))]


@pytest.mark.parametrize("depth", [0.0, 10.0])
def test_two_soils_stay_at_rest_below_a_lowered_water_table(depth):
    soil = coupling.load_scene("quick").soils[0].model_dump() | {"hydraulic_conductivity": 1e-7}
    lower = {"name": "lower", "top_depth": 31.0, "youngs_modulus": 8e7, "porosity": 0.38, "k0": 0.5}
    scene = coupling.load_scene(
        "quick", gate="none", soils=[soil, soil | lower], water={"table_depth": depth}, discretisation=COARSE
    )
    rough = scene.tunnels[0].model_copy(update={"friction_coefficient": 0.6})
    scene = scene.model_copy(update={"tunnels": (rough,)})
    solver = mpm.Solver(scene, mpm.build_mesh(scene))
    solver.relax()
    pressure, stress = change_in(solver, 5.0)
    # A tight soil: what hangs above the table seeps into it by half a micrometre.
    assert pressure < 500.0 and stress < 1000.0


def test_water_that_hangs_above_the_table_seeps_into_it():
    """Nothing holds water at zero pressure: it falls at the conductivity, and its pressure at the table spreads.

    Source: Carslaw & Jaeger (1959), section 2.9: a plane source of constant strength in a medium without end.
    """
    column = Column(cells=40, size=0.5)
    scene = column.scene()
    scene = scene.model_copy(update={"water": scene.water.model_copy(update={"table_depth": 10.0})})
    solver = mpm.Solver(scene, column.mesh(), threads=1)
    time, weight = 5.0, 9.81 * scene.water.density
    before = by_place(solver)["pore_pressure"]
    change_in(solver, time)
    points, soil = by_place(solver), scene.soils[0]
    nu = soil.poissons_ratio
    oedometric = soil.youngs_modulus * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    storage = soil.porosity / scene.water.bulk_modulus + 1 / oedometric
    diffusivity = soil.hydraulic_conductivity / (weight * storage)
    z, spread = np.abs(points["y"] + 10.0), np.sqrt(diffusivity * time)
    rise = weight * (spread / np.sqrt(np.pi) * np.exp(-((z / spread / 2) ** 2)) - z / 2 * erfc(z / spread / 2))
    near = z < 4.0
    error = points["pore_pressure"][near] - before[near] - rise[near]
    assert np.abs(error).max() < 0.01 * rise.max()
