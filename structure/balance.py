"""Sums of nodal forces on a free body, and the refusal of loads that nothing carries."""

from __future__ import annotations

import numpy as np

from structure.ring import Ring

#: Resultant over the sum of all nodal forces below which a ring without ground counts as balanced.
BALANCE_TOLERANCE = 1e-6


def refuse_unbalanced(ring: Ring, resultant: np.ndarray, magnitude: np.ndarray, times: np.ndarray):
    """Refuse what nothing carries: any resultant of a free ring, a torque where the soil does not resist sliding.

    Parameters
    ----------
    resultant : (3, n_times) float64
        Sum to the right, up, and clockwise couple about the axis over the centre-line radius [N/m].
    magnitude : (n_times,) float64
        Sum of the sizes of all nodal forces [N/m].
    times : (n_times,) float64

    Raises
    ------
    ValueError
        With the first such time, its sums, and the remedy.
    """
    ground = ring.ground
    if ring.support == "invert" or (ground is not None and ground.tangential_springs):
        return
    carried = np.abs(resultant)
    if ground is not None:
        carried[:2] = 0
    excess = carried.max(0) > BALANCE_TOLERANCE * magnitude
    if not excess.any():
        return
    first = int(np.argmax(excess))
    horizontal, vertical, torque = resultant[:, first]
    remedy = (
        "give the ring a ground, balance_uplift or support='invert'"
        if ground is None
        else "switch tangential_springs on"
    )
    raise ValueError(
        f"ring: loads must balance where nothing carries their sum, got {horizontal:.6g} N/m to the right,"
        f" {vertical:.6g} N/m up, torque/radius {torque:.6g} N/m at time {times[first]:g} s; {remedy}"
    )
