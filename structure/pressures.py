"""Pressures as lining models take them: in Pa over seconds and degrees, complete around the ring, of a usual size."""

from __future__ import annotations

import re
import warnings
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from structure.inputs import GushingWarning, shortened
from structure.response import PRESSURES

if TYPE_CHECKING:
    import xarray as xr

    from structure.ring import Ring

FEWEST_ANGLES = 8
#: Between angles pressures are linear: what lies in a wider gap is not known [degree].
WIDEST_GAP = 60.0
#: A ring is pulled all around where the mean is below this share of the largest size, which a few cells do not change.
PULLED = 0.25
#: A part is not judged below this share of all, and taken for rounding below that one.
SMALL, NOTHING = 1e-2, 1e-8
#: Largest pressures outside of this are no tunnel's: less than 0.1 m of water, more than 2 km of rock [Pa].
USUAL_PRESSURE = (1e3, 5e7)


def check_pressures(pressures: xr.Dataset, ring: Ring | None = None) -> xr.Dataset:
    """Pressures as a model takes them; what they cannot mean is refused, what they hardly mean is warned of.

    Parameters
    ----------
    pressures : xarray.Dataset
        soil_pressure, water_pressure, soil_shear (time, theta) in the units of their attributes, Pa where there are
        none; theta in degree, rad, gon, degree where there are none; time in s, ms, h, as dates or as durations, s
        where there are none.
    ring : structure.Ring, optional
        Whose weight the pressures are compared with.

    Returns
    -------
    xarray.Dataset
        The three variables [Pa], and inflow_mass where it is given, over time [s], from the first record where it was
        given as dates, and theta [degree], ascending in [0, 360). Attributes are kept.

    Raises
    ------
    ValueError
        Rule, name, value, remedy.
    """
    _require_variables(pressures)
    kept = [*PRESSURES, *(["inflow_mass"] if "inflow_mass" in pressures else [])]
    found = pressures[kept].assign_coords(time=_time(pressures["time"]), theta=_angles(pressures["theta"]))
    for name in PRESSURES:
        variable = found[name]
        units = str(variable.attrs.get("units", "Pa"))
        values = _in_unit(variable.values, units, "Pa", name, "values that are not; drop those times")
        found[name] = variable.copy(data=values).assign_attrs(units="Pa").transpose("time", "theta")
    found = _around_the_ring(found.sortby("theta"))
    _warn_of_size(found, ring)
    return found


def _require_variables(pressures):
    if not hasattr(pressures, "data_vars"):
        raise ValueError(
            f"pressures: must be an xarray.Dataset of {', '.join(PRESSURES)}, got a {type(pressures).__name__}; "
            "structure.theoretical_pressures makes one"
        )
    missing = [name for name in PRESSURES if name not in pressures]
    if missing:
        raise ValueError(
            f"pressures: {', '.join(missing)} must be given, got {sorted(map(str, pressures.data_vars))};"
            " add zeros for an action that is absent"
        )
    for name in PRESSURES:
        variable = pressures[name]
        if set(variable.dims) != {"time", "theta"}:
            raise ValueError(
                f"pressures: {name} must have the dimensions (time, theta), got {variable.dims};"
                " select one tunnel, or expand_dims(time=[0.0]) for a single state"
            )
    for name in ("time", "theta"):
        if name not in pressures.coords:
            raise ValueError(f"pressures: coordinate {name} must be given, got none; assign_coords({name}=...)")
    if pressures.sizes["time"] == 0:
        raise ValueError("pressures: time must have at least one record, got none; wait for the first output")


def _time(time):
    """The coordinate in seconds."""
    units = str(time.attrs.get("units", "s"))
    values, about = time.values, {"units": "s", "long_name": time.attrs.get("long_name", "time")}
    if " since " in units:
        values, units = _dates(values, units, time.attrs.get("calendar")), "s"
    if values.dtype.kind == "M":
        about |= {"long_name": "time since the first record", "time_origin": str(values[0])}
        values = values - values[0]
    if values.dtype.kind == "m":
        values, units = values / np.timedelta64(1, "ns") * 1e-9, "s"
    values = _in_unit(values, units, "s", "time", "values that are not; drop them")
    if np.any(np.diff(values) <= 0):
        k = int(np.argmax(np.diff(values) <= 0))
        raise ValueError(
            f"pressures: time must increase from record to record, got {values[k + 1]:g} s after {values[k]:g} s; "
            "sortby('time') and drop repeated records"
        )
    return "time", values, about


def _dates(values, units, calendar):
    import xarray as xr

    attributes = {"units": units, **({"calendar": calendar} if calendar else {})}
    try:
        return xr.decode_cf(xr.Dataset({"time": ("time", values, attributes)}))["time"].values
    except ValueError as problem:
        raise ValueError(f"pressures: time must be dates of CF, got units {units!r}: {problem}; correct them") from None


def _angles(theta):
    """The coordinate in degrees in [0, 360), in the order given."""
    units, rest = str(theta.attrs.get("units", "degree")), "angles that are not; drop them, with their values"
    values = _in_unit(theta.values, units, "degree", "theta", rest)
    if values is not theta.values:  # of 2 pi rad, say, a last digit may be left
        values = np.round(values, 10)
    about = {"units": "degree", "long_name": "angle from the crown, clockwise"}
    if len(values) and np.ptp(values) > 360 + 1e-6:
        raise ValueError(
            f"pressures: theta must lie within one turn, got {values.min():g} to {values.max():g} degrees; give theta "
            "its units where it is in gon or rad, or take theta % 360"
        )
    # % alone makes 360 of -1e-20
    return "theta", values % 360 % 360, {**theta.attrs, **about}


def _around_the_ring(found):
    """Without an angle that stands there twice with the same values; complete around the ring."""
    again = np.diff(found["theta"].values, prepend=np.nan) == 0
    differ = np.any([(found[name] != found[name].shift(theta=1)).any("time") for name in PRESSURES], axis=0)
    if (again & differ).any():
        raise ValueError(
            f"pressures: theta must hold every angle once, got {found['theta'].values[again & differ][0]:g} degrees"
            " twice with different values; drop one of them"
        )
    found = found.isel(theta=~again)
    theta = found["theta"].values
    if len(theta) < FEWEST_ANGLES:
        raise ValueError(
            f"pressures: theta must hold at least {FEWEST_ANGLES} different angles in [0, 360) degrees, got "
            f"{len(theta)}; add angles, interpolated where nothing was measured"
        )
    gaps = np.diff(np.append(theta, theta[0] + 360))
    k = int(np.argmax(gaps))
    if gaps[k] > WIDEST_GAP + 1e-9:
        hint = "give theta its units where it is in radians" if theta[-1] <= 2 * np.pi + 1e-6 else (
            "mirror a half ring: append the values at 360 - theta, soil_shear with the other sign"
        )  # fmt: skip
        raise ValueError(
            f"pressures: theta must leave no gap of more than {WIDEST_GAP:g} degrees, got {gaps[k]:.4g} after "
            f"{theta[k]:g} degrees; add angles there, or {hint}"
        )
    return found


def _warn_of_size(found, ring):
    """Say where pressures are those of no tunnel: the wrong sign or unit."""
    parts = [found[name].transpose("time", "theta").values for name in PRESSURES]
    total = parts[0] + parts[1]
    largest, shear = float(np.abs(total).max()), float(np.abs(parts[2]).max())
    least, most = USUAL_PRESSURE
    what = "0.1 m of water"
    if ring is not None:
        least, what = ring.concrete_unit_weight * ring.thickness, "the weight of the ring"
    told = _pulling(found, {"soil and water": total, "soil alone": parts[0], "water alone": parts[1]})
    small = [name for name, each in zip(PRESSURES[:2], parts, strict=False)
             if NOTHING * largest < np.abs(each).max() < USUAL_PRESSURE[0]]  # fmt: skip
    if told:
        pass
    elif 0 < largest < least:
        told = (
            f"soil and water are {largest:.3g} Pa at most, less than {what} ({least:.3g} Pa); numbers without units "
            "are taken as Pa, give e.g. units = 'kPa'"
        )
    elif max(largest, shear) > most:
        told = f"they are up to {max(largest, shear):.3g} Pa, beyond any tunnel's ({most:.1g} Pa); check their units"
    elif small:
        told = (
            f"{' and '.join(small)} never reach {USUAL_PRESSURE[0]:g} Pa where all together are {largest:.3g} Pa; "
            "numbers without units are taken as Pa, give e.g. units = 'kPa'"
        )
    told = told or _odd_step(found["theta"].values)
    if told:
        warnings.warn(f"pressures: {told}", GushingWarning, stacklevel=3)


def _pulling(found, parts):
    """What is said of the first of the parts {name: (time, theta)} that pulls all around, "" where none does."""
    whole = max(float(np.abs(values).max()) for values in parts.values())
    for name, values in parts.items():
        mean, largest = values.mean(axis=1), float(np.abs(values).max())
        if largest > SMALL * whole and mean.min() < -PULLED * largest:
            return (
                f"{name} pull the ring outward all around, {mean.min() / 1e3:.3g} kPa in the mean at "
                f"{found['time'].values[mean.argmin()]:g} s; inward is positive, change the sign if yours is not"
            )
    return ""


def _odd_step(theta):
    """What is said of one step between angles [degree] unlike all others: angles in another unit than they seem."""
    gaps = np.diff(np.append(theta, theta[0] + 360))
    odd = int(np.argmax(np.abs(gaps - np.median(gaps))))
    others = np.delete(gaps, odd)
    uneven = others.max() > 2.5 * others.min()
    if uneven or (2 * gaps[odd] >= others.min() and gaps[odd] <= 2 * others.max() + 1e-6):
        return ""
    return (
        f"theta has steps of {others.min():.4g} to {others.max():.4g} degrees, but one of {gaps[odd]:.4g} after "
        f"{theta[odd]:g}; pressures are linear there, check the units of theta or add what is missing"
    )


@cache
def _registry():
    import pint  # loaded only where units are not SI

    return pint.UnitRegistry()


#: Names of units that pint does not know or reads as something else.
SPELLINGS = {"": "1", "sec": "s", "degrees_clockwise": "degree", "°": "degree"}


#: Names with a one-digit exponent at most, joined by * or /: pint would compute "9**9**9 Pa" for ever.
_UNIT = r"[^\W\d]+(?:(?:\*\*|\^)-?[0-9])?"
UNITS = re.compile(rf"1|(?:1 */ *)?\(?{_UNIT}(?: *[*/.] *\(?{_UNIT}\)?){{0,8}}")


def _in_unit(values, units, wanted, name, rest):
    """Values as finite float64 in another unit; `rest` says what those that are not finite are, and the remedy."""
    try:
        numbers = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"pressures: {name} must be numbers in {wanted}, got {values.dtype}; convert them") from None
    if units not in (wanted, f"{wanted}s"):
        numbers = numbers * _factor(units, wanted, name)
    bad = int((~np.isfinite(numbers)).sum())
    if bad:
        raise ValueError(f"pressures: {name} must be finite, got {bad} {rest}")
    return numbers


def _factor(units, wanted, name):
    """From one unit to the other."""
    # CF writes N m-2
    text = re.sub(r"([a-zA-Z])(-?[0-9])", r"\1**\2", SPELLINGS.get(units.strip(), units.strip()))
    text = re.sub(r"(?<=[\w)])\s+(?=[a-zA-Z])", "*", text)
    try:
        if not UNITS.fullmatch(text):
            raise ValueError("no unit")
        return _registry().Quantity(1.0, text).to(wanted).magnitude
    except Exception:
        raise ValueError(
            f"pressures: {name} must be in {wanted}, got {shortened(units)}; convert it, or correct its units"
        ) from None
