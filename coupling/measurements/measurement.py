"""One measurement: what, where, when, the value, its unit and its error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from coupling.measurements.quantities import QUANTITIES
from mpm.quantities import Length, Mass, Time, quantity_in
from structure.inputs import Input

#: Unit of a number that names a place, by the dimension.
PLACES = {"theta": "degree", "x": "m", "ground": "m"}
#: How a place of a dimension is told.
PLACE_TEXTS = {"theta": "{:g} deg", "joint": "joint {:g}", "x": "x {:g} m", "ground": "x {:g} m, {:g} m deep"}


class Measurement(Input):
    """A value that was measured.

    Parameters
    ----------
    quantity : str
        One of :data:`coupling.measurements.QUANTITIES`.
    place : float, optional
        Angle from the crown [degree], number of the joint, or horizontal position [m], as the quantity asks for.
    depth : float, optional
        Of a place in the ground, below the surface [m].
    time : float, optional
        Since the gate opened [s]; or
    inflow_mass : float, optional
        what had come in by then [kg/m]: the state of its first crossing.
    value, error : float
        In `unit`; the error is one standard deviation, independent of all others.
    common_error : float
        One standard deviation, in `unit`, of an error that all measurements of the same quantity by the same sensor
        share, as that of a calibration: each may have its own size of it, they go up and down together.
    unit : str
        Any of the quantity's dimension; value and error are converted to that of `QUANTITIES`.
    change : bool
        The value is the change since the gate opened, as of a gauge that was set to zero then.
    tunnel : int, optional
        Number of the tunnel, from 0; left out: the one with the gate.
    sensor : str
        What it is called.
    line : str
        Where it was read.
    """

    quantity: Literal[tuple(QUANTITIES)]  # type: ignore[valid-type]
    place: float | None = None
    depth: Length | None = Field(default=None, ge=0)
    time: Time | None = Field(default=None, ge=0)
    inflow_mass: Mass | None = Field(default=None, ge=0)
    value: float
    unit: str
    error: float = Field(gt=0)
    common_error: float = Field(default=0.0, ge=0)
    change: bool = False
    tunnel: int | None = Field(default=None, ge=0)
    sensor: str = ""
    line: str = ""

    @model_validator(mode="before")
    @classmethod
    def _in_si(cls, cells: Any) -> Any:
        """Numbers of texts; value and error in the quantity's own unit."""
        known = QUANTITIES.get(cells.get("quantity")) if isinstance(cells, dict) else None
        if known is None:
            return cells
        cells = {key: _number(value) if key in ("place", "depth", "time", "inflow_mass") else value
                 for key, value in cells.items()}  # fmt: skip
        if "unit" in cells:
            for key in [key for key in ("value", "error", "common_error") if key in cells]:
                cells[key] = _converted(key, known.unit, f"{cells[key]} {cells['unit']}")
            cells["unit"] = known.unit
        if known.place in PLACES and "place" in cells:
            cells["place"] = _converted("place", PLACES[known.place], cells["place"])
        return cells

    @model_validator(mode="after")
    def _check(self) -> Measurement:
        known = QUANTITIES[self.quantity]
        if known.place is None and self.place is not None:
            raise ValueError(f"place: {self.quantity} has none, got {self.place:g}; leave it empty")
        if known.place is not None and self.place is None:
            position = "a horizontal position as '12 m'"
            asked = {"theta": "an angle from the crown as '90 deg'", "joint": "the number of a joint"}
            asked = asked.get(known.place, position)
            raise ValueError(f"place: {self.quantity} must have one, got none; give {asked}")
        if (self.depth is None) == (known.place == "ground"):
            rule, remedy = (
                ("must have one", "give it as '8 m'") if self.depth is None else ("has none", "leave it empty")
            )
            raise ValueError(f"depth: {self.quantity} {rule}, got {self.depth}; {remedy}")
        if self.common_error and not self.sensor:
            raise ValueError(
                f"sensor: must be named where a common_error is given, got none with {self.common_error:g}; all lines "
                "of that sensor and quantity share it"
            )
        if (self.time is None) == (self.inflow_mass is None):
            given = "neither" if self.time is None else "both"
            raise ValueError(f"time or inflow_mass: one must be given, got {given}; give one and leave the other empty")
        if self.quantity == "inflow_mass" and self.time is None:
            raise ValueError("time: inflow_mass as a quantity must have one, got none; give when it was measured")
        if not known.of_tunnel and self.tunnel is not None:
            raise ValueError(f"tunnel: {self.quantity} has none, got {self.tunnel}; leave it empty")
        return self

    @property
    def place_text(self) -> str:
        """The place as people read it."""
        kind = QUANTITIES[self.quantity].place
        return "" if kind is None else PLACE_TEXTS[kind].format(self.place, self.depth)


def error_covariance(given: Sequence[Measurement]) -> NDArray[np.float64]:
    """Covariance of the errors, (n, n) float64, in the products of the measurements' units."""
    shared = np.array([one.common_error for one in given])
    sources = [(one.sensor, one.quantity, one.tunnel) for one in given]
    same = np.array([[one == other for other in sources] for one in sources])
    return np.diag([one.error**2 for one in given]) + np.where(same, np.outer(shared, shared), 0.0)


def _number(value):
    try:
        return float(value)
    except (TypeError, ValueError):
        return value


def _converted(key, unit, text):
    try:
        return quantity_in(unit, text)
    except ValueError as problem:
        raise ValueError(f"{key}: {problem}") from None
