"""Sums of nodal forces that nothing bears: taken out evenly where they are next to nothing, else refused."""

from __future__ import annotations

import numpy as np

from structure.ring import Ring
from structure.springs import soil_springs

#: Resultant over the sum of all nodal forces below which it counts as rounding of the input, and is taken out.
BALANCE_TOLERANCE = 1e-6


def borne(ring: Ring) -> np.ndarray:
    """Whether anything resists a movement to the right, up, and a turn about the axis, (3,) bool."""
    if ring.support == "invert":
        return np.ones(3, dtype=bool)
    if ring.ground is None:
        return np.zeros(3, dtype=bool)
    normal, tangential = (spring.stiffness > 0 and spring.limit > 0 for spring in soil_springs(ring))
    return np.array([normal or tangential, normal or tangential, tangential])


def even_loads(theta: np.ndarray, by_pressure, by_shear, rigid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Loads spread evenly over the outer face, each with one resultant of 1 N/m.

    Parameters
    ----------
    theta : (n_theta,) float64
        [rad].
    by_pressure, by_shear : (n_unknowns, n_theta) sparse
        Loads per Pa at `theta`.
    rigid : (3, n_unknowns) float64
        As of :class:`structure.nodal_forces.RingParts`.

    Returns
    -------
    uplift : (n_unknowns,) float64
        Of a radial pressure in proportion to cos(theta); its upward sum is one.
    unit : (3, n_unknowns) float64
        To the right, up and clockwise, the two other resultants zero.
    """
    raw = np.stack([by_pressure @ np.sin(theta), by_pressure @ np.cos(theta), by_shear @ np.ones(len(theta))])
    sums = raw @ rigid.T
    return raw[1] / sums[1, 1], np.linalg.solve(sums, raw)


def without_unborne(
    ring: Ring, loads: np.ndarray, resultant: np.ndarray, magnitude: np.ndarray, unit: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Loads whose sums are all borne: what is next to nothing is taken out evenly, more is refused.

    Parameters
    ----------
    loads : (n_times, n_unknowns) float64
        Nodal forces.
    resultant : (3, n_times) float64
        Of `loads`: to the right, up, and clockwise couple about the axis over the centre-line radius [N/m].
    magnitude : (n_times,) float64
        Sum of the sizes of all nodal forces [N/m].
    unit : (3, n_unknowns) float64
        From :func:`even_loads`.
    times : (n_times,) float64

    Returns
    -------
    loads : (n_times, n_unknowns) float64
    unborne : (n_times,) float64
        Largest resultant that was taken out, over `magnitude` [-].

    Raises
    ------
    ValueError
        A resultant that nothing bears is more than `BALANCE_TOLERANCE` of the loads: the first such time, the
        resultants, and the remedy.
    """
    rest = np.where(borne(ring)[:, None], 0.0, resultant)
    unborne = np.abs(rest).max(0) / np.maximum(magnitude, 1e-300)
    if np.any(unborne > BALANCE_TOLERANCE):
        first = int(np.argmax(unborne > BALANCE_TOLERANCE))
        raise ValueError(_refusal(ring, rest[:, first], unborne[first], times[first]))
    return loads - rest.T @ unit, unborne


def _refusal(ring, rest, share, time):
    horizontal, vertical, torque = rest
    ground, least = ring.ground, BALANCE_TOLERANCE / share * np.abs(rest).max()
    parts, remedies = [], []
    if max(abs(horizontal), abs(vertical)) > least:
        parts.append(f"a net force of {horizontal:.6g} N/m to the right and {vertical:.6g} N/m up")
        holds = "give the ring a ground, balance_uplift or support='invert'"
        remedies.append(
            holds if ground is None else "give the soil a limit pressure above 0, or the ring balance_uplift"
        )
    if abs(torque) > least:
        parts.append(f"a net torque of {torque * ring.centre_radius:.6g} N m/m clockwise")
        holds = "give the ring a ground with tangential springs or support='invert'"
        if ground is not None:
            holds = "give the soil a tangential limit pressure above 0"
            holds = holds if ground.tangential_springs else "switch tangential_springs on"
        remedies.append(f"{holds}, or subtract the mean of soil_shear")
    return (
        f"ring: loads must balance where nothing carries their sum, got {' and '.join(parts)} at time {time:g} s,"
        f" {share:.2g} of all loads (up to {BALANCE_TOLERANCE:g} is taken out evenly); {'; '.join(remedies)}"
    )
