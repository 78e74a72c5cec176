"""One measurement: what, where, when, the value, its unit and its error."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator

from coupling.measurements.quantities import QUANTITIES
from mpm.quantities import Mass, Time, quantity_in
from structure.inputs import Input

#: Unit of a number that names a place, by the dimension.
PLACES = {"theta": "degree", "x": "m"}
#: How a place of a dimension is told.
PLACE_TEXTS = {"theta": "{:g} deg", "joint": "joint {:g}", "x": "x {:g} m"}


class Measurement(Input):
    """A value that was measured.

    Parameters
    ----------
    quantity : str
        One of :data:`coupling.measurements.QUANTITIES`.
    place : float, optional
        Angle from the crown [degree], number of the joint, or horizontal position [m], as the quantity asks for.
    time : float, optional
        Since the gate opened [s]; or
    inflow_mass : float, optional
        what had come in by then [kg/m]: the state of its first crossing.
    value, error : float
        In `unit`; the error is one standard deviation.
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
    time: Time | None = Field(default=None, ge=0)
    inflow_mass: Mass | None = Field(default=None, ge=0)
    value: float
    unit: str
    error: float = Field(gt=0)
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
        cells = {key: _number(value) if key in ("place", "time", "inflow_mass") else value
                 for key, value in cells.items()}  # fmt: skip
        if "unit" in cells:
            for key in [key for key in ("value", "error") if key in cells]:
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
            asked = {"theta": "an angle from the crown as '90 deg'", "joint": "the number of a joint",
                     "x": "a horizontal position as '12 m'"}[known.place]  # fmt: skip
            raise ValueError(f"place: {self.quantity} must have one, got none; give {asked}")
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
        return "" if kind is None else PLACE_TEXTS[kind].format(self.place)


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
