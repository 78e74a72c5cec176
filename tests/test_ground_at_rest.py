"""The state before the gate opens: equilibrium to round-off, and the theoretical pressures on the lining."""

import numpy as np
import pytest

import coupling
import mpm
from mpm.points import initial_stress
from mpm.variables import SXY, VLY, VSX, P


@pytest.fixture(scope="module")
def closed_case_3():
    scene = coupling.load_scene("case-3").mpm
    solver = mpm.Solver(scene, mpm.build_mesh(scene))
    solver.relax()
    return scene, solver


def theory(scene, theta):
    tunnel = scene.tunnels[0]
    a = np.radians(theta)
    vertical, water = initial_stress(scene, tunnel.axis_depth - tunnel.outer_radius * np.cos(a))
    k0 = scene.soils[0].k0
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
    normal, reaction = solver.normal[part.rows], solver.impulse[part.rows]
    vertical = -(reaction[:, 0] + reaction[:, 1]) * normal[:, 1] + reaction[:, 2] * normal[:, 0]
    soil = scene.soils[0]
    weight = 9.81 * ((1 - soil.porosity) * soil.grain_density + soil.porosity * scene.water.density)
    position = solver.mesh.nodes[solver.mesh.outer_nodes[0]]
    x, y = position.T
    area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    # the polygon's own area: equilibrium of the mesh is exact
    assert vertical.sum() == pytest.approx(weight * area, rel=1e-6)


def test_ground_with_a_rough_lining_stays_at_rest():
    source = coupling.load_scene("quick").mpm
    rough = source.tunnels[0].model_copy(update={"friction_coefficient": 0.6})  # K0 shear needs 0.28
    scene = source.model_copy(update={"tunnels": (rough,)})
    solver = mpm.Solver(scene, mpm.build_mesh(scene))
    solver.relax()
    before = solver.points.copy()
    for _ in range(500):
        solver.step()
    change = np.abs(solver.points[:, P : SXY + 1] - before[:, P : SXY + 1]).max()
    assert change < 1e-6 * before[:, P].max()
    assert np.abs(solver.points[:, VSX : VLY + 1]).max() < 1e-9  # m/s: round-off of 5e5 Pa over 500 steps
    lining = solver.lining_pressures(solver.time)[0]
    soil, _water, _, _ = theory(scene, lining["theta"])
    assert np.all(np.isfinite(lining["soil_pressure"])) and soil.min() > 0
