"""The angles around a lining at which a run file holds its pressures: 360 cells of one degree."""

import numpy as np
from numpy.typing import NDArray

from mpm.fields import WHOLE_DEGREES


def cell_centres() -> NDArray[np.float64]:
    """Centres of the 360 one-degree cells: 0, 1, .. 359 [degree]."""
    return WHOLE_DEGREES.copy()


def cell_bounds() -> NDArray[np.float64]:
    """Lower and upper bound of every cell, (360, 2) float64 [degree]; the first is -0.5 .. 0.5."""
    return cell_centres()[:, None] + np.array([-0.5, 0.5])


def cell_mean_weights(theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights that turn nodal values into cell means of their piecewise linear periodic interpolation.

    The interpolation is integrated exactly over every cell, so the integral around the ring is kept.

    Parameters
    ----------
    theta : (n,) float64
        Angles of the nodes [degree], ascending in [0, 360), at least two.

    Returns
    -------
    (360, n) float64
        Rows sum to 1.
    """
    theta = np.asarray(theta, float)
    n = len(theta)
    if n < 2 or theta[0] < 0 or theta[-1] >= 360 or np.any(np.diff(theta) <= 0):
        raise ValueError(f"theta: at least two ascending angles in [0, 360) degrees, got {n} between {theta.min():g} "
                         f"and {theta.max():g}; sort them and drop repeated ones")  # fmt: skip
    edges = cell_bounds()[:, 0]
    breaks = np.unique(np.concatenate([edges, edges[:1] + 360.0, theta, theta - 360.0]))
    breaks = breaks[(breaks >= edges[0]) & (breaks <= edges[0] + 360.0)]
    middle, length = 0.5 * (breaks[1:] + breaks[:-1]), np.diff(breaks)
    cell = np.floor(middle + 0.5).astype(int)
    # on a piece without a break inside, the mean of a linear function is its value in the middle
    wrapped = np.concatenate([theta[-1:] - 360.0, theta, theta[:1] + 360.0])
    left = np.searchsorted(wrapped, middle) - 1
    share = (middle - wrapped[left]) / (wrapped[left + 1] - wrapped[left])
    weights = np.zeros((360, n))
    np.add.at(weights, (cell, (left - 1) % n), length * (1 - share))
    np.add.at(weights, (cell, left % n), length * share)
    return weights
