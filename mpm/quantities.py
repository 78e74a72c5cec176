"""Numbers with units, and what all parts of a scene have in common.

SI units; a string with a unit ("20 kN/m3", "37 deg") is converted. Angles are in degrees.
"""

import re
from functools import cache, partial
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict

#: A number and a unit: letters with a one-digit exponent at most, joined by *, / or a space. Nothing is evaluated: left
#: to itself pint would compute "9**9**9**9 m".
_UNIT = r"(?:[^\W\d_]|[°%])+(?:(?:\*\*|\^)?-?[0-9])?"
_QUANTITY = re.compile(
    rf"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*"
    rf"((?:1?\s*/\s*)?{_UNIT}(?:\s*[*/·]\s*{_UNIT}|\s+{_UNIT})*)\s*"
)
_DECIMAL_COMMA = re.compile(r"([0-9]),([0-9])")


@cache
def _unit_registry():
    import pint  # loaded only where a scene uses strings with units

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def quantity_in(unit: str, value: Any) -> Any:
    """A string with a unit as the number in `unit`, converted by pint; anything else as it is.

    Raises
    ------
    ValueError
        No quantity, or of another dimension: rule, value, remedy.
    """
    if not isinstance(value, str):
        return value
    given, why = value if len(value) <= 40 else f"{value[:40]}..", ""
    if _DECIMAL_COMMA.search(given):
        point = _DECIMAL_COMMA.sub(r"\1.\2", given)
        raise ValueError(f"must have a decimal point, got {given!r} with a comma; write it like {point!r}")
    parts = _QUANTITY.fullmatch(value) if len(value) <= 60 else None
    if parts is not None:
        text = re.sub(r"(?:\*\*|\^)?(-?[0-9])", r"**\1", parts[2].replace("·", "*").removeprefix("1").lstrip())
        try:
            quantity = _unit_registry().Quantity(float(parts[1]), f"1{text}" if text.startswith("/") else text)
            return quantity.to(unit).magnitude
        except Exception as error:
            why = f": {error}"
    raise ValueError(f"must be a quantity in {unit}, got {given!r}{why}; write it like '20 {unit}'")


def in_unit(unit: str) -> BeforeValidator:
    """Lets a float field in `unit` also take a string with a unit, see :func:`quantity_in`."""
    return BeforeValidator(partial(quantity_in, unit))


Length = Annotated[float, in_unit("m")]
Pressure = Annotated[float, in_unit("Pa")]
Density = Annotated[float, in_unit("kg/m**3")]
Angle = Annotated[float, in_unit("degree")]
Velocity = Annotated[float, in_unit("m/s")]
Time = Annotated[float, in_unit("s")]
Mass = Annotated[float, in_unit("kg/m")]
Acceleration = Annotated[float, in_unit("m/s**2")]


class Part(BaseModel):
    """A part of a scene: immutable, unknown keys refused, infinities and NaN refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
