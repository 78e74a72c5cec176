"""Terzaghi's consolidation of a column: two-phase coupling with drag, whatever the permeability."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from mpm.scene import Scene
from mpm.solver import Solver
from mpm.variables import SXX, SYY, SZZ, V_P, P, Y

E, NU, POROSITY = 4e7, 0.3, 0.45


def column_mesh(cells, size):
    """Two cells wide, crossed diagonals, drained at the top; the fields that the solver reads of a mesh."""
    x, y = np.meshgrid(np.arange(3) * size - size, (np.arange(cells + 2) - cells) * size)
    nodes = np.column_stack([x.ravel(), y.ravel()])
    elements = []
    for j in range(cells + 1):
        for i in range(2):
            a, b, c, d = 3 * j + i, 3 * j + i + 1, 3 * j + i + 3, 3 * j + i + 4
            elements += [[a, b, d], [a, d, c]] if (i + j) % 2 else [[a, b, c], [b, d, c]]
    elements = np.array(elements, np.int32)
    none = np.zeros(0, np.int32)
    region = np.where(nodes[elements].mean(axis=1)[:, 1] > 0, 3, 0).astype(np.int8)
    return SimpleNamespace(
        nodes=nodes, elements=elements, region=region, outer_nodes=(), outer_theta=(), opening_nodes=none,
        corner_nodes=none, wall_nodes=none, wall_side=none, inner_nodes=none,
        left=np.flatnonzero(x.ravel() < -size / 2).astype(np.int32),
        right=np.flatnonzero(x.ravel() > size / 2).astype(np.int32),
        bottom=np.arange(3, dtype=np.int32), top=none,
    )  # fmt: skip


def consolidate(cells, conductivity, bulk_modulus, time_factor, model="elastic"):
    """Profile error over the initial excess pressure, number of steps and largest time step."""
    height, initial = 1.0, 1e4
    size = height / cells
    scene = Scene.model_validate({
        "name": "column",
        "gravity": 9.81,
        "box": {"width": 2 * size, "depth": height},
        "water": {"table_depth": 0.0, "density": 1000.0, "bulk_modulus": bulk_modulus},
        "soils": [{
            "name": "column", "top_depth": 0.0, "model": model, "youngs_modulus": E, "poissons_ratio": NU,
            "cohesion": 1e5, "friction_angle": 30.0, "dilatancy_angle": 0.0, "porosity": POROSITY,
            "loose_porosity": 0.6, "grain_density": 2650.0, "hydraulic_conductivity": conductivity, "k0": 0.5,
        }],
        "discretisation": {
            "element_size": size, "element_size_lining": size, "element_size_interior": size, "gate_radius": size,
        },
        "stop": {"time": 1.0},
        "output": {"interval": 1.0},
    })  # fmt: skip
    solver = Solver(scene, column_mesh(cells, size))
    excess = np.full(len(solver.points), initial)
    hydrostatic = solver.points[:, P].copy()
    solver.points[:, P] += excess
    solver.points[:, SYY] += excess  # total stress unchanged: the load is carried by the water
    solver.points[:, SXX] += NU / (1 - NU) * excess
    solver.points[:, SZZ] += NU / (1 - NU) * excess
    solver.nodes[:, V_P] += initial * (solver.mesh.nodes[:, 1] < 1e-9)
    constrained = E * (1 - NU) / ((1 + NU) * (1 - 2 * NU))
    storage = 1 / constrained + POROSITY / bulk_modulus
    end = time_factor * height**2 * 1000 * 9.81 * storage / conductivity
    steps = []
    while solver.time < end * (1 - 1e-12):
        steps.append(solver.step(end - solver.time)[0])
    depth = -solver.points[:, Y]
    odd = 2 * np.arange(200)[:, None] + 1
    exact = np.sum(
        4 / np.pi / odd * np.sin(odd * np.pi / 2 * depth) * np.exp(-((odd * np.pi / 2) ** 2) * time_factor), axis=0
    )
    error = (solver.points[:, P] - hydrostatic) / initial - exact
    return math.sqrt(np.mean(error**2)), max(steps)


@pytest.mark.parametrize("time_factor, limit", [(0.1, 0.014), (0.5, 0.006)])
@pytest.mark.parametrize("conductivity, bulk_modulus", [(1e-4, 8e7), (3e-5, 2.2e8)])
def test_terzaghi_profile_with_twenty_cells(conductivity, bulk_modulus, time_factor, limit):
    # limits: what a strain-smoothed linear triangle reached in trials without the consistent filter
    error, _ = consolidate(20, conductivity, bulk_modulus, time_factor)
    assert error < limit


def test_time_step_does_not_depend_on_permeability():
    steps = {k: consolidate(10, k, 8e7, 1e-4 * k / 1e-4)[1] for k in (1e-3, 1e-4)}
    assert steps[1e-3] == pytest.approx(steps[1e-4], rel=1e-3)


def test_undrained_soil_keeps_its_excess_pressure():
    # k = 1e-9 m/s over 0.05 s: Tv is 5e-9, the exact answer is the initial state below the first cells
    error, _ = consolidate(10, 1e-9, 8e7, 5e-9)
    assert error < 0.10  # the drained top cell alone: sqrt(1/10) of its own step


def test_error_shrinks_with_the_mesh():
    coarse, fine = (consolidate(n, 1e-4, 8e7, 0.1)[0] for n in (5, 10))
    assert fine < 0.7 * coarse
