"""Strain rates of remapped velocities (MUSL) or of those just solved (USL): one answer, different small masses."""

import numpy as np
import pytest
from pydantic import ValidationError

import mpm
import mpm.scene
from coupling.stability.amplification import Column, SteppedAt
from coupling.verification import problems
from mpm.variables import SXX, SYY, SZZ, V_SY, X, Y


def error(name, **settings):
    problem = problems()[name]
    return problem.solve(**(problem.fast | settings)).error


@pytest.mark.parametrize("remapping", [True, False])
def test_vibration_of_a_bar_converges_to_the_exact_one_with_and_without_remapping(remapping):
    coarse, fine = (error("bar", cells=cells, remapping=remapping) for cells in (10, 20))
    assert coarse / fine > 3.0  # second order: 4, less what half a cell at the free end costs
    assert fine < problems()["bar"].limit


def test_slow_compression_and_draining_ground_give_one_answer_with_and_without_remapping():
    # velocities that hardly change from point to point survive the way through them: the errors differ in what is left
    for name in ("oedometer", "terzaghi"):
        with_it, without = error(name), error(name, remapping=False)
        assert abs(with_it - without) < 0.05 * with_it, name


def rate_at_a_small_mass(remapping, share):
    """Strain rate over the time step [1/s2] of the top elements, whose points touch the top nodes by `share`."""
    column = Column(bulk_modulus=None, cells=2, remapping=remapping)
    solver = SteppedAt(column.scene(), column.mesh(), threads=1)
    rows = solver.points
    rows[:, [SXX, SYY, SZZ]] = -1e5
    mesh = solver.mesh
    at_top = (mesh.nodes[:, 1] > -1e-9)[mesh.elements].astype(float)
    count = at_top.sum(axis=1, keepdims=True)
    near = share * at_top / np.maximum(count, 1) + (1 - share) * (1 - at_top) / (3 - count)
    weight = np.where(count > 0, near, 1 / 3)
    place = np.einsum("ek,ekd->ed", weight, mesh.nodes[mesh.elements])
    rows[:, X : Y + 1] = place[solver.element_of_point]
    top = count[:, 0] > 0
    dt = 1e-9  # nothing moves, so the first step is that of the stress alone
    solver.step_of(dt)
    velocity, slope = solver.nodes[solver.levels.rows[top], V_SY], solver.geometry[top]
    rate = slope[:, 1] * (velocity[:, 1] - velocity[:, 0]) + slope[:, 3] * (velocity[:, 2] - velocity[:, 0])
    return float(np.abs(rate).max()) / dt


def test_a_node_that_points_hardly_touch_strains_without_bound_only_without_remapping():
    # the force on the node is that of the stress, its mass the share of the points': velocity and strain go as 1/share
    musl = [rate_at_a_small_mass(True, share) for share in (1e-3, 1e-6)]
    usl = [rate_at_a_small_mass(False, share) for share in (1e-3, 1e-6)]
    assert usl[1] / usl[0] == pytest.approx(1e3, rel=0.05)
    assert musl[1] / musl[0] == pytest.approx(1.0, rel=0.05)  # through the points: once more times the share
    assert musl[0] < usl[0]


def test_run_without_remapping_ends_with_the_reason_where_its_step_vanishes():
    # the corners of the block run along the floor's edges, on which they put almost no mass
    with pytest.raises(mpm.RunFailed, match=r"the time step fell .* remapping = true"):
        error("sliding-block", remapping=False)


def test_step_of_the_altitude_is_refused_without_remapping():
    with pytest.raises(ValidationError, match="critical_step: must be 'spectral' where remapping is false"):
        mpm.scene.Numerics(remapping=False, critical_step="altitude")
