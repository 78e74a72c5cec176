"""Parameters from measurements: posteriors in closed form, errors that an emulator knows, and the command."""

import json
import sys
from importlib import import_module

import numpy as np
import pytest
import xarray as xr
from report_study import synthetic_run
from running import gush

from coupling.fits.emulator import Emulator
from coupling.fits.ensemble import Ensemble
from coupling.fits.fit import fitted
from coupling.fits.posterior import sample
from coupling.fits.prior import Prior, read_plan
from coupling.measurements.measurement import Measurement
from coupling.refused import Refused

PRIORS = {
    "gate.angle": {"mean": 90.0, "deviation": 10.0},
    "soils.0.hydraulic_conductivity": {"median": 1e-4, "factor": 2.0},
}


def pressure(value, error, common=0.0):
    return Measurement(quantity="water_pressure", place=90.0, time=0.0, value=value, unit="Pa", error=error,
                       common_error=common, sensor="P1")  # fmt: skip


def linear(plan, weights):
    """Runs whose outputs are linear in normal parameters of mean 0 and deviation 1; one output is the curve's, too."""
    study = plan.study("quick")
    rows = [list(row.values()) for row in study.combinations()]
    places = np.array([[p.place(v) for p, v in zip(plan.parameters.values(), row, strict=True)] for row in rows])
    measured = 6.0 * (places - 0.5) @ weights.T  # the range is six deviations wide
    time = np.array([0.0, 1.0, 2.0])
    curve = 0.6 + 0.1 * measured[:, :1] * time
    return Ensemble(places, measured, time, {"convergence_utilisation": curve, "inflow_mass": 50 * curve}, 0)


@pytest.fixture(scope="module")
def plan():
    return read_plan({"parameters": PRIORS, "samples": 32, "draws": 4096, "records": 3})


@pytest.fixture(scope="module")
def bayes(plan):
    """A linear model, what was measured of it, and the closed form of the posterior: mean and covariance."""
    weights = np.array([[1.0, 0.5], [0.3, -1.0], [1.0, 1.0]])
    measured, errors, common = np.array([0.8, -0.6, 1.1]), np.array([0.3, 0.3, 0.2]), np.array([0.2, 0.2, 0.4])
    given = tuple(pressure(*one) for one in zip(measured.tolist(), errors.tolist(), common.tolist(), strict=True))
    covariance = np.diag(errors**2) + np.outer(common, common)
    spread = np.linalg.inv(np.eye(2) + weights.T @ np.linalg.solve(covariance, weights))
    middle = spread @ weights.T @ np.linalg.solve(covariance, measured)
    return fitted(plan, given, linear(plan, weights)), middle, spread


def test_linear_model_with_normal_errors_has_the_posterior_of_the_closed_form(bayes):
    found, middle, spread = bayes
    draws = found["draw_value"].values
    standard = np.column_stack([(draws[:, 0] - 90) / 10, np.log(draws[:, 1] / 1e-4) / np.log(2.0)])
    deviation = np.sqrt(np.diag(spread))
    # 4096 correlated draws: means to some hundredths of a deviation, deviations to a few per cent
    np.testing.assert_allclose((standard.mean(axis=0) - middle) / deviation, 0.0, atol=0.1)
    np.testing.assert_allclose(standard.std(axis=0) / deviation, 1.0, atol=0.08)
    correlation = spread[0, 1] / deviation.prod()
    assert np.corrcoef(standard.T)[0, 1] == pytest.approx(correlation, abs=0.06)
    assert found.attrs["different"] > 0.9 and found.attrs["count"] == 3


def test_band_and_time_to_the_limit_follow_from_the_posterior(bayes):
    found, middle, spread = bayes
    weight = np.array([1.0, 0.5])
    mean, deviation = weight @ middle, np.sqrt(weight @ spread @ weight)
    last = found["convergence_utilisation"].sel(knowledge="posterior").isel(time=-1).values
    expected = 0.6 + 0.2 * (mean + deviation * np.array([-1.645, -0.674, 0.0, 0.674, 1.645]))
    np.testing.assert_allclose(last, expected, atol=0.1 * 0.2 * deviation)
    # passes 1 at time t where 0.6 + 0.1 y t = 1: by the last time, 2 s, for y > 2
    from scipy.stats import norm

    share = norm.sf(2.0, mean, deviation)
    assert found["share_passing"].sel(knowledge="posterior").item() == pytest.approx(share, abs=0.02)
    prior = norm.sf(2.0, 0.0, np.linalg.norm(weight))
    times = found["passing_time"].sel(knowledge="prior", limit="convergence_utilisation")
    assert found["share_passing"].sel(knowledge="prior").item() == pytest.approx(prior, abs=0.01)
    assert np.isinf(times.sel(level=0.5)) and (np.isfinite(times.sel(level=0.05)) == (prior > 0.05))


def test_sobol_indices_of_a_linear_function_are_the_squares_of_its_weights(bayes):
    found, *_ = bayes
    indices = found["first_order"].sel(quantity="inflow_mass").values
    # 512 draws of a quasi-random sequence
    np.testing.assert_allclose(indices, np.array([1.0, 0.25]) / 1.25, atol=0.05)


def test_emulator_knows_the_noise_of_its_outputs():
    rng = np.random.default_rng(2)
    places = rng.random((80, 2))
    smooth = np.column_stack([np.sin(3 * places[:, 0]) + places[:, 1], places[:, 0] * places[:, 1]])
    emulator = Emulator(places, smooth + 0.1 * rng.normal(size=smooth.shape), smooth.std(axis=0))
    # left-out errors hold the noise and what 80 runs do not say of the functions: some tenths more
    assert (emulator.validation.error > 0.08).all() and (emulator.validation.error < 0.15).all()
    np.testing.assert_allclose(emulator.validation.standardised, 1.0, atol=0.3)
    there = rng.random((200, 2))
    truth = np.column_stack([np.sin(3 * there[:, 0]) + there[:, 1], there[:, 0] * there[:, 1]])
    inside = (np.abs(emulator.outputs(emulator.components(there)[0]) - truth) < 2 * emulator.validation.error).mean()
    assert inside > 0.95


def test_two_separate_maxima_are_both_drawn_from():
    def logarithm(shares):
        return np.logaddexp(*(-0.5 * ((shares - middle) ** 2).sum(axis=1) / 0.03**2 for middle in (0.2, 0.8)))

    found = sample(logarithm, 2, 2048, seed=1)
    near = (found.shares < 0.5).all(axis=1)
    assert 0.4 < near.mean() < 0.6 and ((found.shares > 0.5).all(axis=1) | near).all()
    np.testing.assert_allclose(found.shares[near].std(axis=0), 0.03, rtol=0.1)  # of 1000 draws


def test_priors_have_their_quantiles_and_ranges():
    normal = Prior(mean=0.5, deviation=0.1, low=0.4)
    assert normal.quantile(np.array([0.0, 1.0])) == pytest.approx([0.4, 0.8]) and normal.range.low == 0.4
    lognormal = Prior(median=1e-4, factor=2.0)
    assert lognormal.quantile(0.5) == pytest.approx(1e-4) and lognormal.range.high == pytest.approx(8e-4)
    # within the cube of the factor a truncated normal holds 68.27 / 99.73 % in its middle
    assert lognormal.quantile(0.5 + 0.5 * 0.6827 / 0.9973) == pytest.approx(2e-4, rel=1e-3)
    uniform = Prior(low=1e-5, high=1e-3, scale="log")
    assert uniform.quantile(0.5) == pytest.approx(1e-4) and uniform.place(1e-4) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('"gate.angle" = {low = 60.0}', "gate.angle: low and high, mean and deviation, or median and factor"),
        ('"gate.angle" = {low = 90.0, high = 60.0}', "low: must be below high, got 90 and 60"),
        ('"gate.angle" = {mean = 90.0}', "deviation: must be given where mean is"),
        ('"gate.angle" = {mean = 90.0, deviation = "2 m"}', "must be a quantity in degree, got '2 m'"),
        ('"gate.angle" = [60.0, 90.0]', "must be a table of bounds or of a distribution"),
        ('"gate.angel" = {low = 60.0, high = 90.0}', "gate"),
    ],
)
def test_wrong_priors_are_refused_before_anything_runs(tmp_path, text, message):
    (tmp_path / "priors.toml").write_text("samples = 8\n[parameters]\n" + text + "\n")
    (tmp_path / "field.csv").write_text("quantity,time,value,unit,error\ninflow_mass,1,1,kg/m,1\n")
    where = ("--priors", tmp_path / "priors.toml", "--out", tmp_path / "out", "--workers", "0")
    result = gush("fit", "quick", tmp_path / "field.csv", *where)
    assert result.exit_code == 2 and message in result.output, result.output
    assert not list((tmp_path / "out").rglob("run.nc"))


def test_missing_scikit_learn_is_told_before_anything_runs(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "sklearn", None)
    monkeypatch.setitem(sys.modules, "sklearn.gaussian_process", None)
    result = gush(
        "fit", "quick", tmp_path / "field.csv", "--priors", tmp_path / "priors.toml", "--out", tmp_path / "out"
    )
    assert result.exit_code == 2 and "gushing[fit]" in result.output


@pytest.mark.slow
def test_command_finds_the_friction_angle_of_a_run_and_runs_nothing_twice(tmp_path, monkeypatch):
    import coupling
    from coupling.datasets import read_pressures

    begun = []

    def run(scene, folder, **options):
        begun.append(folder)
        synthetic_run(scene, folder, **options)

    monkeypatch.setattr(import_module("coupling.runs.run"), "run", run)
    synthetic_run(coupling.load_scene("quick", **{"soils.0.friction_angle": 31.0}), tmp_path / "truth")
    truth = read_pressures(tmp_path / "truth")["soil_pressure"]
    rows = [f"soil_pressure,{theta},{time},,{truth.sel(theta=theta).interp(time=time).item()!r},Pa,{error}"
            for theta, time, error in ((90.0, 0.3, 800.0), (0.0, 0.5, 800.0), (270.0, 0.8, 800.0))]  # fmt: skip
    rows.append("inflow_mass,,9,,1,kg/m,1")  # after the end
    (tmp_path / "field.csv").write_text("quantity,place,time,inflow_mass,value,unit,error\n" + "\n".join(rows) + "\n")
    (tmp_path / "priors.toml").write_text(
        'samples = 8\nrecords = 3\ndraws = 512\n[fixed]\n"limits.convergence_per_mille" = 1.0\n'
        '"ring.n_elements" = 72\n[parameters]\n'
        '"soils.0.friction_angle" = {low = 25.0, high = 37.0}\n'
    )
    words = ("fit", "quick", tmp_path / "field.csv", "--priors", tmp_path / "priors.toml", "--out", tmp_path / "out",
             "--workers", "0", "--json", tmp_path / "a.json")  # fmt: skip
    result = gush(*words)
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "a.json").read_text())
    band = data["parameters"]["soils.0.friction_angle"]["posterior"]
    # soil pressures change by 1 kPa a degree times cos: at waists and crown 1, 0 and -1: deviation 0.8 / sqrt(2) degree
    assert band["median"] == pytest.approx(31.0, abs=0.2)
    assert band["high"] - band["low"] == pytest.approx(2 * 1.645 * 0.8 / 2**0.5, rel=0.15)
    assert data["limits"]["convergence_utilisation"]["share_passing"] in (0.0, 1.0)
    assert "1 measurements are later than the end of most runs" in result.output and data["count"] == 3
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"ensemble", "fit.nc", "fit.png"}
    with xr.open_dataset(data["data"], engine="h5netcdf", decode_timedelta=False) as stored:
        assert stored["inflow_mass"].sel(knowledge="posterior").isel(time=-1).std() < 1e-6  # no parameter moves it
    assert len(begun) == 8

    def stopped(*arguments):
        raise KeyboardInterrupt  # all that comes after the runs is as it was

    monkeypatch.setattr(import_module("coupling.fits.fit"), "fitted", stopped)
    assert gush(*words).exit_code == 130 and len(begun) == 8


def test_runs_that_end_too_early_are_refused(plan):
    from coupling.fits.fit import observe

    ensemble = linear(plan, np.eye(2))
    early = ensemble._replace(measured=np.where(np.arange(32)[:, None] > 8, np.nan, ensemble.measured))
    with pytest.raises(Refused, match=r"at least 12 runs must get to all measurements, got 0 of 32"):
        observe(early)


def test_output_that_never_varies_has_nothing_to_explain():
    rng = np.random.default_rng(0)
    places = rng.random((16, 2))
    outputs = np.column_stack([np.full(16, 3.0) + 1e-12 * rng.normal(size=16), places @ [1.0, 2.0]])
    explained = Emulator(places, outputs, np.ones(2)).validation.explained
    assert explained[0] == 1.0 and 0.9 < explained[1] <= 1.0
