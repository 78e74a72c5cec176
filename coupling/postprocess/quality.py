"""How good a run is by its own account: errors with verdicts, and what its points were held at."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from mpm.errors import COMPARED
from mpm.fields import CLAMPS


class Judged(NamedTuple):
    """An error of a run and how it is judged.

    label, form : str
        Of the line for people.
    of : str
        What it is a share of.
    good, fair : float
        Largest values that are called so [-]; all beyond is poor.
    remedy : str
        What makes it smaller.
    """

    label: str
    form: str
    of: str
    good: float
    fair: float
    remedy: str

    def verdict(self, value: float) -> str:
        """'good', 'fair' or 'poor'; what is no number is poor."""
        return "good" if value <= self.good else "fair" if value <= self.fair else "poor"

    def text(self, value: float) -> str:
        """The value as people read it, with what it is a share of."""
        return f"{self.form.format(value)} {self.of}".strip()


MORE_POINTS = "raise discretisation.points_per_element_gate"
SHORTER_STEPS = "lower numerics.courant"
BUG = "this is round-off where the program is right: please report it with scene.toml and run.log"
#: Name in :func:`quality`: how it is judged. A speed that is wrong by 5 % changes inflow and forces by less than
#: another mesh does, one that is wrong by 15 % by more; energy is its square, but what lands loses all of it one way or
#: the other. Water that is lost no longer presses, and overlap makes what flows as much too dense: the same shares.
ERRORS = {
    "water_lost": Judged("water lost", "{:.1%}", "of what came in", 0.05, 0.15, MORE_POINTS),
    "momentum_error": Judged("momentum", "{:.1%}", "of the flow's", 0.05, 0.15, MORE_POINTS),
    "energy_error": Judged(
        "energy",
        "{:.1%}",
        "of what moves",
        0.10,
        0.50,
        "keep numerics.stress_damping above 0; what lands loses energy as well, interior = 'sink' leaves it out",
    ),
    "flow_overlap": Judged("overlap", "{:.1%}", "of the flow", 0.05, 0.15, MORE_POINTS),
    "grain_mass_error": Judged("grain mass", "{:.0e}", "", 1e-9, 1e-9, BUG),
    "contact_error": Judged("contact", "{:.0e}", "of the reactions", 1e-9, 1e-9, BUG),
    "held_fraction": Judged("held values", "{:.0e}", "of point-steps", 1e-4, 1e-2, SHORTER_STEPS),
    "largest_courant": Judged("Courant number", "{:.2f}", "", 1.0, 1.2, SHORTER_STEPS),
    "lining_equilibrium": Judged(
        "lining equilibrium", "{:.0e}", "of the loads", 1e-6, 1e-6, "look at the ring's joints and springs"
    ),
}
#: States that material may be in, not errors, of which a record knows the share of points: name to the limit met.
STATES = {"tip_fraction": "tension", "suspended_fraction": "suspended"}
#: What no sound run does: porosities out of their range, points through walls.
HELD = ("porosity_floor", "porosity_ceiling", "returned_to_mesh")


def quality(history: xr.Dataset, response: xr.Dataset | None = None) -> dict[str, Any]:
    """Errors of a run over all its records, and of the lining's equilibrium.

    Parameters
    ----------
    history : xarray.Dataset
        Of :func:`coupling.datasets.read_history`, at least one record.
    response : xarray.Dataset or None
        Of a lining model.

    Returns
    -------
    dict
        water_lost, momentum_error, energy_error, overlap, flow_overlap [-]: see :func:`mpm.errors.errors`, where the
        file holds them; grain_mass_error [-]: largest change over the initial mass; contact_error [-]: part of the
        reactions that is not felt; held_fraction [-]: updates at which a porosity was held in its range or a point put
        back onto a wall, over all updates; largest_courant [-]; tip_fraction, suspended_fraction [-]: largest shares of
        points at the tip of the Mohr-Coulomb cone, and of points whose grains do not touch; clamps: updates that met
        each limit over all updates, by name; lining_equilibrium [-]: largest unbalanced force over the loads, where
        there is a response.
    """
    last = history.isel(time=-1)
    mass = history["grain_mass"].values
    updates = max(int(last["point_steps"]), 1)
    clamps = {name: int(last[f"clamp_{name}"]) / updates for name in CLAMPS}
    # of a file by an earlier version some are missing; these already are the largest so far
    result = {name: float(last[name]) for name in COMPARED if name in last}
    result |= {
        "grain_mass_error": float(np.abs(mass / mass[0] - 1).max()),
        "contact_error": float(history["contact_error"].values.max()),
        "held_fraction": sum(clamps[name] for name in HELD),
        "largest_courant": float(last["largest_courant"]),
        **{name: float(history[name].values.max()) for name in STATES if name in last},
        "clamps": clamps,
    }
    unbalanced = None if response is None else lining_equilibrium(response)
    if unbalanced is not None:
        result["lining_equilibrium"] = unbalanced
    return result


def lining_equilibrium(response: xr.Dataset) -> float | None:
    """Largest unbalanced force of a lining model's answer over its loads [-]; None of one that moved in the ground."""
    if "equilibrium_residual" not in response:
        return None
    return float(np.abs(response["equilibrium_residual"].values).max())


def verdicts(values: Mapping[str, Any]) -> dict[str, str]:
    """'good', 'fair' or 'poor' for each error of :func:`quality`."""
    return {name: judged.verdict(values[name]) for name, judged in ERRORS.items() if name in values}


def quality_line(values: Mapping[str, Any]) -> str:
    """The errors of :func:`quality` with their verdicts in one line for people."""
    found = verdicts(values)
    return ", ".join(f"{ERRORS[name].label} {ERRORS[name].text(values[name])} ({found[name]})" for name in found)


def states_line(values: Mapping[str, Any]) -> str:
    """The states and limits that points met, which are no errors, in one line for people."""
    points = {clamp: f"{values[name]:.1%} of points, " for name, clamp in STATES.items() if name in values}
    met = {name: share for name, share in values["clamps"].items() if share > 0}
    told = (f"{CLAMPS[name]} {points.get(name, '')}{share:.2%} of point-steps" for name, share in met.items())
    return "; ".join(told) or "none"


def poor_errors(values: Mapping[str, Any]) -> list[str]:
    """What a reader must know before believing the run, one sentence an error that is poor, with its remedy."""
    told = []
    for name, verdict in verdicts(values).items():
        judged = ERRORS[name]
        if verdict == "poor":
            limit = judged.form.format(judged.fair)
            told.append(f"{judged.label} {judged.text(values[name])} is poor, {limit} is fair; {judged.remedy}")
    return told


def stored_quality(attributes: Mapping[str, Any]) -> dict[str, float]:
    """The errors among the attributes of a run file: name to value."""
    names = (name for name in ERRORS if f"quality_{name}" in attributes)
    return {name: float(attributes[f"quality_{name}"]) for name in names}


def quality_attributes(values: dict[str, Any]) -> dict[str, float]:
    """The same as attributes of a run file: `quality_<name>`, numbers only."""
    return {f"quality_{name}": value for name, value in values.items() if name != "clamps" and value is not None}
