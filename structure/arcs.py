"""Tractions around a circle, linear between samples: where arcs are integrated, and what that makes of the samples."""

from __future__ import annotations

import numpy as np
from scipy import sparse

#: Gauss points of a piece of an arc on [0, 1]: up to 15 degrees only rounding is left of linear tractions times linear
#: or quadratic shares times the sine of an angle within the piece.
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(5)[0] / 2 + 0.5, np.polynomial.legendre.leggauss(5)[1] / 2


def arc_pieces(start: np.ndarray, span: np.ndarray, kinks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gauss points on arcs that are cut at kinks, so that what is smooth between the kinks is integrated exactly.

    Parameters
    ----------
    start, span : (n_arcs,) float64
        First angle and angle of each arc [rad], no two overlapping.
    kinks : (n_kinks,) float64
        [rad].

    Returns
    -------
    arc : (n_points,) int
        Which arc a point lies on.
    angle : (n_points,) float64
        [rad], from `start` on.
    weight : (n_points,) float64
        Angle that the point stands for [rad]; those of an arc sum to its span.
    """
    order = np.argsort(start % (2 * np.pi))
    last = np.searchsorted(start[order] % (2 * np.pi), kinks % (2 * np.pi), side="right") - 1  # -1: across the crown
    after = (kinks - start[order[last]]) % (2 * np.pi)
    inside = after < span[order[last]]
    ends = np.arange(len(start))
    arcs = np.concatenate([ends, ends, order[last[inside]]])
    cuts = np.concatenate([np.zeros(len(start)), span, after[inside]])
    sorting = np.lexsort((cuts, arcs))
    arcs, cuts = arcs[sorting], cuts[sorting]
    length = np.diff(cuts)
    kept = np.flatnonzero((arcs[1:] == arcs[:-1]) & (length > 0))
    arc, begin, length = arcs[kept], cuts[kept], length[kept]
    angle = (start[arc] + begin)[:, None] + length[:, None] * POINTS
    return np.repeat(arc, len(POINTS)), angle.ravel(), (length[:, None] * WEIGHTS).ravel()


def sampled_operator(
    unknown: np.ndarray, values: np.ndarray, theta: np.ndarray, angle: np.ndarray, n_unknowns: int
) -> sparse.csr_array:
    """Nodal forces per sample at `theta` from those per traction at points, (n_unknowns, n_theta).

    unknown, values : (n_points, ...);  angle : (n_points,) of the points [rad].
    """
    samples, shares = periodic_shares(theta, angle)
    count = values[0].size
    columns = np.concatenate([np.repeat(sample, count) for sample in samples])
    shared = np.concatenate([np.repeat(share, count) * values.ravel() for share in shares])
    rows = np.tile(unknown.ravel(), 2)
    return sparse.coo_array((shared, (rows, columns)), shape=(n_unknowns, len(theta))).tocsr()


def periodic_shares(theta: np.ndarray, angle: np.ndarray):
    """Two samples around each angle [rad] and their linear shares; the last sample neighbours the first."""
    angle = angle % (2 * np.pi)
    after = np.searchsorted(theta, angle, side="right") % len(theta)
    before = after - 1
    gap = (theta[after] - theta[before]) % (2 * np.pi)
    share = ((angle - theta[before]) % (2 * np.pi)) / gap
    return (before % len(theta), after), (1 - share, share)
