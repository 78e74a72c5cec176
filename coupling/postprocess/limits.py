"""Utilisations of limits as the rows of a table, the same on the command line and on a page."""

import math

from structure.limits import UTILISATIONS

HEADS = ("limit", "largest", "at", "passes 1")


def limit_rows(found: dict) -> list[tuple[str, ...]]:
    """Cells under `HEADS`, a row a limit; `found` as of :func:`structure.utilisations`."""
    return [
        (UTILISATIONS[name], utilisation_text(one["largest"]), place_text(one["at"]),
         "never" if one["passes"] is None else place_text(one["passes"]))
        for name, one in found.items()
    ]  # fmt: skip


def place_text(place: dict[str, float]) -> str:
    """A place and time of :func:`structure.utilisations` as people read it."""
    told = [f"{place['time']:.3g} s"]
    told += [f"{place['inflow_mass']:.4g} kg/m"] if "inflow_mass" in place else []
    told += [f"{place['theta']:.4g}°"] if "theta" in place else []
    return ", ".join(told + ([f"joint {place['joint']:.0f}"] if "joint" in place else []))


def utilisation_text(value: float) -> str:
    """A utilisation as text; one that is infinite says that nothing of the kind is carried."""
    return f"{value:.2f}" if math.isfinite(value) else "not carried"
