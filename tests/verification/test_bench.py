"""What `gush bench` says about a step adds up, and its counts are those of the arrays and the source."""

import math
import subprocess
import sys

import numpy as np
import pytest

import mpm
from mpm.machine.team import stage_at_hand
from verification.small_event import small_scene
from verification.speed.command import bench, bytes_per_point_step
from verification.speed.passes import kernel_times, stages
from verification.speed.stepping import configurations, prepared, slope, steps

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def solver():
    scene = small_scene()
    return prepared(scene, mpm.build_mesh(scene))


def test_kernel_times_add_up_to_the_step_and_leave_the_solver_as_it_was(solver):
    attributes = set(vars(solver))
    kernels = kernel_times(solver, 0.2)
    assert set(vars(solver)) == attributes and "together" not in vars(solver.workers)
    assert {"update_points", "advance_points", "solve_nodes", "remap_nodes", "python"} <= set(kernels)
    assert all(spent > 0 for spent in kernels.values())


def test_stages_of_long_steps_are_those_that_the_kernel_goes_through(solver):
    counted, together = [], solver.workers.together

    def counting(kernel, *arguments):
        before = stage_at_hand(solver.workers._meeting)
        others = together(kernel, *arguments)
        if kernel is solver._long_step:
            named = sum(parts for _, parts in stages(arguments[3].substeps, solver.parts))
            counted.append((stage_at_hand(solver.workers._meeting) - before, named))
        return others

    solver.workers.together = counting
    try:
        steps(solver)
    finally:
        del solver.workers.together
    assert counted and all(done == named for done, named in counted)


def test_bytes_of_a_point_are_two_passes_over_its_row_order_and_soil(solver):
    counted = bytes_per_point_step(solver)
    assert counted["points"] == 2 * (2 * 16 * 8 + 4 + 4)  # 16 numbers of 8 bytes, read and written; two integers
    assert counted["elements"] > 0
    assert counted["nodes"] > 0


def test_slope_is_that_of_a_power_law():
    rows = [{"points": n, "points_per_second": 1e7 * n**-0.25} for n in (1e3, 1e4, 1e5, 1e6)]
    assert math.isclose(slope(rows), 1.25, rel_tol=1e-12)


def test_configurations_differ_in_what_they_leave_out():
    whole = small_scene()
    scenes = dict(configurations(whole))
    assert scenes["dry, elastic"].water is None
    assert {soil.model for soil in scenes["elastic"].soils} == {"elastic"}
    assert scenes["no filter"].numerics.pressure_filter == scenes["no damping"].numerics.stress_damping == 0
    assert not scenes["one time step"].numerics.local_time_stepping
    assert scenes["full"] == whole
    assert len({scene.model_dump_json() for scene in scenes.values()}) == len(scenes)


def test_step_is_measured_beside_the_reference_and_the_copy():
    data = bench(small_scene(), step_only=True, rounds=1, seconds=0.05)
    step, reference = data["step_points_per_second"], data["reference_points_per_second"]
    assert data["step_to_reference_ratio"] == step / reference
    assert math.isclose(
        data["roofline_points_per_second"],
        data["copy_bytes_per_second"] / sum(data["bytes_per_point_step"].values()),
    )
    assert np.isfinite([step, reference, data["bytes_per_point"]]).all()


def test_import_of_the_solver_neither_meshes_nor_compiles():
    """What takes seconds waits for the call that needs it; `gush bench` measures the import."""
    code = (
        "import sys, numba, mpm.solver\n"
        "print(*sys.modules)\n"
        "kernels = [value for name, module in list(sys.modules.items()) if name.startswith('mpm.')"
        " for value in vars(module).values() if isinstance(value, numba.core.dispatcher.Dispatcher)]\n"
        "print(len(kernels), sum(len(kernel.overloads) for kernel in kernels))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    modules, counts = out.splitlines()
    assert not {"gmsh", "xarray", "skfem", "matplotlib", "pandas"} & set(modules.split())
    kernels, compiled = map(int, counts.split())
    assert kernels > 10 and compiled == 0
