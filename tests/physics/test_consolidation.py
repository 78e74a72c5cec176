"""Terzaghi's consolidation of a column: two-phase coupling with drag, whatever the permeability."""

import pytest

from verification.problems.columns import terzaghi

pytestmark = pytest.mark.slow


def consolidate(cells, conductivity, bulk_modulus, time_factor, **settings):
    """Profile error over the initial excess pressure, and largest time step [s]."""
    result = terzaghi(cells, conductivity, bulk_modulus, time_factor, **settings)
    return result.error, result.values["time_step"]


@pytest.mark.parametrize("time_factor, limit", [(0.1, 0.014), (0.5, 0.006)])
@pytest.mark.parametrize("conductivity, bulk_modulus", [(1e-3, 8e7), (1e-3, 2.2e8), (1e-4, 8e7), (3e-5, 2.2e8)])
def test_terzaghi_profile_with_twenty_cells(conductivity, bulk_modulus, time_factor, limit):
    # at k = 1e-3 m/s waves are still there, which inertia makes (up to 4 %) and `stress_damping` damps: 0.4 % at the
    # later time, 0.2 % without it
    error, _ = consolidate(20, conductivity, bulk_modulus, time_factor, inertia=True)
    assert error < limit


def test_inertia_fades_where_the_ground_drains_slowly():
    quick, slow = (terzaghi(10, k, 8e7, 0.1, inertia=True).values["inertia"] for k in (1e-3, 1e-5))
    assert quick > 0.01 > 0.001 > slow


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
