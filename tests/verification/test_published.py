"""The published study beside ours: a rehearsal on very coarse meshes; its rules on states made to pass or fail them."""

import re

import numpy as np
import pytest
import xarray as xr
from running import gush

import coupling
from coupling.postprocess import with_inflow
from structure.theory import theoretical_pressures
from verification.published.answers import twin_answers
from verification.published.evidence import RunEvidence, initial_theory, mirror_difference
from verification.published.page import write_page
from verification.published.run_all import plans
from verification.published.sensitivity_figure import changes, sensitivity_figure
from verification.published.sources import at_study_inflow, published_numbers
from verification.small_event import COARSE

pytestmark = pytest.mark.slow

FIXED = {f"discretisation.{name}": value for name, value in COARSE.items()} | {
    "numerics.relaxation_tolerance": 1e-3,
    "stop.inflow_mass": 40.0,
    "stop.time": 1.0,
    "output.interval": 0.002,
    "output.snapshot_interval": 0.03,
}


@pytest.fixture(scope="module")
def rehearsal(tmp_path_factory):
    """Case 3, case 9 and the twin tunnels, a hundred times too coarse, and the page of them."""
    folder = tmp_path_factory.mktemp("published")
    for name, scenes in (("table-2", ["case-3", "case-9"]), ("twin-and-mirror", ["twin-tunnels"])):
        plan = {"name": name, "design": "list", "records": 5, "fixed": FIXED, "parameters": {"scene": scenes}}
        study = coupling.study(plan, folder / name, workers=0)
        assert study["status"].values.tolist() == ["finished"] * len(scenes), study["message"].values
    return folder, write_page(folder, folder)


def test_page_answers_every_statement_and_draws_every_figure(rehearsal):
    folder, data = rehearsal
    page = (folder / "study.md").read_text(encoding="utf-8")
    numbers = "06 07 09 10 11 12 13 14 15 15-ring 16 17 19 20 21 22 23".split()
    assert sorted(data["figures"]) == numbers
    for path in re.findall(r"\]\((images/\S+)\)", page):
        assert (folder / path).stat().st_size > 10_000
    assert data["missing"] == ["case 3 mirrored", "sensitivity"]
    for published in ("1185", "-267", "+114", "+82", "+75", "2 and 3", "about 3", "about 1"):
        assert f"| {published} |" in page
    assert "not run" not in page and "| case-9 | 90° | 5 m | sand | beam-spring |" in page
    assert all(row["agrees"] in (True, False, None) for row in data["answers"])


def test_numbers_on_the_page_are_those_of_the_datasets(rehearsal):
    folder, data = rehearsal
    study = coupling.read_study(folder / "table-2")
    moment = study["joint_bending_moment"].isel(case=0, progress=0, model=0).values / 1e3
    ours = {row["statement"]: row["ours"] for row in data["answers"]}
    assert ours["initial M, joint 2 [kN m/m]"] == f"{moment[1]:.0f}"
    largest = study["bending_moment"].isel(case=0, model=0).max("theta")
    change = 100 * float(largest.interp(progress=0.5) / largest.isel(progress=0)) - 100
    # the page takes the state of the run, the study that between two of its five: equal at half of the last inflow
    assert float(re.match(r"[+-]\d+", ours["largest positive moment [%]"])[0]) == pytest.approx(change, abs=1.0)


def test_figures_command_draws_a_study(rehearsal, tmp_path):
    folder, _ = rehearsal
    result = gush("figures", folder / "twin-and-mirror", "--out", tmp_path / "figures")
    assert result.exit_code == 0, result.output
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {"figure-06.png", "figure-07.png"}
    result = gush("figures", tmp_path)
    assert result.exit_code == 2 and "run gush study first" in result.output


def test_theory_of_the_initial_pressures_is_that_of_the_ring():
    scene = coupling.load_scene("case-3")
    ours = initial_theory(scene, scene.tunnels[0])
    soil = scene.soils[0]
    buoyant = 9.81 * (1 - soil.porosity) * (soil.grain_density - 1000.0)
    theirs = theoretical_pressures(
        outer_diameter=6.6, cover=20.0, buoyant_unit_weight=buoyant, coefficient_at_rest=3 / 7
    ).isel(time=0)
    for name in ("soil_pressure", "water_pressure"):
        np.testing.assert_allclose(ours[name], theirs[name].interp(theta=ours["theta"]), rtol=1e-9)


def test_mirror_images_differ_by_nothing_and_others_do():
    theta, time = np.arange(360.0), np.array([0.0, 1.0])
    field = (1 + time)[:, None] * (2 + np.sin(np.radians(theta)) + 0.3 * np.cos(np.radians(3 * theta)))
    image = (1 + time)[:, None] * (2 - np.sin(np.radians(theta)) + 0.3 * np.cos(np.radians(3 * theta)))

    def run(values):
        return xr.Dataset(
            {"soil_pressure": (("time", "theta"), values), "water_pressure": (("time", "theta"), values),
             "inflow_mass": ("time", 100 * time)}, coords={"time": time, "theta": theta},
        )  # fmt: skip

    found = mirror_difference(run(field), run(image), 50.0)
    assert max(map(abs, found.values())) < 1e-12
    assert mirror_difference(run(field), run(field), 50.0)["soil_pressure"] > 0.3


def twin(widths):
    """Evidence of twin tunnels whose troughs have these widths at four inflow masses and grow."""
    x, time = np.arange(-39.5, 40.0), np.arange(5.0)
    rows = [0 * x] + [0.01 * k * np.exp(-(x**2) / (2 * w**2)) for k, w in enumerate(widths, start=1)]
    settlement = xr.DataArray(np.array(rows), dims=("time", "x"), coords={"time": time, "x": x}, name="settlement")
    history = xr.Dataset({"inflow_mass": ("time", 500 * time)}, coords={"time": time})
    theory = xr.Dataset({name: ("theta", np.full(8, 1e5)) for name in ("soil_pressure", "water_pressure")})
    pressures = xr.concat([theory, 1.04 * theory], dim="tunnel").expand_dims("time")
    nothing = dict.fromkeys(("scene", "history", "points", "mesh", "horizontal", "vertical"))
    return RunEvidence(
        masses=(500.0, 1000.0, 1500.0, 2000.0), pressures=pressures, responses={}, theory=[theory, theory],
        settlement=with_inflow(settlement.to_dataset(), history), **nothing,
    )  # fmt: skip


def test_rules_on_the_twin_tunnels_pass_and_fail():
    narrow = [answer.agrees for answer in twin_answers(twin([8.0, 8.1, 8.2, 8.3]))]
    # 4 % off theory: soil within 5 %, water not within 2 %; all the rest as published
    assert narrow == [True, False, True, True, True]
    wide = [answer.agrees for answer in twin_answers(twin([8.0, 12.0, 16.0, 20.0]))]
    assert wide[-2:] == [False, False]


def sensitivity_data():
    """A study of three cases: as it is, half the permeability and half the rate, one that failed."""
    import json

    mass, progress = np.linspace(0.0, 100.0, 11), np.linspace(0.0, 1.0, 11)
    time = np.stack([mass / 50, mass / 25, np.nan * mass])
    theta, joint = np.arange(0.0, 360.0, 90.0), np.arange(1, 7)
    ones = np.ones((3, 11))[..., None]
    forces = {name: (("case", "progress", "model", "theta"), ones[..., None] * np.ones(4) * 1e3)
              for name in ("axial_force", "shear_force", "bending_moment")}  # fmt: skip
    return xr.Dataset(
        {
            "time": (("case", "progress"), time),
            "soil_pressure": (("case", "progress", "theta"), ones * np.ones(4) * 1e3),
            "joint_rotation": (("case", "progress", "model", "joint"), ones[..., None] * np.ones(6)),
            "status": ("case", ["finished", "finished", "failed"]),
            **forces,
        },
        coords={
            "case": [0, 1, 2], "progress": progress, "inflow_mass": (("case", "progress"), np.tile(mass, (3, 1))),
            "theta": theta, "joint": joint, "model": ["beam-spring"],
            "soils_0_k": ("case", [2.0, 1.0, 0.5]),
        },
        attrs={"study": json.dumps({"parameters": {"soils.0.k": [1.0, 0.5]}})},
    )  # fmt: skip


def test_sensitivity_compares_at_equal_inflow_and_leaves_failures_out():
    table = changes(sensitivity_data())
    assert [row["change"] for row in table["rows"]] == ["as it is", "soils.0.k = 1"]
    assert [row["inflow rate"] for row in table["rows"]] == pytest.approx([50.0, 25.0])
    assert table["inflow_mass"] == 100.0 and len(sensitivity_figure(table).axes) == len(table["units"])


def test_study_at_an_inflow_mass_is_unknown_beyond_what_was_run():
    data = sensitivity_data()
    assert at_study_inflow(data, 45.0)["time"].values[:2] == pytest.approx([0.9, 1.8])
    assert np.isnan(at_study_inflow(data, 101.0)["time"]).all()


def test_full_study_has_the_published_stops_and_a_rehearsal_is_coarse():
    from coupling.studies.design import cases

    full, rehearsed = plans(), plans(coarse=True)
    assert len(cases(full[0])) == 10 and full[0].backends == ("beam-spring", "continuum")
    end = published_numbers()["gushing"]["end_inflow_mass"]
    assert {case.scene.stop.inflow_mass for plan in full[:2] for case in cases(plan)} == {end}
    sizes = {case.scene.discretisation.element_size for plan in rehearsed for case in cases(plan)}
    assert sizes == {coupling.load_scene("quick").discretisation.element_size}
