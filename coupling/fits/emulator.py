"""What a run would give, from what others gave: a Gaussian process for each output or component, and its error."""

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve

from coupling.refused import Refused

Array = NDArray[np.float64]

#: So many outputs have a process each; more are turned to principal components first.
MOST_ALONE = 24
#: Over the scale of an output: what varies less between the runs depends on no parameter.
SMALLEST_SPREAD = 1e-6
#: Components are taken until they hold this share of the outputs' variance, or are so many.
SHARE_KEPT, MOST_COMPONENTS = 0.9995, 12


def require_scikit_learn() -> None:
    """Refuse to begin without the library of the Gaussian processes."""
    try:
        import sklearn.gaussian_process  # noqa: F401
    except ImportError:
        raise Refused(
            "gush fit: needs scikit-learn, which is not installed; install it with: pip install 'gushing[fit]' "
            "(in a clone: uv sync --extra fit)"
        ) from None


class Validation(NamedTuple):
    """Leave-one-out cross-validation, of each output over all runs, (m,) float64.

    error : root of the mean squared error, in the output's unit;  explained : share of the variance, 1 - sum of squared
    errors over that around the mean, 1 where nothing varies [-];  standardised : root of the mean squared error over
    the variance that the emulator gives [-], 1 where it knows its error.
    """

    error: Array
    explained: Array
    standardised: Array


class Emulator:
    """Outputs of runs over the places of their parameters.

    Each output, less its mean and over `scale`, or each principal component where there are many, is a Gaussian process
    (Matern 5/2, a correlation length a parameter, noise); what components leave is noise of each output. Errors of
    components are normal, correlated as leave-one-out finds them, shrunk towards no correlation since runs are few, and
    enlarged where it finds them too small.

    Parameters
    ----------
    places : (n, d) float64
        Parameters of the runs, each from 0 to 1 over its range.
    outputs : (n, m) float64
    scale : (m,) float64
        Sizes by which outputs count, in their units; above 0.

    Attributes
    ----------
    mean, scale : (m,);  basis : (k, m), orthonormal components;  left : (n, m), what they leave of each run's outputs
    over scale;  correlation : (k, k), of the errors of the components over their deviations;  validation : Validation,
    with the basis, noise and correlation lengths of all runs.

    Source: Higdon, Gattiker, Williams & Rightley (2008); leave-one-out: Dubrule (1983), Rasmussen & Williams (2006),
    eq. 5.12; shrinking: Ledoit & Wolf (2004).
    """

    def __init__(self, places: Array, outputs: Array, scale: Array):
        self.mean, self.scale = outputs.mean(axis=0), scale
        scaled = (outputs - self.mean) / scale
        self.basis = _basis(scaled)
        components, count = scaled @ self.basis.T, len(self.basis)
        self.left = scaled - components @ self.basis
        self._sizes = np.sqrt(np.mean(components**2, axis=0))
        self._processes = [_process(places, values) for values in (components / self._sizes).T]
        apart = np.array([_left_out(process) for process in self._processes]).reshape(count, 2, len(places))
        errors, deviation = apart[:, 0].T, np.sqrt(apart[:, 1].T)
        self.correlation = _correlation(errors / deviation)
        self.validation = self._validated(scaled, errors * self._sizes, deviation * self._sizes)

    def _validated(self, scaled, errors, deviation):
        missed = errors @ self.basis + self.left
        parts = deviation[:, :, None] * self.basis
        known = np.sum(parts * (self.correlation @ parts), axis=1) + self.variance_left
        spread = np.sum(scaled**2, axis=0)
        varies = spread > SMALLEST_SPREAD**2 * len(scaled)
        unexplained = np.sum(missed**2, axis=0) / np.where(varies, spread, 1.0)
        return Validation(
            error=np.sqrt(np.mean(missed**2, axis=0)) * self.scale,
            explained=np.where(varies, 1 - unexplained, 1.0),
            standardised=np.sqrt(np.mean(missed**2 / np.maximum(known, 1e-300), axis=0)),
        )

    @property
    def variance_left(self) -> Array:
        """Variance of what the components leave, of each output over scale, (m,)."""
        return np.mean(self.left**2, axis=0)

    def components(self, places: Array) -> tuple[Array, Array]:
        """Means and standard deviations of the components of the outputs over scale at places (p, d), (p, k) each.

        The covariance of their errors is that of `correlation` times the deviations.
        """
        if not self._processes:
            return np.zeros((len(places), 0)), np.zeros((len(places), 0))
        pairs = [process.predict(places, return_std=True) for process in self._processes]
        mean, deviation = (np.column_stack(part) for part in zip(*pairs, strict=True))
        return mean * self._sizes, deviation * self._sizes

    def outputs(self, components: Array) -> Array:
        """Outputs (p, m) of components (p, k)."""
        return self.mean + self.scale * (components @ self.basis)

    def draws(self, places: Array, rng: np.random.Generator) -> Array:
        """Outputs (p, m) at places (p, d), each with an error of the emulator."""
        mean, deviation = self.components(places)
        drawn = mean + deviation * (rng.normal(size=mean.shape) @ np.linalg.cholesky(self.correlation).T)
        return self.outputs(drawn) + self.scale * self.left[rng.integers(len(self.left), size=len(places))]


def _basis(scaled):
    """Orthonormal components (k, m) of outputs (n, m) around 0: those that vary, or their principal components."""
    if scaled.shape[1] <= MOST_ALONE:
        return np.eye(scaled.shape[1])[scaled.std(axis=0) > SMALLEST_SPREAD]
    _, sizes, right = np.linalg.svd(scaled, full_matrices=False)
    held = np.cumsum(sizes**2) / max(np.sum(sizes**2), 1e-300)
    return right[: min(int(np.argmax(held >= SHARE_KEPT)) + 1, MOST_COMPONENTS)]


def _process(places, values):
    """The Gaussian process of one component of unit size."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    lengths = np.full(places.shape[1], 0.5)
    kernel = ConstantKernel(1.0, (1e-2, 1e3)) * Matern(lengths, (0.05, 50.0), nu=2.5) + WhiteKernel(1e-3, (1e-8, 1.0))
    process = GaussianProcessRegressor(kernel, n_restarts_optimizer=1, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound: it does not matter
        return process.fit(places, values)


def _correlation(standardised):
    """Second moments (k, k) of errors (n, k) over what their processes give, shrunk; on the diagonal 1 where less."""
    from sklearn.covariance import ledoit_wolf

    if not standardised.shape[1]:
        return np.zeros((0, 0))
    moments = ledoit_wolf(standardised, assume_centered=True)[0]
    own = np.sqrt(np.maximum(1.0, 1 / np.maximum(np.diag(moments), 1e-12)))
    return moments * np.outer(own, own) + 1e-9 * np.eye(len(own))


def _left_out(process):
    """Error and variance at each run from all others, (n,) each, for the noise and lengths of all."""
    inverse = cho_solve((process.L_, True), np.eye(len(process.L_)))
    variance = 1 / np.diag(inverse)
    return process.alpha_ * variance, variance
