"""The band of a statement: our number, what each unknown of the source moves it by, and the error of our mesh."""

from typing import NamedTuple

import numpy as np

from verification.accuracy.orders import extrapolate
from verification.published.statements import Found, Statement


class Verdict(NamedTuple):
    """What becomes of a statement.

    found : ours;  mesh : error of our mesh;  shares : unknown to how far it moves ours (down, up), largest first;
    low, high : the band;  agrees : "yes", "in the band", "no", or "" where no verdict is given.
    """

    statement: Statement
    found: Found
    mesh: float
    shares: dict[str, tuple[float, float]]
    low: float
    high: float
    agrees: str

    @property
    def ours(self) -> str:
        """Our value as the page shows it."""
        value, more = self.statement.form.format(self.found.value), self.found.more
        return f"{more} ({value})" if more else value


def judged(
    statement: Statement,
    found: Found,
    meshes: dict[float, Found],
    unknowns: dict[str, list[tuple[Found, Found]]],
) -> Verdict:
    """Band and verdict of one statement.

    statement, found : what is stated, and ours;  meshes : size of the mesh over that of the scene to ours on it; fewer
    than two others than the scene's give no error;  unknowns : name to pairs of (changed, unchanged), computed alike.
    """
    log = statement.factor
    ours = _of(found.value, log)
    values = {size: _of(one.value, log) for size, one in meshes.items() if np.isfinite(one.value)}
    mesh = 0.0
    if len(values) > 2 and np.ptp(list(values.values())) > 0:
        mesh = extrapolate(list(values), list(values.values())).error
    elif len(values) > 1:
        mesh = float(np.ptp(list(values.values())))
    moved = {}
    for name, pairs in unknowns.items():
        shifts = [_of(a.value, log) - _of(b.value, log) for a, b in pairs]
        shifts = [shift for shift in shifts if np.isfinite(shift)]
        if shifts:
            moved[name] = min(0.0, *shifts), max(0.0, *shifts)
    low, high = (
        ours + sign * float(np.sqrt(mesh**2 + sum(pair[side] ** 2 for pair in moved.values())))
        for side, sign in enumerate((-1, 1))
    )
    low, high = _back(low, log), _back(high, log)
    agrees = ""
    if statement.accepted is not None and np.isfinite(found.value):
        as_run = statement.accepted[0] <= found.value <= statement.accepted[1]
        reaches = low <= statement.stated[1] and high >= statement.stated[0]
        agrees = "yes" if as_run else "in the band" if reaches else "no"
    shares = {
        name: tuple(_back(ours + part, log) - found.value for part in pair)
        for name, pair in sorted(moved.items(), key=lambda item: -max(-item[1][0], item[1][1]))
        if any(pair)
    }
    return Verdict(statement, found, _back(ours + mesh, log) - found.value, shares, low, high, agrees)


def _of(value, log):
    return float(np.log(value)) if log and value > 0 else np.nan if log else float(value)


def _back(value, log):
    return float(np.exp(value)) if log else float(value)
