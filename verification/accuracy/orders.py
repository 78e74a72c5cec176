"""Observed orders, Pareto fronts and extrapolation to a mesh of size zero."""

from typing import NamedTuple

import numpy as np


class Extrapolation(NamedTuple):
    """A value at mesh size zero, and how wrong it may be.

    value : of the fit at size 0;  error : the larger of its distance from the finest mesh's mean and twice its standard
    error;  scatter : standard deviation of the values about the fit;  order : of the fit.
    """

    value: float
    error: float
    scatter: float
    order: float


def observed_order(size: np.ndarray, error: np.ndarray) -> float:
    """Slope of log error over log size, least squares; NaN with fewer than two positive errors or one size only.

    size, error : (n,) float64, mesh size or time step, and errors.
    """
    size, error = np.asarray(size, float), np.asarray(error, float)
    known = np.isfinite(error) & (error > 0) & (size > 0)
    if known.sum() < 2 or np.ptp(np.log(size[known])) == 0:
        return float("nan")
    return float(np.polyfit(np.log(size[known]), np.log(error[known]), 1)[0])


def pareto_front(cost: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Which runs no other run beats in both cost and error, (n,) bool; of equal ones the first."""
    cost, error = np.asarray(cost, float), np.asarray(error, float)
    front = np.zeros(len(cost), bool)
    best = np.inf
    for k in np.lexsort((error, cost)):
        if error[k] < best:
            front[k], best = True, error[k]
    return front


def excess_over_front(cost: np.ndarray, error: np.ndarray, which: int) -> float:
    """Error of a run over the smallest error of all runs that cost no more, 1 on the front."""
    cost, error = np.asarray(cost, float), np.asarray(error, float)
    best = error[cost <= cost[which]].min()
    return float(error[which] / best) if best > 0 else float("inf") if error[which] > 0 else 1.0


def extrapolate(size: np.ndarray, value: np.ndarray, order: float = 1.0) -> Extrapolation:
    """Value at mesh size zero from values on meshes of several sizes, several meshes of one size allowed.

    Fits value = f0 + C size^order by least squares. The order is given, not fitted: three or four sizes with
    scatter do not determine it (Roache 1998 asks for the asymptotic range, where the order is known).

    size, value : (n,) float64, n at least 3, at least two different sizes.

    Raises ValueError: too few values.
    """
    size, value = np.asarray(size, float), np.asarray(value, float)
    if len(size) < 3 or np.ptp(size) == 0:
        raise ValueError(
            f"extrapolation: needs at least 3 values on 2 different mesh sizes, got {len(size)} on"
            f" {len(np.unique(size))}; add a finer or a coarser mesh"
        )
    design = np.column_stack([np.ones_like(size), size**order])
    fit = np.linalg.lstsq(design, value, rcond=None)[0]
    left = value - design @ fit
    scatter = float(np.sqrt(left @ left / (len(size) - 2)))
    deviation = scatter * float(np.sqrt(np.linalg.inv(design.T @ design)[0, 0]))
    finest = float(value[size <= size.min() * (1 + 1e-9)].mean())
    return Extrapolation(float(fit[0]), max(abs(finest - float(fit[0])), 2 * deviation), scatter, order)
