"""Key numbers of a run or a case with what it can say about their error itself."""

from typing import NamedTuple

import numpy as np

from coupling.datasets.geometry import gate_of, has_tunnels, on_tunnel, tunnel_of
from coupling.postprocess.extremes import RING_EXTREMES, shown_extreme
from coupling.postprocess.summary import PLACES

DIFFERENCE = "difference from"
MINUS = "\N{MINUS SIGN}"


class Number(NamedTuple):
    """A number of the run: SI values and how they are shown.

    initial, final : float or None;  scale : factor from SI to `unit`;  error : float (SI) or None;  basis : str, what
    the error is; one that begins with `DIFFERENCE` is no error but how far another lining model is from this one.
    """

    key: str
    label: str
    unit: str
    scale: float
    initial: float | None
    final: float | None
    error: float | None
    basis: str

    @property
    def is_difference(self):
        """Whether `error` is the difference from another lining model."""
        return self.basis.startswith(DIFFERENCE)


def inflow_numbers(run):
    """What flowed in and what it moved: list of Number. run : xarray.DataTree with at least one record."""
    history = run["history"].to_dataset()
    last, mass = history.isel(time=-1), history["grain_mass"].values
    one_point = _mass_of_a_point_inside(run)
    numbers = [
        Number("inflow_mass", "inflow mass", "kg/m", 1.0, None, float(last["inflow_mass"]),
               float(np.abs(mass - mass[0]).max()) + one_point, "change of all mass, and one point"),
    ]  # fmt: skip
    rate = inflow_rate(history)
    if rate is not None:
        numbers.append(Number("inflow_rate", "inflow rate, second half of the time", "kg/m/s", 1.0, None, *rate,
                              "scatter between four parts"))  # fmt: skip
    for name, label in (("flow_zone_area", "flow zone (moved over 50 mm)"),
                        ("disturbed_area", "disturbed zone (10 to 50 mm)")):  # fmt: skip
        numbers.append(Number(name, label, "m²", 1.0, None, float(last[name]), None, ""))
    numbers.append(Number("max_velocity", "largest velocity of the grains", "m/s", 1.0, None,
                          float(last["max_velocity"]), None, ""))  # fmt: skip
    return numbers


def _mass_of_a_point_inside(run):
    """Largest grain mass of a point inside the gate's tunnel at the last snapshot [kg/m]: inflow is counted in them."""
    points = run["points"].to_dataset() if "points" in run.children else None
    if points is None or "grain_mass" not in points or not points.sizes["time"] or not has_tunnels(points):
        return 0.0
    last, tunnel = points.isel(time=-1), tunnel_of(points)
    inside = tunnel.distance(last["x"].values, last["y"].values) < tunnel.inner
    return float(np.nanmax(last["grain_mass"].values[inside])) if inside.any() else 0.0


def inflow_rate(history):
    """Mean inflow rate over the second half of the time and its standard deviation between four equal parts [kg/m/s].

    None with fewer than nine records in that half.
    """
    time, mass = history["time"].values, history["inflow_mass"].values
    if np.sum(time >= 0.5 * time[-1]) < 9:
        return None
    parts = np.linspace(0.5 * time[-1], time[-1], 5)
    rates = np.diff(np.interp(parts, time, mass)) / np.diff(parts)
    return float(rates.mean()), float(rates.std(ddof=1))


def scatter(values, spread):
    """Standard deviation of one record: of its differences to its neighbours, and within its output interval.

    values : (n,) float64, a quantity over time; the last fifth, at least five records, is used. Differences of
        neighbours leave its trend out; of independent errors they have twice the variance;
    spread : float, standard deviation within the last output interval.

    Returns float: None with fewer than five records.
    """
    if len(values) < 5:
        return None
    last = values[-max(5, len(values) // 5) :]
    return float(np.hypot(np.std(np.diff(last)) / np.sqrt(2), spread))


def pressure_numbers(lining, tunnel=None):
    """Pressures at crown, waists and invert of a tunnel (None: that with the gate), of `/lining`: list of Number."""
    if "soil_pressure" not in lining:
        return []
    lining = on_tunnel(lining, tunnel)
    numbers, key = [], "" if tunnel is None else f"tunnel_{tunnel}_"
    for name, label in (("soil_pressure", "soil"), ("water_pressure", "water")):
        for place, theta in PLACES.items():
            series, spread = lining[name].sel(theta=theta).values, lining[f"{name}_std"].sel(theta=theta).values
            open_here = tunnel is None and len(series) > 1 and _in_gate(lining, theta)
            numbers.append(
                Number(
                    f"{key}{name}_{theta}", f"{label}, {place}{' (the gate)' if open_here else ''}", "kPa", 1e-3,
                    float(series[0]), None if open_here else float(series[-1]),
                    None if open_here else scatter(series, spread[-1]), "scatter of the last records",
                )
            )  # fmt: skip
    return numbers


def _in_gate(lining, theta):
    """Whether an angle [degree] lies in the gate, where the open lining carries no pressure."""
    gate = gate_of(lining)
    if gate is None:
        return False
    half = np.degrees(np.arcsin(min(1.0, 0.5 * gate.width / tunnel_of(lining).outer)))
    return abs((theta - gate.angle + 180) % 360 - 180) <= half


def ring_numbers(names, answers, prefix=""):
    """Extremes of a ring's forces and deformation at the last record of its first lining model, beside the first.

    names : list of str, lining models;  answers : list of dict, of each: keys of `RING_EXTREMES` to (n_records,)
    float64, NaN where it has no record;  prefix : str, of the keys.

    Returns list of Number: their error is the largest difference from the other models at the same record.
    """
    first = answers[0] if answers else {}
    known = [np.flatnonzero(np.isfinite(first[key])) for key in RING_EXTREMES if key in first]
    end = max((int(rows[-1]) for rows in known if len(rows)), default=None)
    if end is None:
        return []
    others = [answer for answer in answers[1:] if np.isfinite(answer.get("axial_force_max", [np.nan] * (end + 1))[end])]
    basis = f"{DIFFERENCE} {', '.join(names[1:]) if others else 'another lining model: there is none'}"
    numbers = []
    for key in RING_EXTREMES:
        if key in first:
            apart = [abs(float(other[key][end] - first[key][end])) for other in others if key in other]
            error = max((value for value in apart if np.isfinite(value)), default=None)
            numbers.append(Number(prefix + key, *shown_extreme(key), finite(first[key][0]), finite(first[key][end]),
                                  error, basis))  # fmt: skip
    return numbers


def finite(value):
    """A number as float; None for NaN."""
    return float(value) if np.isfinite(value) else None


def shown(value, unit=""):
    """A number as people read it: three significant digits, whole from 100 on, a true minus sign (as in data.js)."""
    if value is None:
        return "–"
    if value != 0 and (abs(value) >= 1e6 or abs(value) < 1e-4):
        mantissa, power = f"{value:.2e}".split("e")
        text = f"{mantissa}e{int(power)}"
    elif abs(value) >= 100:
        text = f"{value:.0f}"
    else:
        text = f"{float(f'{value:.3g}')!r}".removesuffix(".0")
    return f"{text.replace('-', MINUS)} {unit}".strip()


def shown_error(number):
    """The error of a Number, in its unit: known to two digits at best."""
    if number.error is None:
        return "–"
    return f"{'' if number.is_difference else '± '}{shown(float(f'{number.error * number.scale:.2g}'))}"
