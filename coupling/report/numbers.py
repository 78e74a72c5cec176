"""Key numbers of a run with what the run itself can say about their error, its quality line and its warnings."""

from typing import NamedTuple

import numpy as np

from coupling.datasets import HISTORY
from coupling.report.series import match_times, model_names
from coupling.summary import PLACES

NO_ESTIMATE = "no estimate"
#: Name: (label, unit shown, factor from SI, largest or smallest value).
RING_EXTREMES = {
    "axial_force_max": ("axial force N, largest", "kN/m", 1e-3),
    "axial_force_min": ("axial force N, smallest", "kN/m", 1e-3),
    "shear_force_max": ("shear force Q, largest", "kN/m", 1e-3),
    "shear_force_min": ("shear force Q, smallest", "kN/m", 1e-3),
    "bending_moment_max": ("bending moment M, largest", "kN m/m", 1e-3),
    "bending_moment_min": ("bending moment M, smallest", "kN m/m", 1e-3),
    "joint_opening_max": ("joint opening, largest", "mm", 1e3),
    "joint_rotation_max": ("joint rotation, largest size", "mrad", 1e3),
    "convergence_horizontal": ("horizontal diameter shortens by", "mm", 1e3),
    "convergence_vertical": ("vertical diameter shortens by", "mm", 1e3),
}
RESIDUAL_LIMIT = 1e-6  # of the loads; the ring's iteration stops well below
MASS_LIMIT = 1e-9  # relative; grains are only moved, so round-off is all that may show


class Number(NamedTuple):
    """A number of the run: SI values and how they are shown.

    initial, final : float or None;  scale : factor from SI to `unit`;  error : float (SI) or None;  basis : str.
    """

    key: str
    label: str
    unit: str
    scale: float
    initial: float | None
    final: float
    error: float | None
    basis: str


def key_numbers(run, scene=None):
    """What the run came to.

    Parameters
    ----------
    run : xarray.DataTree
        From :func:`coupling.read_run`, with at least one record.
    scene : coupling.Scene or None
        For the theory of the initial pressures.

    Returns
    -------
    list of Number
    """
    return [*_inflow_numbers(run["history"].to_dataset()), *_pressure_numbers(run, scene), *_ring_numbers(run)]


def _inflow_numbers(history):
    last, mass = history.isel(time=-1), history["grain_mass"].values
    lost = float(np.abs(mass - mass[0]).max())
    numbers = [
        Number("time", "simulated time", "s", 1.0, None, float(last["time"]), None, "sum of the time steps"),
        Number("inflow_mass", "inflow mass", "kg/m", 1.0, None, float(last["inflow_mass"]), lost,
               "change of the mass of all grains"),
    ]  # fmt: skip
    rate = inflow_rate(history)
    if rate is not None:
        numbers.append(Number("inflow_rate", "inflow rate, second half of the run", "kg/m/s", 1.0, None, *rate,
                              "standard deviation between four parts"))  # fmt: skip
    for name, label in (("flow_zone_area", "flow zone (moved over 50 mm)"),
                        ("disturbed_area", "disturbed zone (10 to 50 mm)")):  # fmt: skip
        numbers.append(Number(name, label, "m²", 1.0, None, float(last[name]), None, ""))
    return numbers


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


def _pressure_numbers(run, scene):
    lining = run["lining"].to_dataset()
    if "soil_pressure" not in lining:
        return []
    if "tunnel" in lining.dims:
        lining = lining.isel(tunnel=int(lining.attrs.get("gate_tunnel", 0)))
    numbers = []
    for name, label in (("soil_pressure", "soil pressure"), ("water_pressure", "water pressure")):
        for place, theta in PLACES.items():
            here = lining.sel(theta=theta)
            numbers.append(
                Number(
                    f"{name}_{theta}", f"{label}, {place} ({theta}°)", "kPa", 1e-3, float(here[name].isel(time=0)),
                    float(here[name].isel(time=-1)), float(here[f"{name}_std"].isel(time=-1)),
                    "standard deviation within the last output interval",
                )
            )  # fmt: skip
    theory = initial_theory(scene, lining["theta"].values)
    for name, label in (("soil_pressure", "initial soil pressure"), ("water_pressure", "initial water pressure")):
        if theory is None:
            break
        off = lining[name].isel(time=0).values - theory[name].isel(time=0).values
        mean = float(lining[name].isel(time=0).mean())
        numbers.append(Number(f"initial_{name}", f"{label}, mean of all angles", "kPa", 1e-3, mean, mean,
                              float(np.abs(off).max()), "largest difference from K0 and hydrostatic theory"))  # fmt: skip
    return numbers


def initial_theory(scene, theta):
    """Theoretical pressures before the gate opens, or None where the closed form does not hold.

    It holds for one tunnel in one soil that is dry, or saturated up to the surface.

    scene : coupling.Scene or None;  theta : (n,) float64 [degree];  returns xarray.Dataset or None.
    """
    if scene is None or len(scene.mpm.soils) != 1 or len(scene.mpm.tunnels) != 1:
        return None
    s = scene.mpm
    soil, tunnel = s.soils[0], s.tunnels[0]
    if s.water is not None and s.water.table_depth > 0:
        return None
    from structure import theoretical_pressures

    density = 0.0 if s.water is None else s.water.density
    return theoretical_pressures(
        outer_diameter=tunnel.outer_diameter,
        cover=tunnel.cover,
        buoyant_unit_weight=(1 - soil.porosity) * (soil.grain_density - density) * s.gravity,
        coefficient_at_rest=soil.k0,
        water_unit_weight=density * s.gravity,
        theta=theta,
    )


def ring_extremes(response, record):
    """Extreme forces and joint deformations of one record: key of `RING_EXTREMES` to SI value."""
    state, values = response.isel(time=record), {}
    for key in RING_EXTREMES:
        name, _, extreme = key.rpartition("_")
        if key in state:
            values[key] = float(state[key])
        elif name in state and state[name].size:
            found = np.abs(state[name].values) if name == "joint_rotation" else state[name].values
            values[key] = float(np.nanmax(found) if extreme == "max" else np.nanmin(found))
    return values


def _ring_numbers(run):
    models = model_names(run)
    if not models:
        return []
    responses = {name: run[f"structure/{name}"].to_dataset() for name in models}
    first = responses[models[0]]
    if not first.sizes["time"]:
        return []
    start, end = ring_extremes(first, 0), ring_extremes(first, -1)
    others = []
    for name in models[1:]:
        rows, present = match_times(responses[name]["time"].values, first["time"].values[-1:])
        if present[0]:
            others.append(ring_extremes(responses[name], int(rows[0])))
    basis = f"{models[0]} against {', '.join(models[1:])}" if others else "one lining model: nothing to compare with"
    return [
        Number(key, label, unit, scale, start[key], end[key],
               max((abs(other[key] - end[key]) for other in others if key in other), default=None), basis)
        for key, (label, unit, scale) in RING_EXTREMES.items() if key in end
    ]  # fmt: skip


def quality(run, summary):
    """Balances and limits that say how far the numbers can be trusted.

    Parameters
    ----------
    run : xarray.DataTree
    summary : dict
        From :func:`coupling.summary.summarise_run`.

    Returns
    -------
    list of (str, str, bool)
        What, how much, and whether it is within what is expected.
    """
    history = run["history"].to_dataset()
    rows = [("mass of the grains, largest relative change", f"{summary['grain_mass_error']:.1e}",
             summary["grain_mass_error"] <= MASS_LIMIT)]  # fmt: skip
    for name in model_names(run):
        response = run[f"structure/{name}"].to_dataset()
        if "equilibrium_residual" in response and response.sizes["time"]:
            worst = float(np.abs(response["equilibrium_residual"]).max())
            rows.append((f"equilibrium of the ring, {name}: largest unbalanced share", f"{worst:.1e}",
                         worst <= RESIDUAL_LIMIT))  # fmt: skip
        if "shear_moment_residual" in response and response.sizes["time"]:
            share = float(np.abs(response["shear_moment_residual"]).max() / np.nanmax(np.abs(response["shear_force"])))
            rows.append((f"Q + dM/ds, {name}: largest departure over the largest Q", f"{share:.1e}", share <= 0.05))
    for name, count in summary["clamps"].items():
        share = count / max(summary["point_steps"], 1)
        rows.append((f"limit '{name.replace('_', ' ')}' acted", f"{count} times, {share:.1e} of the updates", True))
    for name, variable in history.data_vars.items():
        if name not in HISTORY and variable.dims == ("time",):
            worst = float(np.abs(variable).max())
            unit = variable.attrs.get("units", "")
            rows.append((f"{variable.attrs.get('long_name', name)}: largest size",
                         f"{worst:.3g} {'' if unit == '1' else unit}".strip(), bool(np.isfinite(worst))))  # fmt: skip
    return rows


def warnings(run, attributes, quality_rows):
    """What a reader must know before believing the page: list of str."""
    found = []
    if attributes["status"] != "finished":
        message = attributes.get("status_message") or "the page shows what was computed until then"
        found.append(f"The run is '{attributes['status']}': {message}.")
    found += [f"Outside what is expected: {what}: {value}." for what, value, good in quality_rows if not good]
    lining = run["lining"].to_dataset()
    records = lining.sizes["time"]
    models = model_names(run)
    if "soil_pressure" in lining and not models:
        found.append("No lining model has answered to the pressures: run `gush respond` on this run.")
    for name in models:
        answered = run[f"structure/{name}"].sizes.get("time", 0)
        if answered != records:
            found.append(f"The response of {name} holds {answered} of {records} records: run `gush respond` again.")
    if "soil_pressure" in lining and records > 1:
        last = lining.isel(time=-1)
        for name, label in (("soil_pressure", "soil"), ("water_pressure", "water")):
            share = float(last[f"{name}_std"].mean() / max(float(np.abs(last[name]).mean()), 1e-9))
            if share > 0.25:
                found.append(f"The {label} pressure still fluctuates: by {share:.0%} of its mean within an interval.")
    if records < 10:
        found.append(f"Only {records} records: what happens between them is not shown.")
    if str(attributes.get("revision", "")).endswith("+changed"):
        found.append(f"The program's files differed from its revision {attributes['revision']}.")
    return found
