"""Parameters of a scene from measurements: runs, emulators, posterior, and bands of what follows."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import chi2, qmc
from threadpoolctl import threadpool_limits

from coupling.files.provenance import made_here
from coupling.fits.emulator import SMALLEST_SPREAD, Emulator, require_scikit_learn
from coupling.fits.ensemble import FEWEST_A_PARAMETER, Ensemble, read_ensemble
from coupling.fits.posterior import Likelihood, Sample, sample
from coupling.fits.prediction import curve_emulators, predicted, sobol
from coupling.fits.prior import FitPlan, places_of, read_plan, values_of
from coupling.measurements import read_measurements
from coupling.measurements.measurement import Measurement, error_covariance
from coupling.measurements.misfit import misfit_table
from coupling.refused import Refused
from coupling.studies.collect import units_of
from coupling.studies.execute import study

Array = NDArray[np.float64]

TITLE = "fit of a scene to measurements"
#: Shares of the distributions that bands are told by; the outer ones hold 90 %.
LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
KNOWLEDGE = ("prior", "posterior")


class Observed(NamedTuple):
    """The emulator of what was measured: which measurements all used runs got to, and which runs these are."""

    emulator: Emulator
    reached: Array
    used: Array


def fit(
    scene: str | Path,
    measurements: str | Path | xr.Dataset | tuple[Measurement, ...],
    priors: str | Path | dict | FitPlan,
    out: str | Path,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[str], None] | None = None,
    watch: Callable | None = None,
) -> xr.Dataset:
    """Fit parameters of a scene to measurements, and predict what follows.

    The runs are a study in `out`/ensemble: what is there is not run again, also with other measurements.

    Parameters
    ----------
    scene : str or path
        Built-in scene or TOML file.
    measurements : path, xarray.Dataset or tuple of Measurement
        As of :func:`coupling.measurements.read_measurements`.
    priors : path, dict or FitPlan
        TOML file of a :class:`coupling.fits.prior.FitPlan`.
    out : path
    workers, scheduler, progress, watch
        As of :func:`coupling.study`.

    Returns
    -------
    xarray.Dataset
        Over knowledge ("prior", "posterior") and level (share of the distribution below): parameter_value (..,
        parameter); NAME (.., time), bands of quantities of the runs, the error of the emulator in them; passing_time
        (.., limit) [s], infinite beyond the last time, share_passing (knowledge, limit) [-]. Of the emulators by
        cross-validation: measured_error, in its unit, measured_explained, measured_standardised [-] (measurement) and
        NAME_error, NAME_explained, NAME_standardised (time). first_order, total_order (quantity, parameter): Sobol
        indices of the quantities at the last time under the prior. draw_value (draw, parameter). Measurements as of
        :func:`coupling.measurements.misfit` (time and inflow_mass as measured_time, measured_inflow_mass), `computed`
        at the median, with computed_band (measurement, level).
        Attributes runs, failed; chi_square, probability: of the closest draw, per measurement; steps, accepted,
        different: of :class:`coupling.fits.posterior.Sample`.

    Raises
    ------
    Refused, StudyError
        Before anything runs: a mistake in scene, priors or measurements, or no scikit-learn. After the runs: too few
        finished, or got to what was measured.
    """
    require_scikit_learn()
    plan = read_plan(priors)
    given = measurements if isinstance(measurements, tuple) else read_measurements(measurements)
    folder = Path(out) / "ensemble"
    study(plan.study(scene), folder, workers, scheduler, progress, watch)
    return fitted(plan, given, read_ensemble(plan, given, folder))


@threadpool_limits.wrap(limits=1, user_api="blas")  # matrices of a hundred rows: other threads only wait
def fitted(plan: FitPlan, given: tuple[Measurement, ...], ensemble: Ensemble) -> xr.Dataset:
    """The dataset of :func:`fit` from runs that are done."""
    observed = observe(ensemble)
    found, likelihood = infer(plan, given, observed)
    rng = np.random.default_rng(plan.seed)
    before = qmc.LatinHypercube(len(plan.parameters), rng=rng).random(plan.draws)
    shares = {"prior": before, "posterior": found.shares}
    where = {key: places_of(plan, each) for key, each in shares.items()}
    emulators = curve_emulators(ensemble)
    result = predicted(plan, ensemble.time, emulators, where, LEVELS).merge(sobol(plan, emulators))
    values = {key: values_of(plan, each) for key, each in shares.items()}
    bands = np.array([np.quantile(each, LEVELS, axis=0).T for each in values.values()])
    result["parameter_value"] = (("knowledge", "parameter", "level"), bands)
    result["draw_value"] = (("draw", "parameter"), values["posterior"])
    ranges = [prior.range for prior in plan.parameters.values()]
    result = result.assign_coords(
        parameter=list(plan.parameters),
        unit_of_parameter=("parameter", [units_of(name) for name in plan.parameters]),
        range_low=("parameter", [each.low for each in ranges]),
        range_high=("parameter", [each.high for each in ranges]),
    )
    result = result.merge(_measured(given, observed, where["posterior"], rng))
    least = float(likelihood.chi_square(where["posterior"]).min())
    count = int(observed.reached.sum())
    numbers = {"runs": int(observed.used.sum()), "failed": ensemble.failed, "count": count,
               "chi_square": least / count, "probability": float(chi2.sf(least, count)),
               **{key: getattr(found, key) for key in ("steps", "accepted", "different")}}  # fmt: skip
    return result.assign_attrs(made_here(TITLE, "parameters fitted to measurements") | numbers)


def observe(ensemble: Ensemble) -> Observed:
    """The emulator of what was measured, of the runs that got to all of it that most runs got to.

    Raises Refused: too few runs did.
    """
    known = np.isfinite(ensemble.measured)
    reached = known.mean(axis=0) >= 0.5
    used = known[:, reached].all(axis=1)
    fewest = FEWEST_A_PARAMETER * (ensemble.places.shape[1] + 1)
    if not reached.any() or used.sum() < fewest:
        raise Refused(
            f"fit: at least {fewest} runs must get to all measurements, got {int(used.sum()) if reached.any() else 0} "
            f'of {len(used)}; let the runs go on, as by "stop.time" under [fixed], or leave the last measurements out'
        )
    outputs = ensemble.measured[np.ix_(used, reached)]
    spread = outputs.std(axis=0)
    size = np.maximum(abs(outputs).max(axis=0), 1e-300)
    scale = np.where(spread > SMALLEST_SPREAD * size, spread, size)
    return Observed(Emulator(ensemble.places[used], outputs, scale), reached, used)


def infer(plan: FitPlan, given: tuple[Measurement, ...], observed: Observed) -> tuple[Sample, Likelihood]:
    """Draws from the posterior distribution of the parameters, and the likelihood that made it of the priors."""
    own = [one for one, there in zip(given, observed.reached, strict=True) if there]
    likelihood = Likelihood(observed.emulator, np.array([one.value for one in own]), error_covariance(own))

    def logarithm(shares):
        return likelihood.logarithm(places_of(plan, shares))

    return sample(logarithm, len(plan.parameters), plan.draws, plan.seed), likelihood


def _measured(given, observed, where, rng):
    """Measurements beside what the emulator gives at the draws, and its error."""
    reached, emulator = observed.reached, observed.emulator

    def over_all(values):
        whole = np.full((len(given), *values.shape[1:]), np.nan)
        whole[reached] = values
        return whole

    band = over_all(np.quantile(emulator.draws(where, rng), LEVELS, axis=0).T)
    result = misfit_table(given, band[:, LEVELS.index(0.5)], np.array([np.nan] * len(given)))
    result["computed_band"] = (("measurement", "level"), band)
    validation = emulator.validation
    for name in validation._fields:
        result[f"measured_{name}"] = ("measurement", over_all(getattr(validation, name)))
    return result.drop_vars("run_time").rename(time="measured_time", inflow_mass="measured_inflow_mass")
