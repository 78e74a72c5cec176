"""Error against run time: orders, fronts and extrapolation by hand, a ladder over a problem with a known error."""

import json
from importlib import import_module

import numpy as np
import pytest
import xarray as xr
from report_study import synthetic_run
from running import gush

import coupling
from verification.accuracy.ladders import assess, dataset, measure
from verification.accuracy.orders import excess_over_front, extrapolate, observed_order, pareto_front
from verification.problems.problem import Problem, Result
from verification.sensitivity.inflow import error_bars, measured_table, spread
from verification.sensitivity.mesh import scene_ladder, write_ladder
from verification.sensitivity.variants import meshes


def solve(cells=8, courant=0.5, friction_angle=30.0):
    """Error 1/cells^2 + 0.001 courant; cost cells^3/courant."""
    if cells > 1000:
        raise ArithmeticError("did not converge")
    return Result(
        error=1 / cells**2 + 0.001 * courant,
        values={"answer": 1.0},
        steps=cells,
        points=cells,
        cpu_seconds=cells**3 / courant,
    )


PROBLEM = Problem(
    name="parabola",
    title="known error",
    source="by hand",
    norm="difference",
    solve=solve,
    fast={"cells": 8, "courant": 0.5},
    ladder={"cells": (4, 8, 16, 2000), "courant": (0.25, 1.0), "friction_angle": (10.0, 40.0)},
    limit=0.02,
    why="1/64 and the time step's half per mille",
)


def test_order_is_the_slope_of_the_logarithms():
    size = np.array([1.0, 0.5, 0.25])
    assert observed_order(size, 3 * size**2) == pytest.approx(2)
    assert np.isnan(observed_order([1.0, 1.0], [1.0, 2.0])) and np.isnan(observed_order([1.0], [1.0]))


def test_front_is_what_nothing_beats_in_both():
    cost, error = np.array([1.0, 2.0, 3.0, 3.0]), np.array([0.5, 0.6, 0.1, 0.2])
    assert pareto_front(cost, error).tolist() == [True, False, True, False]
    assert excess_over_front(cost, error, 1) == pytest.approx(1.2)
    assert excess_over_front(cost, error, 2) == 1.0


def test_extrapolation_finds_the_value_at_size_zero_and_covers_scatter():
    size = np.array([2.0, 2.0, 1.0, 0.5])
    exact = extrapolate(size, 5 + 3 * size)
    assert exact.value == pytest.approx(5) and exact.scatter < 1e-12
    assert exact.error == pytest.approx(1.5)  # distance of the finest
    generator = np.random.default_rng(1)
    size = np.repeat([2.0, 1.41, 1.0, 0.7], 3)
    inside = 0
    for _ in range(200):
        found = extrapolate(size, 5 + 0.01 * size + generator.normal(0, 1, len(size)))
        inside += abs(found.value - 5) <= found.error
    assert inside > 180  # twice the standard error covers 95 %, the distance of the finest more
    with pytest.raises(ValueError, match="add a finer or a coarser mesh"):
        extrapolate([1.0, 1.0, 1.0], [1.0, 2.0, 3.0])


def test_ladder_measures_orders_front_and_failures():
    rows = measure(PROBLEM)
    assert [row["value"] for row in rows] == [None, 4, 8, 16, 2000, 0.25, 1.0, 10.0, 40.0]
    assert rows[4]["failure"] == "did not converge" and np.isnan(rows[4]["error"])
    verdict = assess(rows)
    assert verdict["orders"].keys() == {"cells", "courant"}  # another friction angle is another problem
    assert 1.9 < verdict["orders"]["cells"] < 2.0
    assert verdict["excess"] == 1.0
    table = dataset(rows)
    assert table.sizes["run"] == 9 and int(table["on_front"][1]) == 1
    assert table["cpu_seconds"].attrs["units"] == "s"


def test_command_writes_page_data_and_pictures(tmp_path, monkeypatch):
    monkeypatch.setattr("verification.problems.problems", lambda: {"parabola": PROBLEM})
    result = gush("accuracy", "--out", tmp_path, "--json", tmp_path / "data.json")
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "data.json").read_text())
    assert data["problems"]["parabola"]["within"] is True
    page = (tmp_path / "accuracy.md").read_text()
    assert "| [parabola](#parabola) | 1.61e-02 | 0.02 |" in page and "failed: did not converge" in page
    for picture in ("accuracy-overview.png", "accuracy-parabola.png"):
        assert f"images/{picture}" in page and (tmp_path / "images" / picture).stat().st_size > 5000
    with xr.open_dataset(tmp_path / "accuracy.nc", engine="h5netcdf") as stored:
        assert stored.sizes["run"] == 9
    result = gush("accuracy", "parabol", "--out", tmp_path)
    assert result.exit_code == 2 and "did you mean 'parabola'" in result.output


def test_refined_scene_keeps_the_gate_in_whole_elements():
    scene = coupling.load_scene("case-3")
    finer = coupling.load_scene("case-3", **meshes(scene, 0.5**0.5)).discretisation
    assert finer.elements_across_gate == 11 and finer.element_size == pytest.approx(0.75 * 0.5**0.5)
    assert meshes(scene, 4.0)["discretisation.elements_across_gate"] == 2


def test_page_of_a_mesh_ladder_says_value_and_error_bar(tmp_path):
    factor = np.array([2.0, 1.0, 0.5])
    found = {500.0: {"M max [kN m/m]": 100 + 10 * factor, "N max [kN/m]": 50 - factor}}
    written = write_ladder("case-3", factor, found, np.ones(3), tmp_path)
    assert "| M max [kN m/m] | 110 | 100 | ±5 |" in (tmp_path / "case-3-ladder.md").read_text()
    assert (tmp_path / "images" / "case-3-ladder-500.png").stat().st_size > 5000
    with xr.open_dataset(written["data"], engine="h5netcdf") as stored:
        assert stored["error_bar"].sel(quantity="M max [kN m/m]").item() == pytest.approx(5.0)


@pytest.mark.slow
def test_mesh_ladder_of_a_scene_runs_its_meshes_once(tmp_path, monkeypatch):
    sizes, lines = [], []

    def run(scene, folder, **options):
        sizes.append(scene.discretisation.element_size)
        synthetic_run(scene, folder, **options)

    monkeypatch.setattr(import_module("coupling.runs.run"), "run", run)
    monkeypatch.setattr("verification.sensitivity.mesh.draw", lambda state, path: None)  # drawn by the test above
    study = coupling.study
    monkeypatch.setattr(coupling, "study", lambda plan, out, **options: study(plan, out, **{**options, "workers": 0}))
    for _ in range(2):
        written = scene_ladder("quick", 300.0, tmp_path / "out", lines.append, factors=(1.0, 0.9, 0.8))
    np.testing.assert_allclose(sizes, 1.5 * np.array([1.0, 0.9, 0.8]))
    assert sum(line.endswith("done") for line in lines) == 3
    with xr.open_dataset(written["data"], engine="h5netcdf") as stored:
        assert stored.sizes == {"mesh": 3, "inflow_mass": 5, "quantity": len(stored["quantity"])}
        time = stored["value"].sel(quantity="time [s]")
        assert (time.isel(inflow_mass=-1) > time.isel(inflow_mass=1)).all()
        assert np.isfinite(stored["value"]).all()


def test_error_bars_take_the_meshes_apart_from_all_other_choices():
    variants = ["as the scene has it", *(f"all elements {k} times as large" for k in (2, 1.4, 0.7)), "courant 0.4",
                "half the elements across the gate"]  # fmt: skip
    found = {"M max [kN m/m]": np.array([110.0, 120.0, 114.0, 107.0, 113.0, 200.0])}
    assert "| M max [kN m/m] | 110 | 100 | 7 | 3 |" in "\n".join(error_bars(variants, found))
    assert "M max -2.7 .. +81.8 %" in spread(found)
    assert "| courant 0.4 | 113 |" in "\n".join(measured_table(variants, found))
