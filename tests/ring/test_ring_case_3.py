"""Initial ring forces of case 3 (Xie, Zhang & Zhou, Table 3) under theory loads.

Joint stiffnesses are per metre of tunnel (k_n = 6e8, k_s = 8e7 N/m per metre): taken per face area and multiplied
by the thickness 0.35 m, the joints would close by 6 mm each and the ring would leave the soil.
Tangential soil springs on the outer face, the default of the ring, miss one moment by 2 kN m. At the beam nodes, as
in a load-structure model (slip_at="centre_line", the choice of the built-in scenes), all hold, the last by 0.1 kN m;
that option was added after comparing with the table, so it explains the gap and predicts nothing.
"""

import numpy as np
import pytest
from rings import BUOYANT_UNIT_WEIGHT, case_3_ground, case_3_pressures, case_3_ring

from structure import BeamSpringLining

THICKNESS = 0.35
AXIAL_FORCE = np.array([1185, 1452, 1289, 1290, 1452, 1185]) * 1e3
BENDING_MOMENT = np.array([-178, 147, 3.5, 4.5, 146, -178]) * 1e3


def initial_response(slip_at, per_face_area=False):
    share = THICKNESS if per_face_area else 1.0
    ring = case_3_ring(
        ground=case_3_ground(slip_at=slip_at), joint_normal_stiffness=6e8 * share, joint_shear_stiffness=8e7 * share
    )
    return BeamSpringLining(ring).respond(case_3_pressures()).isel(time=0)


def moment_error(response):
    return np.abs(response["joint_bending_moment"].values - BENDING_MOMENT).max()


@pytest.mark.parametrize("slip_at", ["outer_face", "centre_line"])
def test_joint_axial_forces_of_table_3(slip_at):
    response = initial_response(slip_at)
    # 5 %: the agreement asked for with the published table.
    np.testing.assert_allclose(response["joint_axial_force"], AXIAL_FORCE, rtol=0.05)


def test_joint_moments_of_table_3_with_tangential_springs_at_the_nodes():
    # 10 kN m: the agreement asked for; the table's own Q and M contradict each other, so more cannot be had.
    assert moment_error(initial_response("centre_line")) < 10e3


@pytest.mark.xfail(strict=True, reason="joint 1: -190 against -178 kN m, 12 where 10 is asked for; see slip_at")
def test_joint_moments_of_table_3_with_tangential_springs_on_the_outer_face():
    assert moment_error(initial_response("outer_face")) < 10e3


@pytest.mark.xfail(strict=True, reason="N of joint 1 is 6.8 % low, M 43 kN m off: the ring shrinks away from the soil")
def test_table_3_with_joint_stiffness_per_face_area():
    response = initial_response("centre_line", per_face_area=True)
    np.testing.assert_allclose(response["joint_axial_force"], AXIAL_FORCE, rtol=0.05)


@pytest.mark.parametrize("slip_at", ["outer_face", "centre_line"])
def test_places_of_the_extremes(slip_at):
    response = initial_response(slip_at)
    right = response.sel(theta=slice(0, 180))
    # 5 degrees: the agreement asked for.
    assert right["axial_force"].idxmax().item() == pytest.approx(90, abs=5)
    assert right["bending_moment"].idxmax().item() == pytest.approx(90, abs=5)


def test_uplift_is_buoyancy_less_weight():
    # 468 kN/m from Archimedes by hand; 1e-3 for its three digits.
    expected = np.pi * 3.3**2 * (BUOYANT_UNIT_WEIGHT + 9810) - 25e3 * np.pi * (3.3**2 - 2.95**2)
    assert initial_response("outer_face")["balanced_uplift"].item() == pytest.approx(expected, rel=1e-3)
