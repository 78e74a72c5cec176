"""What measurements say of the parameters: the likelihood of an emulator, and draws from the posterior distribution."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import logsumexp
from scipy.stats import qmc

from coupling.fits.emulator import Emulator

Array = NDArray[np.float64]

#: Each step towards the posterior leaves so large a share of the draws effective.
SHARE_EFFECTIVE = 0.5
#: Random walks of every draw after each step, and after the last one.
MOVES, LAST_MOVES = 6, 20
#: Share of moves that is aimed at: Roberts, Gelman & Gilks (1997).
ACCEPTED = 0.3


class Likelihood:
    """Probability of what was measured, by an emulator whose outputs it is: normal errors of both.

    Parameters
    ----------
    emulator : Emulator
    measured : (m,) float64
    covariance : (m, m) float64
        Of the errors of the measurements, in the products of their units.

    Notes
    -----
    Of the covariance C = A + V S V', only that of the components' errors, S, depends on the parameters. With the
    differences whitened by A, and Q R = A^-1/2 V, what lies outside of Q is constant, and k by k matrices remain.
    """

    def __init__(self, emulator: Emulator, measured: Array, covariance: Array):
        self._emulator = emulator
        constant = covariance / np.outer(emulator.scale, emulator.scale) + np.diag(emulator.variance_left)
        factor = np.linalg.cholesky(constant)
        difference = solve_triangular(factor, (measured - emulator.mean) / emulator.scale, lower=True)
        directions, self._along = np.linalg.qr(solve_triangular(factor, emulator.basis.T, lower=True))
        self._difference = directions.T @ difference
        self._outside = float(difference @ difference - self._difference @ self._difference)

    def _terms(self, components):
        """Squared differences over their covariance and logarithm of its determinant, (p,) each."""
        mean, deviation = components
        left = self._difference - mean @ self._along.T
        parts = self._along * deviation[:, None, :]
        matrix = np.eye(left.shape[1]) + parts @ self._emulator.correlation @ parts.swapaxes(1, 2)
        square = np.einsum("pi,pi->p", left, np.linalg.solve(matrix, left[..., None])[..., 0])
        return square, np.linalg.slogdet(matrix)[1]

    def logarithm(self, places: Array) -> Array:
        """Logarithm of the likelihood at places (p, d) but for a constant, (p,)."""
        return self.logarithm_of(self._emulator.components(places))

    def logarithm_of(self, components: tuple[Array, Array]) -> Array:
        """The same where the emulator gives these means and deviations (p, k) of its components."""
        square, determinant = self._terms(components)
        return -0.5 * (square + determinant)

    def chi_square(self, places: Array) -> Array:
        """Squared differences over their covariance at places (p, d), (p,)."""
        return self._terms(self._emulator.components(places))[0] + self._outside


class Sample(NamedTuple):
    """Draws from a posterior distribution.

    shares : (count, d) float64, each parameter as the share of its prior below it;  steps : int, from prior to
    posterior;  accepted : float, share of the last moves;  different : float, share of draws that are not repeated.
    """

    shares: Array
    steps: int
    accepted: float
    different: float


def sample(logarithm: Callable[[Array], Array], dimensions: int, count: int, seed: int = 0) -> Sample:
    """Draws from the distribution over the unit cube whose density is that of a likelihood.

    The likelihood is raised to powers that grow from 0 to 1; after each step the draws are resampled by their weights
    and moved by random walks, so several separate maxima are kept.

    Parameters
    ----------
    logarithm : callable
        Logarithm of the likelihood (p,) at shares (p, d).
    dimensions, count, seed : int

    Source: Del Moral, Doucet & Jasra (2006).
    """
    rng = np.random.default_rng(seed)
    shares = qmc.LatinHypercube(dimensions, rng=rng).random(count)
    values = logarithm(shares)
    power, steps, accepted, size = 0.0, 0, 0.0, 2.4 / dimensions**0.5
    while power < 1:
        step = _step(values, 1 - power)
        weights = np.exp(step * values - logsumexp(step * values))
        power, steps = (1.0 if step >= 1 - power else power + step), steps + 1
        spread = np.atleast_2d(np.cov(shares.T, aweights=weights)) + 1e-12 * np.eye(dimensions)
        factor = np.linalg.cholesky(spread)
        chosen = np.searchsorted(np.cumsum(weights), (np.arange(count) + rng.random()) / count).clip(max=count - 1)
        shares, values = shares[chosen], values[chosen]
        for _ in range(LAST_MOVES if power == 1 else MOVES):
            proposed = _folded(shares + size * rng.normal(size=shares.shape) @ factor.T)
            there = logarithm(proposed)
            taken = np.log(rng.random(count)) < power * (there - values)
            shares, values = np.where(taken[:, None], proposed, shares), np.where(taken, there, values)
            accepted = float(taken.mean())
            size *= np.exp(accepted - ACCEPTED)
    return Sample(shares, steps, accepted, len(np.unique(shares, axis=0)) / count)


def _step(values, most):
    """Largest step of the power, up to `most`, that leaves the share of effective draws."""

    def effective(step):
        return np.exp(2 * logsumexp(step * values) - logsumexp(2 * step * values)) / len(values)

    if effective(most) >= SHARE_EFFECTIVE:
        return most
    low, high = 0.0, most
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(middle) >= SHARE_EFFECTIVE else (low, middle)
    return high


def _folded(shares):
    """Shares beyond 0 or 1 mirrored there, which keeps the walk symmetric."""
    return 1 - abs(1 - np.mod(shares, 2.0))
