"""Limits in a study: the worst case of each and the share of cases beyond it."""

import json
import math

import numpy as np
import pytest
from report_study import write_study
from running import gush

import coupling
from coupling.datasets import read_response
from coupling.studies.limits import limits_of_case, limits_of_study
from structure import additional, utilisations
from structure.limits import CHECK_VARIABLES

pytestmark = pytest.mark.slow

CONVERGENCE = "convergence_utilisation"


def folders(folder):
    return sorted(path.parent for path in folder.rglob("run.nc"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two gates and two soils; a limit between the least and the largest convergence of the cases."""
    place = tmp_path_factory.mktemp("limits")
    cases = {"gate.angle": [90.0, 45.0], "soils.0.friction_angle": [25.0, 30.0]}
    fixed = {"stop.inflow_mass": 300.0, "limits.convergence_per_mille": 1.87}  # the cases come to 1.82 to 1.94
    with pytest.MonkeyPatch.context() as monkeypatch:
        return write_study(place / "checked", monkeypatch, backends=("beam-spring",), fixed=fixed, parameters=cases)


def test_study_tells_the_worst_case_and_the_share_beyond(folder):
    data = json.loads(gush("study", folder, "--workers", "0", "--json", "-").stdout)
    done = {case["case"]: case["utilisations"][CONVERGENCE] for case in data["cases"] if case["status"] == "finished"}
    found = data["limits"][CONVERGENCE]
    assert list(data["limits"]) == [CONVERGENCE] and found["cases"] == len(done) == 4
    assert found["largest"] == max(one["largest"] for one in done.values()) == done[found["worst_case"]]["largest"]
    assert 0 < found["beyond"] < 4 and found["share"] == found["beyond"] / 4
    beyond = [one for one in done.values() if one["largest"] > 1]
    assert found["least_passing_mass"] == min(one["passing_mass"] for one in beyond)
    assert all(one["passing_mass"] is None for one in done.values() if one["largest"] <= 1)


def test_case_has_what_all_records_of_its_run_say(folder):
    dataset = coupling.read_study(folder)
    for run in folders(folder):
        expected = utilisations(read_response(run))[CONVERGENCE]
        of_model = dataset.sel(model="beam-spring")
        (case,) = np.flatnonzero(of_model[f"{CONVERGENCE}_largest"] == expected["largest"])
        passing = of_model[f"{CONVERGENCE}_passing_mass"].item(case)
        assert math.isnan(passing) if expected["passes"] is None else passing == expected["passes"]["inflow_mass"]
    assert not set(CHECK_VARIABLES) & set(dataset.data_vars)


def test_table_of_the_study_shows_its_limits(folder):
    shown = gush("study", folder, "--workers", "0").output
    assert "worst case" in shown and "of 4" in shown


def test_share_counts_the_cases_that_are_held_against_the_limit():
    cases = {
        2: {"crack_utilisation": {"largest": 1.4, "passing_mass": 80.0}},
        4: {"crack_utilisation": {"largest": math.inf, "passing_mass": 20.0},
            "shear_utilisation": {"largest": 1.0, "passing_mass": None}},
        5: {"crack_utilisation": {"largest": 0.3, "passing_mass": None}},
        7: {},
    }  # fmt: skip
    found = limits_of_study(cases)
    assert found["crack_utilisation"] == {
        "cases": 3, "beyond": 2, "share": pytest.approx(2 / 3), "worst_case": 4, "largest": math.inf,
        "least_passing_mass": 20.0,
    }  # fmt: skip
    assert found["shear_utilisation"]["beyond"] == 0 and found["shear_utilisation"]["least_passing_mass"] is None
    assert limits_of_study({}) == {}


def test_case_without_limits_or_model_has_none(folder):
    case = coupling.read_study(folder).isel(case=0)
    assert limits_of_case(case, None) == {}
    assert limits_of_case(case.drop_vars(f"{CONVERGENCE}_largest"), "beam-spring") == {}


def test_what_an_event_adds_has_no_checks(folder):
    added = additional(read_response(folders(folder)[0]))
    assert not set(CHECK_VARIABLES) & set(added.data_vars)


def test_page_of_the_study_tells_its_limits(folder):
    from coupling.report import page, study_page

    shown = study_page.collect(folder, folder)
    ((cells, beyond),) = shown["limits"]["rows"]
    data = json.loads(gush("study", folder, "--workers", "0", "--json", "-").stdout)
    found = data["limits"][CONVERGENCE]
    assert beyond and cells[3] == f"{found['beyond']} of 4 ({found['share']:.0%})"
    assert cells[1] == data["cases"][found["worst_case"]]["name"] and cells[2] == f"{found['largest']:.2f}"
    assert '<h2 id="limits">Limits</h2>' in page.rendered(shown)
