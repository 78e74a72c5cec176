"""Files of imported pressures as other programs and people write them, and what has to become of each."""

import re
import time
import warnings

import numpy as np
import xarray as xr

import structure
from structure.pressures import PRESSURES

#: Longest that judging a file may take [s]; usual are some milliseconds.
PATIENCE = 5.0
#: Units, with the factor from degree, s and Pa to them; None: none are stated, and numbers are those of SI and degrees.
ANGLES = {"degree": 1, "degrees": 1, "deg": 1, "rad": np.pi / 180, "radians": np.pi / 180, "gon": 10 / 9, None: 1}
TIMES = {"s": 1, "ms": 1e3, "min": 1 / 60, "h": 1 / 3600, None: 1, "dates": 1, "durations": 1}
STRESSES = {"Pa": 1, "kPa": 1e-3, "MPa": 1e-6, "kN m-2": 1e-3, "N/mm^2": 1e-6, "bar": 1e-5, None: 1}
NO_UNITS = ("kg", "m", "9**9**9", "degC", "", "xyz", 5, "Pa; import os", "°C", "s s s", 3000 * "m", [1.0, 2.0])
#: Fewer angles than these, unevenly spaced, in gon called degrees and all within one turn: as good a file in degrees.
ANGLES_THAT_TELL = 10
KINDS = (
    "right", "right", "right", "theta in other units", "time without its units", "time in no units",
    "theta in no units",
    "pressures in no units", "pressures in other units", "one pressure in other units", "compression negative",
    "soil negative", "gap", "half ring", "quarter", "few angles", "NaN", "infinite", "NaN angle", "NaN time",
    "angle twice", "angle twice, other values", "time twice", "times shuffled", "one missing", "text", "no time",
    "packed", "one state", "strange dates", "more than a turn",
)  # fmt: skip


def wild_pressures(random):
    """A file's content, and what it means.

    random : random.Random.

    Returns xarray.Dataset, xarray.Dataset, str: as it is written; in Pa, s and degrees ascending in [0, 360) as the
    generator knows them; the kind of its mistake, "right" without one.
    """
    draw, kind = np.random.default_rng(random.getrandbits(64)), random.choice(KINDS)
    count, records = random.choice((8, 9, 12, 36, 72, 360)), random.choice((1, 2, 5))
    moved = random.choice((0.0, 0.0, 0.15)) * draw.uniform(-1, 1, count)  # of eight none 60 degrees from the next
    theta = (np.arange(count) + moved) * 360 / count
    theta %= 360
    order = np.argsort(theta)
    true = _true(draw, theta[order], np.cumsum(draw.uniform(0.5, 60.0, records)).round(3))
    given = _mistaken(random, draw, kind, true)
    if random.random() < 0.5:
        given = given.isel(theta=draw.permutation(given.sizes["theta"]))
    if random.random() < 0.3 and kind != "more than a turn":
        given = given.assign_coords(theta=(given["theta"] + 180) % 360 - 180)
    return _in_units(random, kind, given), true, kind


def _true(draw, theta, times):
    size, angle = (len(times), len(theta)), np.radians(theta)
    loads = {
        "soil_pressure": 1e5 * draw.uniform(0.5, 2) * (1 + 0.1 * np.cos(2 * angle)) + 1e3 * draw.normal(size=size),
        "water_pressure": 2e5 * draw.uniform(0.5, 2) * (1 - 0.1 * np.cos(angle)) + 1e3 * draw.normal(size=size),
        "soil_shear": 1e4 * np.sin(2 * angle) + 1e2 * draw.normal(size=size),
    }
    return xr.Dataset({k: (("time", "theta"), v) for k, v in loads.items()}, {"time": times, "theta": theta})


def _mistaken(random, draw, kind, true):
    """The pressures with the mistake of a kind, still in Pa, s and degrees."""
    given, count = true.copy(deep=True), true.sizes["theta"]
    name = random.choice(PRESSURES)
    at = random.randrange(count)
    if kind == "compression negative":
        given = -given
    elif kind == "soil negative":
        given["soil_pressure"] = -given["soil_pressure"]
    elif kind == "gap":
        wide = random.uniform(5, 200)
        given = given.isel(theta=np.flatnonzero((given["theta"].values - given["theta"].values[at]) % 360 >= wide))
    elif kind in ("half ring", "quarter"):
        given = given.isel(theta=given["theta"].values <= (180 if kind == "half ring" else 90))
    elif kind == "few angles":
        given = given.isel(theta=np.sort(draw.permutation(count)[: random.randrange(8)]))
    elif kind in ("NaN", "infinite"):
        given[name][-1, at] = np.nan if kind == "NaN" else np.inf
    elif kind == "NaN angle":
        given = given.assign_coords(theta=np.where(np.arange(count) == at, np.nan, given["theta"]))
    elif kind == "NaN time":
        given = given.assign_coords(time=np.r_[given["time"].values[:-1], np.nan])
    elif kind.startswith("angle twice"):
        again = given.isel(theta=[at])
        if kind.endswith("values"):
            again[name] = again[name] + 1e3
        given = xr.concat([given, again.assign_coords(theta=again["theta"] + random.choice((0, 360)))], "theta")
    elif kind == "time twice":
        given = xr.concat([given, given.isel(time=[-1])], "time")
    elif kind == "times shuffled":
        given = xr.concat([given, given.isel(time=[0])], "time")
    elif kind == "one missing":
        given = given.drop_vars(name)
    elif kind == "text":
        given[name] = given[name].astype(str)
    elif kind == "one state":
        given = given.isel(time=0, drop=random.random() < 0.5)
    elif kind == "no time":
        given = given.drop_vars("time")
    elif kind == "more than a turn":
        factors = [factor for factor in (2.0, 10 / 9) if factor * np.ptp(given["theta"].values) > 360.0]
        given = given.assign_coords(theta=given["theta"] * random.choice(factors) + 0.1)
    return given


def _in_units(random, kind, given):
    """The pressures as numbers with stated units; of some kinds the units stated are not those of the numbers."""

    def stated(what, units):
        unit = random.choice(list(units))
        # bar for MPa could be meant
        others = [each for each in units if units[each] != units[unit] and "bar" not in (each, unit)] or [unit]
        factor = units[random.choice(others)] if kind == f"{what} in other units" else units[unit]
        if kind == f"{what} in no units":
            unit = random.choice(NO_UNITS)
        return factor, {} if unit is None else {"units": unit}

    if "theta" in given.coords:
        factor, about = stated("theta", ANGLES)
        given = given.assign_coords(theta=("theta", given["theta"].values * factor, about))
    if "time" in given.dims and "time" in given.coords:
        given = given.assign_coords(time=_written_times(random, kind, given["time"].values))
    factor, about = stated("pressures", STRESSES)
    alone = random.choice(PRESSURES[:2])
    for name in [name for name in PRESSURES if name in given and given[name].dtype.kind == "f"]:
        own = {**about}
        size = factor
        if kind == "one pressure in other units" and name == alone:
            size, own = random.choice(((1e-3, {}), (1e-6, {}), (1e3, {"units": "MPa"}), (1.0, {"units": "kPa"})))
        given[name] = (given[name] * size).assign_attrs(own)
        if kind == "packed":
            given[name].encoding = {"dtype": "i4", "scale_factor": 0.01 * size, "_FillValue": -(2**31)}
        elif random.random() < 0.1:
            given[name] = given[name].astype(random.choice(("f4", ">f8")))
    return given.transpose() if random.random() < 0.2 else given


def _written_times(random, kind, seconds):
    if kind == "strange dates":
        calendar = random.choice(("noleap", "360_day", "julian", "none", "xyz"))
        units = random.choice(("days since 2026-03-01", "seconds since 0000-00-00", "s since",
                               "months since 1999-01-01", "seconds since yesterday",
                               "days since 99999-01-01"))  # fmt: skip
        return "time", seconds, {"units": units, "calendar": calendar}
    if kind == "time without its units":
        return "time", seconds, {}
    if kind == "time in no units":
        return "time", seconds, {"units": random.choice(NO_UNITS)}
    units = random.choice(list(TIMES) if np.isfinite(seconds).all() else ["s", "ms"])
    if units in ("dates", "durations"):
        values = np.round(seconds * 1e3).astype("timedelta64[ms]").astype("timedelta64[ns]")
        return "time", values if units == "durations" else np.datetime64("2026-03-01T10:00", "ns") + values
    return "time", seconds * TIMES[units], {} if units is None else {"units": units}


def judged(path, true, kind):
    """What becomes of a file: "right values", "right values, warned of", "warned of" (others), "refused" or "untold".

    "untold": taken as it is written, and nobody can know better (`ANGLES_THAT_TELL`).

    Raises AssertionError, or whatever the program should not have raised.
    """
    from coupling.datasets import RunFileError
    from coupling.responses.source import read_source

    begin = time.monotonic()
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            found = read_source(path).pressures
    except RunFileError as refusal:
        message = str(refusal)
        assert str(path) in message and len(message) < 2000, message[:500]
        assert re.search("must|missing|needs", message) and "got" in message and ";" in message, message
        assert kind != "right", message
        verdict = "refused"
    else:
        assert all(issubclass(each.category, structure.GushingWarning) for each in told), [str(each) for each in told]
        assert all(";" in str(each.message) for each in told), [str(each.message) for each in told]
        difference = different(found, true)
        if difference == "angles" and not told and _cannot_tell(true, kind):
            return "untold"
        assert not difference or told, f"{kind}: {difference}, without a word"
        verdict = ("right values, " if not difference else "") + "warned of" if told else "right values"
        assert kind != "right" or verdict == "right values", [str(each.message) for each in told]
    assert time.monotonic() - begin < PATIENCE, "too slow"
    return verdict


def _cannot_tell(true, kind):
    theta = true["theta"].values
    return (
        kind == "theta in other units"
        and len(theta) < ANGLES_THAT_TELL
        and np.ptp(np.diff(theta)) > 1.0
        and ANGLES["gon"] * theta[-1] < 360.0
    )


def different(found, true):
    """What differs from the truth, "" where nothing does but rounding (and the origin of dates)."""
    theta = true["theta"].values
    if found.sizes != true.sizes:
        # fewer angles: right where they are, and no gap is wide
        places = [np.flatnonzero(np.abs(theta - angle) < 1e-4) for angle in found["theta"].values]
        if found.sizes["time"] != true.sizes["time"] or any(len(place) != 1 for place in places):
            return f"sizes {dict(found.sizes)} of {dict(true.sizes)}"
        true = true.isel(theta=np.concatenate(places))
    times = [each["time"].values - each["time"].values[0] for each in (found, true)]
    if not np.allclose(*times, atol=2e-3):
        return f"times {times[0]} for {times[1]}"
    if not np.allclose(found["theta"], true["theta"], atol=1e-4):
        return "angles"
    for name in PRESSURES:
        # single precision, and packed numbers of 0.01 Pa
        if not np.allclose(found[name], true[name], rtol=1e-6, atol=0.02):
            return f"{name} {found[name].values.flat[0]:g} for {true[name].values.flat[0]:g}"
    return ""
