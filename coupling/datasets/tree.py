"""What a run as a tree holds: answers of its lining models, its records at some times."""

import numpy as np
import xarray as xr

from coupling.datasets.schema import structure_group


def responses_of(run: xr.DataTree, tunnel: int | None = None) -> dict[str, xr.Dataset]:
    """Responses for a tunnel (None: that with the gate) by the users' names of their models, the leading one first."""
    home = structure_group("", tunnel).rstrip("/")
    answered = run[home].children if home in run.children else {}
    return {str(response.attrs.get("model", group)): response.to_dataset() for group, response in answered.items()}


def match_times(available, wanted):
    """For every wanted time the record with that time, and whether there is one: (n,) int64, (n,) bool."""
    if not len(available):
        return np.zeros(len(wanted), int), np.zeros(len(wanted), bool)
    rows = np.clip(np.searchsorted(available, wanted - 1e-9), 0, len(available) - 1)
    return rows, np.abs(available[rows] - wanted) <= 1e-9 * np.maximum(1.0, np.abs(wanted))
