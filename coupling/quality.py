"""How good a run is by its own account: balances, clamped values, time step, equilibrium of the lining."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mpm.variables import CLAMPS

if TYPE_CHECKING:
    import xarray as xr

#: Name in :func:`quality`: (long name for the line, format).
LABELS = {
    "grain_mass_error": ("grain mass", "{:.0e}"),
    "water_mass_error": ("water mass", "{:.0e}"),
    "momentum_error": ("momentum", "{:.0e}"),
    "energy_error": ("energy", "{:.1%}"),
    "contact_error": ("contact", "{:.0e}"),
    "suspended_fraction": ("suspended", "{:.1%}"),
    "clamped_fraction": ("clamped", "{:.2%}"),
    "largest_courant": ("Courant number", "{:.2f}"),
    "lining_equilibrium": ("lining equilibrium", "{:.0e}"),
}


def quality(history: xr.Dataset, response: xr.Dataset | None = None) -> dict[str, Any]:
    """Errors of a run's balances over all its records, and of the lining's equilibrium.

    Parameters
    ----------
    history : xarray.Dataset
        Of :func:`coupling.datasets.read_history`, at least one record.
    response : xarray.Dataset or None
        Of a lining model.

    Returns
    -------
    dict
        grain_mass_error, water_mass_error [-]: largest change over the initial mass; momentum_error [-]: largest
        departure over the impulse of gravity; energy_error [-]: kinetic energy lost between points and nodes over the
        largest of the works of gravity, stress and drag; contact_error [-]: part of the reactions that is not felt;
        suspended_fraction [-]: largest share of points without contact; clamped_fraction [-]: updates that met a clamp
        over all updates, clamps: the same by name; largest_courant [-]; lining_equilibrium [-]: largest unbalanced
        force over the loads, where there is a response.
    """
    last = history.isel(time=-1)
    mass = history["grain_mass"].values
    works = [abs(float(last[name])) for name in ("work_gravity", "work_stress", "work_drag")]
    updates = max(int(last["point_steps"]), 1)
    clamps = {name: int(last[f"clamp_{name}"]) / updates for name in CLAMPS}
    # suspended and cavitated are states that the material may be in, not values cut off
    cut = ("tension", "porosity_floor", "porosity_ceiling", "returned_to_mesh")
    result = {
        "grain_mass_error": float(np.abs(mass / mass[0] - 1).max()),
        "water_mass_error": float(np.abs(history["water_mass_error"].values).max()),
        "momentum_error": float(history["momentum_error"].values.max()),
        "energy_error": abs(float(last["transfer_loss"])) / max(works) if max(works) > 0 else 0.0,
        "contact_error": float(history["contact_error"].values.max()),
        "suspended_fraction": float(history["suspended_fraction"].values.max()),
        "clamped_fraction": sum(clamps[name] for name in cut),
        "clamps": clamps,
        "largest_courant": float(last["largest_courant"]),
    }
    if response is not None and "equilibrium_residual" in response:
        result["lining_equilibrium"] = float(np.abs(response["equilibrium_residual"].values).max())
    return result


def quality_line(values: dict[str, Any]) -> str:
    """The numbers of :func:`quality` in one line for people."""
    return ", ".join(f"{label} {form.format(values[name])}" for name, (label, form) in LABELS.items() if name in values)


def quality_attributes(values: dict[str, Any]) -> dict[str, float]:
    """The same as attributes of a run file: `quality_<name>`, numbers only."""
    return {f"quality_{name}": value for name, value in values.items() if name != "clamps"}
