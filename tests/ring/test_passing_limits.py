"""When and where checks pass 1."""

import json

import numpy as np
import pytest
import xarray as xr
from rings import ring

from structure import Limits, check, utilisations


def response(values, mass=None):
    """Dislocations (time, joint) [mm] at 0, 1, 2 .. s."""
    given = 1e-3 * np.array(values, float)
    dataset = xr.Dataset(
        {"joint_dislocation": (("time", "joint"), given), "settlement": ("time", given[:, 0])},
        {"time": np.arange(float(len(given))), "joint": np.arange(given.shape[1])},
        {"ring": ring().model_dump_json()},
    )
    return dataset if mass is None else dataset.assign_coords(inflow_mass=("time", mass))


def verdict(values, mass=None, **limits):
    limits = limits or dict(joint_dislocation=10e-3)
    return next(iter(utilisations(check(response(values, mass), Limits(**limits))).values()))


def test_first_joint_to_pass_is_told_with_its_time_and_inflow_mass():
    # joint 1 passes 10 mm between 4 and 16: half way from 1 s to 2 s, 40 of 80 kg beyond 20; joint 0 passes later,
    # between 6 and 18 at a third from 2 s; joint 0 is the largest.
    found = verdict([[2, 4], [6, 4], [6, 16], [18, 17]], mass=[0.0, 20.0, 100.0, 160.0])
    assert found["passes"] == pytest.approx({"time": 1.5, "inflow_mass": 60.0, "joint": 1})
    assert found["at"] == {"time": 3.0, "inflow_mass": 160.0, "joint": 0}
    assert found["largest"] == pytest.approx(1.8)


def test_what_never_passes_and_what_begins_beyond():
    assert verdict([[2, 4], [6, -10]])["passes"] is None
    assert verdict([[2, -11], [6, 4]])["passes"] == {"time": 0.0, "joint": 1}
    # back below and beyond again: the first time counts
    assert verdict([[0, 0], [20, 0], [0, 0], [20, 0]])["passes"]["time"] == pytest.approx(0.5)


def test_quantity_without_places_has_a_time_alone():
    found = verdict([[0], [30]], own=dict(settlement=20e-3))
    assert found["passes"] == pytest.approx({"time": 2 / 3})


def test_infinite_utilisation_passes_at_the_record_before():
    checked = check(response([[1, 1], [2, 2], [3, 3]]), Limits(joint_dislocation=10e-3))
    checked["joint_dislocation_utilisation"].values[2, 1] = np.inf
    found = utilisations(checked)["joint_dislocation_utilisation"]
    assert found["passes"] == {"time": 1.0, "joint": 1} and np.isinf(found["largest"])


def test_utilisations_are_plain_values_and_a_plain_response_has_none():
    assert json.loads(json.dumps(verdict([[2, 4], [16, 4]]))) == verdict([[2, 4], [16, 4]])
    assert utilisations(response([[1]])) == {}
