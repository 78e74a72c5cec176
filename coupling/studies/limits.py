"""What the limits of a study's cases come to: the worst case of each, and the share of cases beyond it."""

from typing import Any

import numpy as np
import xarray as xr

from coupling.postprocess.limits import utilisation_text
from structure.limits import UTILISATIONS


def limits_of_case(case: xr.Dataset, model: str | None) -> dict[str, dict[str, float | None]]:
    """Utilisations of one case of a study by one lining model.

    case : of :func:`coupling.studies.case.at_inflow_masses`;  model : None: the study has no lining model.

    Returns: name of :data:`structure.limits.UTILISATIONS` to: largest [-], infinite where nothing is carried;
    passing_mass: inflow mass [kg/m] at which it first passes 1, None for never. Empty for a case without limits or
    result.
    """
    found: dict[str, dict[str, float | None]] = {}
    answered = model is not None and "model" in case.dims and model in case["model"].values
    for name in UTILISATIONS if answered else ():
        if f"{name}_largest" in case:
            largest, passing = (float(case[f"{name}_{end}"].sel(model=model)) for end in ("largest", "passing_mass"))
            if not np.isnan(largest):
                found[name] = {"largest": largest, "passing_mass": None if np.isnan(passing) else passing}
    return found


def limits_of_study(cases: dict[int, dict[str, dict[str, float | None]]]) -> dict[str, dict[str, Any]]:
    """The worst case and the share of cases beyond every limit.

    cases : number of a finished case to what :func:`limits_of_case` says of it.

    Returns: name of :data:`structure.limits.UTILISATIONS` to: cases, how many are held against it; beyond, how many of
    them pass 1; share [-] of these; worst_case, its number; largest [-], its utilisation; least_passing_mass, the least
    inflow mass [kg/m] at which a case passes 1, None for none.
    """
    found = {}
    for name in UTILISATIONS:
        checked = {number: one[name] for number, one in cases.items() if name in one}
        if checked:
            worst = max(checked, key=lambda number: checked[number]["largest"])
            beyond = sum(one["largest"] > 1 for one in checked.values())
            masses = [one["passing_mass"] for one in checked.values() if one["passing_mass"] is not None]
            found[name] = {
                "cases": len(checked),
                "beyond": beyond,
                "share": beyond / len(checked),
                "worst_case": worst,
                "largest": checked[worst]["largest"],
                "least_passing_mass": min(masses, default=None),
            }
    return found


#: Of the table of a study's limits.
HEADS = ("limit", "worst case", "largest", "cases beyond", "first passed at")


def limit_rows(found: dict[str, dict[str, Any]], names: dict[int, str]) -> list[tuple[str, ...]]:
    """Cells under `HEADS`, a row a limit, of :func:`limits_of_study`; names : number of a case to its name."""
    rows = []
    for name, one in found.items():
        mass = one["least_passing_mass"]
        beyond = f"{one['beyond']} of {one['cases']} ({one['share']:.0%})"
        first = "never" if mass is None else f"{mass:.4g} kg/m"
        rows.append((UTILISATIONS[name], names[one["worst_case"]], utilisation_text(one["largest"]), beyond, first))
    return rows


def governing_of_study(found: dict[str, dict[str, Any]], names: dict[int, str]) -> str:
    """The check with the worst case of all, in a sentence; arguments as of :func:`limit_rows`."""
    if not found:
        return "No limits are stated, so nothing says whether the rings bear this: give the scene a table [limits]."
    name = max(found, key=lambda one: found[one]["largest"])
    what, case, largest, beyond, first = limit_rows({name: found[name]}, names)[0]
    told = f"utilisation {largest} in {case}; cases beyond 1: {beyond}, first passed at {first}"
    return f"{what[:1].upper()}{what[1:]}: {told}."
