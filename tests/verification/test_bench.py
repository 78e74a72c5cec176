"""What `gush bench` says about a step adds up, and its counts are those of the arrays and the source."""

import json
import math

import numpy as np
import pytest

import mpm
from verification.small_event import small_scene
from verification.speed import layout, processes, studies
from verification.speed.command import bench
from verification.speed.sizes import slope
from verification.speed.stepping import configurations, kernel_times, prepared

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def solver():
    scene = small_scene()
    return prepared(scene, mpm.build_mesh(scene))


def test_kernel_times_add_up_to_the_step_and_leave_the_solver_as_it_was(solver):
    attributes = set(vars(solver))
    kernels = kernel_times(solver, 0.2)
    assert set(vars(solver)) == attributes
    assert {"update_points", "advance_points", "solve_nodes", "remap_nodes", "python"} <= set(kernels)
    assert all(spent > 0 for spent in kernels.values())


def test_bytes_of_a_point_are_two_passes_over_its_row_order_and_soil(solver):
    counted = layout.bytes_per_point_step(solver)
    assert counted["points"] == 2 * (2 * 16 * 8 + 4 + 4)  # 16 numbers of 8 bytes, read and written; two integers
    assert counted["elements"] > 0
    assert counted["nodes"] > 0


def test_operations_are_those_of_the_loop_over_points():
    source = (
        "for j in range(start[e], start[e + 1]):\n    a = b * c + d\n    a += 2.0 / b\n    if a > b:\n        a = 0"
    )
    loop = layout.ast.parse(source).body[0]
    assert layout._over_points(loop)
    assert sum(layout._operations(line) for line in loop.body) == 4  # times, plus, plus, over


def test_slope_is_that_of_a_power_law():
    rows = [{"points": n, "points_per_second": 1e7 * n**-0.25} for n in (1e3, 1e4, 1e5, 1e6)]
    assert math.isclose(slope(rows), 1.25, rel_tol=1e-12)


def test_configurations_differ_in_what_they_leave_out():
    whole = small_scene()
    scenes = dict(configurations(whole))
    assert scenes["dry, elastic"].water is None
    assert {soil.model for soil in scenes["two-phase, elastic"].soils} == {"elastic"}
    undamped = scenes["two-phase, Mohr-Coulomb, no filter or damping"].numerics
    assert undamped.pressure_filter == undamped.stress_damping == 0
    assert scenes["two-phase, Mohr-Coulomb"] == whole
    assert len({str(scene) for scene in scenes.values()}) == len(scenes)


def test_step_is_measured_beside_the_reference_and_the_copy():
    data = bench(small_scene(), step_only=True, rounds=1, seconds=0.05)
    step, reference = data["step_points_per_second"], data["reference_points_per_second"]
    assert data["step_to_reference_ratio"] == step / reference
    assert math.isclose(
        data["roofline_points_per_second"],
        data["copy_bytes_per_second"] / sum(data["bytes_per_point_step"].values()),
    )
    assert np.isfinite([step, reference, data["bytes_per_point"]]).all()


def test_solver_is_imported_within_a_third_of_a_second_of_numba():
    """Processor time; the limit is 0.3 s, and an import that compiles or meshes takes seconds."""
    assert processes.import_seconds(["mpm over numba"])["mpm over numba"] < 0.3


def test_section_on_studies_is_the_last_of_its_page_and_written_anew(tmp_path):
    for name in ("performance.md", "performance.json"):
        (tmp_path / name).write_bytes((studies.DOCS / name).read_bytes())
    data = json.loads((tmp_path / "performance.json").read_text())["study"]
    before = (tmp_path / "performance.md").read_text()
    studies.write(data, tmp_path)
    assert (tmp_path / "performance.md").read_text() == before
    studies.write(data | {"share_of_loop": 0.123}, tmp_path)
    after = (tmp_path / "performance.md").read_text()
    assert after.count(studies.HEADING) == 1 and "takes 0.12 of the faster loop" in after
    assert after.split(studies.HEADING)[0] == before.split(studies.HEADING)[0]
