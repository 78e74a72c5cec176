"""Errors of a run, each over what it is an error of: the largest departure so far over the largest amount so far."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

#: Error [-]: departure and the amounts that it is compared with, of :meth:`mpm.Solver.balances`; of several amounts the
#: first that is not zero.
COMPARED = {
    "water_lost": ("water_missing", ("water_inflow", "flow_water")),
    "momentum_error": ("momentum_departure", ("flow_momentum",)),
    "energy_error": ("transfer_loss", ("moving_energy",)),
    "overlap": ("overlap_volume", ("material_volume",)),
    "flow_overlap": ("flow_overlap_volume", ("flow_volume",)),
}


def largest_so_far(largest: Mapping[str, float], balances: Mapping[str, float]) -> dict[str, float]:
    """Largest sizes of all departures and amounts, those before, `largest` (may be empty), included: a new dict."""
    names = {name for departure, amounts in COMPARED.values() for name in (departure, *amounts)}
    return {name: max(abs(balances[name]), largest.get(name, 0.0)) for name in sorted(names)}


def errors(largest: Mapping[str, float]) -> dict[str, float]:
    """Errors of what `largest_so_far` gave.

    Both are the largest so far, since they pass their peaks at different times: a jet that has come to rest keeps the
    error that it made while it moved.

    Returns
    -------
    dict of str to float
        water_lost: water lost or made, over the water that came through the gate's outer face, or, while none came,
        over that of the flow zone; momentum_error: over the momentum of the flow zone; energy_error: kinetic energy
        that transfers took or gave, over that of all that moves; overlap, flow_overlap: share of all material, and of
        that of the flow zone, that stands where there is no room. 0 where nothing flows.
    """
    shares = {}
    for name, (departure, amounts) in COMPARED.items():
        amount = next((largest[each] for each in amounts if largest[each] > 0), 0.0)
        shares[name] = largest[departure] / amount if amount > 0 else 0.0
    return shares
